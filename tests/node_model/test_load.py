"""Bus load to a given share, reproducibly."""

from __future__ import annotations

import pytest

from node_model.frame import INTERMISSION_BITS, Frame
from node_model.load import Load
from node_model.node import S
from node_model.world import World
from tests.node_model.ears import Ear

FRAMES = [Frame(0x100 + n, bytes(n)) for n in range(9)]


def busy_share(share_ppm: int, seed: int = 1) -> tuple[float, list[int]]:
    """Share of two seconds at 1 Mbit/s that the wire was taken, and when frames ended."""
    world = World(1_000_000)
    world.attach(Ear(1_000_000))
    load = Load(FRAMES, share_ppm, 1_000_000, seed)
    controller = world.attach(load, depth=4)
    world.act(controller, load.power_on)
    bits, ends = 0, []
    while (found := world.next_frame(2 * S)) is not None:
        bits += found[0].bits + INTERMISSION_BITS
        ends.append(found[1])
    return bits / 2_000_000, ends


@pytest.mark.parametrize("share_ppm", [50_000, 200_000])
def test_the_wire_is_taken_for_the_share_asked_for(share_ppm: int) -> None:
    """Within 3 % of it over two seconds."""
    assert busy_share(share_ppm)[0] == pytest.approx(share_ppm / 1e6, rel=0.03)


@pytest.mark.slow
def test_at_a_million_the_wire_is_never_idle() -> None:
    """Frame after frame with nothing but the intermission between."""
    assert busy_share(1_000_000)[0] > 0.9999


def test_the_rhythm_follows_from_the_seed() -> None:
    """The same seed, the same instants; another one, others."""
    assert busy_share(50_000)[1] == busy_share(50_000)[1]
    assert busy_share(50_000)[1] != busy_share(50_000, seed=2)[1]


def test_frames_are_sent_in_turn() -> None:
    """Round and round; a late host gets all that were due, in the same order."""
    load = Load(FRAMES[:3], 1_000_000, 1_000_000)
    assert load.power_on(0) == ()
    assert load.deadline() == 1
    assert load.advance(0) == ()
    late = load.advance(100_000_000)
    assert len(late) > 1000
    assert list(late[:6]) == FRAMES[:3] * 2


def test_without_power_it_is_silent() -> None:
    """Power-on twice is power-on once; it heeds nothing."""
    load = Load(FRAMES, 500_000, 125_000)
    assert load.advance(5) == ()
    load.power_on(10)
    assert load.power_on(50) == ()
    assert load.deadline() == 11
    assert load.receive(FRAMES[0], 60) == ()
    assert load.power_off(70) == ()
    assert load.deadline() is None
    assert load.bit_rate == 0
