"""Which NMT commands a node obeys, and where they lead (NMT-04..07, NMT-21, NMT-22)."""

from __future__ import annotations

from itertools import product

import attrs
import pytest

from hil_tests.acceptance.commissioning_steps import boots_as, expect_period
from hil_tests.acceptance.led_steps import flicker
from hil_tests.acceptance.nmt_steps import (
    COMMAND_TO,
    MANY,
    QUICK,
    RESETS,
    RUNNING_STATES,
    enter,
    expect_outcome,
    expect_restart,
    expect_unmoved,
    name_of,
    repeat,
)
from hil_tests.api import MS, Frame, KeypadBench, Keys, Nmt, Power, State, cobs, matchers

UNKNOWN = tuple(set(range(256)) - set(Nmt))
"""00h, 03h..7Fh, 83h..FFh."""

ONE_BIT_OFF = {command ^ 1 << bit for command in Nmt for bit in range(8)} - set(Nmt)

SOME_UNKNOWN = tuple(sorted({0x00, 0x03, 0x04, 0x05, 0x7F, 0x83, 0xFF} | ONE_BIT_OFF))
"""Where each costs real time: the edges, what a heartbeat would show, and near commands."""

ALL_NODES = 0


@pytest.mark.requirement("NMT-04")
@pytest.mark.parametrize("addressee", ["own id", "all nodes"])
def test_each_command_is_obeyed(bench: KeypadBench, addressee: str) -> None:
    """01h starts, 02h stops, 80h leads back, 81h and 82h reset: literal bytes."""
    if addressee == "all nodes":
        bench.needs_exclusive()
    bench.start(QUICK)
    to = ALL_NODES if addressee == "all nodes" else bench.node_id
    for command, state in ((0x01, State.OPERATIONAL), (0x02, State.STOPPED)):
        sent = bench.send(Frame(0x000, bytes((command, to))))
        bench.expect_state(state, after=sent)
    sent = bench.send(Frame(0x000, bytes((0x80, to))))
    bench.expect_state(State.PRE_OPERATIONAL, after=sent)
    for command in (0x81, 0x82):
        expect_restart(bench, bench.send(Frame(0x000, bytes((command, to)))))


@pytest.mark.requirement("NMT-07", "NMT-04", "NMT-06")
@pytest.mark.parametrize("command", Nmt, ids=name_of)
@pytest.mark.parametrize("state", RUNNING_STATES, ids=name_of)
def test_command_to_own_id(bench: KeypadBench, state: State, command: Nmt) -> None:
    """From each state each command to the node leads where CiA 301 says."""
    bench.start(QUICK)
    enter(bench, state)
    sent = bench.nmt(command)
    expect_outcome(bench, command, sent)


@pytest.mark.requirement("NMT-07", "NMT-04", "NMT-05", "NMT-06")
@pytest.mark.parametrize("command", Nmt, ids=name_of)
@pytest.mark.parametrize("state", RUNNING_STATES, ids=name_of)
def test_command_to_another_then_to_all(bench: KeypadBench, state: State, command: Nmt) -> None:
    """From each state a command to another node changes nothing, one to all does."""
    bench.needs_exclusive()
    bench.start(QUICK)
    enter(bench, state)
    sent = bench.nmt(command, bench.node_id + 1)
    expect_unmoved(bench, state, after=sent, by=f"{name_of(command)} to another node")
    sent = bench.nmt(command, ALL_NODES)
    expect_outcome(bench, command, sent)


@pytest.mark.requirement("NMT-05")
@pytest.mark.parametrize("state", RUNNING_STATES, ids=name_of)
def test_unknown_commands_are_ignored(bench: KeypadBench, state: State) -> None:
    """A command byte that CiA 301 does not define changes nothing."""
    bench.start({"heartbeat_ms": 20})
    first = enter(bench, state)
    limits = bench.profile.limits
    for command in UNKNOWN if bench.stage.virtual else SOME_UNKNOWN:
        bench.nmt(command)
        # Long enough for a beat in between: two wrong ones must not cancel each other.
        bench.wait(limits.command_ns + bench.watch.expected.heartbeat_each.at_most_ns)
    expect_unmoved(bench, state, after=first, by="an unknown command")


