"""Checks of a control server, line by line: does it keep the control protocol, version 1?

Speaks to the server directly, because a session of the suite would refuse to go on after
the first answer that makes no sense. Each check is a generator of sentences: what is
wrong, and what to do. A check that yields nothing has passed.
"""

from __future__ import annotations

import json
import socket
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from hil_tests.errors import ControlError

TIMEOUT_S = 5.0
SLACK_S = 0.010
"""How far an `at` may lie outside request and answer: servers round to milliseconds."""
_EYE_S = 5.0
_LONG_LINE = 80 * 1024
_WATCH_S = 0.3
_STEPS_S = (0.0, 0.03, 0.06)
_LIGHTS = ("off", "on", "blink")

Answer = Mapping[str, Any]
Sentences = Iterator[str]


@dataclass
class Line:
    """A connection to a control server that takes down when each line went and came.

    Args:
        address: "tcp:HOST:PORT" or "unix:PATH".
    """

    address: str
    hello: Answer = field(default_factory=dict)
    sent_at: float = 0.0
    came_at: float = 0.0

    def __post_init__(self) -> None:
        kind, _, rest = self.address.partition(":")
        try:
            if kind == "unix":
                self._socket = _unix(rest)
            else:
                host, _, port = rest.rpartition(":")
                self._socket = socket.create_connection((host.strip("[]"), int(port)), TIMEOUT_S)
        except (OSError, ValueError) as error:
            raise ControlError(
                f"control server {self.address}: cannot connect ({error}); start it, or correct"
                " [control] address in the bench file"
            ) from None
        self._reader = self._socket.makefile("rb")
        self._last_id = 0

    def close(self) -> None:
        """Hang up."""
        self._reader.close()
        self._socket.close()

    @property
    def same_clock(self) -> bool:
        """The server says that its instants are on the clock of the frames."""
        return self.hello.get("clock") == "same"

    def send(self, data: bytes) -> None:
        """A line as it is."""
        self.sent_at = time.time()
        try:
            self._socket.sendall(data + b"\n")
        except OSError as error:
            raise ControlError(f"it hung up ({error})") from None

    def read(self, extra_s: float = 0.0) -> Answer:
        """The next answer.

        Raises:
            ControlError: none came in time, or it is no JSON object in a line.
        """
        self._socket.settimeout(TIMEOUT_S + extra_s)
        try:
            line = self._reader.readline()
        except OSError:
            raise ControlError(f"no answer within {TIMEOUT_S + extra_s:g} s") from None
        self.came_at = time.time()
        if not line.endswith(b"\n"):
            raise ControlError("it hung up instead of answering")
        try:
            answer = json.loads(line)
        except ValueError:
            raise ControlError(f"answered with no JSON: {line[:60]!r}") from None
        if not isinstance(answer, dict) or not isinstance(answer.get("ok"), bool):
            raise ControlError(f"answered {line[:60]!r}: an object with ok true or false is due")
        return answer

    def ask(self, do: str, extra_s: float = 0.0, **fields: object) -> Answer:
        """A request, and its answer, which must repeat its id."""
        self._last_id += 1
        self.send(json.dumps({"id": self._last_id, "do": do, **fields}).encode())
        answer = self.read(extra_s)
        if answer.get("id") != self._last_id:
            raise ControlError(
                f"answered {do}, id {self._last_id}, with id {answer.get('id')!r}: answers come in"
                " order and repeat the request's id"
            )
        return answer

    def must(self, do: str, extra_s: float = 0.0, **fields: object) -> Answer:
        """A request that must be granted."""
        answer = self.ask(do, extra_s, **fields)
        if answer["ok"] is not True:
            raise ControlError(f"refused {do} {fields}: {answer.get('error')!r}")
        return answer


def _unix(path: str) -> socket.socket:
    peer = socket.socket(socket.AF_UNIX)
    try:
        peer.settimeout(TIMEOUT_S)
        peer.connect(path)
    except OSError:
        peer.close()
        raise
    return peer


