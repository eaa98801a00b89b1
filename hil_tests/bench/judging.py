"""Expectations and verdicts on top of the engine.

Every check leaves a verdict in the results, also when it passes; one that does not pass
ends the test with what was expected, what was seen, and the frames in between.
"""

from __future__ import annotations

from typing import NoReturn

from hil_tests.bench import chronicle
from hil_tests.bench.core import BenchCore
from hil_tests.bench.terms import When, interval_of, name_of
from hil_tests.clock import MS, Interval, S, show_span
from hil_tests.errors import NotAcknowledged
from hil_tests.judge import matchers
from hil_tests.judge.causal import Seen
from hil_tests.judge.cobs import ERROR_CONTROL, SHOWN, Nmt, State, nmt_frame
from hil_tests.judge.matchers import Matcher
from hil_tests.judge.verdict import (
    DeviceFailure,
    InconclusiveResult,
    Limits,
    NotRun,
    Outcome,
    Verdict,
)
from node_model.frame import Frame

SEND_PATIENCE_NS = 2 * S
"""How long an own frame may wait for the bus before the bench is called broken."""

LOOK_ON_NS = 250 * MS
"""How much longer than its limit a frame is waited for, to tell late from missing."""

BUSY_PATIENCE_NS = 10 * S
"""How long a full bus may keep us from knowing whether a frame was asked for."""

EVIDENCE_FRAMES = 12


