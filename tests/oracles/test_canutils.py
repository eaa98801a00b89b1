"""The way to can-utils' lengths: it must notice when the tool does not answer as expected."""

from __future__ import annotations

from pathlib import Path

import pytest

from node_model.frame import Frame
from tests.oracles import canutils

needs_tools = pytest.mark.skipif(
    bool(canutils.missing()), reason=f"not installed: {canutils.missing()}"
)


@needs_tools
@pytest.mark.slow
def test_lengths_come_frame_by_frame_and_in_order(tmp_path: Path) -> None:
    """Frames of 44 + 8n bits and their stuff bits come back in the order of the question."""
    sample = [Frame(0x123, bytes([0x55] * size)) for size in range(9)]
    found = canutils.lengths(sample, canutils.build(tmp_path))
    assert found == sorted(found)
    assert len(set(found)) == 9


@needs_tools
@pytest.mark.slow
def test_can_utils_counts_data_in_remote_frames(tmp_path: Path) -> None:
    """Why remote frames compare with DLC 0 only: can-utils adds eight bits a byte asked for.

    When a later can-utils makes this fail, the comparison can take all remote frames in.
    """
    (found,) = canutils.lengths([Frame(0x555, remote=True, dlc=3)], canutils.build(tmp_path))
    assert found > Frame(0x555, remote=True, dlc=3).bits + 20


def test_random_frames_repeat_with_their_seed() -> None:
    """The same seed gives the same frames, another seed gives others."""
    one = list(canutils.random_frames(50, seed=1))
    assert one == list(canutils.random_frames(50, seed=1))
    assert one != list(canutils.random_frames(50, seed=2))
