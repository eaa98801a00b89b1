"""What the LEDs may show after the frames that were sent (LED-01..04, LED-06, LED-20..22).

A pure function of the whole story: it carries the set of all pairs of maps that the device
can hold, and asks of each look whether one of them explains what was seen. Where none does,
it asks which rule, if broken, would: that one is blamed, and what the source says only where
no other reading of it explains what was seen.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from enum import Enum
from itertools import combinations
from typing import NamedTuple, assert_never

from hil_tests.judge.verdict import Outcome, Verdict


class Chance(Enum):
    """Whether something acted on the device."""

    NO = 0
    PERHAPS = 1
    SURE = 2


class Write(NamedTuple):
    """A frame with one of the two maps.

    Args:
        blink: the map of blinking LEDs, else that of steady ones.
        data: its bytes.
        acts: the device was operational.
    """

    blink: bool
    data: bytes
    acts: Chance


class Leave(NamedTuple):
    """The device has left operational, or perhaps has."""


class Restart(NamedTuple):
    """The device was reset, or switched on."""

    acts: Chance = Chance.SURE


class Look(NamedTuple):
    """What was seen.

    Args:
        at: until when, ns.
        lights: "on", "off" or "blink" for each LED.
        operational: it surely was.
    """

    at: int
    lights: Mapping[str, str]
    operational: bool


Event = Write | Leave | Restart | Look
Maps = tuple[int, int]
"""Steady and blinking LEDs, as bits."""

DARK: Maps = (0, 0)


class Broken(Enum):
    """One way to break a rule, which may explain a look."""

    SHORT_TAKEN = "LED-06"
    LONG_REFUSED = "LED-06 "
    KEPT_OVER_RESET = "LED-21"
    LIT_AFTER_RESET = "LED-21 "
    OTHER_WINS = "LED-20"
    TAKEN_OUTSIDE = "LED-04"
    STEADY_CLEARS_BLINK = "LED-03"
    BLINK_CLEARS_STEADY = "LED-03 "
    STEADY_TAKES_FROM_BLINK = "LED-03  "
    BLINK_TAKES_FROM_STEADY = "LED-03   "

    @property
    def requirement(self) -> str:
        """The rule that is broken."""
        return self.value.rstrip()


Ways = frozenset[Broken]
"""Broken together; none = the device is right."""

_READINGS = (
    Broken.SHORT_TAKEN,
    Broken.LONG_REFUSED,
    Broken.KEPT_OVER_RESET,
    Broken.LIT_AFTER_RESET,
    Broken.OTHER_WINS,
)
"""Where our own reading of the source may not be the device's, in one thing or in several."""

_SUSPECTS: tuple[Ways, ...] = (
    *(
        frozenset(ways)
        for count in range(1, len(_READINGS) + 1)
        for ways in combinations(_READINGS, count)
    ),
    *(frozenset((broken,)) for broken in Broken if broken not in _READINGS),
)
"""In the order in which they are tried: what the source itself says is broken last."""

_CROSSED: Mapping[Broken, tuple[bool, bool]] = {
    Broken.STEADY_CLEARS_BLINK: (False, True),
    Broken.BLINK_CLEARS_STEADY: (True, True),
    Broken.STEADY_TAKES_FROM_BLINK: (False, False),
    Broken.BLINK_TAKES_FROM_STEADY: (True, False),
}
"""Writing which map (True = blinking) touches the other: all of it (True), or the bits set."""


class LightRules(NamedTuple):
    """Facts of a device.

    Args:
        leds: bit by name.
        size: bytes of a map.
        steady_wins: where both bits of an LED are set; else blinking does (LED-20).
    """

    leds: Mapping[str, int]
    size: int
    steady_wins: bool = True


def judge_lights(events: Sequence[Event], rules: LightRules) -> Iterator[Verdict]:
    """The first look that nothing explains."""
    for at, lights in _unexplained(events, rules, frozenset()):
        name = _explained(events, rules, at) or _plain(events, at, lights, rules)
        shown = ", ".join(f"{led} {light}" for led, light in lights.items() if light != "off")
        text = f"the LEDs show {shown or 'nothing'}, which no LED frame explains"
        yield Verdict(name, Outcome.FAIL, text, at=at)
        return