class JudgingBench(BenchCore):
    """Expecting, measuring, concluding."""

    # Verdicts.

    def conclude(self, verdict: Verdict, since: When | None = None) -> Verdict:
        """Record a verdict; unless it passes, end the test with it and its evidence.

        Raises:
            DeviceFailure: it is a FAIL.
            InconclusiveResult: it is INCONCLUSIVE.
        """
        self.record(verdict)
        if verdict.outcome is Outcome.FAIL:
            raise DeviceFailure(verdict, self.evidence(since))
        if verdict.outcome is Outcome.INCONCLUSIVE:
            raise InconclusiveResult(verdict, self.evidence(since))
        return verdict

    def fail(self, text: str, *, requirement: str = "", since: When | None = None) -> NoReturn:
        """The device broke the requirement under test, or the one named."""
        verdict = Verdict(requirement, Outcome.FAIL, text, at=self.now())
        self.record(verdict)
        raise DeviceFailure(verdict, self.evidence(since))

    def check(
        self, fact: bool, text: str, *, requirement: str = "", since: When | None = None
    ) -> None:
        """A yes-or-no check: `text` says what is expected."""
        if not fact:
            self.fail(text, requirement=requirement, since=since)
        self.record(Verdict(requirement, Outcome.PASS, text, at=self.now()))

    def measure(
        self,
        measured: Interval,
        limits: Limits,
        text: str,
        *,
        requirement: str = "",
        since: When | None = None,
    ) -> Verdict:
        """Hold a measured span against limits, guard-banded."""
        outcome = limits.check(measured)
        verdict = Verdict(requirement, outcome, text, measured, limits, self.now())
        return self.conclude(verdict, since)

    def measure_between(
        self,
        cause: When,
        effect: When,
        limits: Limits,
        text: str,
        *,
        requirement: str = "",
        since: When | None = None,
    ) -> Verdict:
        """Hold the time from a cause to its effect against limits, guard-banded."""
        begin, end = self.when(cause), self.when(effect)
        measured = end.since(begin)
        outcome = limits.check(measured)
        verdict = Verdict(requirement, outcome, text, measured, limits, self.now(), begin, end)
        return self.conclude(verdict, since)

    def characteristic(self, requirement: str, text: str) -> None:
        """Write down how this device does what the source leaves open."""
        self.record(Verdict(requirement, Outcome.CHARACTERISTIC, text, at=self.now()))

    def evidence(self, since: When | None) -> str:
        """The frames since an instant (or the last ones), decoded, for a failure message."""
        stop = len(self.trace)
        origin = interval_of(since).earliest if since is not None else None
        start = self.trace.index_at(origin) if origin is not None else stop - EVIDENCE_FRAMES
        start = max(start, 0)
        if stop <= start:
            return "    (no frame was seen)"
        if origin is None:
            origin = self.trace.frame(start).at
        node_id = self.parameters.node_id if self.parameters else None
        from hil_tests.decode import show_frames  # noqa: PLC0415

        return "\n".join(show_frames(self.trace, start, stop, node_id, origin))

    def check_monitors(self) -> None:
        """End the test now if a monitor has found something (for examples of a property).

        Raises:
            DeviceFailure, InconclusiveResult: what it found.
        """
        self._close_watch(off=False)
        for verdict in self._found:
            self.conclude(verdict)

    def monitored(self) -> list[Verdict]:
        """What the monitors have found in this test so far, for the caller to conclude."""
        self._close_watch(off=False)
        found, self._found = self._found, []
        return found

    # Looking.

    def first(self, matcher: Matcher, after: When, until: int) -> Seen | None:
        """The first matching frame asked for after something and before `until`.

        It waits until then, and for what a hosted device's host has kept back.
        """
        index = self._index_after(after)
        since = interval_of(after).earliest
        while True:
            while index < len(self.trace):
                seen = self.seen(index)
                index += 1
                if not seen.own and seen.wanted.latest >= since and matcher.accepts(seen.frame):
                    return seen
            if not self.pump(until) and self._clock() >= until:
                break
        if self.stage.health is None:
            return None
        self.settle()
        for seen in self.frames_seen(index):
            if not seen.own and matcher.accepts(seen.frame) and self.when(seen).earliest <= until:
                return seen
        return None

    def _index_after(self, after: When) -> int:
        """Where in the trace frames later than something can begin."""
        if isinstance(after, Seen):
            return after.index + 1
        return self.trace.index_at(interval_of(after).earliest)

    def expect(
        self,
        matcher: Matcher,
        *,
        after: When,
        within: int | Limits,
        requirement: str = "",
    ) -> Seen:
        """A matching frame must be asked for within limits after something.

        Args:
            matcher: which frame.
            after: the stimulus or frame from which time counts.
            within: at most that many ns, or limits on both sides.
            requirement: id, where it is not the first one of the test.

        Raises:
            DeviceFailure: missing, too early or too late.
            InconclusiveResult: the doubt straddles a limit.
        """
        limits = within if isinstance(within, Limits) else Limits(at_most_ns=within)
        self._await(f"{matcher}", after, limits, requirement)
        bound = interval_of(after).latest + limits.at_most_ns
        seen = self.first(matcher, after, bound + LOOK_ON_NS) or self._late(matcher, after, bound)
        if seen is None:
            return self._missing(matcher, after, limits, requirement)
        text = f"{matcher} after {name_of(after)}"
        self.measure_between(after, seen, limits, text, requirement=requirement, since=after)
        return seen

    def _await(self, what: str, after: When, limits: Limits, requirement: str) -> None:
        """Note in the record what is waited for, and from when its time counts."""
        if not self.trace.sinks:
            return
        since = interval_of(after)
        text = f"expects {what} after {name_of(after)}"
        self.trace.remark(chronicle.expectation(self.now(), text, since, limits, requirement))

    def _late(self, matcher: Matcher, after: When, bound: int) -> Seen | None:
        """A frame that a busy bus or a stalled host has kept back."""
        give_up_at = self.now() + BUSY_PATIENCE_NS
        while self.watch.quiet_from(self._clock()) <= bound and self._clock() < give_up_at:
            if not self.pump(give_up_at):
                break
        self.settle()
        return self.first(matcher, after, self.now())

    def _missing(
        self, matcher: Matcher, after: When, limits: Limits, requirement: str
    ) -> NoReturn:
        waited = self.now() - interval_of(after).latest
        bound = interval_of(after).latest + limits.at_most_ns
        known = self.watch.quiet_from(self.known_until) > bound
        outcome = Outcome.FAIL if known else Outcome.INCONCLUSIVE
        why = "" if known else " (the bus was never free)"
        text = f"expected {matcher} after {name_of(after)}; none came in {show_span(waited)}{why}"
        cause = self.when(after)
        verdict = Verdict(requirement, outcome, text, None, limits, self.now(), cause)
        self.conclude(verdict, after)
        raise AssertionError(text)  # pragma: no cover - conclude never returns here

    def never(self, matcher: Matcher, *, after: When, for_ns: int, requirement: str = "") -> None:
        """No matching frame may be asked for in the span after something.

        Raises:
            DeviceFailure: one was, for certain.
            InconclusiveResult: one was, but perhaps before the span began.
        """
        since = interval_of(after)
        end = since.latest + for_ns
        self._await(f"no {matcher}", after, Limits(at_most_ns=for_ns), requirement)
        self.wait_until(end)
        self.settle()
        found = [
            self._intruder(seen, after, requirement)
            for seen in self.collect(matcher, after=after, until=end)
        ]
        if found:
            # One that came for certain afterwards decides, whatever others leave open.
            sure = [verdict for verdict in found if verdict.outcome is Outcome.FAIL]
            self.conclude((sure or found)[0], after)
        text = f"no {matcher} in {show_span(for_ns)} after {name_of(after)}"
        self.record(Verdict(requirement, Outcome.PASS, text, at=end))

    def _intruder(self, seen: Seen, after: When, requirement: str) -> Verdict:
        """The verdict on a frame that should not have come."""
        since, when = interval_of(after), self.when(seen)
        outcome = Outcome.FAIL if when.earliest >= since.latest else Outcome.INCONCLUSIVE
        late_ns = when.latest - since.latest
        text = f"{seen.frame} came {show_span(late_ns)} after {name_of(after)}; none is allowed"
        return Verdict(requirement, outcome, text, at=seen.at, cause=since, effect=when)

    def collect(self, matcher: Matcher, *, after: When, until: int) -> list[Seen]:
        """The matching frames asked for after something and before `until`, as seen so far.

        What a hosted device's host has kept back is among them.
        """
        since = interval_of(after).earliest
        if until > self.known_until and self.stage.health is not None:
            self.settle()
        start, accepts = self._index_after(after), matcher.accepts
        return [
            seen
            for index, frame in self.trace.others(start)
            if accepts(frame) and since <= (seen := self.seen(index)).wanted.latest
            if seen.wanted.earliest <= until or self.when(seen).earliest <= until
        ]

    def beats(self, matcher: Matcher, count: int, *, after: When, patience_ns: int) -> list[Seen]:
        """The next `count` matching frames; fewer where one stays away for `patience_ns`."""
        found: list[Seen] = []
        last: When = after
        while len(found) < count:
            begin = interval_of(last).latest
            seen = self.first(matcher, last, begin + patience_ns)
            if seen is None:
                break
            found.append(seen)
            last = seen
        self.settle()
        return found

    # Sending.

    def send(self, frame: Frame, requirement: str = "") -> Seen:
        """Send a frame and wait until it was on the bus; `requirement` = the device hears it.

        Raises:
            DeviceFailure: nobody acknowledges any more, though the device was heard in this
                test: it has left the bus.
            NotAcknowledged: nobody acknowledges, and nobody was heard either.
        """
        index = len(self.trace)
        self.post(frame)
        return self.await_own(frame, index, requirement)

    def await_own(self, frame: Frame, index: int, requirement: str = "") -> Seen:
        """Wait until a frame of ours that was queued is on the bus; see `send`.

        Args:
            frame: which one.
            index: of the first frame of the trace that it can be.
            requirement: which says that the device hears it.
        """
        give_up_at = self.now() + SEND_PATIENCE_NS
        while True:
            while index < len(self.trace):
                seen = self.seen(index)
                if seen.own and seen.frame == frame:
                    return seen
                index += 1
            if not self.pump(give_up_at) and self._clock() >= give_up_at:
                self._not_acknowledged(frame, requirement)

    def _not_acknowledged(self, frame: Frame, requirement: str) -> NoReturn:
        text = (
            f"{frame} was not on the bus within {show_span(SEND_PATIENCE_NS)}: nobody"
            " acknowledges (device off, other bit rate, cable) or the bus is full"
        )
        if not self.was_heard():
            raise NotAcknowledged(text)
        text = f"the device was heard, and is gone from the bus: {text}"
        self.fail(text, requirement=requirement)

    def was_heard(self) -> bool:
        """Whether any frame of another station was seen in this test."""
        return self.trace.hears_others()

    # Network management.

    def nmt(self, command: Nmt | int, node_id: int | None = None) -> Seen:
        """Send an NMT command, to the device or to `node_id` (0 = all)."""
        return self.send(nmt_frame(command, self.node_id if node_id is None else node_id))

    def shown_state(self, after: When) -> State:
        """The state that the first heartbeat shows which is due after a command's effect.

        Raises:
            NotRun: the device sends no heartbeat.
            DeviceFailure: none came, or it shows no state.
        """
        expected = self.watch.expected
        if not expected.heartbeat_ns:
            raise NotRun("the device is commissioned without heartbeat; its state cannot be seen")
        settled = interval_of(after).latest + expected.command_ns
        matcher = matchers.heartbeat(self.node_id)
        patience_ns = expected.heartbeat_each.at_most_ns
        effect = Interval(settled, settled)
        last: When = effect
        while True:
            seen = self.first(matcher, last, settled + patience_ns + LOOK_ON_NS)
            if seen is None or self.when(seen).earliest > settled:
                break
            # Due before the effect, perhaps, and kept back by the bus or its host. Or after it:
            # then it is the one that was wanted, and the next one comes a period after it.
            last = seen
            effect = Interval(settled, max(settled, self.when(seen).latest))
        requirement = self._beat_rule(seen)
        if seen is None:
            seen = self.expect(matcher, after=last, within=patience_ns, requirement=requirement)
        else:
            limits = Limits(at_most_ns=patience_ns)
            text = f"{matcher} after {name_of(after)} has acted"
            self.measure_between(effect, seen, limits, text, requirement=requirement, since=after)
        state = SHOWN.get(seen.frame.data[0]) if len(seen.frame.data) == 1 else None
        if state is None:
            text = f"{seen.frame} shows no NMT state"
            self.fail(text, requirement=expected.ids.beat_form, since=after)
        return state

    def _beat_rule(self, beat: Seen | None) -> str:
        """The requirement on when a beat comes (None = the next one): the first has its own."""
        mine = matchers.cob(ERROR_CONTROL + self.node_id)
        places = reversed(range(len(self.trace) if beat is None else beat.index))
        older = (each for each in map(self.trace.frame, places) if not each.own)
        last = next((each for each in older if mine.accepts(each.frame)), None)
        return self.watch.rule_after(last)

    def expect_state(self, state: State, *, after: When, requirement: str = "") -> None:
        """The heartbeat shows `state` once a command has had time to act.

        Where only the next one does, the command was obeyed and shown too late.
        """
        found = self.shown_state(after)
        if found is not state and self.shown_state(self.now()) is state:
            requirement = self.watch.expected.ids.shown_late
        text = f"state {state} after {name_of(after)}; the heartbeat shows {found}"
        self.check(found is state, text, requirement=requirement, since=after)
