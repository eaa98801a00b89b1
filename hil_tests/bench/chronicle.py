"""What a bench writes into its record besides frames, so that the record alone can be judged.

Each note is a `Moment`, in its place among the frames. Together with "power", "keys",
"faults", "bitrate" and "leds", which the facilities write, these are all the verbs of a record:

- "begin", first of all: what the bench is, and how it stands when the test begins;
- "renew": another device is there now, or this one has other parameters;
- "lights": every change of light that was seen in a stretch of time;
- "load", "unload", "disturb": what another station did on the bus;
- "refused": a frame that the adapter has no way to send;
- "wait": a wait that ended late, in real time; "late": what the host of a model kept back;
- "end", last of all: when nobody looked any more.

Expectations and verdicts are a `Mark` each: they say what was made of the record. So is what the
clock showed when a test read it, in real time.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from typing import TYPE_CHECKING, cast

import attrs

from hil_tests.clock import Interval
from hil_tests.judge.verdict import Limits, Verdict
from hil_tests.trace import Mark, Moment
from node_model.frame import Frame

if TYPE_CHECKING:
    from hil_tests.bench.action import LedEdges
    from hil_tests.bench.core import BenchCore
    from hil_tests.config import Setup

CLOCK = "clock"
"""Kind of a mark: see `reading`."""

FACILITIES = ("power", "keys", "leds", "faults", "bitrate")


def opening(bench: BenchCore) -> Moment:
    """How a bench stands when a test begins."""
    stage, port = bench.stage, bench.stage.port
    detail: dict[str, object] = {
        "bench": stage.name,
        "port": {
            "name": port.name,
            "timed": port.timed,
            "clock": port.clock,
            "doubt_ns": port.doubt_ns,
        },
        "virtual": stage.virtual,
        "exclusive": stage.exclusive,
        "writes_allowed": stage.writes_allowed,
        "fades": stage.fades,
        "bit_rate": stage.bit_rate,
        "facilities": [name for name in FACILITIES if getattr(stage, name)],
        "timed_sequences": bool(stage.keys and stage.keys.timed_sequences),
        "sees_edges": bool(stage.leds and stage.leds.sees_edges),
        "health": stage.health is not None,
        "parameters": plain(bench.parameters),
        "home": plain(bench.home),
        "held": sorted(bench.held),
        "active": sorted(bench.faults.active) if bench.faults else [],
        "power": bench.power.standing() if bench.power else None,
        "heard": bench.heard_at_all,
    }
    now = port.now()
    return Moment("begin", now, now, detail)


def plain(parameters: Setup | None) -> dict[str, object] | None:
    """Setup of a device by name; None = not known."""
    if parameters is None:
        return None
    return {name: getattr(parameters, name) for name in _names(type(parameters))}


@cache
def _names(kind: type) -> tuple[str, ...]:
    """What a setup of that kind holds."""
    return tuple(each.name for each in attrs.fields(cast("type[attrs.AttrsInstance]", kind)))


def renewal(began_at: int, now: int, parameters: Setup, *, off: bool, fresh: bool) -> Moment:
    """From now on the device has these parameters.

    Args:
        began_at: up to then it had others.
        now: when it has these.
        parameters: what it is set to.
        off: it has no power.
        fresh: it is another device, which the stage has brought.
    """
    detail = {"parameters": plain(parameters), "off": off, "fresh": fresh}
    return Moment("renew", began_at, now, detail)


def lights(seen: LedEdges) -> Moment:
    """Every change of light in a stretch of time."""
    edges = [[when.earliest, when.latest, led, lit] for when, led, lit in seen.edges]
    detail = {"start": dict(seen.start), "edges": edges}
    return Moment("lights", seen.watched.earliest, seen.watched.latest, detail)


def loading(now: int, frames: Sequence[Frame], share_ppm: int) -> Moment:
    """Another station loads the bus."""
    return Moment("load", now, now, {"frames": list(map(str, frames)), "share_ppm": share_ppm})


def lateness(began_at: int, now: int, pairs: Iterable[tuple[int, int]]) -> Moment:
    """The host of a simulated device was late: pairs of due and sent."""
    return Moment("late", began_at, now, {"pairs": [list(pair) for pair in pairs]})


def mark_of(verdict: Verdict, now: int) -> Mark:
    """A verdict, at the instant to look at."""
    measured, limits = verdict.measured, verdict.limits
    data: dict[str, object] = {
        "kind": "verdict",
        "requirement": verdict.requirement,
        "outcome": verdict.outcome.value,
        "text": verdict.text,
        "measured_ns": list(measured) if measured else None,
        "limits_ns": _ends(limits) if limits else None,
        "cause_at": list(verdict.cause) if verdict.cause else None,
        "effect_at": list(verdict.effect) if verdict.effect else None,
    }
    return Mark(verdict.at if verdict.at is not None else now, str(verdict), data)


def reading(now: int) -> Mark:
    """What the clock showed to a test."""
    return Mark(now, "the clock is read", {"kind": CLOCK})


def expectation(now: int, text: str, since: Interval, limits: Limits, requirement: str) -> Mark:
    """What is waited for from now on, and from when its time counts."""
    data: Mapping[str, object] = {
        "kind": "expectation",
        "requirement": requirement,
        "since": list(since),
        "limits_ns": _ends(limits),
    }
    return Mark(now, text, data)


def _ends(limits: Limits) -> list[int | None]:
    return list(limits.ends)
