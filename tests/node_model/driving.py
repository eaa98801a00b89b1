"""Plays a script of inputs to a node, as different hosts would: in time, late, fussily."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from enum import Enum

from node_model.frame import Frame
from node_model.node import MS, Frames, Node, Panel


class Host(Enum):
    """How a host tells a node that time passes."""

    TIMELY = "at each deadline"
    LATE = "only before each input"
    FUSSY = "at each deadline, and in between where nothing is due"


@dataclass(frozen=True)
class Step:
    """After `wait_ns` one input: a frame, power on (True) or off, a set of names.

    The names are keys that are held, or errors that exist where a node can have some.
    """

    wait_ns: int
    what: frozenset[str] | Frame | bool | None


@dataclass(frozen=True)
class Record:
    """What a node did up to a step and in it, and how it looked afterwards."""

    before: tuple[Frame, ...]
    answer: tuple[Frame, ...]
    bit_rate: int
    deadline: int | None
    lit: tuple[bool, ...]
    image: bytes


def pass_time(node: Node, start: int, until: int, host: Host) -> list[Frame]:
    """Let a host pass time; the laws of the deadline are checked on the way."""
    frames: list[Frame] = []
    if host is Host.LATE:
        frames += node.advance(until)
        assert_later(node, until)
        return frames
    at = start
    while (due := node.deadline()) is not None and due <= until:
        if host is Host.FUSSY and at < due - 1:
            for early in ((at + due) // 2, due - 1):
                looks = look(node, early)
                assert not node.advance(early), f"frames at {early}, but the deadline is {due}"
                assert look(node, early) == looks
        frames += node.advance(due)
        assert_later(node, due)
        at = due
    return frames


def assert_later(node: Node, now: int) -> None:
    """After `advance(now)` the deadline is None or later."""
    due = node.deadline()
    assert due is None or due > now, f"deadline {due} after advance({now})"


def look(node: Node, now: int) -> tuple[int, int | None, tuple[bool, ...], bytes]:
    """All that a node shows without being changed."""
    lit: tuple[bool, ...] = ()
    image = b""
    if is_panel(node):
        panel: Panel = node  # type: ignore[assignment]
        lit = tuple(panel.lit(led, now) for led in panel.leds)
        image = panel.image()
        change = panel.lamp_change(now)
        assert change is None or change > now
        assert_steady(panel, lit, now)
    return node.bit_rate, node.deadline(), lit, image


def assert_steady(panel: Panel, lit: tuple[bool, ...], now: int) -> None:
    """No lamp changes before the predicted change, unless the node does something before."""
    events = (panel.lamp_change(now), panel.deadline(), now + 2000 * MS)
    until = min(at for at in events if at is not None) - 1
    if until > now:
        later = tuple(panel.lit(led, until) for led in panel.leds)
        assert later == lit, f"a lamp has changed between {now} and {until}, and nobody said so"


def is_panel(node: Node) -> bool:
    """Whether it has keys and LEDs."""
    return hasattr(node, "lit")


def act(node: Node, what: frozenset[str] | Frame | bool | None, now: int) -> Frames:
    """One input."""
    if isinstance(what, Frame):
        return node.receive(what, now)
    if what is True:
        return node.power_on(now)
    if what is False:
        frames = node.power_off(now)
        assert not frames, "power_off returned frames"
        assert node.bit_rate == 0, "a bit rate without power"
        return frames
    if what is not None and is_panel(node):
        panel: Panel = node  # type: ignore[assignment]
        if panel.faults:
            return panel.fail(what & frozenset(panel.faults), now)
        return panel.hold(what & frozenset(panel.keys), now)
    return ()


def play(node: Node, steps: Iterable[Step], host: Host = Host.TIMELY) -> Sequence[Record]:
    """Play a script and write down what came of it."""
    now = 0
    records = []
    for step in steps:
        start, now = now, now + step.wait_ns
        before = tuple(pass_time(node, start, now, host))
        answer = tuple(act(node, step.what, now))
        records.append(Record(before, answer, *look(node, now)))
    return records


def frames_of(records: Iterable[Record]) -> list[Frame]:
    """Every frame of a play, in order."""
    return [frame for record in records for frame in (*record.before, *record.answer)]
