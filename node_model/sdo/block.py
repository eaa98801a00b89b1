"""Block transfers (CiA 301 4.2.0, 7.2.4.3.9 to 7.2.4.3.16): many segments, one confirmation.

The CRC is CRC-16 with the polynomial 1021h, begun with 0; "123456789" gives 31C3h.
"""

from __future__ import annotations

from binascii import crc_hqx
from enum import Enum

from node_model.od import AbortCode, SdoAbort
from node_model.sdo.settings import MOST_SEGMENTS, SdoSettings
from node_model.sdo.transfer import NO_PAYLOADS, SEGMENT, Inlet, Payloads, Transfer

_LAST = 0x80
_NUMBER = 0x7F


def check_block_size(size: int) -> int:
    """A block size that a client asks for.

    Raises:
        SdoAbort: it is not 1..127.
    """
    if not 1 <= size <= MOST_SEGMENTS:
        raise SdoAbort(AbortCode.BLOCK_SIZE)
    return size


def crc_of(data: bytes | bytearray) -> int:
    """The check sequence of a block transfer."""
    return crc_hqx(data, 0)


class BlockDownload(Transfer):
    """Block download: segments with numbers, and after each block how many came in a row.

    Args:
        multiplexer: three bytes, index and sub-index.
        inlet: where the data goes.
        settings: block size, and the time-out inside a block.
        with_crc: both sides do the CRC.
        now: when it was initiated.
    """

    def __init__(
        self, multiplexer: bytes, inlet: Inlet, settings: SdoSettings, with_crc: bool, now: int
    ) -> None:
        super().__init__(multiplexer)
        self.inlet = inlet
        self.settings = settings
        self.with_crc = with_crc
        self.takes_any = True
        self.good = 0
        """Number of the last segment that came in sequence."""
        self.block_size = self.next_block_size()
        self.wait(now)

    def next_block_size(self) -> int:
        """How many segments the next block may have."""
        return self.settings.block_size

    def wait(self, now: int) -> None:
        """The block is confirmed by itself when nothing comes for a time."""
        span = self.settings.block_time_out_ns
        self.due_at = now + span if span and self.takes_any else None

    def receive(self, data: bytes, now: int) -> Payloads:
        """A segment, or the end of the transfer when the last one was confirmed."""
        if not self.takes_any:
            return self.end(data, now)
        answers = self.segment(data)
        self.wait(now)
        return answers

    def advance(self, now: int) -> Payloads:  # noqa: ARG002  called when it is due
        """Nothing came for a time: say once what is here, so that the rest is sent again."""
        self.due_at = None
        return (self.confirm(),)

    def segment(self, data: bytes) -> Payloads:
        """One segment; out of sequence it is dropped, the client learns it at the end."""
        number, last = data[0] & _NUMBER, data[0] & _LAST
        self.check_number(number)
        if number == self.good + 1:
            self.good = number
            self.store(data[1:], last != 0)
        return (self.confirm(),) if last or number == self.block_size else NO_PAYLOADS

    def check_number(self, number: int) -> None:
        """Refuse a number that no segment of this block can have."""
        if not 1 <= number <= self.block_size:
            raise SdoAbort(AbortCode.SEQUENCE)

    def store(self, data: bytes, last: bool) -> None:
        """Keep the bytes; how many of the last ones count is told at the end."""
        if last:
            self.inlet.data += data
            self.takes_any = False
        else:
            self.inlet.take(data)

    def confirm(self) -> bytes:
        """How many segments of the block came in sequence, and how long the next may be."""
        good, self.good = self.good, 0
        self.block_size = self.next_block_size()
        return bytes((0xA2, good, self.block_size, 0, 0, 0, 0, 0))

    def end(self, data: bytes, now: int) -> Payloads:
        """All is here: unused bytes off, CRC, size, then the object is written."""
        command = data[0]
        if command & 0xE1 != 0xC1:
            raise SdoAbort(AbortCode.COMMAND)
        gathered = self.inlet.data
        del gathered[len(gathered) - (command >> 2 & 7) :]
        if self.with_crc:
            self.check_crc(data[1] | data[2] << 8)
        self.inlet.check_growth(len(gathered))
        self.inlet.finish(now)
        self.done = True
        return (b"\xa1" + bytes(7),)

    def check_crc(self, told: int) -> None:
        """Refuse data that was damaged on its way."""
        if crc_of(self.inlet.data) != told:
            raise SdoAbort(AbortCode.CRC)


