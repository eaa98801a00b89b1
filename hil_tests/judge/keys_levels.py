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


def _order(move: _Move) -> tuple[int, bool]:
    """By instant; what must be comes before what may follow."""
    return move[0], move[2] is None


class Attention:
    """When a node must look at its keys, and when it need not; the same for each of them.

    Args:
        turns: into and out of operational.
        windows: of those turns.
        rules: facts and limits.
    """

    def __init__(self, turns: Sequence[Turn], windows: Sequence[Window], rules: KeyRules) -> None:
        self.windows = windows
        self.scan_ns, self.command_ns = rules.scan_ns, rules.command_ns
        self.soonest_ns, self.surely_ns = rules.soonest_ns, rules.surely_ns
        command_ns = rules.command_ns
        closes = [-FOREVER, *(window.closes.earliest for window in windows)]
        opens = [*(window.opens.latest + command_ns for window in windows), FOREVER]
        self.breaks = [Interval(a, b) for a, b in zip(closes, opens, strict=True)]
        """When the node may not be looking at its keys."""
        self.closings = [
            (window.closes.earliest, window.closes.latest + command_ns, pause.latest)
            for window, pause in zip(windows, self.breaks[1:], strict=True)
        ]
        """The end of each window, from and to; and when it must look again after that."""
        starts = [(turn.when.earliest, turn.ready_at) for turn in turns]
        self.resets = [(at, ready_at) for at, ready_at in starts if ready_at is not None]
        """When the node begins anew, and by when it has."""
        entries = [(w.opens.earliest, w.opens.latest + command_ns) for w in windows]
        self.at_once = entries + self.resets
        """Spans in which what is held may count at once (KEY-22)."""


class KeyLevels:
    """The sets of one key over time.

    Args:
        bit: of the key.
        stays: of its contact.
        attention: of the node.
    """

    def __init__(self, bit: int, stays: Sequence[Stay], attention: Attention) -> None:
        self.bit = bit
        self.stays = stays
        self._attention = attention
        self.steps: list[tuple[int, int]] = [(-FOREVER, 1 << stays[0].level)]
        """From when on which levels are possible: 1 = released, 2 = pressed, 3 = both."""
        self.changes: list[Change] = []
        self._walk(sorted(self._moves(), key=_order))

    def may_count_at(self, index: int) -> int | None:
        """From when on a stay may have counted; None = it is certainly too short."""
        stay, first = self.stays[index], self._chain(index)
        counts_at = self.stays[first].start.earliest + self._attention.soonest_ns
        if self._end(stay) < counts_at:
            return None
        # What stands between a chain may be overlooked, so it may count meanwhile.
        between_ns = 0 if first == index else self._attention.scan_ns
        return max(stay.start.earliest - between_ns, counts_at)

    def _chain(self, index: int) -> int:
        """The first of the stays at this level with nothing between that must be seen."""
        while index > 1 and self._unseen(self.stays[index - 1]):
            index -= 2
        return index

    def _unseen(self, stay: Stay) -> bool:
        """Whether a keypad may miss it: between two scans, or outside operational."""
        from_at, to_at = stay.start.latest, stay.end.earliest
        if to_at - from_at < self._attention.scan_ns:
            return True
        return any(from_at >= start and to_at <= end for start, end in self._attention.breaks)

    def _end(self, stay: Stay) -> int:
        """When the keypad saw it end, at the latest: perhaps not before it looks again."""
        end = stay.end.latest
        for closes, left_by, looks_at in self._attention.closings:
            if looks_at > end and stay.touches(closes, left_by):
                end = looks_at
        return end

    def _moves(self) -> Iterator[_Move]:
        for index, stay in enumerate(self.stays):
            at = self.may_count_at(index) if index else None
            if at is not None:
                yield _Move(at, stay.level)
            yield from self._at_once(stay)
            yield from self._surely(stay)
        for at, _ in self._attention.resets:
            yield _Move(at, 0)

    def _at_once(self, stay: Stay) -> Iterator[_Move]:
        """What is held on entry, or while the node starts, may count at once (KEY-22)."""
        from_at, to_at = stay.start.earliest, stay.end.latest + self._attention.scan_ns
        for earliest, latest in self._attention.at_once:
            if from_at <= latest and to_at >= earliest:
                yield _Move(max(from_at, earliest), stay.level)

    def _surely(self, stay: Stay) -> Iterator[_Move]:
        """Where the stay must have counted: only time in operational is sure to count."""
        command_ns, surely_ns = self._attention.command_ns, self._attention.surely_ns
        start, ends = stay.start, stay.end.earliest
        if start.latest + surely_ns >= ends:
            return  # too short, whatever the node did
        for opens, closes in self._attention.windows:
            open_by = opens.latest + command_ns
            begun_by = max(open_by, start.latest)
            must_be_at = begun_by + surely_ns
            if must_be_at < ends and must_be_at < closes.earliest:
                outside = start.earliest < open_by
                began = Interval(opens.earliest, begun_by) if outside else start
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
