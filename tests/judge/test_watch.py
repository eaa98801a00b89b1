"""The watch: whose frames are whose, when the tester is deaf, and what stimuli mean."""

from __future__ import annotations

import pytest

from hil_tests.clock import MS, Interval
from hil_tests.judge.cobs import Nmt, State
from hil_tests.trace import EventKind, Moment, Sighting
from node_model.frame import Frame
from tests.judge.scene import BEAT, Scene, device

FOREIGN = Frame(0x123, b"\x01")


def test_alone_every_frame_of_others_is_the_nodes() -> None:
    """On an exclusive bus a strange frame is blamed on the node."""
    scene = Scene().started()
    scene.see(FOREIGN, 60)
    assert scene.blamed(100) == ["ROB-02"]


def test_on_a_shared_bus_only_its_identifiers_are() -> None:
    """Others may send what they like; an extended frame is nobody's here."""
    scene = Scene(device(exclusive=False)).started()
    scene.see(FOREIGN, 60)
    scene.see(Frame(BEAT, b"\x05", extended=True), 61)
    assert scene.blamed(100) == []
    scene.beat(150, 0x05)
    assert scene.blamed(150) == ["NMT-03"]


def test_stations_of_the_bench_are_not_the_node() -> None:
    """A load is admitted by its identifiers."""
    scene = Scene().started()
    scene.watch.admit(frozenset((0x123,)))
    scene.watch.admit(frozenset((0x124,)))
    scene.see(FOREIGN, 60)
    scene.see(Frame(0x124), 61)
    assert scene.blamed(100) == []
    scene.see(Frame(0x125), 62)
    assert scene.blamed(100) == ["ROB-02"]


def test_own_frames_are_never_blamed() -> None:
    """The tester may send anything; only NMT for the node and 4F8h mean something."""
    scene = Scene().started()
    for frame in (FOREIGN, Frame(BEAT, b"\x05"), Frame(0, b""), Frame(0x205, b"\x01")):
        scene.see(frame, 60, own=True)
    scene.command(Nmt.START, 61, to=6)
    scene.command(0x03, 62)
    scene.beats([150, 250])
    assert scene.blamed(300) == []


def test_a_node_that_is_not_known_is_watched_for_strange_frames() -> None:
    """Without a node id only the echo is known; NMT means nothing."""
    scene = Scene(device(node_id=None, heartbeat_ms=None, exclusive=False))
    scene.command(Nmt.START, 10)
    scene.see(Frame(0x705, b"\x05"), 20)
    scene.power(30, on=True, mode="commissioning")
    scene.see(Frame(0x3F8, bytes(6)), 40)
    assert scene.blamed(100) == ["COM-01"]


def test_at_another_bit_rate_nothing_is_heard() -> None:
    """A node that cannot hear obeys nothing and owes nothing; back at its rate it does."""
    scene = Scene(rate=125_000)
    scene.power(0, on=True)
    assert scene.blamed(5000) == []
    scene.command(Nmt.RESET_NODE, 5000)
    assert scene.blamed(9000) == []
    scene.rate(9000, 250_000)
    scene.command(Nmt.RESET_NODE, 9100)
    assert scene.blamed(10_101) == ["NMT-06"]


def test_changing_the_rate_ends_what_was_watched() -> None:
    """A beat that is overdue then is told; nothing is afterwards."""
    for away_at, blamed in ((300, []), (400, ["HB-01"])):
        scene = Scene().started()
        scene.beats([150, 250])
        scene.rate(away_at, 125_000)
        assert scene.blamed(9000) == blamed


def test_a_device_without_a_known_rate_is_always_heard() -> None:
    """What is not known is held against nobody."""
    scene = Scene(device(bit_rate=None), rate=125_000)
    scene.power(0, on=True)
    assert scene.blamed(2000) == ["NMT-02"]


def test_other_stimuli_mean_nothing_to_it() -> None:
    """Keys are the business of tests."""
    scene = Scene().started()
    scene.watch.did(Moment("keys", 60 * MS, 60 * MS, {"held": ["k3"]}))
    scene.beats([150, 250])
    assert scene.blamed(300) == []


def test_states_follow_the_stimuli() -> None:
    """Power, boot-up, command: the timeline knows."""
    scene = Scene()
    sure = scene.watch.timeline.sure
    scene.power(0, on=False)
    assert sure(Interval(0, 0)) is State.OFF
    scene.started(1000)
    assert sure(Interval(1050 * MS, 1050 * MS)) is State.PRE_OPERATIONAL
    scene.command(Nmt.START, 1100)
    assert sure(Interval(1150 * MS, 1150 * MS)) is State.OPERATIONAL