def other_ids(bench: KeypadBench) -> list[int]:
    """Node ids to address wrongly: all, or those that share bits with the right one."""
    own = bench.node_id
    alike = (own ^ 1, own ^ 2, own + 16, own + 64, own + 128, 127, 255)
    wrong = range(1, 256) if bench.stage.virtual else alike
    return [node_id for node_id in wrong if node_id not in {0, own}]


@pytest.mark.requirement("NMT-05")
@pytest.mark.parametrize("command", Nmt, ids=name_of)
def test_commands_to_other_ids_are_ignored(bench: KeypadBench, command: Nmt) -> None:
    """A command to any other node id, also to one that shares bits, changes nothing."""
    bench.needs_exclusive()
    bench.start({**QUICK, "node_id": 6})
    state = State.STOPPED if command is not Nmt.STOP else State.OPERATIONAL
    sent = enter(bench, state)
    for node_id in other_ids(bench):
        bench.nmt(command, node_id)
    expect_unmoved(bench, state, after=sent, by=f"{name_of(command)} to another node")


def malformed(command: Nmt, node_id: int) -> list[Frame]:
    """Frames with identifier 0 (or its like) that are no NMT frame but resemble one."""
    data = bytes((command, node_id))
    return [
        Frame(0, b""),
        Frame(0, bytes((command,))),
        Frame(0, remote=True, dlc=2),
        Frame(0, remote=True, dlc=0),
        Frame(0, remote=True, dlc=8),
        Frame(0, data, extended=True),
        Frame(0x3FFFF, data, extended=True),  # the first eleven bits are 0
        Frame(0x800, data, extended=True),  # the last eleven are
        Frame(0, remote=True, extended=True, dlc=2),
        # Longer, and for another node: whatever such a frame means, it is not meant here.
        Frame(0, bytes((command, node_id + 16, node_id))),
        Frame(0, bytes((command, node_id + 16)) + data * 3),
    ]


@pytest.mark.requirement("NMT-05")
@pytest.mark.parametrize("command", Nmt, ids=name_of)
def test_malformed_frames_are_not_obeyed(bench: KeypadBench, command: Nmt) -> None:
    """Empty, one-byte, remote, extended and foreign long frames with identifier 0 do nothing."""
    bench.needs_exclusive()
    boot = bench.start(QUICK)
    state = State.STOPPED if command is Nmt.START else State.OPERATIONAL
    # The last frame in the node's buffer is a good one: what is missing must not be taken
    # from there.
    since = boot if state is State.PRE_OPERATIONAL else enter(bench, state)
    for frame in malformed(command, bench.node_id):
        bench.send(frame)
        bench.wait(bench.profile.limits.command_ns)
    expect_unmoved(bench, state, after=since, by="a malformed NMT frame")


@pytest.mark.requirement("NMT-05")
@pytest.mark.parametrize("command", RESETS, ids=name_of)
def test_remote_frame_does_not_repeat_the_last_command(bench: KeypadBench, command: Nmt) -> None:
    """After a reset, frames without data do not make the node reset again."""
    bench.needs_exclusive()
    bench.start(QUICK)
    sent = bench.nmt(command)
    limits = bench.profile.limits
    boot = bench.expect(
        matchers.boot_up(bench.node_id),
        after=sent,
        within=limits.boot_up_ns,
        requirement="NMT-06",
    )
    bench.send(Frame(0, remote=True, dlc=2))
    bench.send(Frame(0, b""))
    bench.never(matchers.boot_up(bench.node_id), after=boot, for_ns=limits.boot_up_ns)


