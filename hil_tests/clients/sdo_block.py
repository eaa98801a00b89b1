"""SDO block transfers as the client sees them (CiA 301 4.2.0, 7.2.4.3.9 to 7.2.4.3.16)."""

from __future__ import annotations

from hil_tests.clients import sdo_frames
from hil_tests.clients.sdo import NOTHING, Requests, Transfer, Upload
from hil_tests.clients.sdo_frames import LONGEST_BLOCK, SEGMENT_BYTES, crc16

_PATIENCE = 16
"""So many blocks without a single segment of progress are no recovery any more."""


class BlockDownload(Transfer):
    """Write in blocks.

    Args:
        index: of the object.
        sub: its sub-index.
        data: what to write.
        lose: which of the segments, counted from 1 as they would be sent, the wire loses.
        crc_error: bits to falsify in the CRC.
        size: to declare in place of the true one.
    """

    def __init__(
        self,
        index: int,
        sub: int,
        data: bytes,
        *,
        lose: frozenset[int] = frozenset(),
        crc_error: int = 0,
        size: int = -1,
    ) -> None:
        super().__init__(index, sub)
        self._data = data
        self._lose = lose
        self._crc_error = crc_error
        self._size = len(data) if size < 0 else size
        self._at = 0
        self._sent = 0
        self._count = 0
        self._stuck = 0
        self._crc = False

    def begin(self) -> Requests:
        """Initiate block download."""
        return (sdo_frames.block_write(self.index, self.sub, self._size),)

    def _first(self, data: bytes) -> Requests:
        if data[0] & 0xFB != 0xA0:
            raise self._wrong("C-SD-10", "an answer A0h or A4h to a block download", data)
        self._names_object(data)
        self._crc = bool(data[0] & 0x04)
        self._next = self._acknowledged
        return self._block(data[4], data)

    def _block(self, length: int, data: bytes) -> Requests:
        if not 1 <= length <= LONGEST_BLOCK:
            raise self._wrong("C-SD-10", "a block of 1 to 127 segments", data)
        left = max(1, -(-(len(self._data) - self._at) // SEGMENT_BYTES))
        self._count = min(length, left)
        requests = []
        for number in range(1, self._count + 1):
            place = self._at + (number - 1) * SEGMENT_BYTES
            chunk = self._data[place : place + SEGMENT_BYTES]
            self._sent += 1
            if self._sent not in self._lose:
                last = place + SEGMENT_BYTES >= len(self._data)
                requests.append(sdo_frames.block_segment(number, chunk, last=last))
        return requests

    def _acknowledged(self, data: bytes) -> Requests:
        good = data[1]
        if data[0] != 0xA2:
            raise self._wrong("C-SD-10", "an answer A2h to a block", data)
        if good > self._count:
            text = f"at most the {self._count} segments that were sent acknowledged"
            raise self._wrong("C-SD-10", text, data)
        self._stuck = 0 if good else self._stuck + 1
        if self._stuck >= _PATIENCE:
            raise self._wrong("C-SD-10", "a segment acknowledged at last", data)
        self._at += good * SEGMENT_BYTES
        if self._at < len(self._data) or not good:
            return self._block(data[2], data)
        self._next = self._ended
        crc = (crc16(self._data) if self._crc else 0) ^ self._crc_error
        unused = -len(self._data) % SEGMENT_BYTES if self._data else SEGMENT_BYTES
        return (sdo_frames.block_write_end(unused, crc),)

    def _ended(self, data: bytes) -> Requests:
        if data[0] != 0xA1:
            raise self._wrong("C-SD-11", "an answer A1h to the end of a block download", data)
        self.result = b""
        return NOTHING


class BlockUpload(Transfer):
    """Read in blocks; a server may answer as to an ordinary read instead (C-SD-13).

    Args:
        index: of the object.
        sub: its sub-index.
        block: segments a block, 1..127.
        threshold: bytes up to which the server may change to an ordinary read; 0 = never.
        lose: which of the segments, counted from 1 as they come, the wire loses.
    """

    def __init__(
        self,
        index: int,
        sub: int,
        *,
        block: int = LONGEST_BLOCK,
        threshold: int = 0,
        lose: frozenset[int] = frozenset(),
    ) -> None:
        super().__init__(index, sub)
        self._block = block
        self._threshold = threshold
        self._lose = lose
        self._size: int | None = None
        self._crc = False
        self._read = bytearray()
        self._came = 0
        self._seen = 0
        self._good = 0
        self._plain: Upload | None = None

    @property
    def switched(self) -> bool:
        """The server answered as to an ordinary read."""
        return self._plain is not None

    def begin(self) -> Requests:
        """Initiate block upload."""
        return (sdo_frames.block_read(self.index, self.sub, self._block, self._threshold),)

    def _first(self, data: bytes) -> Requests:
        if data[0] & 0xF0 == 0x40:
            self._plain = Upload(self.index, self.sub)
            self._next = self._as_plain
            return self._as_plain(data)
        if data[0] & 0xF9 != 0xC0:
            raise self._wrong("C-SD-10", "an answer C0h to C6h to a block upload", data)
        self._names_object(data)
        self._size = int.from_bytes(data[4:], "little") if data[0] & 0x02 else None
        self._crc = bool(data[0] & 0x04)
        self._next = self._segment
        return (sdo_frames.block_read_start(),)

    def _as_plain(self, data: bytes) -> Requests:
        assert self._plain is not None
        requests = self._plain.answer(data)
        self.result = self._plain.result
        return requests

    def _segment(self, data: bytes) -> Requests:
        number, last = data[0] & 0x7F, data[0] >> 7
        if number != self._seen + 1:
            raise self._wrong("C-SD-10", f"segment {self._seen + 1} of the block", data)
        self._seen = number
        self._came += 1
        if self._came not in self._lose and number == self._good + 1:
            self._good = number
            self._read += data[1:]
        if number < self._block and not last:
            return NOTHING
        acknowledge = sdo_frames.block_read_acknowledge(self._good, self._block)
        if last and self._good == number:
            self._next = self._ended
        self._seen = self._good = 0
        return (acknowledge,)

    def _ended(self, data: bytes) -> Requests:
        if data[0] & 0xE3 != 0xC1:
            raise self._wrong("C-SD-10", "C1h with the unused bytes to end the upload", data)
        unused = data[0] >> 2 & 7
        read = bytes(self._read[: len(self._read) - unused])
        if self._size is not None and len(read) != self._size:
            text = f"the {self._size} bytes that were told, not {len(read)},"
            raise self._wrong("C-SD-10", text, data)
        told = int.from_bytes(data[1:3], "little")
        if self._crc and told != crc16(read):
            raise self._wrong("C-SD-11", f"CRC {crc16(read):04X}h", data)
        self.result = read
        return (sdo_frames.block_read_end(),)
