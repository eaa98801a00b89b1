"""What the control protocol asks for and takes time: key sequences and looking at LEDs."""

from __future__ import annotations

from collections.abc import Sequence

from node_model.host.jsonline import Seconds
from node_model.host.loop import Loop
from node_model.node import MS, Panel, earliest

EYE_NS = 1200 * MS
"""How long an eye looks at a changing light: more than one period of 1 s."""


class KeySequence:
    """Keys moved at planned instants; a late host does not shift the edges.

    Args:
        loop: who moves them.
        start: the instant of the first step.
        steps: spans in ns from the first step, and the keys held from then on.
    """

    def __init__(
        self, loop: Loop[Panel], start: int, steps: Sequence[tuple[int, frozenset[str]]]
    ) -> None:
        self._loop = loop
        self._steps = [(start + span, held) for span, held in steps]
        self._done: list[tuple[Seconds, Seconds]] = []

    def due(self) -> int | None:
        """The instant of the next edge."""
        done = len(self._done)
        return self._steps[done][0] if done < len(self._steps) else None

    def run(self, at: int) -> None:
        """Move the keys."""
        held = self._steps[len(self._done)][1]
        self._done.append((Seconds(at), Seconds(at)))
        self._loop.hold(held, at)

    def look(self, at: int) -> None:
        """Nothing to see."""

    def answer(self) -> dict[str, object]:
        """One interval a step."""
        return {"at": self._done}


class LampWatch:
    """Sees every change of light from `start` to `end`."""

    def __init__(self, loop: Loop[Panel], start: int, span_ns: int) -> None:
        self._node = loop.node
        self._start = start
        self._end = start + span_ns
        self._seen_at = start
        self._over = False
        self._now = self._lights(start)
        self._before = dict(self._now)
        self._edges: list[tuple[int, str, bool]] = []

    def _lights(self, at: int) -> dict[str, bool]:
        return {led: self._node.lit(led, at) for led in self._node.leds}

    def due(self) -> int | None:
        """The next change of a lamp, or the end."""
        if self._over:
            return None
        return earliest(self._node.lamp_change(self._seen_at), self._end)

    def run(self, at: int) -> None:
        """A lamp changes by itself, or the time is over."""
        self.look(at)
        self._over = self._over or at >= self._end

    def look(self, at: int) -> None:
        """Compare the lights with those seen last."""
        if self._over or at > self._end:
            return
        self._seen_at = max(at, self._seen_at)
        for led, lit in self._lights(at).items():
            if lit != self._now[led]:
                self._now[led] = lit
                self._edges.append((at, led, lit))

    def answer(self) -> dict[str, object]:
        """Lights at the start and every change, with the stretch that was watched."""
        return {
            "at": (Seconds(self._start), Seconds(self._end)),
            "start": self._before,
            "edges": [(Seconds(at), led, lit) for at, led, lit in self._edges],
        }


class LampEye(LampWatch):
    """Judges each light as an eye does: off, on, or blinking.

    Where no lamp will change by itself the answer is there at once.
    """

    def __init__(self, loop: Loop[Panel], start: int) -> None:
        super().__init__(loop, start, EYE_NS)
        self._over = loop.node.lamp_change(start) is None

    def answer(self) -> dict[str, object]:
        """Two changes or more are a blink; one is a light that was switched meanwhile."""
        changes = [led for _, led, _ in self._edges]
        leds = {
            led: "blink" if changes.count(led) > 1 else "on" if lit else "off"
            for led, lit in self._now.items()
        }
        return {"leds": leds}
