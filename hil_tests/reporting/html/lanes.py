"""The lanes of a bus timeline: one a COB-ID, and what was in force: supply, keys, LEDs, NMT state.

States are spans: from the instant at which something began to hold to the next change.
Instants are ns from the origin of the recording.
"""

from __future__ import annotations

from bisect import bisect_right
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

from hil_tests.reporting.html.facts import table_of
from hil_tests.reporting.html.recording import Recording
from hil_tests.reporting.html.stimuli import names_in, told
from hil_tests.trace import Moment
from node_model.frame import Frame

MOST_LANES = 24
"""Identifiers with a lane of their own; rarer ones share one."""
OTHERS = "other identifiers"
_MOST_SPANS = 4000
_MOST_NODES = 6
_CUTS = (" of ", " to ", " -> ", ":", " (", ",")
_STATES = {0: "boot-up", 4: "stopped", 5: "operational", 127: "pre-operational"}
"""Error control, CiA 301 4.2.0, 7.2.8.3.2."""
_CLASSES = {0: "boot", 4: "stopped", 5: "operational", 127: "pre"}

Span = tuple[int, int, str, str]
"""From, to, label, class of its colour."""


@dataclass(frozen=True, slots=True)
class Lanes:
    """Lanes of frames.

    Args:
        names: from top to bottom.
        of: identifier (an extended one negative) -> its lane.
    """

    names: list[str]
    of: Mapping[int, int]


def _key(frame: Frame) -> int:
    """An identifier, extended ones apart from the others."""
    return ~frame.can_id if frame.extended else frame.can_id


def lanes_of(recording: Recording, used: Mapping[int, int]) -> Lanes:
    """One lane for each identifier, by identifier; the rarest share one.

    Args:
        recording: whose frames they are.
        used: number of a kind -> how many frames of it there are.
    """
    kinds = recording.kinds.all
    count: Counter[int] = Counter()
    words: dict[int, dict[str, None]] = {}
    for number, frames in used.items():
        frame = kinds[number].frame
        key = _key(frame)
        count[key] += frames
        services = words.setdefault(key, {})
        if len(services) < 2:
            nmt = frame.can_id == 0 and not frame.extended
            services["NMT" if nmt else _short(recording.kinds.words(number))] = None
    chosen = sorted((key for key, _ in count.most_common(MOST_LANES)), key=lambda k: (k < 0, k))
    names = [f"{_identifier(key)}  {' / '.join(words[key])}" for key in chosen]
    of = {key: place for place, key in enumerate(chosen)}
    if len(count) > len(chosen):
        of |= {key: len(chosen) for key in count if key not in of}
        names.append(OTHERS)
    return Lanes(names, of)


def lane_of(lanes: Lanes, frame: Frame) -> int:
    """The lane of a frame."""
    return lanes.of[_key(frame)]


def _identifier(key: int) -> str:
    return f"{key:03X}" if key >= 0 else f"{~key:08X}"


@lru_cache(maxsize=4096)
def _short(text: str) -> str:
    """The service, without node, value and remarks."""
    for cut in _CUTS:
        text = text.partition(cut)[0]
    return text[:24]


def spans_of(
    recording: Recording, used: Iterable[int], origin_at: int, end_at: int
) -> list[tuple[str, list[Span]]]:
    """What was in force when: a lane each for supply, keys, LEDs, bit rate and NMT states."""
    moments = recording.moments()
    lanes = [
        (name, _spans(moments, what, reader, origin_at, end_at))
        for what, (name, reader) in _HELD.items()
    ]
    lanes += _lights(moments, origin_at)
    lanes += [
        (f"node {node}", spans)
        for node, spans in _states(recording, used, origin_at, end_at).items()
    ]
    return [(name, spans) for name, spans in lanes if spans]


def _held(moment: Moment) -> tuple[str, str]:
    return names_in(moment.detail, "held"), "held"


def _faults(moment: Moment) -> tuple[str, str]:
    return names_in(moment.detail, "active"), "stopped"


def _power(moment: Moment) -> tuple[str, str]:
    return ("on", "on") if moment.detail.get("on") else ("off", "off")


def _leds(moment: Moment) -> tuple[str, str]:
    leds = moment.detail.get("leds")
    if not isinstance(leds, Mapping):
        return "", "lit"
    lit = [
        f"{name}{' blinks' if light == 'blink' else ''}"
        for name, light in leds.items()
        if light != "off"
    ]
    return ", ".join(lit) or "all off", "lit"


