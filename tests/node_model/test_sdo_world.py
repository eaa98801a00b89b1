"""SDO in a world with bit times: a block upload beside what the device has to send."""

from __future__ import annotations

import pytest

from node_model.device import Cia301Device
from node_model.devices import make_device
from node_model.frame import Frame
from node_model.node import MS
from node_model.world import World

NAME = 0x1008
PERIOD_MS = 20
LONGEST_BITS = 138


@pytest.mark.parametrize("bit_rate", [50_000, 250_000, 1_000_000])
def test_heartbeats_keep_their_time_beside_a_block_upload(bit_rate: int) -> None:
    """None waits for more than the frame on the wire and one of the block, at any bit rate."""
    device = make_device("drive", settings={"heartbeat_ms": PERIOD_MS, "bit_rate": bit_rate})
    assert isinstance(device, Cia301Device)
    world = World(bit_rate)
    tester = world.attach()
    world.act(world.attach(device), device.power_on)
    world.run(100 * MS)
    value = bytes(i & 0xFF for i in range(127 * 7))
    device.od.put(NAME, 0, value)
    world.send(tester, Frame(0x605, b"\xa0\x08\x10\0\x7f\0\0\0"))
    world.send(tester, Frame(0x605, b"\xa3" + bytes(7)))
    segments, beats = [], []
    while (seen := world.next_frame(1000 * MS)) is not None:
        frame, ended_at, _, _ = seen
        if frame.can_id == 0x585 and frame.data[0] != 0xC6:
            segments.append(frame.data)
        elif frame.can_id == 0x705:
            beats.append(ended_at)
    assert b"".join(data[1:] for data in segments) == value
    most = 2 * LONGEST_BITS * 1_000_000_000 // bit_rate
    late = [at - beats[0] - n * PERIOD_MS * MS for n, at in enumerate(beats)]
    assert len(beats) > 40
    assert all(-most <= each <= most for each in late)