@pytest.mark.requirement("NMT-06")
@pytest.mark.parametrize("state", RUNNING_STATES, ids=name_of)
@pytest.mark.parametrize("command", RESETS, ids=name_of)
def test_parameters_outlast_a_reset(bench: KeypadBench, command: Nmt, state: State) -> None:
    """After a reset by command the node has its node id and its heartbeat time still."""
    bench.start({"node_id": 11, "heartbeat_ms": 60})
    enter(bench, state)
    sent = bench.nmt(command)
    within = bench.profile.limits.boot_up_ns
    boot = bench.expect(matchers.boot_up(bench.node_id), after=sent, within=within)
    assert bench.parameters
    if bench.parameters.heartbeat_ns:
        expect_period(bench, boot, bench.parameters, "NMT-06")
    bench.expect_state(State.PRE_OPERATIONAL, after=boot)


@pytest.mark.requirement("NMT-06")
def test_commissioned_parameters_outlast_resets(
    bench: KeypadBench, power: Power, keys: Keys
) -> None:
    """What was commissioned over the bus is still there after resets from every state."""
    target = attrs.evolve(bench.fresh(), node_id=13, heartbeat_ms=60)
    bench.commission(target)
    boots_as(bench, target, "COM-06")
    limits = bench.profile.limits
    for command, state in product(RESETS, RUNNING_STATES):
        enter(bench, state)
        sent = bench.nmt(command)
        boot_up = matchers.boot_up(bench.node_id)
        boot = bench.expect(boot_up, after=sent, within=limits.boot_up_ns)
        expect_period(bench, boot, target, "NMT-06")


@pytest.mark.requirement("NMT-04", "NMT-07")
@pytest.mark.parametrize("last", Nmt, ids=name_of)
def test_burst_ends_in_the_state_of_the_last(bench: KeypadBench, last: Nmt) -> None:
    """Of commands back to back none is lost: the last one decides."""
    bench.start(QUICK)
    others = [command for command in COMMAND_TO.values() if command is not last]
    for command in others * 3:
        bench.post(cobs.nmt_frame(command, bench.node_id))
    sent = bench.nmt(last)
    expect_outcome(bench, last, sent)


@pytest.mark.requirement("NMT-04", "NMT-06")
def test_hundreds_of_commands_wear_nothing_out(bench: KeypadBench) -> None:
    """After hundreds of commands and LED frames in one life the node obeys as before."""
    bench.start(QUICK)
    for state in (State.STOPPED, State.PRE_OPERATIONAL):
        enter(bench, state)
        repeat(bench, [cobs.nmt_frame(COMMAND_TO[state], bench.node_id)], MANY // 2)
    enter(bench, State.OPERATIONAL)
    repeat(bench, flicker(bench))

    for state in (State.STOPPED, State.PRE_OPERATIONAL, State.OPERATIONAL):
        enter(bench, state)
    for command in RESETS:
        expect_restart(bench, bench.nmt(command))


@pytest.mark.requirement("NMT-21")
@pytest.mark.parametrize("length", [3, 8], ids=lambda length: f"{length}-bytes")
def test_longer_frames_are_recorded(bench: KeypadBench, length: int) -> None:
    """Whether an NMT frame of more than two bytes is obeyed is written down."""
    bench.start(QUICK)
    frame = Frame(0, bytes((Nmt.STOP, bench.node_id)).ljust(length, b"\0"))
    sent = bench.send(frame)
    obeyed = bench.shown_state(sent) is State.STOPPED
    what = "obeyed" if obeyed else "ignored"
    bench.characteristic("NMT-21", f"an NMT frame of {length} bytes is {what}")
    enter(bench, State.OPERATIONAL)


@pytest.mark.requirement("NMT-22")
def test_emcy_after_reset_communication_is_recorded(bench: KeypadBench) -> None:
    """Whether the EMCY comes again after reset communication is written down."""
    bench.start(QUICK)
    sent = bench.nmt(Nmt.RESET_COMMUNICATION)
    limits = bench.profile.limits
    boot = bench.expect(
        matchers.boot_up(bench.node_id),
        after=sent,
        within=limits.boot_up_ns,
        requirement="NMT-06",
    )
    bench.wait(limits.emcy_ns + 50 * MS)
    found = bench.collect(matchers.emcy(bench.node_id), after=boot, until=bench.now())
    what = f"sends {found[0].frame}" if found else "sends no EMCY"
    bench.characteristic("NMT-22", f"after reset communication the node {what}")