def _rate(moment: Moment) -> tuple[str, str]:
    return f"{moment.detail.get('bit_rate')} bit/s", "rate"


_HELD: Mapping[str, tuple[str, Callable[[Moment], tuple[str, str]]]] = {
    "power": ("supply", _power),
    "keys": ("keys", _held),
    "faults": ("errors", _faults),
    "leds": ("LEDs", _leds),
    "bitrate": ("bit rate", _rate),
}


def other_moments(recording: Recording, origin_at: int) -> Iterator[tuple[int, str]]:
    """Stimuli that have no lane of their own."""
    for moment in recording.moments():
        if moment.what not in _HELD and moment.what != "lights":
            yield moment.began_at - origin_at, told(moment)


def _spans(
    moments: list[Moment],
    what: str,
    reader: Callable[[Moment], tuple[str, str]],
    origin_at: int,
    end_at: int,
) -> list[Span]:
    changes = [moment for moment in moments if moment.what == what][:_MOST_SPANS]
    ends = [moment.began_at for moment in changes[1:]]
    found = []
    for moment, until in zip(changes, [*ends, end_at], strict=False):
        label, class_ = reader(moment)
        if label:
            found.append((moment.began_at - origin_at, until - origin_at, label, class_))
    return found


def _lights(moments: Sequence[Moment], origin_at: int) -> list[tuple[str, list[Span]]]:
    """When each LED was lit, as far as it was watched."""
    found: dict[str, list[Span]] = {}
    for moment in moments:
        if moment.what == "lights":
            for led, start, stop in _lit(moment):
                span = (start - origin_at, stop - origin_at, "lit", "lit")
                found.setdefault(led, []).append(span)
    return [(f"LED {led}", spans[:_MOST_SPANS]) for led, spans in found.items()]


def _lit(moment: Moment) -> Iterator[tuple[str, int, int]]:
    """LED, and from when to when it was lit, within the stretch that was watched."""
    since = {led: moment.began_at for led, lit in table_of(moment.detail, "start").items() if lit}
    edges = moment.detail.get("edges")
    for edge in edges if isinstance(edges, list) else ():
        if not isinstance(edge, list) or len(edge) != 4 or not isinstance(edge[1], int):
            continue
        _, at, led, lit = edge
        if lit:
            since.setdefault(str(led), at)
        elif str(led) in since:
            yield str(led), since.pop(str(led)), at
    yield from ((led, start, moment.ended_at) for led, start in since.items())


def _states(
    recording: Recording, used: Iterable[int], origin_at: int, end_at: int
) -> dict[int, list[Span]]:
    """NMT state of each node as it told it itself, from one change to the next."""
    kinds = recording.kinds.all
    told_by = {
        number: (kinds[number].frame.can_id & 0x7F, kinds[number].frame.data[0] & 0x7F)
        for number in used
        if not kinds[number].own and _tells_state(kinds[number].frame)
    }
    changes: dict[int, list[tuple[int, int]]] = {}
    last: dict[int, int] = {}
    for at, number in zip(recording.at, recording.kind, strict=True):
        if number not in told_by:
            continue
        node, state = told_by[number]
        if last.get(node) != state:
            last[node] = state
            changes.setdefault(node, []).append((at, state))
    offs = sorted(
        m.began_at for m in recording.moments() if m.what == "power" and not m.detail.get("on")
    )
    return {
        node: _state_spans(changes[node][:_MOST_SPANS], offs, origin_at, end_at)
        for node in sorted(changes)[:_MOST_NODES]
    }


def _state_spans(
    changes: list[tuple[int, int]], offs: list[int], origin_at: int, end_at: int
) -> list[Span]:
    """A state holds until the next change, and not longer than the supply."""
    ends = [at for at, _ in changes[1:]] + [end_at]
    found = []
    for (at, state), until in zip(changes, ends, strict=True):
        off = bisect_right(offs, at)
        dark = min([until, *offs[off : off + 1]])
        label = _STATES.get(state, f"state {state:02X}h")
        class_ = _CLASSES.get(state, "strange")
        found.append((at - origin_at, dark - origin_at, label, class_))
    return found


def _tells_state(frame: Frame) -> bool:
    return (
        0x700 < frame.can_id < 0x780
        and not frame.extended
        and not frame.remote
        and len(frame.data) == 1
    )
