"""Regular operation: boot-up, NMT, heartbeat, key frames, LED frames."""

from __future__ import annotations

from dataclasses import replace

import pytest

from node_model.frame import Frame
from node_model.heartbeat import HeartbeatProducer
from node_model.keypad import Parameters, Profile, load
from node_model.keypad.operation import Operation
from node_model.nmt import NmtState
from node_model.node import MS, Frames

PROFILE = load()
PARAMETERS = Parameters(node_id=15, bit_rate_code=1, heartbeat_ms=1000, debounce=1)
BOOT_UP = Frame(0x70F, b"\x00")
EMCY = Frame(0x08F, b"\x00\x50\x01\x00\x00\x00\x00\x00")
START = Frame(0, b"\x01\x0f")
STOP = Frame(0, b"\x02\x0f")
PRE_OPERATIONAL = Frame(0, b"\x80\x0f")
RESET_NODE = Frame(0, b"\x81\x0f")
RESET_COMMUNICATION = Frame(0, b"\x82\x00")
COMMANDS = {
    NmtState.OPERATIONAL: START,
    NmtState.STOPPED: STOP,
    NmtState.PRE_OPERATIONAL: PRE_OPERATIONAL,
}


def keys(mask: int) -> Frame:
    """The key frame of node 15."""
    return Frame(0x18F, bytes((mask,)))


def booted(
    mask: int = 0, profile: Profile = PROFILE, parameters: Parameters = PARAMETERS
) -> Operation:
    """A keypad that has just booted at 0."""
    mode = Operation(profile, parameters, mask, 0)
    mode.advance(0)
    return mode


def started(mask: int = 0, profile: Profile = PROFILE) -> Operation:
    """A keypad that became operational at 0."""
    mode = booted(mask, profile)
    mode.receive(START, 0)
    return mode


def shown(mode: Operation, now: int) -> int:
    """The state in the heartbeat that is due by `now`."""
    (frame,) = (frame for frame in mode.advance(now) if frame.can_id == 0x70F)
    return frame.data[0]


def test_boot_up_comes_first_then_emcy_then_a_heartbeat_each_period() -> None:
    """70Xh with 00h, 80Xh hardware, then 7Fh at 1000, 2000, ... ms."""
    mode = Operation(PROFILE, PARAMETERS, 0, 5)
    assert mode.bit_rate == 0
    assert mode.deadline() == 5
    assert mode.advance(4) == ()
    assert mode.advance(5) == (BOOT_UP, EMCY)
    assert mode.bit_rate == 500_000
    assert mode.deadline() == 1000 * MS + 5
    assert mode.advance(3000 * MS + 5) == (Frame(0x70F, b"\x7f"),) * 3


def test_period_zero_means_no_heartbeat_but_boot_up() -> None:
    """Nothing is due after the start."""
    mode = Operation(PROFILE, replace(PARAMETERS, heartbeat_ms=0), 0, 0)
    assert mode.advance(0) == (BOOT_UP, EMCY)
    assert mode.deadline() is None


@pytest.mark.parametrize("origin", COMMANDS)
@pytest.mark.parametrize("target", COMMANDS)
def test_each_state_leads_to_each_other(origin: NmtState, target: NmtState) -> None:
    """Three commands in three states; the next heartbeat shows the result."""
    mode = booted()
    mode.receive(COMMANDS[origin], 0)
    mode.receive(COMMANDS[target], 1)
    assert mode.state is target
    assert shown(mode, 1000 * MS) == target.value


@pytest.mark.parametrize("origin", COMMANDS)
@pytest.mark.parametrize(
    ("command", "frames"),
    [(RESET_NODE, (BOOT_UP, EMCY)), (RESET_COMMUNICATION, (BOOT_UP,))],
    ids=["reset node", "reset communication"],
)
def test_a_reset_leads_through_initialisation_to_pre_operational(
    origin: NmtState, command: Frame, frames: Frames
) -> None:
    """Off the bus for 10 ms, then boot-up, after a full reset with EMCY; a new cadence."""
    mode = booted()
    mode.receive(COMMANDS[origin], 0)
    assert mode.receive(command, 300 * MS) == ()
    assert mode.bit_rate == 0
    assert mode.receive(START, 305 * MS) == ()
    assert mode.advance(310 * MS) == frames
    assert mode.bit_rate == 500_000
    assert mode.state is NmtState.PRE_OPERATIONAL
    assert mode.deadline() == 1310 * MS


