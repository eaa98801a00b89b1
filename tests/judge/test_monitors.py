"""The monitors: what each one blames, what it lets pass, and both sides of each limit."""

from __future__ import annotations

import pytest

from hil_tests.clock import MS
from hil_tests.judge.cobs import Nmt, nmt_frame
from hil_tests.judge.verdict import Outcome
from node_model.frame import Frame
from tests.judge.scene import BEAT, NODE, Scene, device

STEADY = [150 + 100 * n for n in range(25)]
"""Beats of a node that booted at 50 ms, the first one a period later."""


# Allowed frames (ROB-02, KEY-07, COM-01, COM-12).


def test_without_a_node_id_a_strange_frame_is_nobodys() -> None:
    """It may well be one of the node's."""
    scene = Scene(device(node_id=None, heartbeat_ms=None))
    scene.see(Frame(0x705, b"\x05"), 10)
    assert scene.verdicts(100) == []


def test_a_regular_life_is_blamed_for_nothing() -> None:
    """Start, EMCY, beats, operational, key frame, SDO answer."""
    scene = Scene().started()
    scene.see(Frame(0x085, bytes(8)), 51)
    scene.beats([150, 250])
    scene.command(Nmt.START, 260)
    scene.see(Frame(0x185, b"\x00"), 261)
    scene.see(Frame(0x585, bytes(8)), 262)
    scene.beats([350, 450], 0x05)
    assert scene.verdicts(500) == []


@pytest.mark.parametrize(
    "frame",
    [
        Frame(0x123, b"\x01"),
        Frame(BEAT, dlc=1, remote=True),
        Frame(BEAT, b"\x7f", extended=True),
    ],
    ids=["identifier", "remote", "extended"],
)
def test_a_frame_that_is_none_of_its_own(frame: Frame) -> None:
    """Other identifiers, and its own ones in another format."""
    scene = Scene().started()
    scene.see(frame, 60)
    (verdict,) = scene.verdicts(100)
    assert verdict.requirement == "ROB-02"
    assert verdict.outcome is Outcome.FAIL
    assert "none of its frames" in verdict.text


@pytest.mark.parametrize(
    ("can_id", "size"), [(0x085, 7), (0x185, 0), (0x185, 2), (0x585, 7), (BEAT, 2), (BEAT, 0)]
)
def test_a_frame_of_wrong_length(can_id: int, size: int) -> None:
    """Each of its frames has one length; here in operational, where all are allowed."""
    scene = Scene().started()
    scene.command(Nmt.START, 51)
    scene.see(Frame(can_id, bytes([5] * size)), 140)
    (verdict,) = scene.verdicts(145)
    assert verdict.requirement == "ROB-02"
    assert f"with {size} bytes" in verdict.text


def test_a_key_frame_before_operational() -> None:
    """Pre-operational allows none."""
    scene = Scene().started()
    scene.see(Frame(0x185, b"\x00"), 60)
    (verdict,) = scene.verdicts(100)
    assert verdict.requirement == "KEY-07"
    assert "while it was pre-operational" in verdict.text


@pytest.mark.parametrize(("at_ms", "blamed"), [(310, []), (311, ["KEY-07"])])
def test_a_key_frame_after_operational(at_ms: int, blamed: list[str]) -> None:
    """Until a command must have acted one may still come."""
    scene = Scene().started()
    scene.command(Nmt.START, 110)
    scene.beats([150, 250], 0x05)
    scene.command(Nmt.STOP, 260)
    scene.see(Frame(0x185, b"\x00"), at_ms - 0.5)
    assert scene.blamed(320) == blamed


@pytest.mark.parametrize(("at_ms", "blamed"), [(150, []), (151, ["ROB-02"])])
def test_the_emcy_of_a_start_in_stopped(at_ms: int, blamed: list[str]) -> None:
    """A stopped node sends none, but that of its start may have been queued before."""
    scene = Scene().started()
    scene.command(Nmt.STOP, 60)
    scene.see(Frame(0x085, bytes(8)), at_ms)
    assert scene.blamed(151) == blamed


def test_no_other_frame_is_excused_by_a_start() -> None:
    """Key frames are none of it."""
    scene = Scene().started()
    scene.command(Nmt.STOP, 60)
    scene.see(Frame(0x185, bytes(1)), 149)
    assert scene.blamed(150) == ["KEY-07"]


