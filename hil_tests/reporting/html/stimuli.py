"""What the bench did and noted, in words; see `hil_tests.bench.chronicle` for the verbs."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from hil_tests.clock import show_span
from hil_tests.reporting import journal
from hil_tests.reporting.html.facts import fact, table_of, words
from hil_tests.trace import Moment

Detail = Mapping[str, Any]


def told(moment: Moment) -> str:
    """A stimulus or a note of the bench in one line; whatever its detail holds."""
    teller = _TOLD.get(moment.what)
    return teller(moment) if teller else journal.describe(moment)


def names_in(detail: Detail, key: str) -> str:
    """A list of names, joined; "" = none."""
    return ", ".join(words(detail, key))


def _setup(detail: Detail) -> str:
    """Parameters of the device."""
    setup = table_of(detail, "parameters")
    return ", ".join(f"{str(name).replace('_', ' ')} {value}" for name, value in setup.items())


def _begin(moment: Moment) -> str:
    setup = _setup(moment.detail)
    return "the test begins" + (f"; device: {setup}" if setup else "")


def _renew(moment: Moment) -> str:
    first = "a device without history" if moment.detail.get("fresh") else "the device, set anew"
    setup = _setup(moment.detail)
    off = ", without supply" if moment.detail.get("off") else ""
    return f"{first}{off}" + (f": {setup}" if setup else "")


def _end(moment: Moment) -> str:
    outcome = fact(moment.detail, "outcome")
    return f"the test ends: {outcome}" if isinstance(outcome, str) else "the test ends"


def _power(moment: Moment) -> str:
    detail = moment.detail
    if not detail.get("on"):
        return "supply off"
    held = names_in(detail, "held")
    mode = f", {detail['mode']} start" if detail.get("mode") else ""
    return f"supply on{mode}" + (f", keys held: {held}" if held else "")


def _keys(moment: Moment) -> str:
    held = names_in(moment.detail, "held")
    return f"keys held: {held}" if held else "keys released"


def _faults(moment: Moment) -> str:
    active = names_in(moment.detail, "active")
    return f"errors that exist: {active}" if active else "no error exists"


def _leds(moment: Moment) -> str:
    leds = table_of(moment.detail, "leds")
    return "LEDs read: " + ", ".join(f"{name} {light}" for name, light in leds.items())


def _lights(moment: Moment) -> str:
    edges = moment.detail.get("edges")
    count = len(edges) if isinstance(edges, list) else 0
    span = show_span(moment.ended_at - moment.began_at)
    return f"LEDs watched for {span}: {count} change{'s' * (count != 1)}"


def _load(moment: Moment) -> str:
    share = moment.detail.get("share_ppm")
    much = f" to {share / 10_000:g} %" if isinstance(share, int) else ""
    return f"another station loads the bus{much}"


def _late(moment: Moment) -> str:
    pairs = moment.detail.get("pairs")
    count = len(pairs) if isinstance(pairs, list) else 0
    return f"the host of the simulated device was late {count} time{'s' * (count != 1)}"


_TOLD: Mapping[str, Callable[[Moment], str]] = {
    "begin": _begin,
    "renew": _renew,
    "end": _end,
    "power": _power,
    "keys": _keys,
    "faults": _faults,
    "leds": _leds,
    "lights": _lights,
    "bitrate": lambda moment: f"the tester's bit rate is {moment.detail.get('bit_rate')} bit/s",
    "load": _load,
    "unload": lambda _: "the loading station falls silent",
    "disturb": lambda _: "an error frame is put on the bus",
    "refused": lambda moment: f"the adapter cannot send {moment.detail.get('frame')}",
    "wait": lambda moment: f"a wait ended {show_span(moment.ended_at - moment.began_at)} late",
    "late": _late,
}
