"""Steps that the tests of start, network management and heartbeat share.

They judge from recorded instants only, and leave one verdict for each thing that they say.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from hil_tests.api import MS, Frame, KeypadBench, Nmt, Seen, State, cobs, matchers

QUICK: Mapping[str, int] = {"heartbeat_ms": 100}
"""Preferred, so that the state is soon seen; right with any period but 0."""

RUNNING_STATES = (State.PRE_OPERATIONAL, State.OPERATIONAL, State.STOPPED)

RESETS = cobs.RESETS

BOOT_UP = b"\x00"

COMMAND_TO = {
    State.PRE_OPERATIONAL: Nmt.PRE_OPERATIONAL,
    State.OPERATIONAL: Nmt.START,
    State.STOPPED: Nmt.STOP,
}


MANY = 260
"""More than a byte counts."""

PACE_NS = 5 * MS
"""From frame to frame, where every one must be taken."""


def name_of(value: State | Nmt) -> str:
    """A readable id for a parameter of a test, e.g. "reset-node"."""
    return value.name.lower().replace("_", "-")


def enter(bench: KeypadBench, state: State, requirement: str = "NMT-04") -> Seen:
    """Command the node into a state and see that it is there.

    Returns:
        The command.
    """
    command = bench.nmt(COMMAND_TO[state])
    bench.expect_state(state, after=command, requirement=requirement)
    return command


def repeat(bench: KeypadBench, frames: Sequence[Frame], count: int = MANY) -> None:
    """Send frames in turn, so many in all."""
    for turn in range(count):
        bench.send(frames[turn % len(frames)])
        bench.wait(PACE_NS)


def expect_restart(bench: KeypadBench, sent: Seen) -> Seen:
    """A reset brings a boot-up; how soon it must is NMT-06."""
    limit_ns = bench.profile.limits.boot_up_ns
    boot_up = matchers.boot_up(bench.node_id)
    bench.expect(boot_up, after=sent, within=2 * limit_ns)
    return bench.expect(boot_up, after=sent, within=limit_ns, requirement="NMT-06")


def expect_outcome(bench: KeypadBench, command: Nmt, sent: Seen) -> None:
    """The node does what CiA 301 says of a command (7.3.2.1): a state, or a new start."""
    if command not in RESETS:
        bench.expect_state(cobs.LEADS_TO[command], after=sent)
        return
    bench.expect_state(State.PRE_OPERATIONAL, after=expect_restart(bench, sent))


def expect_unmoved(bench: KeypadBench, state: State, *, after: Seen, by: str) -> None:
    """Since `after` every heartbeat shows `state`, one more does, and nothing rebooted.

    Args:
        bench: the bench.
        state: in which the node was when it was told `after`.
        after: the first frame that must not move it.
        by: what that was, for people.
    """
    bench.shown_state(bench.now())
    # A beat that was due while `after` itself might still act, or before it, tells nothing.
    settled = after.when.latest + bench.profile.limits.command_ns
    error_control = matchers.cob(cobs.ERROR_CONTROL + bench.node_id)
    for seen in bench.collect(error_control, after=after, until=bench.now()):
        since = after.when.latest if seen.frame.data == BOOT_UP else settled
        wrong = seen.frame.data != bytes((state.value,))
        if wrong and bench.when(seen).earliest > since:
            bench.fail(f"{by} must leave the node {state}; then came {seen.frame}", since=after)
    bench.check(True, f"{by} leaves the node {state}", since=after)
