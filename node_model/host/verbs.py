"""The requests of the bench control protocol, version 1, done to a hosted node."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Mapping, Sequence

from node_model.host.jobs import KeySequence, LampEye, LampWatch
from node_model.host.jsonline import Seconds, span_ns
from node_model.host.loop import Job, Loop
from node_model.node import Panel, S

PROTOCOL = 1
CAN = ("power", "keys", "key-sequences", "leds", "led-edges", "bus", "health")
_LONGEST_WAIT_NS = 600 * S
_MOST_STEPS = 1000
_FASTEST = 1_000_000
"""bit/s of classical CAN."""
_LATE_A_LINE = 1200
"""Pairs of instants, 46 bytes each, that fit a line of 64 KiB."""

Request = Mapping[str, object]
Answer = dict[str, object]


class Refusal(Exception):
    """A request that cannot be done; the text is one sentence for the answer."""


class Verbs:
    """Carries out requests on the node of a loop."""

    def __init__(self, loop: Loop[Panel]) -> None:
        self._loop = loop
        self._verbs: dict[str, Callable[[Request], Answer | Job]] = {
            "hello": self._hello,
            "state": self._state,
            "power": self._power,
            "keys": self._keys,
            "leds": self._leds,
            "faults": self._faults,
            "bus": self._bus,
            "health": self._health,
            "bye": lambda _: {},
        }

    def __call__(self, request: Request) -> Answer | Job:
        """Do it, or start the job that does it.

        Raises:
            Refusal: what is wrong with the request.
        """
        name = request.get("do")
        verb = self._verbs.get(name) if isinstance(name, str) else None
        if verb is None:
            known = ", ".join(self._verbs)
            raise Refusal(f"unknown do {_short(name)}; this server knows {known}")
        done = verb(request)
        if not isinstance(done, dict):
            self._loop.job = done
        return done

    def release(self) -> None:
        """The job is over, or nobody waits for it any more."""
        self._loop.job = None

    def _hello(self, request: Request) -> Answer:
        protocol = request.get("protocol")
        if protocol != PROTOCOL or isinstance(protocol, bool):
            raise Refusal(f"protocol {_short(protocol)} is not spoken here, only {PROTOCOL}")
        node = self._loop.node
        can = [*CAN, "faults"] if node.faults else list(CAN)
        return {"protocol": PROTOCOL, "device": node.name, "can": can, "clock": "same"}

    def _state(self, _: Request) -> Answer:
        loop = self._loop
        held = [key for key in loop.node.keys if key in loop.held]
        answer: Answer = {"power": loop.node.powered, "held": held}
        if loop.tester_rate is not None:
            answer["bus"] = loop.tester_rate
        return answer

    def _power(self, request: Request) -> Answer:
        on = request.get("on")
        if not isinstance(on, bool):
            raise Refusal(f"power needs on: true or false, not {_short(on)}")
        at = self._loop.instant()
        self._loop.power(on, at)
        return self._by_now(at)

    def _keys(self, request: Request) -> Answer | Job:
        if ("held" in request) == ("sequence" in request):
            raise Refusal("keys needs either held or sequence")
        if "sequence" in request:
            steps = self._steps(request["sequence"])
            return KeySequence(self._loop, self._loop.instant(), steps)
        held = _names(request["held"], "key", self._loop.node.keys)
        at = self._loop.instant()
        self._loop.hold(held, at)
        return _done(at)

    def _faults(self, request: Request) -> Answer:
        active = _names(request.get("active"), "fault", self._loop.node.faults)
        at = self._loop.instant()
        self._loop.fail(active, at)
        return _done(at)

    def _steps(self, value: object) -> list[tuple[int, frozenset[str]]]:
        if not isinstance(value, list) or not 1 <= len(value) <= _MOST_STEPS:
            raise Refusal(f"sequence is a list of 1 to {_MOST_STEPS} steps")
        steps: list[tuple[int, frozenset[str]]] = []
        for step in value:
            if not isinstance(step, list) or len(step) != 2:
                raise Refusal(f"a step is [seconds, [names]], not {_short(step)}")
            span = span_ns(step[0], _LONGEST_WAIT_NS)
            if span is None:
                raise Refusal(f"{_short(step[0])} is no time of 0 to 600 s")
            if steps and span < steps[-1][0]:
                raise Refusal("the steps of a sequence go forward in time")
            steps.append((span, _names(step[1], "key", self._loop.node.keys)))
        first = steps[0][0]
        return [(span - first, held) for span, held in steps]

    def _leds(self, request: Request) -> Answer | Job:
        if "for" not in request:
            return LampEye(self._loop, self._loop.instant())
        span = span_ns(request["for"], _LONGEST_WAIT_NS)
        if not span:
            raise Refusal(f"for is a time above 0 and up to 600 s, not {_short(request['for'])}")
        return LampWatch(self._loop, self._loop.instant(), span)

    def _bus(self, request: Request) -> Answer:
        rate = request.get("bitrate")
        if isinstance(rate, bool) or not isinstance(rate, int) or not 0 < rate <= _FASTEST:
            raise Refusal(f"bitrate is 1 to {_FASTEST} bit/s, not {_short(rate)}")
        at = self._loop.instant()
        self._loop.tester_rate = rate
        return self._by_now(at)

    def _by_now(self, at: int) -> Answer:
        """It took effect between that instant and now.

        A frame that was due just before is sent, and stamped, while the host catches up: a
        silence that began at `at` to the nanosecond would be held against the node.
        """
        return {"at": (Seconds(at), Seconds(max(at, self._loop.clock())))}

    def _health(self, _: Request) -> Answer:
        """What was late since the last call; `more` where it did not fit one line."""
        self._loop.instant()  # what was due by now is sent, late or not
        late = self._loop.late
        count = min(len(late), _LATE_A_LINE)
        pairs = [tuple(map(Seconds, late.popleft())) for _ in range(count)]
        return {"late": pairs, "more": True} if late else {"late": pairs}


def _names(value: object, what: str, known: Sequence[str]) -> frozenset[str]:
    """Names out of those that the device has."""
    if not isinstance(value, list) or not all(isinstance(name, str) for name in value):
        raise Refusal(f"{what}s are a list of names, not {_short(value)}")
    for name in value:
        if name not in known:
            near = difflib.get_close_matches(name, known, 3) or known or ("none",)
            raise Refusal(f"no {what} {_short(name)}; it has {', '.join(near)}")
    return frozenset(value)


def _done(at: int) -> Answer:
    """The node felt it at exactly that instant: the host decides it."""
    return {"at": (Seconds(at), Seconds(at))}


def _short(value: object) -> str:
    return repr(value)[:80]