def test_a_command_for_another_node_is_ignored() -> None:
    """Node 14 is not node 15."""
    mode = booted()
    assert mode.receive(Frame(0, b"\x01\x0e"), 0) == ()
    assert mode.state is NmtState.PRE_OPERATIONAL


def test_entering_operational_sends_the_keys_once() -> None:
    """The held keys at once; a second start sends nothing; entering again does."""
    mode = booted(0x82)
    assert mode.receive(START, 0) == (keys(0x82),)
    assert mode.receive(START, 1) == ()
    mode.receive(STOP, 2)
    assert mode.receive(START, 3) == (keys(0x82),)


def test_a_press_is_reported_after_the_debounce_time_and_so_is_its_release() -> None:
    """Exactly 100 ms after the edge."""
    mode = started()
    assert mode.hold(0x01, 10 * MS) == ()
    assert mode.deadline() == 110 * MS
    assert mode.advance(110 * MS) == (keys(0x01),)
    mode.hold(0x00, 200 * MS)
    assert mode.advance(300 * MS) == (keys(0x00),)


def test_without_debounce_an_edge_is_reported_at_once() -> None:
    """Debounce time 0."""
    mode = booted(parameters=replace(PARAMETERS, debounce=0))
    mode.receive(START, 0)
    assert mode.hold(0x04, 5) == (keys(0x04),)


def test_a_profile_may_keep_releases_silent() -> None:
    """Presses are reported, with what is still held."""
    mode = started(profile=replace(PROFILE, releases_reported=False))
    mode.hold(0x01, 0)
    assert mode.advance(100 * MS) == (keys(0x01),)
    mode.hold(0x00, 200 * MS)
    assert mode.advance(300 * MS) == ()
    mode.hold(0x02, 400 * MS)
    assert mode.advance(500 * MS) == (keys(0x02),)


@pytest.mark.parametrize("command", [STOP, PRE_OPERATIONAL])
def test_outside_operational_no_key_is_reported_and_none_made_up_for(command: Frame) -> None:
    """The entry frame alone shows what changed meanwhile."""
    mode = started()
    mode.receive(command, 0)
    mode.hold(0x01, 0)
    mode.hold(0x03, 50 * MS)
    assert mode.advance(200 * MS) == ()
    assert mode.receive(START, 200 * MS) == (keys(0x03),)


def test_keys_held_during_a_reset_count_at_once() -> None:
    """Debouncing begins with what is held when initialisation is done."""
    mode = started()
    mode.receive(RESET_NODE, 0)
    assert mode.hold(0x10, 5 * MS) == ()
    mode.advance(10 * MS)
    assert mode.receive(START, 11 * MS) == (keys(0x10),)


def test_a_key_frame_and_a_heartbeat_of_one_instant_both_leave() -> None:
    """The key first, then the heartbeat; neither waits for the other."""
    mode = started()
    mode.hold(0x01, 900 * MS)
    assert mode.advance(1000 * MS) == (keys(0x01), Frame(0x70F, b"\x05"))


def test_a_key_is_due_before_or_after_the_heartbeat() -> None:
    """The deadline is the sooner of the two, or the only one."""
    mode = started()
    mode.hold(0x01, 950 * MS)
    assert mode.deadline() == 1000 * MS
    mode.advance(1000 * MS)
    assert mode.deadline() == 1050 * MS
    silent = booted(parameters=replace(PARAMETERS, heartbeat_ms=0))
    silent.hold(0x01, 0)
    assert silent.deadline() == 100 * MS


