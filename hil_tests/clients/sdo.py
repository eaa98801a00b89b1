"""SDO transfers as the client sees them (CiA 301 4.2.0, 7.2.4.3), without input and output.

A transfer says what to send first (`begin`), takes one answer after the other (`answer`),
and has a `result` once it is over. Laws: the same answers lead to the same requests; an
answer that the protocol does not allow is a `Breach` with the rule that it breaks.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from hil_tests.clients import sdo_frames
from hil_tests.clients.sdo_frames import SEGMENT_BYTES

Requests = Sequence[bytes]
NOTHING: Requests = ()

FRAME_BYTES = 8
ABORT = 0x80
UNKNOWN_COMMAND = 0x0504_0001
"""Which object its abort names is left to the server: it did not understand the request."""


@dataclass(frozen=True, slots=True)
class Abort:
    """The server ended a transfer."""

    code: int
    index: int
    sub: int


class Breach(Exception):
    """An answer that the protocol does not allow.

    Args:
        requirement: the rule that it breaks.
        text: what was expected, and what came.
    """

    def __init__(self, requirement: str, text: str) -> None:
        super().__init__(text)
        self.requirement = requirement


def abort_in(data: bytes) -> Abort | None:
    """The abort that an answer of eight bytes is, or None."""
    if len(data) != FRAME_BYTES or data[0] != ABORT:
        return None
    index = data[1] | data[2] << 8
    return Abort(int.from_bytes(data[4:], "little"), index, data[3])


class Transfer:
    """What all transfers share: the object, the result, and how an abort is told.

    Args:
        index: of the object.
        sub: its sub-index.
    """

    def __init__(self, index: int, sub: int) -> None:
        self.index = index
        self.sub = sub
        self.result: bytes | Abort | None = None
        """Bytes read (none after a write), or the server's abort; None = not over."""
        self._next: Callable[[bytes], Requests] = self._first

    @property
    def name(self) -> str:
        """The object for people."""
        return f"{self.index:04X}h:{self.sub:02X}"

    def begin(self) -> Requests:
        """What to send first."""
        raise NotImplementedError

    def answer(self, data: bytes) -> Requests:
        """The server answered; what to send now.

        Raises:
            Breach: the protocol does not allow this answer here.
        """
        if len(data) != FRAME_BYTES:
            raise Breach("C-SD-01", f"an SDO answer has 8 bytes; {show(data)} has {len(data)}")
        if data[0] == ABORT:
            self.result = abort_in(data)
            if int.from_bytes(data[4:], "little") != UNKNOWN_COMMAND:
                self._names_object(data)
            return NOTHING
        return self._next(data)

    def _first(self, data: bytes) -> Requests:
        raise NotImplementedError

    def _names_object(self, data: bytes) -> None:
        if data[1:4] != sdo_frames.multiplexer(self.index, self.sub):
            raise Breach("C-SD-01", f"the answer names {self.name}; it was {show(data)}")

    def _wrong(self, requirement: str, wanted: str, data: bytes) -> Breach:
        return Breach(requirement, f"{wanted} for {self.name}; it was {show(data)}")


class Upload(Transfer):
    """Read, expedited or in segments, as the server chooses."""

    def begin(self) -> Requests:
        """Initiate upload."""
        return (sdo_frames.read(self.index, self.sub),)

    def _first(self, data: bytes) -> Requests:
        command = data[0]
        if command & 0xF0 != 0x40:
            raise self._wrong("C-SD-02", "an answer 4xh to a read", data)
        self._names_object(data)
        if command & 0x02:
            return self._expedited(data)
        if command & 0x0E:
            raise self._wrong("C-SD-04", "41h and the size to begin an upload", data)
        self._size = int.from_bytes(data[4:], "little") if command & 1 else None
        self._read = bytearray()
        self._toggle = 0
        self._next = self._segment
        return (sdo_frames.read_segment(0),)

    def _expedited(self, data: bytes) -> Requests:
        unused = data[0] >> 2 & 3
        if unused and not data[0] & 1:
            raise self._wrong("C-SD-02", "4Fh, 4Bh, 47h or 43h by size", data)
        self.result = data[4 : 8 - unused]
        return NOTHING

    def _segment(self, data: bytes) -> Requests:
        command = data[0]
        if command >> 5:
            raise self._wrong("C-SD-04", "a segment of the upload", data)
        if command >> 4 & 1 != self._toggle:
            raise self._wrong("C-SD-06", f"toggle bit {self._toggle} in the segment", data)
        chunk = data[1 : 8 - (command >> 1 & 7)]
        self._read += chunk
        if not command & 1:
            if not chunk:
                raise self._wrong("C-SD-04", "bytes in a segment that is not the last", data)
            self._toggle ^= 1
            return (sdo_frames.read_segment(self._toggle),)
        if self._size is not None and len(self._read) != self._size:
            told = f"the {self._size} bytes that were told, not {len(self._read)},"
            raise self._wrong("C-SD-04", told, data)
        self.result = bytes(self._read)
        return NOTHING


class Download(Transfer):
    """Write, expedited where the data allow it.

    Args:
        index: of the object.
        sub: its sub-index.
        data: what to write.
        segmented: in segments, however short.
        size: to declare in place of the true one, in segments.
    """

    def __init__(
        self, index: int, sub: int, data: bytes, *, segmented: bool = False, size: int = -1
    ) -> None:
        super().__init__(index, sub)
        self._data = data
        self._segmented = segmented or not 0 < len(data) <= 4
        self._size = len(data) if size < 0 else size
        self._at = 0
        self._toggle = 0

    def begin(self) -> Requests:
        """Initiate download."""
        if self._segmented:
            return (sdo_frames.write_many(self.index, self.sub, self._size),)
        return (sdo_frames.write(self.index, self.sub, self._data),)

    def _first(self, data: bytes) -> Requests:
        if data[0] != 0x60:
            requirement = "C-SD-05" if self._segmented else "C-SD-03"
            raise self._wrong(requirement, "an answer 60h to a write", data)
        self._names_object(data)
        if not self._segmented:
            self.result = b""
            return NOTHING
        self._next = self._confirmed
        return self._send()

    def _send(self) -> Requests:
        chunk = self._data[self._at : self._at + SEGMENT_BYTES]
        self._at += len(chunk)
        last = self._at >= len(self._data)
        return (sdo_frames.write_segment(self._toggle, chunk, last=last),)

    def _confirmed(self, data: bytes) -> Requests:
        if data[0] & 0xEF != 0x20:
            raise self._wrong("C-SD-05", "an answer 20h or 30h to a segment", data)
        if data[0] >> 4 & 1 != self._toggle:
            raise self._wrong("C-SD-06", f"toggle bit {self._toggle} in the answer", data)
        if self._at >= len(self._data):
            self.result = b""
            return NOTHING
        self._toggle ^= 1
        return self._send()


def show(data: bytes) -> str:
    """Bytes of an answer for people."""
    return data.hex(" ").upper() or "no data"