def _explained(events: Sequence[Event], rules: LightRules, at: int) -> str:
    """The rule that, if broken, explains every look, or else that one; "" = none does."""
    wrong = {ways: [look for look, _ in _unexplained(events, rules, ways)] for ways in _SUSPECTS}
    whole = (ways for ways in _SUSPECTS if not wrong[ways])
    first = (ways for ways in _SUSPECTS if at not in wrong[ways])
    found = next(whole, None) or next(first, frozenset())
    return next((broken.requirement for broken in Broken if broken in found), "")


def _plain(events: Sequence[Event], at: int, lights: Mapping[str, str], rules: LightRules) -> str:
    """LED-01 or LED-02: on which map the nearest explanation differs from the look."""
    possible = next(maps for look, maps in _carried(events, rules, frozenset()) if look.at == at)
    wants = [_lights(maps, rules, frozenset()) for maps in possible]
    nearest = min(wants, key=lambda want: sum(want[led] != lights.get(led) for led in want))
    differ = [
        (nearest[led], lights.get(led)) for led in nearest if nearest[led] != lights.get(led)
    ]
    return "LED-02" if all("blink" in pair for pair in differ) else "LED-01"


def _unexplained(
    events: Sequence[Event], rules: LightRules, broken: Ways
) -> Iterator[tuple[int, Mapping[str, str]]]:
    """The looks that no possible pair of maps explains, with some rules broken."""
    for look, possible in _carried(events, rules, broken):
        shown = [_lights(maps, rules, broken) for maps in possible]
        if not look.operational:
            shown.append(_lights(DARK, rules, broken))  # LED-22
        if look.lights not in shown:
            yield look.at, look.lights


def _carried(
    events: Sequence[Event], rules: LightRules, broken: Ways
) -> Iterator[tuple[Look, frozenset[Maps]]]:
    """Each look with every pair of maps that the device can hold then."""
    possible = frozenset((DARK,))
    for event in events:
        match event:
            case Look():
                yield event, possible
            case Write():
                possible = _written(possible, event, rules, broken)
            case Leave():
                possible |= {DARK}  # LED-22: what it keeps is its own choice
            case Restart(acts):
                kept = (
                    possible
                    if Broken.KEPT_OVER_RESET in broken or acts is not Chance.SURE
                    else frozenset()
                )
                lit = Broken.LIT_AFTER_RESET in broken
                possible = kept | {(_every(rules), 0) if lit else DARK}
            case _:
                assert_never(event)


def _written(
    possible: frozenset[Maps], write: Write, rules: LightRules, broken: Ways
) -> frozenset[Maps]:
    size = len(write.data)
    if size < rules.size and Broken.SHORT_TAKEN not in broken:
        return possible
    if size > rules.size and Broken.LONG_REFUSED in broken:
        return possible
    if write.acts is Chance.NO and Broken.TAKEN_OUTSIDE not in broken:
        return possible
    new = int.from_bytes(write.data[: rules.size], "little") & _every(rules)
    after = frozenset(_changed(maps, new, blink=write.blink, broken=broken) for maps in possible)
    return after if write.acts is not Chance.PERHAPS else after | possible


def _every(rules: LightRules) -> int:
    """The map of all LEDs."""
    return sum(1 << bit for bit in rules.leds.values())


def _changed(maps: Maps, new: int, *, blink: bool, broken: Ways) -> Maps:
    other = maps[0] if blink else maps[1]
    for crossed in (_CROSSED[each] for each in broken if each in _CROSSED):
        if crossed[0] is blink:
            other = 0 if crossed[1] else other & ~new
    return (other, new) if blink else (new, other)


def _lights(maps: Maps, rules: LightRules, broken: Ways) -> dict[str, str]:
    """What a pair of maps looks like."""
    steady, blinking = maps
    if rules.steady_wins is not (Broken.OTHER_WINS in broken):
        blinking &= ~steady
    else:
        steady &= ~blinking
    return {
        name: "on" if steady >> bit & 1 else "blink" if blinking >> bit & 1 else "off"
        for name, bit in rules.leds.items()
    }
