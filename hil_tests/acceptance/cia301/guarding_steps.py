"""Steps that the tests of node guarding, life guarding and heartbeat consumers share."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

from hil_tests.acceptance.cia301.steps import (
    BEHAVIOUR,
    COMMUNICATION_BIT,
    ERROR_REGISTER,
    LIFE_GUARD_CODE,
    REACTION,
    expect_emcy,
    go,
    rule_of_missing,
)
from hil_tests.api import (
    MS,
    Cia301Bench,
    Frame,
    Limits,
    Outcome,
    Sdo,
    Seen,
    State,
    Verdict,
    cobs,
    matchers,
    sdo_frames,
    show_span,
    u8,
)

SERVED = {State.PRE_OPERATIONAL: True, State.OPERATIONAL: True, State.STOPPED: False}


def poll(bench: Cia301Bench) -> Seen:
    """A guarding request."""
    return bench.send(Frame(cobs.ERROR_CONTROL + bench.node_id, remote=True, dlc=1))


def answer_to(bench: Cia301Bench, request: Seen, requirement: str) -> int:
    """The byte that a guarding request is answered with, in time."""
    matcher = matchers.cob(cobs.ERROR_CONTROL + bench.node_id, "a guarding answer")
    within = bench.profile.limits.guard_answer_ns
    seen = bench.expect(matcher, after=request, within=within, requirement=requirement)
    size = len(seen.frame.data)
    text = f"a guarding answer has one byte; it was {seen.frame}"
    bench.check(size == 1, text, requirement="C-NG-02", since=request)
    return seen.frame.data[0]


def expect_answer(
    bench: Cia301Bench, state: State, toggle: int, requirement: str = "C-NG-02"
) -> Seen:
    """A request is answered with that state and toggle bit; returns the request."""
    request = poll(bench)
    byte = answer_to(bench, request, requirement)
    told = f"the answer shows {state}; it was {byte:02X}h"
    bench.check(byte & 0x7F == state.value, told, requirement="C-NG-10", since=request)
    told = f"toggle bit {toggle}; the answer was {byte:02X}h"
    bench.check(byte >> 7 == toggle, told, requirement="C-NG-03", since=request)
    return request


def expect_event(
    bench: Cia301Bench, since: Seen, span_ns: int, requirement: str, timing: str
) -> Seen:
    """EMCY 8130h when a span is over: not before, and not much later.

    Args:
        bench: the bench.
        since: what began the span.
        span_ns: life time or consumer time.
        requirement: that there is an event.
        timing: that it comes then.
    """
    limits = bench.profile.limits
    late_ns = limits.life_ns + limits.emcy_ns
    matcher = matchers.emcy(bench.node_id, code=LIFE_GUARD_CODE)
    found = bench.first(matcher, since, since.when.latest + span_ns + late_ns + 1000 * MS)
    if found is None:
        requirement = rule_of_missing(bench, LIFE_GUARD_CODE, since, requirement)
    bench.check(found is not None, "EMCY 8130h follows", requirement=requirement, since=since)
    assert found is not None
    text = f"EMCY 8130h after {since.frame}"
    # The device counts with a clock of its own, as good as that of its heartbeat.
    allowed = Limits(limits.heartbeat_mean_ns(span_ns)[0], span_ns + late_ns)
    bench.measure_between(since, found, allowed, text, requirement=timing, since=since)
    return found


def expect_no_event(bench: Cia301Bench, since: Seen | int, span_ns: int, requirement: str) -> None:
    """No EMCY 8130h for a while."""
    matcher = matchers.emcy(bench.node_id, code=LIFE_GUARD_CODE)
    bench.never(matcher, after=since, for_ns=span_ns, requirement=requirement)


def expect_none_while_fed(
    bench: Cia301Bench,
    feed: Callable[[], Seen],
    times: int,
    every_ns: int,
    life_ns: int,
    requirement: str,
) -> None:
    """No EMCY 8130h while the tester sends often enough.

    Where the tester's own computer was late with it, an event says nothing of the device.

    Args:
        bench: the bench.
        feed: sends what the device waits for.
        times: how often.
        every_ns: pause after each.
        life_ns: how long the device waits.
        requirement: that is judged.

    Raises:
        DeviceFailure: an event came all the same.
        InconclusiveResult: one came, and the tester had kept it waiting.
    """
    began = bench.now()
    fed = []
    for _ in range(times):
        fed.append(feed().at)
        bench.wait(every_ns)
    ended = bench.now()
    matcher = matchers.emcy(bench.node_id, code=LIFE_GUARD_CODE)
    longest_ns = max(later - earlier for earlier, later in pairwise([*fed, ended]))
    if longest_ns > (every_ns + life_ns) // 2 and bench.collect(matcher, after=began, until=ended):
        text = (
            f"the tester was late: {show_span(longest_ns)} between two of its frames, where"
            f" {show_span(every_ns)} were meant and {show_span(life_ns)} lead to the event"
        )
        bench.conclude(Verdict(requirement, Outcome.INCONCLUSIVE, text, at=ended), began)
    expect_no_event(bench, began, ended - began, requirement)


def expect_register(bench: Cia301Bench, sdo: Sdo, emcy: Seen, requirement: str) -> None:
    """Bit 4 (communication) and bit 0 are set, in the EMCY and in 1001h."""
    wanted = COMMUNICATION_BIT | 1
    told = emcy.frame.data[2]
    text = f"the EMCY shows bit 0 and 4 of the error register; it shows {told:02X}h"
    rule = requirement if told & COMMUNICATION_BIT != COMMUNICATION_BIT else "C-OD-02"
    bench.check(told & wanted == wanted, text, requirement=rule)
    register = sdo.number(ERROR_REGISTER)
    text = f"1001h is what the EMCY shows, {told:02X}h; it is {register:02X}h"
    bench.check(register == told, text, requirement="C-EM-03")


def expect_recovery(bench: Cia301Bench, after: Seen, requirement: str) -> Seen:
    """EMCY 0000h: the error is over, and there was no other."""
    within = bench.profile.limits.life_ns + bench.profile.limits.emcy_ns
    return expect_emcy(bench, 0x0000, after=after, within=within, requirement=requirement)


def prepare_reaction(bench: Cia301Bench, sdo: Sdo, behaviour: int) -> None:
    """1029h:01 is set to a reaction, and the device is operational."""
    sdo.write(BEHAVIOUR, 1, u8(behaviour), requirement="C-EM-22")
    go(bench, State.OPERATIONAL)


def expect_reaction(bench: Cia301Bench, sdo: Sdo, behaviour: int, requirement: str) -> None:
    """The device is where 1029h:01 leads; told by a PDO-free sign: SDO, and the error control.

    In stopped SDO is silent; whether it is operational a guarding answer tells.
    """
    wanted = REACTION[behaviour]
    bench.wait(bench.profile.limits.command_ns)
    answer = sdo.offer(sdo_frames.read(ERROR_REGISTER, 0))
    text = f"SDO is {'served' if SERVED[wanted] else 'silent'} in {wanted} after the event"
    bench.check((answer is not None) == SERVED[wanted], text, requirement=requirement)


def expect_shown(bench: Cia301Bench, behaviour: int, requirement: str) -> None:
    """A guarding answer shows the state that 1029h:01 leads to."""
    request = poll(bench)
    byte = answer_to(bench, request, "C-NG-02")
    wanted = REACTION[behaviour]
    text = f"1029h:01 = {behaviour} leads to {wanted}; the answer shows {byte & 0x7F:02X}h"
    bench.check(byte & 0x7F == wanted.value, text, requirement=requirement, since=request)