def hello(line: Line, declared: Sequence[str]) -> Sentences:
    """Hello names the protocol and what the server can; it can what the bench file declares."""
    answer = line.must("hello", protocol=1)
    line.hello = answer
    if answer.get("protocol") != 1:
        yield f"hello says protocol {answer.get('protocol')!r}; this suite speaks 1"
    if not isinstance(answer.get("device"), str):
        yield f"hello says device {answer.get('device')!r}; a text for people is due"
    can = answer.get("can")
    if not isinstance(can, list):
        yield f"hello says can {can!r}; a list of names is due"
        return
    needs = ["bus" if name == "bitrate" else name for name in declared]
    lacking = [name for name in needs if name not in can]
    if lacking:
        yield (
            f"hello lacks {', '.join(lacking)}, which the bench file declares; serve it, or remove"
            " the section"
        )


def goes_on(line: Line, what: str) -> Sentences:
    """A refused line leaves the session whole."""
    answer = line.read()
    if answer["ok"] is not False:
        yield f"{what} was answered ok true; it must be refused with ok false"
    elif not isinstance(answer.get("error"), str):
        yield f"the refusal of {what} says no error; one sentence is due"
    if line.ask("hello", protocol=1)["ok"] is not True:
        yield f"the session did not go on after {what}"


def garbage(line: Line) -> Sentences:
    """A malformed line, one that is no object and one that is too long are refused; it goes on."""
    for data, what in (
        (b"{power on, please", "a malformed line"),
        (b"[1, 2]", "a line that is no object"),
        (b'{"id": 900, "do": "dance"}', "an unknown do"),
        (b'{"id": 901}', "a request without do"),
        (b'{"id": 902, "do": "' + b"x" * _LONG_LINE + b'"}', "a line of 80 KiB"),
    ):
        line.send(data)
        yield from goes_on(line, what)


def order(line: Line) -> Sentences:
    """Two requests sent at once are answered in order."""
    line.send(
        b'{"id": 910, "do": "hello", "protocol": 1}\n{"id": 911, "do": "hello", "protocol": 1}'
    )
    ids = [line.read().get("id"), line.read().get("id")]
    if ids != [910, 911]:
        yield f"requests 910 and 911 were answered as {ids}; answer in order, with their ids"


def power(line: Line) -> Sentences:
    """On when on and off when off change nothing; each says when it happened."""
    for on in (True, True, False, False, True):
        answer = line.must("power", on=on)
        yield from _at(line, answer.get("at"), "power")
        state = line.ask("state")
        if state["ok"] and "power" in state and state["power"] is not on:
            yield f"state says power {state['power']} after power {on}"


def keys(line: Line, names: Sequence[str]) -> Sentences:
    """Every key of the profile can be held, alone and with all others; unknown ones cannot."""
    for held in (*([name] for name in names), list(names), []):
        answer = line.must("keys", held=held)
        yield from _at(line, answer.get("at"), "keys")
        state = line.ask("state")
        if state["ok"] and "held" in state and sorted(state["held"]) != sorted(held):
            yield f"state says held {state['held']} after keys {held}"
    answer = line.ask("keys", held=["no such key"])
    if answer["ok"]:
        yield "a key that the device does not have was accepted; refuse it with ok false"
    if not line.ask("keys", held=[])["ok"]:
        yield "after an unknown key it refuses to release all keys"


def faults(line: Line, names: Sequence[str]) -> Sentences:
    """Every error of the profile can be raised, alone and with all others; unknown ones cannot."""
    for active in (*([name] for name in names), list(names), []):
        answer = line.must("faults", active=active)
        yield from _at(line, answer.get("at"), "faults")
    answer = line.ask("faults", active=["no such error"])
    if answer["ok"]:
        yield "an error that the device cannot have was accepted; refuse it with ok false"
    if not line.ask("faults", active=[])["ok"]:
        yield "after an unknown error it refuses to heal all errors"


