"""The monitor of the heartbeat: what it blames, and both sides of each limit."""

from __future__ import annotations

import pytest

from hil_tests.clock import MS
from hil_tests.judge.cobs import Nmt, nmt_frame
from hil_tests.judge.verdict import Outcome
from node_model.frame import Frame
from tests.judge.scene import NODE, Scene, device

STEADY = [150 + 100 * n for n in range(25)]
"""Beats of a node that booted at 50 ms, the first one a period later."""


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


def test_operational_though_a_reset_was_commanded() -> None:
    """A node that ignores the reset was started by NMT all the same."""
    scene = Scene().started()
    scene.command(Nmt.START, 60)
    scene.beats([150], 0x05)
    scene.command(Nmt.RESET_NODE, 160)
    scene.beat(250, 0x05)
    assert scene.blamed(260) == ["NMT-06", "NMT-07"]


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
