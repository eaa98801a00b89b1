"""Transfers in more than one frame: what they have in common, and the segmented ones.

A transfer is told the eight bytes of each request and returns the eight bytes of each
answer. It raises SdoAbort to end with an abort; its channel then forgets it.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence

from node_model.od import AbortCode, ObjectDictionary, SdoAbort

Payloads = Sequence[bytes]
NO_PAYLOADS: tuple[bytes, ...] = ()

SEGMENT = 7
"""Bytes of data in a segment."""
TOGGLE = 0x10
_LAST = 0x01
_PAD = bytes(7)


class Transfer(ABC):
    """One object on its way.

    Args:
        multiplexer: index and sub-index as the initiating request had them, three bytes.
    """

    takes_any = False
    """The next request is a segment of a block: its first byte is a number, no command."""
    done = False
    due_at: int | None = None
    """When `advance` must be called although the client said nothing."""

    def __init__(self, multiplexer: bytes) -> None:
        self.multiplexer = multiplexer

    @abstractmethod
    def receive(self, data: bytes, now: int) -> Payloads:
        """The next request of the client.

        Raises:
            SdoAbort: it does not fit, or the object refuses the value.
        """

    def advance(self, now: int) -> Payloads:  # noqa: ARG002  most have nothing of their own
        """What is due; called when `due_at` has come."""
        return NO_PAYLOADS


class Inlet:
    """Where the bytes of a download are gathered; the entry gets them all at once.

    Args:
        od: the dictionary.
        multiplexer: three bytes, index and sub-index.
        size: bytes that will come; None = not told.
        memory: most bytes for an entry that has no limit.

    Raises:
        SdoAbort: the download cannot succeed.
    """

    def __init__(
        self, od: ObjectDictionary, multiplexer: bytes, size: int | None, memory: int
    ) -> None:
        self.od = od
        self.index = multiplexer[0] | multiplexer[1] << 8
        self.sub = multiplexer[2]
        self.size = size
        entry = od.accepts(self.index, self.sub, size)
        self.most = entry.data_type.size or entry.most
        self.memory = memory
        self.data = bytearray()
        if size is not None:
            self.check_memory(size)

    def check_memory(self, size: int) -> None:
        """Refuse what no memory is there for."""
        if size > self.memory:
            raise SdoAbort(AbortCode.MEMORY)

    def take(self, data: bytes) -> None:
        """More bytes, all of them valid.

        Raises:
            SdoAbort: there are more than the client told or the object can hold.
        """
        self.data += data
        self.check_growth(len(self.data))

    def check_growth(self, size: int) -> None:
        """Refuse too many bytes as soon as they are too many."""
        if self.size is not None and size > self.size:
            raise SdoAbort(AbortCode.TOO_LONG)
        if self.most and size > self.most:
            raise SdoAbort(AbortCode.TOO_LONG)
        self.check_memory(size)

    def finish(self, now: int) -> None:
        """All bytes are here: write them.

        Raises:
            SdoAbort: fewer than the client told, or the object refuses the value.
        """
        self.check_size(len(self.data))
        self.od.write(self.index, self.sub, bytes(self.data), now)

    def check_size(self, size: int) -> None:
        """Refuse fewer bytes than were told."""
        if self.size is not None and size != self.size:
            raise SdoAbort(AbortCode.LENGTH)


class Download(Transfer):
    """Segmented download (CiA 301 4.2.0, 7.2.4.3.3 and 7.2.4.3.4)."""

    def __init__(self, multiplexer: bytes, inlet: Inlet) -> None:
        super().__init__(multiplexer)
        self.inlet = inlet
        self.toggle = 0

    def receive(self, data: bytes, now: int) -> Payloads:
        """A segment: toggle, then data, then the last one writes the object."""
        command = data[0]
        if command >> 5 != 0:
            raise SdoAbort(AbortCode.COMMAND)
        self.check_toggle(command & TOGGLE)
        self.inlet.take(data[1 : 8 - (command >> 1 & 7)])
        if command & _LAST:
            self.inlet.finish(now)
            self.done = True
        answer = self.answer()
        self.toggle ^= TOGGLE
        return (answer,)

    def check_toggle(self, toggle: int) -> None:
        """Refuse a segment that is not the next one."""
        if toggle != self.toggle:
            raise SdoAbort(AbortCode.TOGGLE)

    def answer(self) -> bytes:
        """The confirmation of a segment."""
        return bytes((0x20 | self.toggle,)) + _PAD


class Upload(Transfer):
    """Segmented upload (CiA 301 4.2.0, 7.2.4.3.6 and 7.2.4.3.7)."""

    def __init__(self, multiplexer: bytes, value: bytes) -> None:
        super().__init__(multiplexer)
        self.value = value
        self.position = 0
        self.toggle = 0

    def receive(self, data: bytes, now: int) -> Payloads:  # noqa: ARG002  a verb of transfers
        """The request for the next segment."""
        command = data[0]
        if command >> 5 != 3:
            raise SdoAbort(AbortCode.COMMAND)
        self.check_toggle(command & TOGGLE)
        answer = self.segment(self.value[self.position : self.position + SEGMENT])
        self.position += SEGMENT
        self.toggle ^= TOGGLE
        return (answer,)

    def check_toggle(self, toggle: int) -> None:
        """Refuse a request that is not for the next segment."""
        if toggle != self.toggle:
            raise SdoAbort(AbortCode.TOGGLE)

    def segment(self, data: bytes) -> bytes:
        """An answer with up to seven bytes; the last one says so."""
        self.done = self.position + SEGMENT >= len(self.value)
        command = self.toggle | (SEGMENT - len(data)) << 1 | self.done
        return bytes((command,)) + data.ljust(SEGMENT, b"\0")
