"""Which debounced state can a key have had, and when? From its contact alone, as sets.

Each stay of a contact at a level lasts from one edge to the next, both known as intervals.
It certainly counts where it lasted the debounce time and a scan, certainly not where it
lasted less than the debounce time minus a scan, and may count or not in between (KEY-04,
KEY-05). So the state of a key is a set over time: both levels while a change may have
counted, one level from when it must have.

What a conforming keypad may do besides: not see a stay shorter than a scan; not look at
its keys outside operational, or take them at once on entry (KEY-22); begin with no key, or
with the contacts as they are, after a reset.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from hil_tests.clock import FOREVER, Interval
from hil_tests.judge.keys_facts import KeyRules, Stay, Turn, Window


class Change(NamedTuple):
    """A debounced change that must have happened while the node was operational.

    Args:
        bit: of the key.
        level: that the key must show.
        can_be_at: from when on it can have that level.
        must_be_at: from when on it can have no other.
        began: the edge, or the start command where that is later.
        sure: it must have had the other level before.
        outside: the edge may have come while the node was not operational.
        closes_at: until then the node is surely operational.
    """

    bit: int
    level: int
    can_be_at: int
    must_be_at: int
    began: Interval
    sure: bool
    outside: bool
    closes_at: int


class _Move(NamedTuple):
    """From `at` on a level is possible (`must` None), or the only one."""

    at: int
    level: int
    must: tuple[Interval, bool, int] | None = None
    """`began`, `outside` and `closes_at` of the change."""

    @property
    def order(self) -> tuple[int, bool]:
        """By instant; what must be comes before what may follow."""
        return self.at, self.must is None


class KeyLevels:
    """The sets of one key over time.

    Args:
        bit: of the key.
        stays: of its contact.
        turns: into and out of operational.
        windows: of those turns.
        rules: facts and limits.
    """

    def __init__(
        self,
        bit: int,
        stays: Sequence[Stay],
        turns: Sequence[Turn],
        windows: Sequence[Window],
        rules: KeyRules,
    ) -> None:
        self.bit = bit
        self.stays = stays
        self._rules = rules
        self._turns = turns
        self._windows = windows
        self._breaks = self._breaks_of(windows)
        self.steps: list[tuple[int, int]] = [(-FOREVER, 1 << stays[0].level)]
        """From when on which levels are possible: 1 = released, 2 = pressed, 3 = both."""
        self.changes: list[Change] = []
        if len(stays) > 1 or stays[0].level:  # else it is released all the time
            self._walk(sorted(self._moves(), key=lambda move: move.order))

    def _breaks_of(self, windows: Sequence[Window]) -> list[Interval]:
        """When the node may not be looking at its keys."""
        closes = [-FOREVER, *(window.closes.earliest for window in windows)]
        opens = [*(window.opens.latest + self._rules.command_ns for window in windows), FOREVER]
        return [Interval(a, b) for a, b in zip(closes, opens, strict=True)]

    def may_count_at(self, index: int) -> int | None:
        """From when on a stay may have counted; None = it is certainly too short."""
        stay, first = self.stays[index], self._chain(index)
        counts_at = self.stays[first].start.earliest + self._rules.soonest_ns
        if self._end(stay) < counts_at:
            return None
        # What stands between a chain may be overlooked, so it may count meanwhile.
        between_ns = 0 if first == index else self._rules.scan_ns
        return max(stay.start.earliest - between_ns, counts_at)

    def _chain(self, index: int) -> int:
        """The first of the stays at this level with nothing between that must be seen."""
        while index > 1 and self._unseen(self.stays[index - 1]):
            index -= 2
        return index

    def _unseen(self, stay: Stay) -> bool:
        """Whether a keypad may miss it: between two scans, or outside operational."""
        if stay.end.earliest - stay.start.latest < self._rules.scan_ns:
            return True
        return any(
            stay.start.latest >= pause.earliest and stay.end.earliest <= pause.latest
            for pause in self._breaks
        )

    def _end(self, stay: Stay) -> int:
        """When the keypad saw it end, at the latest: perhaps not before it looks again."""
        end = stay.end.latest
        for window, pause in zip(self._windows, self._breaks[1:], strict=True):
            left_by = window.closes.latest + self._rules.command_ns
            if stay.touches(window.closes.earliest, left_by):
                end = max(end, pause.latest)
        return end

    def _moves(self) -> Iterator[_Move]:
        for index, stay in enumerate(self.stays):
            at = self.may_count_at(index) if index else None
            if at is not None:
                yield _Move(at, stay.level)
            yield from self._at_once(stay)
            yield from self._surely(stay)
        for turn in self._turns:
            if turn.ready_at is not None:
                yield _Move(turn.when.earliest, 0)

    def _at_once(self, stay: Stay) -> Iterator[_Move]:
        """What is held on entry, or while the node starts, may count at once (KEY-22)."""
        rules = self._rules
        spans = [(w.opens.earliest, w.opens.latest + rules.command_ns) for w in self._windows]
        spans += [(t.when.earliest, t.ready_at) for t in self._turns if t.ready_at is not None]
        for earliest, latest in spans:
            if stay.touches(earliest - rules.scan_ns, latest):
                yield _Move(max(stay.start.earliest, earliest), stay.level)

    def _surely(self, stay: Stay) -> Iterator[_Move]:
        """Where the stay must have counted: only time in operational is sure to count."""
        rules = self._rules
        for opens, closes in self._windows:
            open_by = opens.latest + rules.command_ns
            outside = stay.start.earliest < open_by
            began = stay.start
            if outside:
                began = Interval(opens.earliest, max(open_by, stay.start.latest))
            must_be_at = began.latest + rules.surely_ns
            if must_be_at < min(stay.end.earliest, closes.earliest):
                yield _Move(must_be_at + 1, stay.level, (began, outside, closes.earliest))

    def _walk(self, moves: Sequence[_Move]) -> None:
        """From moves to steps and changes."""
        possible = self.steps[0][1]
        added, can_be_at = -1, -FOREVER
        for at, level, must in moves:
            wanted = 1 << level
            if must is None:
                if not possible & wanted:
                    added, can_be_at, possible = level, at, 3
                    self.steps.append((at, possible))
            elif possible != wanted:
                began, outside, closes_at = must
                sure = added == level
                self.changes.append(
                    Change(self.bit, level, can_be_at, at - 1, began, sure, outside, closes_at)
                )
                possible = wanted
                self.steps.append((at, possible))

    def steady_until(self, change: Change) -> int:
        """Until when the key cannot have another level after a change that must have been."""
        index = bisect_left(self.steps, (change.must_be_at + 1, 0)) + 1
        return self.steps[index][0] if index < len(self.steps) else FOREVER
