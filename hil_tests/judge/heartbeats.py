"""The monitor of the heartbeat: its cadence, its content, its absence."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from hil_tests.clock import FOREVER, Interval, show_span
from hil_tests.judge.causal import Lateness, Seen
from hil_tests.judge.cobs import SHOWN, Nmt, State
from hil_tests.judge.expected import Expected
from hil_tests.judge.periodic import ENOUGH
from hil_tests.judge.suspicion import Silence, Suspicion, always_wrong, confirmed
from hil_tests.judge.timeline import StateTimeline
from hil_tests.judge.verdict import Outcome, Verdict
from node_model.frame import Frame


class Heartbeats:
    """Cadence and content of the heartbeat (of a keypad HB-01 to HB-06, NMT-07)."""

    def __init__(self, expected: Expected, timeline: StateTimeline) -> None:
        self._expected = expected
        self._ids = expected.ids
        self._timeline = timeline
        self._low = expected.heartbeat_each.at_least_ns
        self._high = expected.heartbeat_each.at_most_ns
        self._last: Seen | None = None
        self._first = False
        self._free_until = -1
        self._known: object = None
        self._steady_from: Seen | None = None
        self._steady = 0
        self._started = False
        self._begun = -FOREVER
        """From when on its present period counts."""
        self._suspicions: list[Suspicion] = []
        self._missing: list[Silence] = []

    def see(self, seen: Seen) -> None:
        """A frame with the identifier of the heartbeat: boot-up or beat."""
        frame, _, wanted, _, _ = seen
        if frame is not self._known:
            if frame.data == b"\x00":
                self._boot(seen)
                return
            self._content(seen)
        last = self._last
        self._last = seen
        if last is None:
            return
        if self._first:
            self._first = False
            self._span(seen, last, first=True)
            return
        earliest, latest = last.wanted
        low = wanted[0] - latest
        high = wanted[1] - earliest
        self._steady += 1
        if self._steady_from is None:
            self._resume(last)
        if low < self._low or high > self._high:
            self._span(seen, last, first=False)

    def in_time(self, beat: Frame, requests: Sequence[int], starts: Sequence[int]) -> bool:
        """Whether that beat, coming so often, merely goes on with a steady stretch.

        Args:
            beat: the frame, the same each time.
            requests: the earlier end of the interval in which each was asked for.
            starts: the later one.
        """
        last = self._last
        if last is None or self._steady_from is None or beat is not self._known:
            return False
        low, high = self._low, self._high
        early, late = last.wanted
        for earliest, latest in zip(requests, starts, strict=True):
            if earliest - late < low or latest - early > high:
                return False
            early, late = earliest, latest
        return True

    def go_on(self, last: Seen, count: int) -> None:
        """`see` for `count` beats that came in time, of which this is the last."""
        self._steady += count
        self._last = last

    def _boot(self, seen: Seen) -> None:
        self._end_steady()
        self._last = seen
        self._first = True
        self._started = False

    def _resume(self, last: Seen) -> None:
        """A stretch of undisturbed beats began with `last`, unless a command may still act."""
        if last.wanted.earliest > self._free_until:
            self._steady_from = last
            self._steady = 1

    def _content(self, seen: Seen) -> None:
        """The byte shows a state, and one that is possible."""
        data = seen.frame.data
        if len(data) != 1:
            return  # its length is the other monitor's business
        state = SHOWN.get(data[0])
        if self._expected.heartbeat_ns == 0 and seen.wanted.earliest > self._begun:
            text = f"heartbeat {seen.frame} although its period is 0"
            self._suspect(self._ids.beat_off, text, seen)
        if state is None:
            text = f"heartbeat {seen.frame} shows no NMT state"
            self._suspect(self._ids.beat_form, text, seen)
            return
        if state in self._timeline.possible(seen.wanted):
            if self._timeline.sure(seen.wanted) is state:
                self._known = seen.frame
            return
        never_started = state is State.OPERATIONAL and not self._started
        requirement = self._ids.self_start if never_started else self._ids.state
        text = f"heartbeat shows {state}, which no command led to"
        self._suspicions.append(
            Suspicion(
                requirement,
                text,
                seen,
                lambda when: (
                    Outcome.INCONCLUSIVE
                    if state in self._timeline.possible(when)
                    else Outcome.FAIL
                ),
            )
        )

    def _suspect(self, requirement: str, text: str, seen: Seen) -> None:
        self._suspicions.append(Suspicion(requirement, text, seen, always_wrong))

    def _span(self, seen: Seen, last: Seen, *, first: bool) -> None:
        """Hold one span against its limits; the lower one only on an undisturbed grid."""
        limits = self._expected.heartbeat_first if first else self._expected.heartbeat_each
        if not first and last.wanted.earliest <= self._free_until:
            limits = type(limits)(at_most_ns=limits.at_most_ns)
        name = self._ids.beat_first if first else self._ids.beat
        text = "first heartbeat after the boot-up" if first else "interval between two heartbeats"
        if limits.check(seen.wanted.since(last.wanted)) is Outcome.FAIL:
            self._suspicions.append(Suspicion(name, text, seen, always_wrong, last, limits))

    def _end_steady(self) -> None:
        """A stretch of undisturbed beats ends: its mean is judged."""
        first, last, count = self._steady_from, self._last, self._steady
        self._steady_from, self._steady = None, 0
        if first is None or last is None or count < ENOUGH:
            return
        limits = self._expected.heartbeat_mean
        total = type(limits)(limits.at_least_ns * count, limits.at_most_ns * count)
        measured = last.wanted.since(first.wanted)
        if total.check(measured) is Outcome.FAIL:
            mean = show_span(measured.latest // count)
            text = f"mean of {count} heartbeat intervals is {mean}; allowed {limits} each"
            self._suspicions.append(
                Suspicion(self._ids.beat, text, last, always_wrong, first, total)
            )

    def retimed(self, expected: Expected, when: Interval) -> None:
        """The device beats otherwise from some instant of `when` on: nothing is due in it."""
        self.silenced(when)
        self._expected = expected
        self._low = expected.heartbeat_each.at_least_ns
        self._high = expected.heartbeat_each.at_most_ns
        self._begun = when.latest
        self._free_until = max(self._free_until, when.latest)

    def restarted(self, when: Interval, by: Nmt | None) -> None:
        """A new start."""
        if by is None:
            self._started = False
        self.silenced(when)
        if by is not None:
            self._free_until = when.latest + self._expected.command_ns

    def commanded(self, when: Interval) -> None:
        """A state change may come: an extra beat, a new phase."""
        self._started = True
        self._end_steady()
        self._known = None
        self._free_until = when.latest + self._expected.command_ns + max(self._high, 0)

    def silenced(self, when: Interval) -> None:
        """Nothing is due any more."""
        self._overdue(when.earliest)
        self._end_steady()
        self._known = None
        self._last = None
        self._first = False

    def _overdue(self, until: int) -> None:
        """Note a beat that should have come by `until`."""
        last, period_ns = self._last, self._expected.heartbeat_ns
        if last is None or not period_ns:
            return
        each, first = self._expected.heartbeat_each, self._expected.heartbeat_first
        limits = first if self._first else each
        silent = until - last.wanted.latest
        if silent > limits.at_most_ns:
            name = self._ids.beat_first if self._first else self._ids.beat
            text = f"no heartbeat for {show_span(silent)}"
            measured = Interval(silent, silent)
            verdict = Verdict(name, Outcome.FAIL, text, measured, limits, last.at, last.wanted)
            limit_at = last.wanted.latest + limits.at_most_ns
            self._missing.append(Silence(verdict, limit_at, until))

    def finish(self, until: int, quiet_from: int, lateness: Lateness) -> Iterator[Verdict]:  # noqa: ARG002
        """See `Monitor`."""
        self._overdue(quiet_from)
        self._end_steady()
        yield from confirmed(self._missing, lateness)
        yield from confirmed(self._suspicions, lateness)
