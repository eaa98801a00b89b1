"""What a sequence of NMT frames allows a node to show: a pure function of what was recorded.

Laws: it looks back from each frame of the node to the commands that could explain it, and
keeps no state of a node; what may be either way is allowed. A command acts at some instant
between the end of its frame and the limit "command to effect"; a command that comes while
the node initialises may be lost, or be obeyed when that is over (CiA 301, 7.3.2).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from hil_tests.judge.causal import Seen
from hil_tests.judge.cobs import (
    ERROR_CONTROL,
    KEYS,
    LEADS_TO,
    RESETS,
    SHOWN,
    Nmt,
    State,
    nmt_for,
)

_BOOT_UP = b"\x00"


class Breach(NamedTuple):
    """Something that no order of the recorded events explains."""

    requirement: str
    text: str


class Limits(NamedTuple):
    """Spans of the profile, in ns."""

    command_ns: int
    boot_up_ns: int


class Story(NamedTuple):
    """What a node with that id was told and what it sent, from just after a boot-up on.

    Args:
        node_id: of the node under test.
        frames: everything seen, in the order of the wire.
        until: everything up to this instant was seen.
    """

    node_id: int
    frames: Sequence[Seen]
    until: int


class _Event(NamedTuple):
    """A command to the node, or with None a boot-up of it."""

    command: Nmt | None
    earliest: int
    latest: int
    sure: bool
    """A command that the node must have heard: no reset was under way."""


def breaches(story: Story, limits: Limits) -> list[Breach]:
    """Every frame of the node, and every silence after a reset, that nothing explains."""
    found: list[Breach] = []
    events: list[_Event] = []
    unanswered: list[int] = []
    for seen in story.frames:
        command = nmt_for(seen.frame, story.node_id) if seen.own else None
        if command is not None:
            sure = not _under_way(events) and not _pending(unanswered, seen.at, limits)
            events.append(_Event(command, seen.at, seen.at, sure))
            if command in RESETS:
                unanswered.append(seen.at)
        elif _is_boot_up(seen, story.node_id):
            earliest, latest = seen.wanted
            if not _under_way(events) and not _pending(unanswered, earliest, limits):
                found.append(Breach("NMT-02", f"boot-up {seen.frame} without a reset"))
            found += _late(events, earliest, limits)
            del unanswered[:1]
            events.append(_Event(None, earliest, latest, sure=True))
        elif not seen.own:
            found += _unexplained(seen, story.node_id, events, limits)
    return found + _late(events, story.until, limits)


def _pending(unanswered: Sequence[int], at: int, limits: Limits) -> bool:
    """A reset that came during initialisation may have been kept, and act after boot-up."""
    return any(at <= reset + limits.command_ns + limits.boot_up_ns for reset in unanswered)


def _is_boot_up(seen: Seen, node_id: int) -> bool:
    frame = seen.frame
    return not seen.own and frame.can_id == ERROR_CONTROL + node_id and frame.data == _BOOT_UP


def _under_way(events: Sequence[_Event]) -> bool:
    """Since the last boot-up a reset was commanded: the node may be initialising."""
    for event in reversed(events):
        if event.command is None:
            return False
        if event.command in RESETS:
            return True
    return False


def _late(events: Sequence[_Event], at: int, limits: Limits) -> list[Breach]:
    """The boot-up that is owed since the last reset comes at `at`, or had not come by then."""
    if not _under_way(events):
        return []
    reset = next(event for event in reversed(events) if event.command in RESETS)
    if at <= reset.latest + limits.boot_up_ns:
        return []
    return [Breach("NMT-06", f"no boot-up in time after {reset.command!r}")]


def _unexplained(
    seen: Seen, node_id: int, events: Sequence[_Event], limits: Limits
) -> list[Breach]:
    """A heartbeat or key frame whose state the node cannot have been in."""
    frame = seen.frame
    if frame.can_id == ERROR_CONTROL + node_id:
        state = SHOWN.get(frame.data[0]) if len(frame.data) == 1 else None
        if state is None:
            return [Breach("HB-02", f"{frame} shows no state")]
    elif frame.can_id == KEYS + node_id:
        state = State.OPERATIONAL
    else:
        return []
    if _can_be_in(state, seen, events, limits):
        return []
    return [Breach("NMT-07", f"{frame} means {state}, which no command explains")]


def _can_be_in(state: State, seen: Seen, events: Sequence[_Event], limits: Limits) -> bool:
    """Whether the node can have been in `state` at some instant of the frame's request."""
    booted = False
    for event in reversed(events):
        if event.command is None:
            if state is State.PRE_OPERATIONAL:
                return True
            booted = True
        elif event.latest > seen.wanted.latest:
            continue
        elif LEADS_TO[event.command] is state and (not booted or not event.sure):
            return True
        elif event.sure and (booted or seen.wanted.earliest > event.latest + limits.command_ns):
            # It has acted. What was before it explains nothing any more.
            return False
    return state is State.PRE_OPERATIONAL
