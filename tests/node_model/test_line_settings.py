"""Node id and bit rate in memory."""

from __future__ import annotations

from node_model.line_settings import BYTE_NS, IMAGE_BYTES, LineSettings


def test_the_factory_counts_until_something_is_stored() -> None:
    """Then what was stored, byte by byte; a blank memory has its length."""
    line = LineSettings(5, 250_000)
    assert line.load() == (5, 250_000)
    assert len(line.store.memory) == IMAGE_BYTES
    line.save(9, 1_000_000, 0)
    assert line.deadline() == BYTE_NS
    line.advance(9 * BYTE_NS)
    assert line.load() == (5, 250_000)
    line.advance(11 * BYTE_NS)
    assert line.deadline() is None
    assert line.load() == (9, 1_000_000)
    assert LineSettings(5, 250_000, bytes(line.store.memory)).load() == (9, 1_000_000)