def test_a_frame_gets_its_causal_interval() -> None:
    """On a timed wire it was asked for when it started, to one bit."""
    scene = Scene(bit_ns=4000)
    frame = Frame(BEAT, b"\x7f")
    seen = scene.watch.see(Sighting(frame, 10 * MS), 0)
    start = 10 * MS - frame.bits * 4000
    assert seen.wanted == Interval(start - 4000, start)
    assert scene.watch.quiet_from(10 * MS) <= start


def test_another_bit_rate_is_another_bit_time() -> None:
    """After the change a frame's length in time is a new one; an untimed wire has none."""
    for bit_ns, new_bit_ns in ((4000, 8000), (0, 0)):
        scene = Scene(bit_ns=bit_ns, rate=250_000)
        frame = Frame(BEAT, b"\x7f")
        scene.watch.see(Sighting(frame, 10 * MS), 0)
        scene.rate(15, 125_000)
        seen = scene.watch.see(Sighting(frame, 100 * MS), 1)
        assert seen.wanted.latest == 100 * MS - frame.bits * new_bit_ns


def test_an_event_keeps_the_wire_busy() -> None:
    """A frame right after an error frame may have waited behind it."""
    scene = Scene(bit_ns=4000)
    frame = Frame(BEAT, b"\x7f")
    scene.watch.see(Sighting(frame, 10 * MS), 0)
    scene.event(20, EventKind.ERROR)
    after = 20 * MS + (frame.bits + 3) * 4000
    seen = scene.watch.see(Sighting(frame, after), 1)
    assert seen.wanted.earliest < 10 * MS


def test_a_beat_of_a_longer_chain_of_starts() -> None:
    """Between a reset and its boot-up no beat is taken for granted."""
    scene = Scene().started()
    scene.beats([150, 250])
    scene.command(Nmt.RESET_NODE, 260)
    scene.command(Nmt.RESET_NODE, 261)
    scene.boot(270)
    scene.beats([370, 470])
    assert scene.blamed(500) == []


def test_a_node_in_commissioning_owes_nothing_for_a_reset() -> None:
    """Powered up to be commissioned it obeys no NMT, so no boot-up is missed."""
    scene = Scene(device())
    scene.power(0, on=True, mode="commissioning")
    scene.command(Nmt.RESET_NODE, 500)
    assert scene.blamed(3000) == []


def test_a_node_in_either_mode_may_obey_a_reset() -> None:
    """Where the source leaves the mode open, a boot-up after a reset is as good as none."""
    for boots in (True, False):
        scene = Scene(device())
        scene.power(0, on=True, mode="either")
        scene.see(Frame(BEAT, b"\x00"), 50)
        scene.command(Nmt.RESET_NODE, 60)
        if boots:
            scene.see(Frame(BEAT, b"\x00"), 70)
        assert ("NMT-06" in scene.blamed(3000)) is not boots


@pytest.mark.parametrize(("last_ms", "blamed"), [(1190, []), (1210, ["ROB-02"])])
def test_a_board_may_outlive_its_supply_for_a_while(last_ms: int, blamed: list[str]) -> None:
    """Capacitors carry it on for as long as a power cycle takes; a frame after that is wrong."""
    scene = Scene(device(fade_ms=200)).started()
    scene.beats([100, 200, 300, 400, 500, 600, 700, 800, 900, 1000])
    scene.power(1000, on=False)
    scene.beats([1060, last_ms])
    assert scene.blamed(2000)[:1] == blamed


def test_a_boot_up_that_may_be_as_old_as_the_watch_counts() -> None:
    """A board that boots at once: its boot-up may have been asked for before anybody watched."""
    scene = Scene(device(), bit_ns=4000).started(0.001)
    scene.beats([100, 200])
    scene.power(250, on=False)
    scene.power(500, on=True)
    scene.boot(500.3)
    scene.beats([600, 700])
    assert scene.blamed(750) == []


def test_a_boot_up_without_supply_leads_nowhere() -> None:
    """A device that is off for certain stays off, whatever it says."""
    scene = Scene().started()
    scene.power(1000, on=False)
    scene.boot(1500)
    assert scene.watch.timeline.sure(Interval(1600 * MS, 1600 * MS)) is State.OFF
    assert "ROB-02" in scene.blamed(2000)