def sequences(line: Line, names: Sequence[str]) -> Sentences:
    """A timed sequence says when each of its steps happened, in order and in time."""
    key = names[0]
    steps = [[at, [key] if number % 2 == 0 else []] for number, at in enumerate(_STEPS_S)]
    answer = line.must("keys", _STEPS_S[-1], sequence=steps)
    line.must("keys", held=[])
    if line.came_at < line.sent_at:
        yield "the clock of this host was set back; do not do that now"
    found = answer.get("at")
    if found is None:
        return
    if not isinstance(found, list) or len(found) != len(steps):
        yield f"at is {found!r:.80}; one [began, ended] a step is due, {len(steps)} in all"
        return
    if not line.same_clock:
        return
    for interval in found:
        wrong = _no_interval(interval)
        if wrong:
            yield wrong
            return
    began = [float(interval[0]) for interval in found]
    for (wanted, _), at in zip(steps, began, strict=True):
        off = at - began[0] - float(wanted)  # type: ignore[arg-type]
        if abs(off) > SLACK_S:
            yield f"the step at {wanted} s came {off * 1000:+.1f} ms off; play it more exactly"


def leds(line: Line, names: Sequence[str]) -> Sentences:
    """Every LED of the profile is judged, and no other."""
    lights = line.must("leds", _EYE_S).get("leds")
    if not isinstance(lights, dict):
        yield f"leds is {lights!r:.80}; an object with one word a LED is due"
        return
    yield from _each_once(lights, names)
    for name, light in lights.items():
        if light not in _LIGHTS:
            yield f"LED {name!r} is {light!r}; write off, on or blink"


def edges(line: Line, names: Sequence[str]) -> Sentences:
    """Changes of light are told in order, inside the time that was watched."""
    answer = line.must("leds", _WATCH_S, **{"for": _WATCH_S})
    if line.came_at - line.sent_at < _WATCH_S - SLACK_S:
        yield f"the answer came before the {_WATCH_S} s were over"
    start, found = answer.get("start"), answer.get("edges")
    if not isinstance(start, dict) or not isinstance(found, list):
        yield "start (an object) and edges (a list) are due"
        return
    yield from _each_once(start, names)
    lights, last = dict(start), float("-inf")
    for edge in found:
        if not isinstance(edge, list) or len(edge) != 3 or edge[1] not in lights:
            yield f"the edge {edge!r:.80} is no [time, LED, true or false]"
            return
        at, name, lit = edge
        if at < last:
            yield f"the edge {edge!r:.80} lies before the one that it follows"
        if lights[name] is lit:
            yield f"the edge {edge!r:.80} changes nothing"
        if line.same_clock and not line.sent_at - SLACK_S <= at <= line.came_at + SLACK_S:
            yield f"the edge {edge!r:.80} lies outside the time that was watched"
        lights[name], last = lit, at


def bus(line: Line, bit_rate: int) -> Sentences:
    """The server takes the bit rate at which the tester runs."""
    answer = line.must("bus", bitrate=bit_rate)
    yield from _at(line, answer.get("at"), "bus")


def bye(address: str) -> Sentences:
    """After bye, and after a client that just hangs up, the server is ready for the next."""
    for farewell in (True, False, True):
        line = Line(address)
        try:
            line.must("hello", protocol=1)
            if farewell:
                line.must("bye")
        except ControlError as error:
            yield f"{error}; after a session has ended the server must be ready for another"
            return
        finally:
            line.close()


def _each_once(found: Mapping[str, object], names: Sequence[str]) -> Sentences:
    missing, unknown = set(names) - found.keys(), found.keys() - set(names)
    if missing:
        yield f"LEDs {', '.join(sorted(missing))} of the profile are missing"
    if unknown:
        yield f"LEDs {', '.join(sorted(unknown))} are not in the profile; use its names"


def _at(line: Line, value: object, what: str) -> Sentences:
    """An interval in which something happened lies between request and answer."""
    if value is None:
        return
    wrong = _no_interval(value)
    if wrong or not isinstance(value, list):
        yield f"{what}: {wrong}"
        return
    began, ended = value
    early, late = line.sent_at - SLACK_S - began, ended - line.came_at - SLACK_S
    if line.same_clock and max(early, late) > 0:
        side = "before the request" if early > 0 else "after the answer"
        yield (
            f"{what}: at lies {max(early, late) * 1000:.1f} ms {side}, yet hello says clock"
            " 'same'; stamp with CLOCK_REALTIME of the host that captures, or leave clock out"
        )


def _no_interval(value: object) -> str:
    """Why something is no interval; "" = it is one."""
    match value:
        case [int() | float() as began, int() | float() as ended] if began <= ended:
            return ""
    return f"at {value!r:.80} is no [began, ended] in seconds"
