"""Drives that store or restore parameters wrongly (C-ST)."""

from __future__ import annotations

from collections.abc import Callable

from node_model.faults.parts import Fault
from node_model.node import MS
from node_model.nonvolatile import RESTORE, STORE, Content, NonVolatile


class StoresOnAnySignature(Fault, NonVolatile):
    """Any value that is written to 1010h stores."""

    violates = ("C-ST-02",)

    def is_signature(self, index: int, data: bytes) -> bool:
        return index == STORE or super().is_signature(index, data)


class RestoresOnAnySignature(Fault, NonVolatile):
    """Any value that is written to 1011h restores."""

    violates = ("C-ST-02",)

    def is_signature(self, index: int, data: bytes) -> bool:
        return index == RESTORE or super().is_signature(index, data)


class SignatureInReverse(Fault, NonVolatile):
    """The letters of the signatures are expected in reverse."""

    violates = ("C-ST-02", "C-ST-04", "C-ST-05")

    def is_signature(self, index: int, data: bytes) -> bool:
        return super().is_signature(index, data[::-1])


class SavesNothing(Fault, NonVolatile):
    """Storing is acknowledged and stores nothing."""

    violates = ("C-ST-04", "C-ST-09", "C-SY-13")

    def saved(self, group: range) -> Content:
        return self._content


class StoresEveryWrite(Fault, NonVolatile):
    """A value that was written survives a reset without being stored."""

    violates = ("C-ST-04", "C-NMT-11", "C-NMT-12")

    def restore(self, concerned: Callable[[int], bool]) -> None:
        self._content = self.saved(range(0x1_0000))
        kept = {(e.index, e.sub): e.value for e in self._kept}
        super().restore(concerned)
        for (index, sub), value in kept.items():
            self._od.put(index, sub, value)


class RestoresAtOnce(Fault, NonVolatile):
    """Restoring acts at once instead of with the next reset."""

    violates = ("C-ST-05",)

    def loaded(self, group: range) -> Content:
        for entry in self._kept:
            if entry.index in group:
                entry.value = entry.default
        return super().loaded(group)


class RestoresNothing(Fault, NonVolatile):
    """Restoring is acknowledged and restores nothing."""

    violates = ("C-ST-05",)

    def loaded(self, group: range) -> Content:
        return self._content


class StoresAllGroups(Fault, NonVolatile):
    """Every sub-index of 1010h and 1011h concerns all parameters."""

    violates = ("C-ST-06",)

    def group(self, sub: int) -> range:
        return super().group(1)


class StoringShowsWhatWasWritten(Fault, NonVolatile):
    """Reading 1010h and 1011h gives the signature that was written."""

    violates = ("C-ST-01",)

    def _show_capabilities(self) -> None:
        pass


class StoresForTooLong(Fault, NonVolatile):
    """From the acknowledgement of 1010h it takes seconds until all is stored."""

    violates = ("C-ST-04",)

    def _keep(self, content: Content, now: int) -> None:
        super()._keep(content, now + 3000 * MS)


class StoresHeartbeatNever(Fault, NonVolatile):
    """The heartbeat time is left out when parameters are stored."""

    violates = ("C-ST-04",)

    def saved(self, group: range) -> Content:
        return {key: value for key, value in super().saved(group).items() if key[0] != 0x1017}


FAULTS: tuple[type[Fault], ...] = (
    StoresOnAnySignature,
    RestoresOnAnySignature,
    SignatureInReverse,
    SavesNothing,
    StoresEveryWrite,
    RestoresAtOnce,
    RestoresNothing,
    StoresAllGroups,
    StoringShowsWhatWasWritten,
    StoresForTooLong,
    StoresHeartbeatNever,
)
