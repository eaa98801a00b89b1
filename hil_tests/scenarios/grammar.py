"""How scenarios are made up: a row of small numbers is a scenario, whatever the numbers are.

One grammar serves seeded walks (numbers from a generator), Hypothesis (numbers that it draws
and shrinks) and its state machine. A number picks an action and a span of its family's
tables; the grammar keeps what follows sensible: which keys are held, whether there is power.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache

from hil_tests.clock import MS
from hil_tests.judge.cobs import LED_STEADY
from hil_tests.judge.echoes import NODE_IDS, SIZE
from hil_tests.scenarios.families import FAMILIES, LONG_SPANS, REQUESTS
from hil_tests.scenarios.noise import NOISE
from hil_tests.scenarios.scenario import Scenario, Step
from hil_tests.scenarios.values import MANY, TALLIES, beats_span_ns, key_span_ns, value

BOTH = 0b11
"""The commissioning keys."""

STORED_MS = (502, 610)
"""Store time, and at most a period of the echo."""

OFF_MS = 300
CYCLE_MS = 200
"""The supply is off between two lives for so long, at least (default profile)."""

PAUSE_NS = 150 * MS
LINGER_NS = 70_000 * MS


_step = lru_cache(maxsize=4096)(Step)
"""Walks take the same steps again and again."""

_FLOOD = [_step(0, "send", frame.removeprefix("send ")) for frame in NOISE]


class Teller:
    """Turns actions into steps, keeping in mind what is held and whether there is power."""

    def __init__(self, number: int, *, powered: bool) -> None:
        self._number = number
        self.steps: list[Step] = []
        self._held = 0
        self._powered = powered
        self._waiting = False
        """Powered up to be commissioned."""
        self._asked_for = 0
        """The node id of the first request since then that has a valid one; 0 = none."""

    def tell(self, after_ns: int, action: str) -> None:
        """One action, `after_ns` after the one before."""
        verb, _, what = action.partition(" ")
        if verb in self.ACTIONS:
            self.ACTIONS[verb](self, after_ns, what)
        else:
            self._add(after_ns, verb, what)

    def _nmt(self, after_ns: int, what: str) -> None:
        """No reset with the commissioning keys held: its outcome is the maker's (COM-28)."""
        left_open = self._held & BOTH == BOTH and not self._waiting
        if not (left_open and what.startswith("reset")):
            self._add(after_ns, "nmt", what)

    def _add(self, after_ns: int, verb: str, what: str = "") -> None:
        self.steps.append(_step(after_ns, verb, what))

    def _keys(self, after_ns: int, held: int) -> None:
        if held != self._held:
            self._held = held
            self._add(after_ns, "keys", f"{held:b}")

    def _flip(self, after_ns: int, what: str) -> None:
        self._keys(after_ns, self._held ^ int(what, 2))

    def _switch(self, after_ns: int, *, on: bool) -> None:
        if on != self._powered:
            self._powered = on
            self._waiting = on and self._held == BOTH
            self._asked_for = 0
            self._add(after_ns, "power", "on" if on else "off")

    def _cycle(self, after_ns: int, _: str) -> None:
        """Power off and on again; with both commissioning keys and more, without the more."""
        if self._powered:
            self._switch(after_ns, on=False)
        if self._held & BOTH == BOTH:
            self._keys(0, 0)
        self._switch(CYCLE_MS * MS, on=True)

    def _wait_mode(self, after_ns: int, _: str) -> None:
        """Power up with the commissioning keys held."""
        self._switch(after_ns, on=False)
        self._keys(0, BOTH)
        self._switch(OFF_MS * MS, on=True)

    def _any_long_span(self, after_ns: int, _: str) -> None:
        """Commissioned to the long times whose turn it is."""
        self.tell(after_ns, LONG_SPANS[self._number % len(LONG_SPANS)])

    def _flood(self, after_ns: int, _: str) -> None:
        """Garbage without a pause."""
        self._add(after_ns, "wait")
        self.steps += _FLOOD

    def _linger(self, after_ns: int, _: str) -> None:
        """Longer than the longest heartbeat and debounce time."""
        self._add(LINGER_NS + after_ns, "wait")

    def _commission(self, after_ns: int, what: str) -> None:
        """The whole procedure, and a regular start."""
        self._wait_mode(after_ns, "")
        self._request(after_ns, REQUESTS[int(what)].partition(" ")[2])
        self._switch(STORED_MS[int(what) % 2] * MS, on=False)
        self._cycle(0, "")

    def _value(self, after_ns: int, what: str) -> None:
        """Commissioned to special values; then its heartbeat, a press and a release."""
        request = value(int(what))
        self._wait_mode(after_ns, "")
        self._request(after_ns, request)
        self._switch(STORED_MS[int(what) % 2] * MS, on=False)
        self._cycle(0, "")
        self._add(after_ns, "nmt", "start")
        self._add(beats_span_ns(request), "wait")
        for _ in range(2):
            self._flip(after_ns, "100")
            self._add(key_span_ns(request), "wait")

    def _again(self, after_ns: int, what: str) -> None:
        """The same, or the same in turn, many times."""
        acts = TALLIES[int(what)]
        for index in range(MANY):
            self.tell(after_ns, acts[index % len(acts)])

    def _shine(self, after_ns: int, _: str) -> None:
        """LED frames for its old and its new node id, and looks at the LEDs before and after."""
        self._add(after_ns, "look")
        self._add(0, "look")
        self._add(0, "led", "FF")
        if self._asked_for:
            self._add(0, "send", f"{LED_STEADY + self._asked_for:03X}#FF")
        self._add(0, "look")

    def _any_request(self, after_ns: int, _: str) -> None:
        """The request whose turn it is."""
        self._add(after_ns, "request", REQUESTS[self._number % len(REQUESTS)].partition(" ")[2])

    def _cut(self, after_ns: int, what: str) -> None:
        """As `commission`, but power is cut while the device stores."""
        self._wait_mode(OFF_MS * MS, "")
        self._add(10 * MS, "request", REQUESTS[int(what)].partition(" ")[2])
        self._switch(after_ns, on=False)
        self._cycle(0, "")

    def _request(self, after_ns: int, what: str) -> None:
        """Only where somebody waits for it; elsewhere it is noise."""
        if self._waiting:
            self._asked_for = self._asked_for or _node_id(what)
            self._add(after_ns, "request", what)
        else:
            data = "" if what == "-" else what
            self._add(after_ns, "send", f"4F8#{data}")

    ACTIONS: Mapping[str, Callable[[Teller, int, str], None]] = {
        "again": _again,
        "any-long-span": _any_long_span,
        "any-request": _any_request,
        "commission": _commission,
        "cut": _cut,
        "cycle": _cycle,
        "flip": _flip,
        "flood": _flood,
        "linger": _linger,
        "nmt": _nmt,
        "request": _request,
        "shine": _shine,
        "value": _value,
        "wait-mode": _wait_mode,
    }
    """What needs a thought; every other action is a step as it stands."""


def _node_id(request: str) -> int:
    """The node id in the bytes of a 4F8h, in hex; 0 where it has no valid one."""
    node_id = int(request[:2], 16) if len(request) >= 2 * SIZE else 0
    return node_id if node_id in NODE_IDS else 0


def told(family: str, number: int, codes: Sequence[int]) -> Scenario:
    """The scenario that some numbers stand for.

    Args:
        family: a key of `FAMILIES`.
        number: which of the family's givens.
        codes: one for each action; any whole numbers.
    """
    kind = FAMILIES[family]
    given = kind.givens[number % len(kind.givens)]
    spans = kind.spans(dict(given))
    teller = Teller(number + sum(codes[:1]), powered=kind.begin != "off")
    for action in kind.opening:
        teller.tell(PAUSE_NS, action)
    for code in codes:
        action_number, at = divmod(code, len(spans))
        teller.tell(spans[at], kind.actions[action_number % len(kind.actions)])
    for action in kind.closing:
        teller.tell(PAUSE_NS, action)
    return Scenario(kind.begin, given, tuple(teller.steps))