def test_a_key_frame_of_a_late_host_is_inconclusive() -> None:
    """It may have been due while the node was operational."""
    scene = Scene().started()
    scene.command(Nmt.START, 110)
    scene.beats([150, 250], 0x05)
    scene.command(Nmt.STOP, 260)
    scene.see(Frame(0x185, b"\x00"), 340)
    scene.lateness.add(290 * MS, 341 * MS)
    (verdict,) = scene.verdicts(345)
    assert verdict.requirement == "KEY-07"
    assert verdict.outcome is Outcome.INCONCLUSIVE


def test_nothing_but_echo_in_commissioning() -> None:
    """Before the one message COM-01 is broken, after it COM-12."""
    scene = Scene()
    scene.power(0, on=True, mode="commissioning")
    scene.see(Frame(0x185, b"\x00"), 100)
    scene.see(Frame(0x4F8, bytes(6)), 200, own=True)
    scene.see(Frame(0x3F8, bytes(6)), 210)
    scene.see(Frame(0x185, b"\x00"), 300)
    assert scene.blamed(400) == ["COM-01", "COM-12"]


def test_an_echo_without_a_message() -> None:
    """A new power-up needs a new message."""
    scene = Scene()
    scene.power(0, on=True, mode="commissioning")
    scene.see(Frame(0x4F8, bytes(6)), 200, own=True)
    scene.power(300, on=False)
    scene.power(500, on=True, mode="commissioning")
    scene.see(Frame(0x3F8, bytes(6)), 600)
    assert scene.blamed(700) == ["COM-01"]


def test_a_reset_by_command_forgets_no_message() -> None:
    """Only power does; NMT is not obeyed in commissioning."""
    scene = Scene()
    scene.power(0, on=True, mode="either")
    scene.see(Frame(0x4F8, bytes(6)), 200, own=True)
    scene.command(Nmt.RESET_NODE, 250)
    scene.see(Frame(0x3F8, bytes(6)), 300)
    assert scene.blamed(400) == []


def test_an_extended_4f8h_is_no_message() -> None:
    """It must not be taken for one (COM-24)."""
    scene = Scene()
    scene.power(0, on=True, mode="commissioning")
    scene.see(Frame(0x4F8, bytes(6), extended=True), 200, own=True)
    scene.see(Frame(0x3F8, bytes(6)), 300)
    assert scene.blamed(400) == ["COM-01"]


# Boot-up (NMT-02).


def test_a_second_boot_up() -> None:
    """One power-on, one boot-up."""
    scene = Scene().started()
    scene.boot(60)
    (verdict,) = scene.verdicts(100)
    assert verdict.requirement == "NMT-02"
    assert "without a reset" in verdict.text


@pytest.mark.parametrize(("until_ms", "blamed"), [(1000, []), (1001, ["NMT-02"])])
def test_a_missing_boot_up(until_ms: int, blamed: list[str]) -> None:
    """It may come until its limit."""
    scene = Scene()
    scene.power(0, on=True)
    assert scene.blamed(until_ms) == blamed


@pytest.mark.parametrize("end", ["off", "reset"])
def test_a_boot_up_missing_when_the_next_start_comes(end: str) -> None:
    """What is overdue then is told, once."""
    scene = Scene()
    scene.power(0, on=True)
    if end == "off":
        scene.power(1500, on=False)
    else:
        scene.command(Nmt.RESET_NODE, 1500)
        scene.boot(1600)
    assert scene.blamed(1601) == ["NMT-02"]


def test_nothing_is_owed_without_power() -> None:
    """A start that was cut short is none."""
    scene = Scene()
    scene.power(0, on=True)
    scene.power(500, on=False)
    assert scene.blamed(5000) == []


@pytest.mark.parametrize("command", [Nmt.RESET_NODE, Nmt.RESET_COMMUNICATION])
def test_each_reset_is_answered_by_one(command: Nmt) -> None:
    """Two commands, the second while the node starts: one boot-up or two."""
    for boots in ([120], [120, 130]):
        scene = Scene().started()
        scene.command(command, 100)
        scene.command(command, 110)
        for instant in boots:
            scene.boot(instant)
        assert scene.blamed(150) == []


def test_a_frame_before_boot_up_after_power_on() -> None:
    """Boot-up comes first of all."""
    scene = Scene()
    scene.power(0, on=True)
    scene.see(Frame(0x085, bytes(8)), 40)
    scene.boot(50)
    (verdict,) = scene.verdicts(100)
    assert verdict.requirement == "NMT-02"
    assert "before the boot-up" in verdict.text


