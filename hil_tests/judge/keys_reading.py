"""One reading of a timeline: what every key can have been when, and all of them together."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator

from hil_tests.clock import FOREVER, Interval
from hil_tests.judge.keys_facts import (
    KeyRules,
    KeyTimeline,
    Report,
    Window,
    moved_bits,
    stays_of,
    window_of,
    windows_of,
)
from hil_tests.judge.keys_levels import Attention, KeyLevels
from hil_tests.judge.verdict import Limits, Outcome, Verdict


class Reading:
    """A timeline, and the debounced states that it allows.

    Args:
        timeline: edges, turns and frames.
        rules: facts and limits.
        like: another reading, perhaps of the same stimuli; then the keys are as in that.
    """

    def __init__(
        self, timeline: KeyTimeline, rules: KeyRules, like: Reading | None = None
    ) -> None:
        self._timeline = timeline
        self.rules = rules
        self.until = timeline.until
        self.reports = timeline.reports
        self.bits = sum(1 << bit for bit in rules.keys.values())
        """The bits of all keys."""
        self.windows: list[Window]
        self.again: list[Interval]
        self.keys: dict[str, KeyLevels]
        """The keys that were held at any time; the others are released, always."""
        self._instants: list[int]
        self._possible: list[tuple[int, int]]
        if like is not None and timeline.same_stimuli(like._timeline):
            self.windows, self.again, self.keys = like.windows, like.again, like.keys
            self._instants, self._possible = like._instants, like._possible
        else:
            self.windows, self.again = windows_of(timeline.turns)
            attention = Attention(timeline.turns, self.windows, rules)
            moved = moved_bits(timeline.edges)
            touched = moved | timeline.edges[0].held
            self.keys = {
                name: KeyLevels(bit, stays_of(timeline.edges, bit, moved), attention)
                for name, bit in rules.keys.items()
                if touched >> bit & 1
            }
            self._instants, self._possible = self._join(self.bits & ~touched)
        self.places = [
            window_of(report.wanted, self.windows, rules.command_ns) for report in self.reports
        ]
        """For each frame the last window in which it can have been asked for."""

    def _join(self, untouched: int) -> tuple[list[int], list[tuple[int, int]]]:
        """The possible states of all keys together: masks that can be released, pressed."""
        released, pressed = untouched, 0
        instants, possible = [-FOREVER], [(released, pressed)]
        for at, bit, levels in sorted(
            (at, key.bit, levels) for key in self.keys.values() for at, levels in key.steps
        ):
            released = released & ~(1 << bit) | (levels & 1) << bit
            pressed = pressed & ~(1 << bit) | (levels >> 1) << bit
            if instants[-1] == at:
                possible[-1] = (released, pressed)
            else:
                instants.append(at)
                possible.append((released, pressed))
        return instants, possible

    def sharpened(self, *, late: bool) -> KeyTimeline:
        """The timeline with every doubt turned against the device."""
        return self._timeline.sharpened(self.places, late=late, command_ns=self.rules.command_ns)

    def asked_from(self, report: Report) -> int:
        """The earliest instant whose state a frame may show."""
        earliest = report.wanted.earliest
        oldest = earliest - self.rules.key_frame_ns
        for start in self.starts():
            bound = start.latest + self.rules.command_ns
            if earliest <= bound and start.earliest <= report.wanted.latest:
                oldest = min(oldest, max(start.earliest, earliest - self.rules.command_ns))
        return oldest

    def starts(self) -> Iterator[Interval]:
        """All start commands."""
        yield from (window.opens for window in self.windows)
        yield from self.again

    def can_be(self, report: Report) -> bool:
        """Whether the state was possible at some instant that the frame may show."""
        mask = report.mask
        index = bisect_right(self._instants, self.asked_from(report)) - 1
        while index < len(self._instants) and self._instants[index] <= report.wanted.latest:
            released, pressed = self._possible[index]
            if not mask & ~pressed and not self.bits & ~mask & ~released:
                return True
            index += 1
        return False

    def place_in(self, window: Window, index: int) -> int | None:
        """Which frame since entry it is, 0 = the first; None = it is too late to be of entry."""
        bound = window.opens.latest + self.rules.command_ns
        if self.reports[index].wanted.earliest > bound:
            return None
        earlier = self.reports[:index]
        return sum(r.wanted.latest >= window.opens.earliest for r in earlier)

    def shown(self, report: Report) -> str:
        """The keys of a frame, for people."""
        names = [name for name, bit in self.rules.keys.items() if report.mask >> bit & 1]
        return f"{report.mask:02X}h ({', '.join(names) or 'no key'})"


def instant_of(verdict: Verdict) -> int:
    """Where in time a verdict of the oracle belongs."""
    return verdict.at or 0


def fail(
    requirement: str,
    text: str,
    at: int,
    timed: tuple[Interval, Interval] | None = None,
    limits: Limits | None = None,
) -> Verdict:
    """A FAIL of this reading; `timed` = cause and effect, where the time between is wrong."""
    if timed is None:
        return Verdict(requirement, Outcome.FAIL, text, None, limits, at)
    cause, effect = timed
    measured = effect.since(cause)
    return Verdict(requirement, Outcome.FAIL, text, measured, limits, at, cause, effect)
