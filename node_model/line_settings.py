"""Node id and bit rate of a device in its own small memory, apart from its objects."""

from __future__ import annotations

from node_model.node import NOTHING, Frames
from node_model.service import QuietService
from node_model.storage import RecordStore

SIZE = 5
IMAGE_BYTES = 2 * (SIZE + RecordStore.OVERHEAD)
"""Length of the memory."""

BYTE_NS = 50_000
"""How long it needs for one byte."""


class LineSettings(QuietService):
    """What a device needs to know before it can take part on a line.

    Args:
        node_id: as it leaves the factory.
        bit_rate: bit/s, as it leaves the factory.
        image: content of the memory, e.g. from an earlier life.
        store: makes the memory.
    """

    alone = True

    def __init__(
        self,
        node_id: int,
        bit_rate: int,
        image: bytes = b"",
        store: type[RecordStore] = RecordStore,
    ) -> None:
        self._factory = (node_id, bit_rate)
        self.store = store(SIZE, image, BYTE_NS)

    def load(self) -> tuple[int, int]:
        """Node id and bit rate that are stored, or those of the factory."""
        record = self.store.load()
        if record is None:
            return self._factory
        return record[0], int.from_bytes(record[1:], "little")

    def save(self, node_id: int, bit_rate: int, now: int) -> None:
        """Begin to store."""
        self.store.save(record_of(node_id, bit_rate), now)

    # The verbs of a service.

    def advance(self, now: int) -> Frames:
        """The bytes whose time has come are written."""
        self.store.advance(now)
        return NOTHING

    def deadline(self) -> int | None:
        """The next byte to write."""
        return self.store.due_at


def record_of(node_id: int, bit_rate: int) -> bytes:
    """What the memory holds."""
    return bytes((node_id,)) + bit_rate.to_bytes(4, "little")
