"""Power, keys, LEDs, bit rate and health through the bench control protocol.

When an action took effect: the server's own interval `at`, if its hello said that its
clock is the one that stamps the CAN frames, else between our request and its answer.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from decimal import Decimal
from itertools import pairwise
from typing import Generic, TypeVar

from hil_tests.bench.action import Action, LedEdges
from hil_tests.bench.drivers.peer import Answer, ControlSession
from hil_tests.clock import MS, Interval, S, show_span
from hil_tests.errors import ControlError

__all__ = [
    "ControlBitRate",
    "ControlFaults",
    "ControlHealth",
    "ControlKeys",
    "ControlLeds",
    "ControlPower",
    "ControlSession",
]

Result = TypeVar("Result")

_SLACK_NS = 10 * MS
"""How far an `at` may lie outside request and answer: servers round to milliseconds."""
_FLUSH_NS = 10 * MS
"""How soon to poll again while the peer has not read all of a request."""
_EYE_NS = 5 * S
"""How long judging blinking LEDs may take a server, beside the usual time-out."""
_MOST_LATE = 100_000
_LATEST_S = 10**11
_LIGHTS = ("off", "on", "blink")


class _Ask(Generic[Result]):
    """A request, and what its answer means (an `Action`).

    Args:
        session: the connection.
        request: what to send.
        read: makes the result of the answer and the interval from request to answer;
            returns None to ask once more.
        takes_ns: the time that the request itself takes.
    """

    def __init__(
        self,
        session: ControlSession,
        request: Mapping[str, object],
        read: Callable[[Answer, Interval], Result | None],
        takes_ns: int = 0,
    ) -> None:
        self._session = session
        self._request = request
        self._read = read
        self._takes_ns = takes_ns
        self._ident = 0
        self._sent_at = 0
        self._limit_at = 0
        self._now = 0
        self._result: Result | None = None

    @property
    def descriptors(self) -> Sequence[int]:
        """The connection."""
        return (self._session.fileno(),)

    @property
    def wake_at(self) -> int:
        """The end of the time-out; sooner while the request is not out."""
        if self._session.unsent:
            return min(self._limit_at, self._now + _FLUSH_NS)
        return self._limit_at

    def start(self, now: int) -> None:
        """Send the request."""
        self._now = now
        self._send()

    def _send(self) -> None:
        self._sent_at = self._session.clock()
        self._limit_at = self._sent_at + self._session.timeout_ns + self._takes_ns
        self._ident = self._session.send(self._request)

    def poll(self, now: int) -> bool:
        """Look whether the answer is there."""
        self._now = now
        answer = self._session.take(self._ident)
        if answer is None:
            if now >= self._limit_at:
                self._session.stalled(self._ident)
            return False
        if "refused" in answer:
            raise ControlError(f"control server {self._session.address} {answer['refused']}")
        # The clock is read again: the answer may have come after the caller's `now`.
        result = self._read(answer, Interval(self._sent_at, self._session.clock()))
        if result is None:
            self._send()
            return False
        self._result = result
        return True

    def result(self) -> Result:
        """What came of it."""
        assert self._result is not None
        return self._result


class _Facility:
    """What the facilities share: reading times out of answers."""

    def __init__(self, session: ControlSession, *needs: str) -> None:
        session.require(*needs)
        self._session = session

    def _when(self, answer: Answer, asked: Interval) -> Interval:
        """The interval in which an action took effect."""
        if "at" not in answer or not self._session.same_clock:
            return asked
        return self._interval(answer["at"], asked, answer)

    def _interval(self, value: object, asked: Interval, answer: Answer) -> Interval:
        if not isinstance(value, list) or len(value) != 2:
            raise self._session.broke(f"at {value!r:.80} is no [began, ended]", answer)
        began, ended = (self._instant(item, asked, answer) for item in value)
        if ended < began:
            raise self._session.broke(f"at {value!r:.80} ends before it begins", answer)
        return Interval(began, ended)

    def _instant(self, value: object, asked: Interval, answer: Answer) -> int:
        """A time of the answer, which must lie between request and answer."""
        at = _ns(value)
        if at is None:
            raise self._session.broke(f"{value!r:.80} is no time in seconds", answer)
        off = max(asked.earliest - at, at - asked.latest)
        if off > _SLACK_NS:
            side = "before the request" if at < asked.earliest else "after the answer"
            raise self._session.broke(
                f"the time {value} lies {show_span(off)} {side}, yet its hello says clock "
                "'same' (CLOCK_REALTIME of the host that captures),",
                answer,
            )
        return at


class ControlPower(_Facility):
    """Supply of the device."""

    def __init__(self, session: ControlSession) -> None:
        super().__init__(session, "power")

    def switch(self, on: bool) -> Action[Interval]:
        """Supply on or off."""
        return _Ask(self._session, {"do": "power", "on": on}, self._when)


class ControlKeys(_Facility):
    """Keys of the device."""

    def __init__(self, session: ControlSession) -> None:
        super().__init__(session, "keys")
        self.timed_sequences = "key-sequences" in session.can

    def hold(self, held: frozenset[str]) -> Action[Interval]:
        """From now on exactly these keys are held."""
        return _Ask(self._session, {"do": "keys", "held": sorted(held)}, self._when)

    def sequence(self, steps: Sequence[tuple[int, frozenset[str]]]) -> Action[Sequence[Interval]]:
        """Timed sets of held keys; one interval a step."""
        self._session.require("key-sequences")
        wanted = [[span_ns / S, sorted(held)] for span_ns, held in steps]
        spans = [span_ns for span_ns, _ in steps]
        takes_ns = max(spans, default=0)

        def read(answer: Answer, asked: Interval) -> Sequence[Interval]:
            return self._steps(answer, asked, spans)

        return _Ask(self._session, {"do": "keys", "sequence": wanted}, read, takes_ns)

    def _steps(self, answer: Answer, asked: Interval, spans: Sequence[int]) -> Sequence[Interval]:
        """One interval a step; without a common clock all that is known is the order."""
        if "at" not in answer or not self._session.same_clock:
            # The first step came after the request and, if the server answered once it was
            # through, so long before the answer as the whole sequence takes.
            first = asked.latest - max(spans, default=0)
            if first < asked.earliest:
                first = asked.latest
            return [Interval(asked.earliest + span, first + span) for span in spans]
        at = answer["at"]
        if not isinstance(at, list) or len(at) != len(spans):
            raise self._session.broke(f"at is no list of {len(spans)} intervals", answer)
        found = [self._interval(item, asked, answer) for item in at]
        for earlier, later in pairwise(found):
            if later.latest < earlier.earliest:
                raise self._session.broke("the steps of at go back in time", answer)
        return found


class ControlFaults(_Facility):
    """Errors of the device."""

    def __init__(self, session: ControlSession) -> None:
        super().__init__(session, "faults")

    def fail(self, active: frozenset[str]) -> Action[Interval]:
        """From now on exactly these errors exist."""
        return _Ask(self._session, {"do": "faults", "active": sorted(active)}, self._when)


class ControlLeds(_Facility):
    """LEDs of the device.

    Args:
        session: the connection.
        names: the LEDs that the profile has.
    """

    def __init__(self, session: ControlSession, names: Sequence[str]) -> None:
        super().__init__(session, "leds")
        self._names = tuple(names)
        # An edge without a clock in common with the frames says nothing of its time.
        self.sees_edges = "led-edges" in session.can and session.same_clock

    def read(self) -> Action[Mapping[str, str]]:
        """Off, on or blink for each LED."""
        return _Ask(self._session, {"do": "leds"}, self._lights, _EYE_NS)

    def watch(self, for_ns: int) -> Action[LedEdges]:
        """Every edge in the coming span."""
        self._session.require("led-edges")

        def read(answer: Answer, asked: Interval) -> LedEdges:
            return self._edges(answer, asked, for_ns)

        return _Ask(self._session, {"do": "leds", "for": for_ns / S}, read, for_ns)

    def _lights(self, answer: Answer, _: Interval) -> Mapping[str, str]:
        found = self._each_led(answer, "leds")
        lights: dict[str, str] = {}
        for name, light in found.items():
            if not isinstance(light, str) or light not in _LIGHTS:
                raise self._session.broke(f"LED {name!r} is {light!r:.80}", answer)
            lights[name] = light
        return lights

    def _each_led(self, answer: Answer, field: str) -> Mapping[str, object]:
        """A field that has exactly one entry for each LED."""
        found = answer.get(field)
        if not isinstance(found, dict):
            raise self._session.broke(f"no object {field!r}", answer)
        unknown = sorted(map(repr, found.keys() - set(self._names)))
        missing = sorted(set(self._names) - found.keys())
        if unknown or missing:
            raise self._session.broke(
                f"{field}: unknown LEDs {', '.join(unknown)[:80] or 'none'}, missing LEDs "
                f"{', '.join(missing) or 'none'} (names are the profile's)",
                answer,
            )
        return found

    def _edges(self, answer: Answer, asked: Interval, for_ns: int) -> LedEdges:
        start: dict[str, bool] = {}
        for name, lit in self._each_led(answer, "start").items():
            if not isinstance(lit, bool):
                raise self._session.broke(f"start of {name!r} is {lit!r:.80}", answer)
            start[name] = lit
        if asked.doubt_ns + _SLACK_NS < for_ns:
            raise self._session.broke(f"answer before the {show_span(for_ns)} were over", answer)
        # Without `at` the watch began somewhere between the request and the last moment
        # that leaves it its length: only what lies in all of these is surely covered.
        first = asked.latest - for_ns
        watched = Interval(first, max(asked.earliest + for_ns, first))
        if "at" in answer and self._session.same_clock:
            watched = self._interval(answer["at"], asked, answer)
        edges = answer.get("edges")
        if not isinstance(edges, list):
            raise self._session.broke("no list 'edges'", answer)
        return LedEdges(watched, start, self._each_edge(edges, start, asked, answer))

    def _each_edge(
        self, edges: list[object], start: Mapping[str, bool], asked: Interval, answer: Answer
    ) -> list[tuple[Interval, str, bool]]:
        """The edges: in order of time, each a change of a known LED."""
        lights = dict(start)
        found: list[tuple[Interval, str, bool]] = []
        for edge in edges:
            match edge:
                case [time, str(name), bool(lit)] if name in lights:
                    at = self._instant(time, asked, answer)
                case _:
                    raise self._session.broke(f"edge {edge!r:.80} is no [time, led, lit]", answer)
            if found and at < found[-1][0].earliest:
                raise self._session.broke(f"edge {edge!r:.80} goes back in time", answer)
            if lights[name] == lit:
                raise self._session.broke(f"edge {edge!r:.80} changes nothing", answer)
            lights[name] = lit
            found.append((Interval(at, at), name, lit))
        return found


class ControlBitRate(_Facility):
    """Tells a simulated device at what rate the tester's interface runs."""

    def __init__(self, session: ControlSession) -> None:
        super().__init__(session, "bus")

    def set(self, bit_rate: int) -> Action[Interval]:
        """Run at `bit_rate` bit/s from now on."""
        return _Ask(self._session, {"do": "bus", "bitrate": bit_rate}, self._when)


