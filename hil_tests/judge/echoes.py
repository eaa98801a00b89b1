"""The echo of commissioning: which 4F8h is taken, and 3F8h every 100 ms (COM-04, -05, -21..24).

A pure function of one stay in commissioning: the frames 4F8h on the wire, and the echoes.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import NamedTuple

from hil_tests.clock import Interval, show_span
from hil_tests.judge.cobs import COMMISSION
from hil_tests.judge.periodic import ENOUGH, mean_interval
from hil_tests.judge.verdict import Limits, Outcome, Verdict
from node_model.frame import Frame

SIZE = 6
NODE_IDS = range(1, 16)
_SERVICES = {0x000, 0x080, 0x7E4, 0x7E5}
"""NMT, SYNC, LSS: what a node in commissioning ignores, too (COM-20)."""


class Request(NamedTuple):
    """A frame of the tester, 4F8h or any other, and when it had ended."""

    at: int
    frame: Frame


class Echo(NamedTuple):
    """A frame 3F8h of the device."""

    wanted: Interval
    data: bytes


class EchoRules(NamedTuple):
    """Limits, in ns."""

    each: Limits
    mean: Limits


class Stay(NamedTuple):
    """A stay in commissioning.

    Args:
        ready_at: the device surely waits from here on.
        requests: every frame of the tester, in order.
        echoes: in order.
        until: what was asked for before this was seen.
    """

    ready_at: int
    requests: Sequence[Request]
    echoes: Sequence[Echo]
    until: int


def is_valid(frame: Frame) -> bool:
    """Whether a frame is the one message that ends the wait (COM-04, COM-22, COM-24)."""
    plain = frame.can_id == COMMISSION and not frame.extended and not frame.remote
    return plain and len(frame.data) >= SIZE and frame.data[0] in NODE_IDS


def taken(requests: Sequence[Request]) -> Request | None:
    """The request that the device takes: the first valid one."""
    return next((request for request in requests if is_valid(request.frame)), None)


def _heard(stay: Stay) -> Request | None:
    """As `taken`; one that came before the device surely waited may have been missed."""
    valid = [request for request in stay.requests if is_valid(request.frame)]
    early = sum(request.at < stay.ready_at for request in valid)
    heard = valid[: early + 1]
    shown = stay.echoes[0].data[:SIZE] if stay.echoes else None
    echoed = (each for each in heard if each.frame.data[:SIZE] == shown)
    return next(echoed, heard[-1] if heard else None)


def judge_echoes(stay: Stay, rules: EchoRules) -> Iterator[Verdict]:
    """What is wrong in a stay, in no order."""
    echoes = list(stay.echoes)
    request = _heard(stay)
    if echoes and (request is None or echoes[0].wanted.latest < request.at):
        why = _lured(echoes[0], stay.requests)
        if why is not None:  # else before any frame: the monitor of allowed frames says so
            yield _fail(_refusal(why.frame), "an echo came", echoes[0], why.frame)
        return
    if request is None:
        return
    yield from _content(request, stay.requests, echoes)
    yield from _cadence(request, stay, echoes, rules)


def _lured(echo: Echo, requests: Sequence[Request]) -> Request | None:
    """The frame that an echo answers: the one whose bytes it shows, else the last before it."""
    before = [each for each in requests if each.at <= echo.wanted.latest]
    shown = [each for each in before if each.frame.data[:SIZE] == echo.data[:SIZE]]
    return next(reversed(shown or before), None)


def _refusal(frame: Frame) -> str:
    """Which requirement says that a device in commissioning does not answer this frame."""
    if frame.can_id == COMMISSION:
        plain = not frame.extended and not frame.remote and len(frame.data) >= SIZE
        return "COM-22" if plain else "COM-24"
    if frame.extended:
        return "COM-24"
    return "COM-20" if frame.remote or frame.can_id in _SERVICES else "COM-03"


def _content(
    request: Request, requests: Sequence[Request], echoes: Sequence[Echo]
) -> Iterator[Verdict]:
    """Bytes 0..5 are those of the request that was taken, for ever."""
    right = request.frame.data[:SIZE]
    for echo in echoes:
        if echo.data[:SIZE] != right:
            name = "COM-21" if _asked_again(requests, request, echo.wanted.latest) else "COM-05"
            yield _fail(name, f"the echo is {echo.data.hex(' ').upper()}", echo, request.frame)
            return


def _asked_again(requests: Sequence[Request], first: Request, until: int) -> bool:
    """Whether another 4F8h had come by then; that it changes nothing is our own reading."""
    return any(
        first.at < each.at <= until and each.frame.can_id == COMMISSION for each in requests
    )


def _cadence(
    request: Request, stay: Stay, echoes: Sequence[Echo], rules: EchoRules
) -> Iterator[Verdict]:
    """The first one in time, then one each 100 ms, to the end."""
    asked = Interval(request.at, request.at)
    spans = [(asked, echo.wanted) for echo in echoes[:1]]
    spans += [(a.wanted, b.wanted) for a, b in pairwise(echoes)]
    for index, (before, after) in enumerate(spans):
        limits = rules.each if index else Limits(at_most_ns=rules.each.at_most_ns)
        measured = after.since(before)
        if limits.check(measured) is Outcome.FAIL and (index or request.at >= stay.ready_at):
            text = f"interval {index} of the echo" if index else "first echo after 4F8h"
            name = "COM-21" if _asked_again(stay.requests, request, after.latest) else "COM-05"
            at = after.latest
            yield Verdict(name, Outcome.FAIL, text, measured, limits, at, before, after)
            return
    if len(spans) > ENOUGH:
        mean = mean_interval([echo.wanted for echo in echoes])
        if rules.mean.check(mean) is Outcome.FAIL:
            text = f"mean of {len(spans) - 1} intervals of the echo"
            yield Verdict("COM-05", Outcome.FAIL, text, mean, rules.mean, stay.until)
    last = echoes[-1].wanted if echoes else asked
    silent = stay.until - last.latest
    if silent > rules.each.at_most_ns and (echoes or request.at >= stay.ready_at):
        longer = len(request.frame.data) > SIZE
        ended = _ended_by(
            stay.requests, Interval(last.earliest, last.latest + rules.each.at_most_ns)
        )
        name = ended if echoes else "COM-24" if longer else "COM-04"
        text = f"no echo for {show_span(silent)} after {request.frame}"
        at = last.latest + rules.each.at_most_ns
        yield Verdict(name, Outcome.FAIL, text, limits=rules.each, at=at)


def _ended_by(requests: Sequence[Request], when: Interval) -> str:
    """Which requirement says that the echo goes on, by what came when it ended."""
    came = [each for each in requests if when.earliest <= each.at <= when.latest]
    return "COM-20" if any(_refusal(each.frame) == "COM-20" for each in came) else "COM-05"


def _fail(name: str, what: str, echo: Echo, frame: Frame) -> Verdict:
    return Verdict(name, Outcome.FAIL, f"{what} after {frame}", at=echo.wanted.latest)
