"""What the key oracle is told: contacts, commands and frames, with the doubt of each."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from hil_tests.clock import FOREVER, Interval, exactly

NEVER = Interval(FOREVER, FOREVER)
ALWAYS = Interval(-FOREVER, -FOREVER)


class Edge(NamedTuple):
    """From some instant of `when` on exactly the keys of the mask `held` are held."""

    when: Interval
    held: int


class Turn(NamedTuple):
    """An NMT command or the supply moves the node into or out of operational.

    A reset or a power-on says by when the initialisation was over (`ready_at`).
    """

    when: Interval
    operational: bool
    ready_at: int | None = None


class Report(NamedTuple):
    """A key frame: when it was asked for, and the keys that it shows as held."""

    wanted: Interval
    mask: int


class KeyRules(NamedTuple):
    """Facts and limits of a keypad, spans in ns.

    Args:
        keys: bit in the key frame by name.
        debounce_ns: how long a change must last; 0 = no filtering.
        scan_ns: how often the keys are read, at most.
        key_frame_ns: debounced change to request of the frame, at most.
        command_ns: NMT command to its effect, at most.
        releases_reported: releases are reported like presses (KEY-20).
    """

    keys: Mapping[str, int]
    debounce_ns: int
    scan_ns: int
    key_frame_ns: int
    command_ns: int
    releases_reported: bool = True

    @property
    def soonest_ns(self) -> int:
        """A stay counts after this at the earliest."""
        return max(self.debounce_ns - self.scan_ns, 0)

    @property
    def surely_ns(self) -> int:
        """A stay has counted after this."""
        return self.debounce_ns + self.scan_ns


class Window(NamedTuple):
    """The node is operational from the effect of one turn to that of another."""

    opens: Interval
    closes: Interval


def windows_of(turns: Sequence[Turn]) -> tuple[list[Window], list[Interval]]:
    """When the node is operational, and the start commands that it got there again."""
    found: list[Window] = []
    again: list[Interval] = []
    opens: Interval | None = None
    for turn in turns:
        if turn.operational and opens is not None:
            again.append(turn.when)
        elif turn.operational:
            opens = turn.when
        elif opens is not None:
            found.append(Window(opens, turn.when))
            opens = None
    if opens is not None:
        found.append(Window(opens, NEVER))
    return found, again


def window_of(wanted: Interval, windows: Sequence[Window], command_ns: int) -> Window | None:
    """The last window in which a frame can have been asked for; None = outside them all."""
    for window in reversed(windows):
        left_by = window.closes.latest + command_ns
        if window.opens.earliest <= wanted.latest and wanted.earliest <= left_by:
            return window
    return None


class KeyTimeline(NamedTuple):
    """Everything that happened between a device and its keys.

    Args:
        edges: of the contacts, in order; the first one says how they were at the beginning.
        turns: into and out of operational, in order; at the beginning the node is outside.
        reports: the key frames, in the order of the wire.
        until: every frame that was asked for before this is among them.
    """

    edges: Sequence[Edge]
    turns: Sequence[Turn]
    reports: Sequence[Report]
    until: int

    def same_stimuli(self, other: KeyTimeline) -> bool:
        """Whether the same was done to the device, at instants that are known as well."""
        return list(self.edges) == list(other.edges) and list(self.turns) == list(other.turns)

    def sharpened(
        self, places: Sequence[Window | None], *, late: bool, command_ns: int
    ) -> KeyTimeline:
        """Every doubt turned against the device: its answers late, or early.

        For a timeline in which nothing is certainly wrong. Only what is possible at all: a
        frame that can have been asked for in operational was, and a frame that can have been
        asked for after an edge or a command was.

        Args:
            places: for each frame the window in which it was asked for.
            late: its answers are as late as can be; else as early.
            command_ns: limit of a command.
        """
        causes, effects = (0, 1) if late else (1, 0)
        acts = sorted(
            [edge.when.latest for edge in self.edges] + [turn.when.latest for turn in self.turns]
        )
        reports = []
        for (wanted, mask), window in zip(self.reports, places, strict=True):
            assert window is not None, "a frame that is certainly outside was judged before"
            last_act = acts[max(bisect_right(acts, wanted.latest) - 1, 0)]
            at = min(wanted[effects], window.closes.latest + command_ns)
            at = max(at, window.opens.latest, min(last_act, wanted.latest))
            reports.append(Report(exactly(at), mask))
        return KeyTimeline(
            [Edge(exactly(when[causes]), held) for when, held in self.edges],
            [Turn(exactly(turn.when[causes]), *turn[1:]) for turn in self.turns],
            reports,
            self.until,
        )


class Stay(NamedTuple):
    """A contact at one level, from one edge to the next."""

    level: int
    start: Interval
    end: Interval

    def touches(self, earliest: int, latest: int) -> bool:
        """Whether it can have been so at some instant of that span."""
        return self.start.earliest <= latest and self.end.latest >= earliest


def moved_bits(edges: Sequence[Edge]) -> int:
    """The contacts that moved at all, as a mask."""
    first, moved = edges[0].held, 0
    for _, held in edges:
        moved |= held ^ first
    return moved


def stays_of(edges: Sequence[Edge], bit: int, moved: int) -> list[Stay]:
    """The stays of one contact; the first one began before everything.

    Args:
        edges: of all contacts.
        bit: of the contact.
        moved: the contacts that moved at all, as a mask.
    """
    found: list[Stay] = []
    level, start = edges[0].held >> bit & 1, ALWAYS
    if moved >> bit & 1:
        for when, held in edges:
            if held >> bit & 1 != level:
                found.append(Stay(level, start, when))
                level, start = 1 - level, when
    found.append(Stay(level, start, NEVER))
    return found
