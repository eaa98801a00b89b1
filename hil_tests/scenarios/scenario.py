"""A scenario: timed steps as plain data, the same in every run and on every bench.

Its text is one line that can be printed, pasted, stored and played again:

    operational debounce=2 heartbeat_ms=50: 20ms keys 1; 188ms keys 0; 5ms nmt stop all

What it begins with, what the device is commissioned to, and then each step: how long after
the one before, the verb, and what it acts on.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from typing import NamedTuple

from hil_tests.api import cobs
from hil_tests.clock import MS, US, S, parse_span
from hil_tests.scenarios import words
from hil_tests.scenarios.words import WORDS, Word

BEGINNINGS = ("off", "pre-operational", "operational")
"""Without power; just booted; just operational, its first key frame seen. No key is held."""

GIVEN = {
    "node_id": range(1, 16),
    "bit_rate_code": range(256),
    "heartbeat_ms": range(65536),
    "sync_time": range(256),
    "debounce": range(256),
}
"""What a device can be commissioned to, as the frame 4F8h carries it."""

LONGEST_NS = 3600 * S
"""A step waits at most an hour."""


class Step(NamedTuple):
    """One thing that is done.

    Args:
        after_ns: since the step before, or since the scenario began.
        verb: a key of `words.WORDS`.
        what: on what, as text.
    """

    after_ns: int
    verb: str
    what: str = ""

    def __str__(self) -> str:
        return f"{_brief(self.after_ns)} {self.verb} {self.what}".rstrip()


@dataclass(frozen=True, slots=True, repr=False)
class Scenario:
    """What is done to a device, from a known beginning on.

    Args:
        begin: one of `BEGINNINGS`.
        given: what it is commissioned to, where that matters; names of `GIVEN`.
        steps: in order.
    """

    begin: str
    given: tuple[tuple[str, int], ...]
    steps: tuple[Step, ...]

    def __str__(self) -> str:
        given = "".join(f" {name}={value}" for name, value in self.given)
        return f"{self.begin}{given}: {'; '.join(map(str, self.steps))}".rstrip()

    def __repr__(self) -> str:
        """As it can be pasted into a test."""
        return f"scenario({str(self)!r})"

    @property
    def span_ns(self) -> int:
        """How long its steps take, without what the device itself takes to start."""
        watches = sum(words.watched(step.what) for step in self.steps if step.verb == "watch")
        return sum(step.after_ns for step in self.steps) + watches

    @property
    def parameters(self) -> Mapping[str, int]:
        """What the device is commissioned to, by name."""
        return dict(self.given)

    @property
    def needs(self) -> frozenset[str]:
        """Facilities that a bench must have for it, by the names of the fixtures."""
        verbs = {step.verb for step in self.steps}
        needs = {name for verb in verbs for name in WORDS[verb].needs}
        return frozenset(needs | ({"power"} if self.begin == "off" else set()))

    @property
    def writes(self) -> bool:
        """Whether it may change what the device has stored; a faulty one may take any 4F8h."""
        return any(
            WORDS[verb].writes
            or (verb == "send" and words.sent(what).frame.can_id == cobs.COMMISSION)
            for _, verb, what in self.steps
        )

    @property
    def disturbs(self) -> bool:
        """Whether it would disturb others on the bus: garbage, load, commands to other nodes."""
        return any(
            WORDS[verb].exclusive or (verb == "nmt" and words.command(what).to != "own")
            for _, verb, what in self.steps
        )

    def pulses(self) -> Iterator[int]:
        """How long each key stayed pressed or released between two edges, in ns."""
        began: dict[int, int] = {}
        now = held = 0
        for span, verb, what in self.steps:
            now += span
            if verb != "keys":
                continue
            moved, held = int(what, 2) ^ held, int(what, 2)
            for bit in range(moved.bit_length()):
                if moved >> bit & 1:
                    if bit in began:
                        yield now - began[bit]
                    began[bit] = now


def scenario(text: str) -> Scenario:
    """The scenario that a line of text stands for.

    Raises:
        ValueError: it is none; names the step and what was meant.
    """
    head, colon, tail = text.strip().partition(":")
    if not colon:
        raise ValueError(f"a scenario is BEGINNING NAME=VALUE...: STEP; STEP..., not {text!r}")
    begin, *given = head.split() or [""]
    _known(begin, BEGINNINGS, "beginning")
    steps = [part for part in tail.split(";") if part.strip()]
    return Scenario(begin, tuple(_given(given)), tuple(map(_step, steps)))


def _given(parts: Iterable[str]) -> Iterator[tuple[str, int]]:
    for part in parts:
        name, _, value = part.partition("=")
        _known(name, GIVEN, "parameter")
        if not value.isdecimal() or int(value) not in GIVEN[name]:
            last = GIVEN[name][-1]
            raise ValueError(f"{part!r}: {name} is a number from {GIVEN[name][0]} to {last}")
        yield name, int(value)


def _step(text: str) -> Step:
    try:
        return _read_step(text)
    except ValueError as error:
        raise ValueError(f"step {text.strip()!r}: {error}") from None


def _read_step(text: str) -> Step:
    span, verb, *what = text.split(maxsplit=2)[:3] if len(text.split()) > 1 else (text, "")
    if not verb:
        raise ValueError("write when and what, e.g. 20ms keys 1")
    after_ns = parse_span(span)
    if after_ns > LONGEST_NS:
        raise ValueError("a step waits an hour at most")
    _known(verb, WORDS, "verb")
    argument = " ".join(what[0].split()) if what else ""
    _fits(WORDS[verb], argument)
    return Step(after_ns, verb, argument)


def _fits(word: Word, what: str) -> None:
    """Refuse what a verb cannot act on."""
    try:
        word.read(what)
    except (ValueError, KeyError, IndexError) as error:
        hint = f" ({error})" if isinstance(error, ValueError) and error.args else ""
        raise ValueError(f"write {word.form}{hint}") from None


def _known(name: str, names: Iterable[str], kind: str) -> None:
    if name not in (known := list(names)):
        near = get_close_matches(name, known) or known
        raise ValueError(f"unknown {kind} {name!r}; there is {', '.join(near)}")


def _brief(span_ns: int) -> str:
    """A span without a blank, exact: 20ms, 500us, 1s."""
    units = (("s", S), ("ms", MS), ("us", US), ("ns", 1))
    name, scale = next(unit for unit in units if not span_ns % unit[1])
    return f"{span_ns // scale}{name}" if span_ns else "0ms"
