"""Parameters that survive: 1010h, 1011h and 1020h (CiA 301 4.2.0, 7.5.2.13, .14 and .23).

Laws: "save" stores the values that a group of parameters has now, "load" forgets those that
were stored; neither changes a value before the next reset. A power cut at any instant
leaves the old or the new stored values. A value that equals its default is not stored, so
that a COB-ID that nobody has changed follows the node id. 1020h is 0 after any change of the
configuration that came after it was set.

Wiring: the device calls `restore` at power-on and at each reset, before the services start,
and `finish` before it obeys a reset, so that only a power cut interrupts storing.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial

from node_model.node import NOTHING, Frames
from node_model.od import AbortCode, Entry, ObjectDictionary, SdoAbort
from node_model.service import QuietService
from node_model.storage import LongRecordStore

ERROR_FIELD = 0x1003
STORE = 0x1010
RESTORE = 0x1011
VERIFY = 0x1020
_ACTIONS = frozenset((ERROR_FIELD, STORE, RESTORE))
"""What is written to them is no value."""
SIGNATURES = {STORE: b"save", RESTORE: b"load"}
ON_COMMAND = 0x1
"""Bit 0 of what a client reads: parameters are stored, or restored, on command."""

GROUPS = {1: range(0x1_0000), 2: range(0x1000, 0x2000), 3: range(0x6000, 0xA000)}
"""Sub-indices that CiA 301 gives a meaning: all, communication, application."""
MAKER = {4: range(0x2000, 0x6000)}

Content = dict[tuple[int, int], bytes]
"""Stored values by index and sub-index."""

BYTE_NS = 50_000
"""How long a memory needs for a byte: a thousand of them are safe within 0.1 s."""

HEADER_BYTES = 5
"""Of each value in a record: index, sub-index, length."""


def is_parameter(entry: Entry) -> bool:
    """Whether an entry is worth storing: written and read by clients, and no process data."""
    if entry.pdo or entry.index in _ACTIONS:
        return False
    access = entry.access
    return access.writable and access.readable and most_bytes(entry) > 0


def most_bytes(entry: Entry) -> int:
    """How long the value of an entry can be; 0 = without limit."""
    return entry.data_type.size or entry.most


class NonVolatile(QuietService):
    """The stored parameters of a device.

    Args:
        od: its 1010h, 1011h and 1020h, as far as they are there, and all that is stored.
        image: content of the memory, e.g. from an earlier life; b"" = nothing was stored.
        keeps: whether an entry is stored.
        maker: indices of the groups from sub-index 4 on.
        byte_ns: how long the memory needs for one byte.
        store: makes the memory from size in bytes, image and `byte_ns`.
    """

    alone = True
    timed_by = frozenset((STORE, RESTORE))

    def __init__(
        self,
        od: ObjectDictionary,
        image: bytes = b"",
        keeps: Callable[[Entry], bool] = is_parameter,
        *,
        maker: Mapping[int, range] = MAKER,
        byte_ns: int = BYTE_NS,
        store: Callable[[int, bytes, int], LongRecordStore] = LongRecordStore,
    ) -> None:
        self._od = od
        self._kept = [entry for entry in od.entries.values() if keeps(entry)]
        self._groups = {**GROUPS, **maker}
        self.broken = False
        """The memory has failed: nothing can be stored."""
        size = sum(HEADER_BYTES + most_bytes(entry) for entry in self._kept)
        self.store = store(size, image, byte_ns)
        self._content = decode(self.store.load() or b"")
        for index, act in ((STORE, self._save), (RESTORE, self._load)):
            od.guard(index, partial(self._guard_signature, index))
            od.observe(index, act)
        self._configuration = frozenset([entry.index for entry in self._kept]) - {VERIFY}
        self._capabilities = [
            entry for entry in od.entries.values() if entry.index in SIGNATURES and entry.sub
        ]
        if VERIFY in od:
            od.witness(self._configured)

    # What the device calls.

    def restore(self, concerned: Callable[[int], bool]) -> None:
        """Objects whose index is `concerned` take their power-on values."""
        content = self._content = decode(self.store.load() or b"")
        indices = set(filter(concerned, self._od.indices))
        for entry in self._od.entries.values():
            if entry.index in indices:
                entry.value = entry.default
        for (index, sub), value in content.items():
            if index in indices and self._od.has(index, sub):
                self._od.put(index, sub, value)
        self._show_capabilities()

    def image(self) -> bytes:
        """Content of the memory."""
        return bytes(self.store.memory)

    def finish(self) -> None:
        """Complete what is being stored: a reset waits for it."""
        self.store.finish()

    # The verbs of a service.

    def advance(self, now: int) -> Frames:
        """The bytes whose time has come are written."""
        self.store.advance(now)
        return NOTHING

    def deadline(self) -> int | None:
        """The next byte to write."""
        return self.store.due_at

    def stop(self) -> None:
        """What is not yet written never will be."""
        super().stop()
        self.store.cut()

    # What decides.

    def is_signature(self, index: int, data: bytes) -> bool:
        """These four letters, the first in the lowest byte."""
        return data == SIGNATURES[index]

    def group(self, sub: int) -> range:
        """Indices that a sub-index of 1010h and 1011h concerns."""
        return self._groups.get(sub, range(0))

    def saved(self, group: range) -> Content:
        """What is stored after "save" for a group: its values now, and the others as before."""
        content = self.others(group)
        for entry in self._kept:
            if entry.index in group and entry.value != entry.default:
                content[entry.index, entry.sub] = entry.value
        return content

    def loaded(self, group: range) -> Content:
        """What is stored after "load" for a group: the others, and 1020h is not set."""
        return {key: value for key, value in self.others(group).items() if key[0] != VERIFY}

    def others(self, group: range) -> Content:
        """What is stored of other groups."""
        return {key: value for key, value in self._content.items() if key[0] not in group}

    # Its objects.

    def _guard_signature(self, index: int, sub: int, data: bytes) -> None:  # noqa: ARG002  all alike
        if not self.is_signature(index, data):
            raise SdoAbort(AbortCode.CANNOT_STORE)
        if self.broken:
            raise SdoAbort(AbortCode.HARDWARE)

    def _save(self, sub: int, now: int) -> None:
        self._keep(self.saved(self.group(sub)), now)

    def _load(self, sub: int, now: int) -> None:
        self._keep(self.loaded(self.group(sub)), now)
        self.clear_verification()

    def _keep(self, content: Content, now: int) -> None:
        self._content = content
        self.store.save(encode(content), now)
        self._show_capabilities()

    def _show_capabilities(self) -> None:
        """A client that reads 1010h or 1011h sees what can be done, not what was written."""
        for entry in self._capabilities:
            entry.value = ON_COMMAND.to_bytes(4, "little")

    def _configured(self, index: int, differs: bool) -> None:
        if differs and index in self._configuration:
            self.clear_verification()

    def clear_verification(self) -> None:
        """The configuration is not the one whose date 1020h tells (7.5.2.23)."""
        for sub in (1, 2):
            if self._od.has(VERIFY, sub):
                self._od.put(VERIFY, sub, bytes(4))


def encode(content: Content) -> bytes:
    """A record: index, sub-index, length and bytes of each value, in order."""
    parts = []
    for (index, sub), value in sorted(content.items()):
        parts.append(index.to_bytes(2, "little") + bytes((sub,)))
        parts.append(len(value).to_bytes(2, "little") + value)
    return b"".join(parts)


def decode(record: bytes) -> Content:
    """The values in a record."""
    content: Content = {}
    at = 0
    while at < len(record):
        index, sub = int.from_bytes(record[at : at + 2], "little"), record[at + 2]
        length = int.from_bytes(record[at + 3 : at + 5], "little")
        at += HEADER_BYTES
        content[index, sub] = record[at : at + length]
        at += length
    return content
