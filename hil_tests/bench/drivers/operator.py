"""The operator as a driver like another: switches, presses and looks when asked to.

An action done by hand took place somewhere between question and answer; no limit of time
is judged from it, only the order of things.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from hil_tests.bench.action import Action, LedEdges
from hil_tests.bench.drivers.terminal import Question, Terminal, ask_done
from hil_tests.clock import Interval
from hil_tests.errors import BenchError

_LETTERS = {"0": "off", "1": "on", "b": "blink", "off": "off", "on": "on", "blink": "blink"}


class OperatorPower:
    """Supply, switched by hand."""

    def __init__(self, terminal: Terminal) -> None:
        self._terminal = terminal

    def switch(self, on: bool) -> Action[Interval]:
        """Ask for the supply to be switched."""
        return ask_done(self._terminal, f"Switch the supply {'ON' if on else 'OFF'}")


class OperatorKeys:
    """Keys, pressed by hand."""

    timed_sequences = False

    def __init__(self, terminal: Terminal) -> None:
        self._terminal = terminal

    def hold(self, held: frozenset[str]) -> Action[Interval]:
        """Ask for exactly these keys to be held."""
        if held:
            text = f"Press and hold exactly these keys: {', '.join(sorted(held))}"
        else:
            text = "Release all keys"
        return ask_done(self._terminal, text)

    def sequence(self, steps: Sequence[tuple[int, frozenset[str]]]) -> Action[Sequence[Interval]]:
        """No hand keeps milliseconds.

        Raises:
            BenchError: always.
        """
        raise BenchError(
            f"an operator cannot play a timed sequence of {len(steps)} steps; give [keys] "
            "another driver"
        )


class OperatorFaults:
    """Errors, made by hand."""

    def __init__(self, terminal: Terminal) -> None:
        self._terminal = terminal

    def fail(self, active: frozenset[str]) -> Action[Interval]:
        """Ask for exactly these errors to be there."""
        if active:
            text = f"Make exactly these errors exist: {', '.join(sorted(active))}"
        else:
            text = "Remove every error"
        return ask_done(self._terminal, text)


class OperatorLeds:
    """LEDs, looked at by the operator.

    Args:
        terminal: where to ask.
        names: the LEDs of the profile, in the order in which they are asked for.
    """

    sees_edges = False

    def __init__(self, terminal: Terminal, names: Sequence[str]) -> None:
        self._terminal = terminal
        self._names = tuple(names)

    def read(self) -> Action[Mapping[str, str]]:
        """Ask for all LEDs at once, one word each."""
        names = " ".join(self._names)
        text = (
            "Look at the LEDs for two seconds. Type 0 (off), 1 (on) or b (blinks) for each "
            f"of: {names}"
        )
        hint = f"{len(self._names)} answers are needed, e.g. {' '.join('0' for _ in self._names)}:"
        return Question(self._terminal, text, self._lights, hint)

    def _lights(self, line: str, _: Interval) -> Mapping[str, str] | None:
        words = [_LETTERS.get(word) for word in line.lower().split()]
        if len(words) != len(self._names):
            return None
        lights = {name: word for name, word in zip(self._names, words, strict=True) if word}
        return lights if len(lights) == len(words) else None

    def watch(self, for_ns: int) -> Action[LedEdges]:
        """No eye times edges.

        Raises:
            BenchError: always.
        """
        raise BenchError(f"an operator cannot time LED edges for {for_ns} ns")