@pytest.mark.parametrize(("at_ms", "blamed"), [(150, []), (151, ["NMT-02"])])
def test_a_frame_before_boot_up_after_a_command(at_ms: int, blamed: list[str]) -> None:
    """Until the command must have acted the node still lives its old life."""
    scene = Scene().started()
    scene.command(Nmt.RESET_NODE, 100)
    scene.see(Frame(0x085, bytes(8)), at_ms)
    scene.boot(160)
    assert scene.blamed(200) == blamed


def test_a_frame_of_a_late_host_before_boot_up() -> None:
    """It was due before the reset had acted: no blame at all."""
    scene = Scene().started()
    scene.command(Nmt.RESET_NODE, 100)
    scene.see(Frame(0x085, bytes(8)), 155)
    scene.boot(160)
    scene.lateness.add(120 * MS, 156 * MS)
    assert scene.blamed(200) == []


@pytest.mark.parametrize("length", [3, 8])
@pytest.mark.parametrize("obeyed", [True, False])
def test_a_longer_reset_may_be_obeyed_or_not(length: int, obeyed: bool) -> None:
    """NMT-21 leaves it open: one boot-up may follow, not two."""
    scene = Scene().started()
    scene.beats([150, 250])
    scene.see(Frame(0, bytes((0x81, NODE)).ljust(length, b"\0")), 260, own=True)
    if obeyed:
        scene.boot(270)
        scene.beats([370, 470])
        assert scene.blamed(500) == []
        scene.boot(480)
        assert scene.blamed(500) == ["NMT-02"]
    else:
        scene.beats([350, 450])
        assert scene.blamed(500) == []


def test_a_boot_up_across_a_loss() -> None:
    """What is owed may have been lost, or may come; the next start is strict again."""
    scene = Scene()
    scene.power(0, on=True)
    scene.event(40)
    assert scene.blamed(3000) == []

    scene = Scene()
    scene.power(0, on=True)
    scene.event(40)
    scene.boot(50)
    scene.power(100, on=False)
    scene.started(1000)
    scene.boot(1060)
    assert scene.blamed(1100) == ["NMT-02"]


def test_keys_that_leave_the_mode_open() -> None:
    """The node may boot, once, or may not."""
    for boots, blamed in (([], []), ([50], []), ([50, 60], ["NMT-02"])):
        scene = Scene()
        scene.power(0, on=True, mode="either")
        for instant in boots:
            scene.boot(instant)
        assert scene.blamed(100) == blamed


# Heartbeat: each interval (HB-01).


@pytest.mark.parametrize(
    ("gap_ms", "blamed"), [(94, ["HB-01"]), (95, []), (105, []), (106, ["HB-01"])]
)
def test_each_interval(gap_ms: int, blamed: list[str]) -> None:
    """Both sides of both limits."""
    scene = Scene().started()
    scene.beats([150, 150 + gap_ms])
    assert scene.blamed(150 + gap_ms) == blamed


def test_doubt_and_lateness_are_held_against_nobody() -> None:
    """A doubtful stamp is no suspicion; a late host's frame is taken back."""
    scene = Scene().started()
    scene.beat(150)
    scene.beat(260, doubt_ms=6)
    assert scene.blamed(260) == []

    scene = Scene().started()
    scene.beats([150, 260])
    scene.lateness.add(250 * MS, 259 * MS)
    assert scene.blamed(260) == []


def test_a_verdict_tells_what_was_measured() -> None:
    """Interval and limits are in it."""
    scene = Scene().started()
    scene.beats([150, 260])
    (verdict,) = scene.verdicts(260)
    assert str(verdict) == (
        "HB-01: interval between two heartbeats; measured 110 ms; allowed 95 ms .. 105 ms"
    )


@pytest.mark.parametrize(("until_ms", "blamed"), [(355, []), (356, ["HB-01"])])
def test_silence(until_ms: int, blamed: list[str]) -> None:
    """A beat that does not come is told at the end."""
    scene = Scene().started()
    scene.beats([150, 250])
    assert scene.blamed(until_ms) == blamed


def test_silence_is_told_when_the_power_goes() -> None:
    """And not held against a node without power."""
    scene = Scene().started()
    scene.beats([150, 250])
    scene.power(400, on=False)
    assert scene.blamed(9000) == ["HB-01"]