class Phase(Enum):
    """What a block upload waits for."""

    START = 0xA3
    CONFIRMATION = 0xA2
    END = 0xA1


class BlockUpload(Transfer):
    """Block upload: as many segments as the client asked for, then its confirmation.

    Args:
        multiplexer: three bytes, index and sub-index.
        value: what is uploaded.
        block_size: segments of the first block, 1..127.
        gap_ns: distance of segments; 0 = all at once.
        with_crc: both sides do the CRC.
    """

    def __init__(
        self, multiplexer: bytes, value: bytes, block_size: int, gap_ns: int, with_crc: bool
    ) -> None:
        super().__init__(multiplexer)
        self.value = value
        self.block_size = block_size
        self.gap_ns = gap_ns
        self.with_crc = with_crc
        self.phase = Phase.START
        self.position = 0
        """Bytes that the client has confirmed."""
        self.sent = 0
        """Segments of this block that are out."""

    def receive(self, data: bytes, now: int) -> Payloads:
        """Start, confirmation of a block, or end: each in its place only."""
        if data[0] & 0xE3 != self.phase.value:
            raise SdoAbort(AbortCode.COMMAND)
        if self.phase is Phase.END:
            self.done = True
            return NO_PAYLOADS
        if self.phase is Phase.CONFIRMATION:
            self.confirmed(data[1])
            if self.position >= max(len(self.value), 1):
                self.phase = Phase.END
                return (self.end(),)
            self.block_size = check_block_size(data[2])
        self.phase = Phase.CONFIRMATION
        return self.begin(now)

    def confirmed(self, number: int) -> None:
        """The client has the segments up to `number`; what follows is sent again."""
        if number > self.sent:
            raise SdoAbort(AbortCode.SEQUENCE)
        self.position += number * SEGMENT
        self.due_at = None

    def begin(self, now: int) -> Payloads:
        """The next block, or its first segment where segments keep a distance."""
        self.sent = 0
        count = self.segments()
        if not self.gap_ns:
            return [self.segment() for _ in range(count)]
        self.due_at = now + self.gap_ns if count > 1 else None
        return (self.segment(),)

    def segments(self) -> int:
        """How many segments this block has; an empty value has one."""
        left = -(-(len(self.value) - self.position) // SEGMENT)
        return min(self.block_size, left or 1)

    def segment(self) -> bytes:
        """The next segment: its number, a mark on the very last, up to seven bytes."""
        at = self.position + self.sent * SEGMENT
        self.sent += 1
        last = _LAST if at + SEGMENT >= len(self.value) else 0
        return bytes((self.sent | last,)) + self.value[at : at + SEGMENT].ljust(SEGMENT, b"\0")

    def advance(self, now: int) -> Payloads:
        """The segments that are due."""
        answers: list[bytes] = []
        while self.due_at is not None and self.due_at <= now:
            answers.append(self.segment())
            self.due_at = self.due_at + self.gap_ns if self.sent < self.segments() else None
        return answers

    def end(self) -> bytes:
        """How many bytes of the last segment do not count, and the CRC."""
        size = len(self.value)
        unused = -size % SEGMENT if size else SEGMENT
        crc = crc_of(self.value) if self.with_crc else 0
        return bytes((0xC1 | unused << 2, crc & 0xFF, crc >> 8, 0, 0, 0, 0, 0))