class ControlHealth(_Facility):
    """Asks the host of a model how late it was."""

    about = "told by the simulated device's host"

    def __init__(self, session: ControlSession) -> None:
        super().__init__(session, "health")

    def late(self) -> Action[Sequence[tuple[int, int]]]:
        """Pairs (due, sent) in ns since the last call."""
        pairs: list[tuple[int, int]] = []

        def read(answer: Answer, _: Interval) -> Sequence[tuple[int, int]] | None:
            pairs.extend(self._pairs(answer))
            if len(pairs) > _MOST_LATE:
                raise self._session.broke(f"more than {_MOST_LATE} late frames", answer)
            # A hosted model of ours sends what does not fit a line in further ones.
            return None if answer.get("more") is True and answer["late"] else pairs

        return _Ask(self._session, {"do": "health"}, read)

    def _pairs(self, answer: Answer) -> list[tuple[int, int]]:
        late = answer.get("late")
        if not isinstance(late, list):
            raise self._session.broke("no list 'late'", answer)
        found = []
        for pair in late:
            instants = [_ns(item) for item in pair] if isinstance(pair, list) else []
            match instants:
                case [int(due), int(sent)] if due <= sent:
                    found.append((due, sent))
                case _:
                    raise self._session.broke(f"late {pair!r:.80} is no [due, sent]", answer)
        return found


def _ns(value: object) -> int | None:
    """A JSON number of seconds since 1970 in ns; None where it is none."""
    if isinstance(value, bool) or not isinstance(value, int | Decimal):
        return None
    # The range first: the exponent of a hostile number may be enormous.
    return round(value * S) if 0 <= value < _LATEST_S else None