def test_nothing_is_overdue_on_a_bus_that_was_never_free() -> None:
    """A beat may wait behind a chain of others' frames, to the end and to the next start."""
    bit_ns = 4000
    frame = Frame(0x010, bytes(8))
    pitch_ms = (frame.bits + 3) * bit_ns / MS
    for ending in ("end", "off", "reset"):
        scene = Scene(device(exclusive=False), bit_ns).started()
        scene.beats([150, 250])
        at_ms = 300.0
        while at_ms < 400:
            scene.see(frame, at_ms)
            at_ms += pitch_ms
        if ending == "off":
            scene.power(at_ms, on=False)
        elif ending == "reset":
            bits = frame.bits - nmt_frame(Nmt.RESET_NODE, NODE).bits
            scene.command(Nmt.RESET_NODE, at_ms - bits * bit_ns / MS)
        assert scene.blamed(at_ms) == []


def test_losses_begin_a_new_row() -> None:
    """The interval across a loss is not judged, the next one is."""
    scene = Scene().started()
    scene.beats([150, 250])
    scene.event(300)
    scene.beats([550, 650, 760])
    assert scene.blamed(760) == ["HB-01"]


# Heartbeat: state changes.


def test_a_state_change_may_add_a_beat_and_shift_the_phase() -> None:
    """Short intervals are right until the command has acted and a period has passed."""
    scene = Scene().started()
    scene.beats([150, 250])
    scene.command(Nmt.START, 270)
    scene.beats([271, 371, 471], 0x05)
    assert scene.blamed(471) == []


def test_a_state_change_may_not_skip_a_beat() -> None:
    """The upper limit holds across it."""
    scene = Scene().started()
    scene.beats([150, 250])
    scene.command(Nmt.START, 270)
    scene.beats([360], 0x05)
    (verdict,) = scene.verdicts(360)
    assert verdict.requirement == "HB-01"
    assert "at most" in str(verdict)


def test_long_after_a_state_change_the_lower_limit_holds_again() -> None:
    """50 ms for the command and a period later the grid is a grid."""
    scene = Scene().started()
    scene.command(Nmt.START, 100)
    scene.beats([150, 250, 350, 440], 0x05)
    assert scene.blamed(440) == ["HB-01"]


# Heartbeat: the mean.


def row(pitch_ms: float, count: int, start_ms: float) -> list[float]:
    """`count` beats at a pitch."""
    return [start_ms + pitch_ms * n for n in range(count)]


@pytest.mark.parametrize(
    ("pitch_ms", "blamed"), [(97.9, ["HB-01"]), (98, []), (102, []), (102.1, ["HB-01"])]
)
def test_the_mean(pitch_ms: float, blamed: list[str]) -> None:
    """Both limits of the mean, over 20 intervals."""
    scene = Scene().started()
    scene.beats(row(pitch_ms, 21, 150))
    verdicts = scene.verdicts(150 + 21 * pitch_ms)
    assert [verdict.requirement for verdict in verdicts] == blamed
    assert all("mean of 20 heartbeat intervals" in verdict.text for verdict in verdicts)


def test_nineteen_intervals_have_no_mean() -> None:
    """The profile speaks of 20 or more."""
    scene = Scene().started()
    scene.beats(row(103, 20, 150))
    assert scene.blamed(150 + 20 * 103) == []


def test_the_mean_is_judged_after_a_command_too() -> None:
    """Once was not: only beats from boot-up to the first command had been counted."""
    scene = Scene().started()
    scene.command(Nmt.START, 100)
    scene.beats(row(103, 30, 150), 0x05)
    (verdict,) = scene.verdicts(150 + 30 * 103)
    assert verdict.requirement == "HB-01"
    assert "mean of" in verdict.text


def test_a_command_cuts_the_row() -> None:
    """Two short rows with a new phase between them are two rows."""
    scene = Scene().started()
    scene.beats(row(103, 15, 150))
    scene.command(Nmt.START, 1600)
    scene.beats(row(103, 15, 1601), 0x05)
    assert scene.blamed(3050) == []


def test_a_mean_of_a_late_host_is_taken_back() -> None:
    """The last beat of the row was due earlier than it was sent."""
    scene = Scene().started()
    scene.beats([*row(102, 20, 150), 150 + 19 * 102 + 105])
    end = round((150 + 19 * 102 + 105) * MS)
    assert scene.blamed(2195) == ["HB-01"]

    scene = Scene().started()
    scene.beats([*row(102, 20, 150), 150 + 19 * 102 + 105])
    scene.lateness.add(end - 4 * MS, end)
    assert scene.blamed(2195) == []


# Heartbeat: content (HB-02, HB-05, NMT-03, NMT-07).


@pytest.mark.parametrize("byte", [0x01, 0x03, 0x84, 0xFF])
def test_a_beat_that_shows_no_state(byte: int) -> None:
    """Bit 7 is 0; only three values are states."""
    scene = Scene().started()
    scene.beat(150, byte)
    assert scene.blamed(160) == ["HB-02"]