def test_led_frames_write_their_own_map() -> None:
    """20Xh the steady one, 30Xh the blinking one."""
    mode = started()
    mode.receive(Frame(0x20F, b"\x05"), 0)
    mode.receive(Frame(0x30F, b"\x0a"), 0)
    assert (mode.lamps.steady, mode.lamps.blinking) == (5, 10)


@pytest.mark.parametrize("command", [STOP, PRE_OPERATIONAL])
def test_led_frames_act_in_operational_only(command: Frame) -> None:
    """CiA 301: no PDO is processed in stopped and pre-operational."""
    mode = started()
    mode.receive(command, 0)
    mode.receive(Frame(0x20F, b"\xff"), 0)
    mode.receive(Frame(0x30F, b"\xff"), 0)
    assert (mode.lamps.steady, mode.lamps.blinking) == (0, 0)


@pytest.mark.parametrize(
    "frame",
    [
        Frame(0x20F, remote=True, dlc=1),
        Frame(0x20F, b"\xff", extended=True),
        Frame(0x20E, b"\xff"),
        Frame(0x30E, b"\xff"),
    ],
    ids=str,
)
def test_other_frames_leave_the_leds_alone(frame: Frame) -> None:
    """Remote, extended, another node's."""
    mode = started()
    assert mode.receive(frame, 0) == ()
    assert (mode.lamps.steady, mode.lamps.blinking) == (0, 0)


def test_leds_survive_leaving_operational_and_not_a_reset() -> None:
    """The implementation's choice, and CiA 301."""
    mode = started()
    mode.receive(Frame(0x20F, b"\xff"), 0)
    mode.receive(STOP, 1)
    assert mode.lamps.steady == 0xFF
    mode.receive(RESET_COMMUNICATION, 2)
    assert mode.lamps.steady == 0


class Shy(Operation):
    """Its heartbeat may be silent."""

    def beat_frames(self) -> Frames:
        """As usual, so far."""
        return super().beat_frames()


class Uneven(HeartbeatProducer):
    """It might beat otherwise."""

    __slots__ = ()


class UnevenPad(Operation):
    """Has such a producer."""

    heartbeat_type = Uneven


def test_heartbeats_are_repeated_up_to_an_instant() -> None:
    """All that are due by then, so many at most; the next deadline comes after them."""
    mode = booted()
    (beat,) = mode.beats[mode.state]
    first = mode.deadline()
    assert first is not None
    period_ns = mode.beat.period_ns
    assert list(mode.repeats(beat, first - 1, MS, 9)) == []
    assert list(mode.repeats(beat, first + period_ns, MS, 9)) == [first, first + period_ns]
    assert list(mode.repeats(beat, first + 9 * period_ns, MS, 1)) == [first + 2 * period_ns]
    assert mode.deadline() == first + 3 * period_ns


def test_a_key_to_settle_ends_the_repeating() -> None:
    """It may be due with a heartbeat, and then both leave together."""
    mode = started()
    (beat,) = mode.beats[mode.state]
    due = mode.deadline()
    assert due is not None
    mode.hold(1, due - mode.debounce_ns())
    assert list(mode.repeats(beat, due + 9 * mode.beat.period_ns, MS, 9)) == []
    assert len(mode.advance(due)) == 2


def test_what_is_no_plain_heartbeat_is_not_repeated() -> None:
    """Another frame, too short a period, a reset, or a device that beats in its own way."""
    mode = booted()
    (beat,) = mode.beats[mode.state]
    far = 1000 * mode.beat.period_ns
    assert not mode.repeats(keys(0), far, MS, 9)
    assert not mode.repeats(beat, far, mode.beat.period_ns, 9)
    mode.receive(Frame(0, b"\x81\x00"), 60 * MS)
    assert not mode.repeats(beat, far, MS, 9)
    for kind in (Shy, UnevenPad):
        other = kind(PROFILE, mode.parameters, 0, 50 * MS)
        other.advance(50 * MS)
        assert not other.repeats(beat, far, MS, 9)
