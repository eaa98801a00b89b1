"""Non-volatile storage of one record that survives a power cut at any instant.

Two slots. A record goes byte by byte into the slot that does not hold the newest one; its
first byte, the mark that makes a slot count, is cleared first and written last. So at each
instant the newest complete record is readable, the old one or the new one.
"""

from __future__ import annotations

from functools import lru_cache

from node_model.frame import crc15

MARK = 0xA5
"""Value of the first byte of a slot that holds a complete record."""


@lru_cache(maxsize=256)  # each start reads both slots again
def _check(body: bytes) -> bytes:
    return crc15(int.from_bytes(body, "big"), 8 * len(body)).to_bytes(2, "big")


class RecordStore:
    """A record of `size` bytes in a memory that can be cut off at any time.

    A slot is the mark, a sequence number of two bytes, the record, and two bytes of check.

    Args:
        size: bytes of the record.
        image: content of the memory, e.g. kept from an earlier life; one of another
            length counts as blank.
        byte_ns: how long the memory needs for one byte.
    """

    OVERHEAD = 5
    """Bytes of a slot besides the record."""

    def __init__(self, size: int, image: bytes = b"", byte_ns: int = 5_000_000) -> None:
        self.size = size
        self._slot_bytes = size + self.OVERHEAD
        self._byte_ns = byte_ns
        blank = bytes(2 * self._slot_bytes)
        self.memory = bytearray(image if len(image) == len(blank) else blank)
        self._queue: list[tuple[int, int]] = []
        self.due_at: int | None = None

    def _slot(self, number: int) -> tuple[int, bytes] | None:
        """Sequence number and record of a slot; None where it holds no complete record."""
        raw = bytes(self.memory[number * self._slot_bytes :][: self._slot_bytes])
        end = self._end(raw)
        body = raw[1:end]
        if raw[0] != MARK or _check(body) != raw[end : end + 2]:
            return None
        return int.from_bytes(body[:2], "big"), self._unpacked(body[2:])

    def _end(self, raw: bytes) -> int:
        """Where in a slot the check stands."""
        return len(raw) - 2

    def _packed(self, record: bytes) -> bytes:
        """A record as it stands in a slot."""
        return record

    def _unpacked(self, packed: bytes) -> bytes:
        """The record that stands so in a slot."""
        return packed

    def _newest(self) -> int | None:
        """Number of the slot with the newest complete record."""
        first, second = self._slot(0), self._slot(1)
        if first is None or second is None:
            return None if first is second else int(first is None)
        return int((second[0] - first[0]) & 0xFFFF < 0x8000)

    def load(self) -> bytes | None:
        """The newest complete record, or None."""
        number = self._newest()
        found = None if number is None else self._slot(number)
        return found[1] if found else None

    def save(self, record: bytes, now: int) -> None:
        """Begin to store `record`; `advance` carries it out."""
        newest = self._newest()
        found = None if newest is None else self._slot(newest)
        sequence = (found[0] + 1 if found else 1) & 0xFFFF
        body = sequence.to_bytes(2, "big") + self._packed(record)
        base = 0 if newest is None else (1 - newest) * self._slot_bytes
        content = enumerate(body + _check(body), base + 1)
        self._queue = [(base, 0), *content, (base, MARK)]
        self.due_at = now + self._byte_ns

    def advance(self, now: int) -> None:
        """Write the bytes whose time has come."""
        while self.due_at is not None and self.due_at <= now:
            place, value = self._queue.pop(0)
            self.memory[place] = value
            self.due_at = self.due_at + self._byte_ns if self._queue else None

    def cut(self) -> None:
        """Power is gone: what is not yet written never will be."""
        self.due_at = None

    def finish(self) -> None:
        """Write at once what is not yet written."""
        for place, value in self._queue if self.due_at is not None else ():
            self.memory[place] = value
        self._queue = []
        self.due_at = None


class LongRecordStore(RecordStore):
    """Records of 0 to `size` bytes: a slot holds the length before the record.

    Only the bytes of the record are written and checked, not the rest of the slot.
    Saving a longer record raises ValueError.
    """

    OVERHEAD = RecordStore.OVERHEAD + 4

    def _end(self, raw: bytes) -> int:
        return 7 + int.from_bytes(raw[3:7], "big")

    def _packed(self, record: bytes) -> bytes:
        if len(record) > self.size:
            raise ValueError(f"a record of {len(record)} bytes; this memory holds {self.size}")
        return len(record).to_bytes(4, "big") + record

    def _unpacked(self, packed: bytes) -> bytes:
        return packed[4:]
