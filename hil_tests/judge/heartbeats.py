"""The monitor of the heartbeat: its cadence, its content, its absence."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from operator import sub

from hil_tests.clock import FOREVER, Interval, show_span
from hil_tests.judge.causal import Lateness, Seen
from hil_tests.judge.cobs import SHOWN, Nmt, State
from hil_tests.judge.expected import Expected
from hil_tests.judge.periodic import ENOUGH
from hil_tests.judge.reaction import Reacted
from hil_tests.judge.suspicion import Silence, Suspicion, always_wrong, confirmed
from hil_tests.judge.timeline import States, StateTimeline
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
        self.begun = -FOREVER
        """From when on its present period counts."""
        self.excused: States = frozenset()
        """States that an error of which nothing was seen may have led to."""
        self._reacted = False
        """A communication error was told since the last command."""
        self._left: tuple[State, int] | None = None
        """The state that it must have left because of that, and by when."""
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
        if requests[0] - late < low or starts[0] - early > high:
            return False
        least = min(map(sub, requests[1:], starts), default=low)
        most = max(map(sub, starts[1:], requests), default=high)
        return least >= low and most <= high

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
        if self._expected.heartbeat_ns == 0 and seen.wanted.earliest > self.begun:
            text = f"heartbeat {seen.frame} although its period is 0"
            self._suspect(self._ids.beat_off, text, seen)
        if state is None:
            text = f"heartbeat {seen.frame} shows no NMT state"
            self._suspect(self._ids.beat_form, text, seen)
            return
        possible = self._timeline.possible(seen.wanted)
        if state in possible:
            if len(possible) == 1:
                self._known = seen.frame
            self._stays(seen, state)
        elif state not in self.excused:
            self._strange(seen, state)

    def _strange(self, seen: Seen, state: State) -> None:
        """No command led there, nor an error that was told by then."""
        never_started = state is State.OPERATIONAL and not self._started
        requirement = self._ids.self_start if never_started else self._ids.state
        if self._reacted:
            requirement = self._ids.reaction
        text = f"heartbeat shows {state}, which no command led to"

        def check(when: Interval) -> Outcome:
            if state in self._timeline.possible(seen.wanted):
                return Outcome.PASS  # an error that was told later did
            known = state not in self._timeline.possible(when)
            return Outcome.FAIL if known else Outcome.INCONCLUSIVE

        self._suspicions.append(Suspicion(requirement, text, seen, check))

    def _stays(self, seen: Seen, state: State) -> None:
        """A communication error should have led away from this state."""
        if self._left is None or self._left[0] is not state:
            return
        settled_at = self._left[1]
        if seen.wanted.earliest > settled_at:
            text = f"heartbeat shows {state} still; 1029h leads elsewhere"
            self._suspicions.append(
                Suspicion(
                    self._ids.reaction,
                    text,
                    seen,
                    lambda when: Outcome.FAIL if when.earliest > settled_at else Outcome.PASS,
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
        reacted, left = self._reacted, self._left
        self.silenced(when)
        self._reacted, self._left = reacted, left
        self._expected = expected
        self._low = expected.heartbeat_each.at_least_ns
        self._high = expected.heartbeat_each.at_most_ns
        self.begun = when.latest
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
        self._reacted, self._left = False, None
        self._unsteady(when)

    def reacted(self, error: Reacted, before: States) -> None:
        """A communication error was told, and may have led from one of these states elsewhere."""
        undisturbed = error.when.latest > self._free_until
        settled_at = error.when.latest + self._expected.command_ns
        self._reacted, self._left = True, None
        state = next(iter(before))
        target = error.leads.get(state, before)
        if error.prompt and undisturbed and len(before) == 1 and state not in target:
            self._left = (state, settled_at)
        # Its beat may have come sooner, with the new state, and the message after it.
        self._suspicions = [
            suspicion
            for suspicion in self._suspicions
            if suspicion.requirement != self._ids.beat
            or suspicion.seen.wanted.latest < error.when.earliest
        ]
        self._unsteady(error.when)

    def _unsteady(self, when: Interval) -> None:
        """The state may change: an extra beat, a new phase."""
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
        self._reacted, self._left = False, None

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
