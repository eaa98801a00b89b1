"""Many nodes at once."""

from __future__ import annotations

import pytest

from hil_tests.clock import MS
from hil_tests.judge.cobs import Nmt, State
from hil_tests.manager import NodeList, What
from node_model.frame import Frame


def test_a_frame_goes_to_the_manager_of_its_sender() -> None:
    """Error control and EMCY of each of 127 nodes; other frames concern nobody."""
    nodes = NodeList(range(1, 128))
    nodes.update(Frame(0x77F, b"\x05"), 1)
    nodes.update(Frame(0x701, b"\x04"), 2)
    nodes.update(Frame(0x085, bytes.fromhex("3081110000000000")), 3)
    nodes.update(Frame(0x000, b"\x01\x05"), 4)
    nodes.update(Frame(0x185, b"\x01\x05"), 5)
    states = {node_id: state for node_id, state in nodes.states().items() if state}
    assert states == {1: State.STOPPED, 127: State.OPERATIONAL}
    assert [(event.what, event.node_id) for event in nodes.take_events()] == [
        (What.LIFE_GUARDING, 5)
    ]
    assert (len(nodes), list(nodes)[:2]) == (127, [1, 2])


def test_one_frame_commands_every_node() -> None:
    """Node id 0 addresses all; each manager then expects the state."""
    nodes = NodeList((3, 4))
    assert nodes.command(Nmt.START, 0) == Frame(0, b"\x01\x00")
    assert [manager.expected for manager in nodes.values()] == [State.OPERATIONAL] * 2


def test_the_soonest_deadline_is_that_of_the_list() -> None:
    """Polls of several nodes come together where they are due together."""
    nodes = NodeList((3, 4, 5))
    assert nodes.deadline() is None
    nodes[3].guard(100 * MS, 2, 0)
    nodes[4].guard(50 * MS, 2, 0)
    assert nodes.deadline() == 0
    assert [frame.can_id for frame in nodes.advance(0)] == [0x703, 0x704]
    assert nodes.deadline() == 50 * MS
    assert [frame.can_id for frame in nodes.advance(50 * MS)] == [0x704]


def test_events_of_all_nodes_come_in_their_order() -> None:
    """Oldest first, whichever node they are of; taken once."""
    nodes = NodeList((3, 4))
    nodes[4].heartbeat(10 * MS, 0, written=True)
    nodes[3].heartbeat(20 * MS, 0, written=True)
    nodes.advance(30 * MS)
    assert [event.node_id for event in nodes.take_events()] == [4, 3]
    assert nodes.take_events() == []


def test_a_list_has_only_nodes_that_can_be() -> None:
    """As a manager alone."""
    with pytest.raises(ValueError, match=r"node id 128: write 1\.\.127"):
        NodeList((1, 128))