def test_operational_without_any_start() -> None:
    """Nothing but NMT starts a node."""
    scene = Scene().started()
    scene.beat(150, 0x05)
    assert scene.blamed(160) == ["NMT-03"]


def test_a_state_that_no_command_led_to() -> None:
    """After some command it is the transition that is wrong."""
    scene = Scene().started()
    scene.command(Nmt.STOP, 60)
    scene.beat(150, 0x05)
    assert scene.blamed(160) == ["NMT-07"]
    scene = Scene().started()
    scene.beat(150, 0x04)
    assert scene.blamed(160) == ["NMT-07"]


@pytest.mark.parametrize(("at_ms", "blamed"), [(249, []), (251, ["NMT-07"])])
def test_the_old_state_after_a_command(at_ms: float, blamed: list[str]) -> None:
    """It may be shown until the command must have acted."""
    scene = Scene().started()
    scene.beats([150])
    scene.command(Nmt.START, 200)
    scene.beat(at_ms)
    assert scene.blamed(252) == blamed


def test_the_old_state_of_a_late_host_is_inconclusive() -> None:
    """It may have been due before the command acted."""
    scene = Scene().started()
    scene.beats([150])
    scene.command(Nmt.START, 195)
    scene.beat(250)
    scene.lateness.add(240 * MS, 251 * MS)
    (verdict,) = scene.verdicts(255)
    assert (verdict.requirement, verdict.outcome) == ("NMT-07", Outcome.INCONCLUSIVE)


def test_a_longer_start_may_be_obeyed_or_not() -> None:
    """Both states are right after it, for as long as it takes."""
    for state in (0x7F, 0x05):
        scene = Scene().started()
        scene.see(Frame(0, bytes((0x01, NODE, 0))), 60, own=True)
        scene.beats([150, 250, 350], state)
        assert scene.blamed(360) == []


def test_a_beat_although_the_period_is_zero() -> None:
    """Each one is wrong; silence is right."""
    scene = Scene(device(heartbeat_ms=0)).started()
    assert scene.blamed(5000) == []
    scene.beats([6000, 6001])
    assert set(scene.blamed(9000)) == {"HB-05"}


def test_a_period_that_is_not_known() -> None:
    """Silence says nothing."""
    scene = Scene(device(heartbeat_ms=None)).started()
    scene.beat(150)
    assert scene.blamed(5000) == []


# Heartbeat: the first one (HB-06).


@pytest.mark.parametrize(("at_ms", "blamed"), [(51, []), (155, []), (156, ["HB-06"])])
def test_the_first_beat(at_ms: int, blamed: list[str]) -> None:
    """At once or a period after boot-up, not later; the next one counts from it."""
    scene = Scene().started()
    scene.beats([at_ms, at_ms + 100])
    assert scene.blamed(at_ms + 100) == blamed


@pytest.mark.parametrize(("until_ms", "blamed"), [(155, []), (156, ["HB-06"])])
def test_a_first_beat_that_does_not_come(until_ms: int, blamed: list[str]) -> None:
    """Silence after boot-up."""
    scene = Scene().started()
    assert scene.blamed(until_ms) == blamed


def test_a_reset_starts_anew() -> None:
    """Nothing is due from the reset to its boot-up, then a first beat."""
    scene = Scene().started()
    scene.beats([150, 250])
    scene.command(Nmt.RESET_NODE, 260)
    scene.boot(1000)
    scene.beats([1100, 1200])
    assert scene.blamed(1250) == []


def test_beats_between_a_reset_and_its_effect() -> None:
    """A last beat of the old life is held against nobody."""
    scene = Scene().started()
    scene.beats([150, 250])
    scene.command(Nmt.RESET_NODE, 345)
    scene.beats([350])
    scene.boot(360)
    assert scene.blamed(400) == []


def test_a_boot_up_cuts_a_row() -> None:
    """Rows before and after a spontaneous boot-up are judged apart."""
    scene = Scene().started()
    scene.beats(row(103, 15, 150))
    scene.boot(1600)
    scene.beats(row(103, 15, 1700))
    assert scene.blamed(3150) == ["NMT-02"]


def test_a_whole_life_with_one_frame_object() -> None:
    """The shortcut for the very same frame judges like the long way."""
    scene = Scene().started()
    scene.beats(STEADY)
    scene.beats([STEADY[-1] + 120])
    assert scene.blamed(STEADY[-1] + 121) == ["HB-01"]
