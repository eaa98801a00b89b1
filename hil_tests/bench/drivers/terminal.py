"""Questions to the operator at the terminal, asked in the loop that also reads the bus.

A question never blocks: it is printed, and its descriptor wakes the loop when a line is
there. pytest's capture is suspended only from question to answer. End of input, a
time-out and "cancel" are no answers: they raise `OperatorAbsent`, and the test is *not
run*. What was typed before the question counts for nothing.
"""

from __future__ import annotations

import contextlib
import os
import select
import termios
from collections.abc import Callable, Sequence
from typing import Generic, Protocol, TypeVar

from hil_tests.bench.action import Action
from hil_tests.clock import Interval, S, show_span
from hil_tests.errors import OperatorAbsent

Result = TypeVar("Result")

ANSWER_NS = 120 * S
"""How long an operator may take by default."""
_BELL = "\a"
_CANCEL = frozenset({"c", "cancel", "skip"})
_MOST_READ = 4096
_LONGEST_LINE = 1024


class Capture(Protocol):
    """Gives the terminal back while a question is open (pytest's capture manager)."""

    def suspend(self) -> None:
        """Standard input and output are the terminal's from now on."""

    def resume(self) -> None:
        """Capture again."""


class NoCapture:
    """Where nothing captures."""

    def suspend(self) -> None:
        """Nothing to do."""

    def resume(self) -> None:
        """Nothing to do."""


class Terminal:
    """Where the operator sits.

    Args:
        clock: the clock of the bench's port, in ns.
        read_fd: descriptor that lines are read from.
        write_fd: descriptor that questions are written to.
        capture: suspended while a question is open.
        answer_ns: how long an answer may take.
    """

    def __init__(
        self,
        clock: Callable[[], int],
        read_fd: int = 0,
        write_fd: int = 2,
        capture: Capture | None = None,
        answer_ns: int = ANSWER_NS,
    ) -> None:
        self.clock = clock
        self.read_fd = read_fd
        self.answer_ns = answer_ns
        self._write_fd = write_fd
        self._capture = capture or NoCapture()

    def open(self, text: str) -> None:
        """Take the terminal, forget what was typed before, ring, and print."""
        self._capture.suspend()
        with contextlib.suppress(termios.error, OSError):  # no terminal but a pipe
            termios.tcflush(self.read_fd, termios.TCIFLUSH)
        self.say(f"\n{_BELL}{text} ")

    def say(self, text: str) -> None:
        """Print to the operator; a terminal that is gone is met when reading."""
        with contextlib.suppress(OSError):
            os.write(self._write_fd, text.encode("utf-8", "replace"))

    def read(self) -> bytes:
        """What was typed; call it only when the descriptor is readable. b"" = end of input."""
        try:
            return os.read(self.read_fd, _MOST_READ)
        except OSError:  # the terminal was hung up
            return b""

    def close(self) -> None:
        """Give the terminal back."""
        self._capture.resume()


class Question(Generic[Result]):
    """A question, open until a line that `read` understands (an `Action`).

    Args:
        terminal: where to ask.
        text: the question, with the answers that are understood.
        read: makes the result of a line and of the interval from question to answer;
            None = not understood, the hint is printed and the question stays open.
        hint: what to print then.
    """

    def __init__(
        self,
        terminal: Terminal,
        text: str,
        read: Callable[[str, Interval], Result | None],
        hint: str,
    ) -> None:
        self._terminal = terminal
        self._text = text
        self._read = read
        self._hint = hint
        self._typed = b""
        self._asked_at = 0
        self._limit_at = 0
        self._result: Result | None = None

    @property
    def descriptors(self) -> Sequence[int]:
        """The terminal."""
        return (self._terminal.read_fd,)

    @property
    def wake_at(self) -> int:
        """The end of the operator's time."""
        return self._limit_at

    def start(self, now: int) -> None:
        """Ask."""
        self._asked_at = now
        self._limit_at = now + self._terminal.answer_ns
        self._terminal.open(f"{self._text} [c = cancel]")

    def poll(self, now: int) -> bool:
        """Look whether there is an answer.

        Raises:
            OperatorAbsent: time-out, end of input, or cancelled.
        """
        try:
            done = self._look(now)
        except BaseException:
            self._terminal.close()
            raise
        if done:
            self._terminal.close()
        return done

    def result(self) -> Result:
        """The answer."""
        assert self._result is not None
        return self._result

    def _look(self, now: int) -> bool:
        while readable(self._terminal.read_fd):
            data = self._terminal.read()
            if not data:
                raise OperatorAbsent(
                    f"nobody answers {self._text!r}: end of input; run from a terminal, or "
                    "give the bench another driver"
                )
            if self._take(data):
                return True
        if now >= self._limit_at:
            raise OperatorAbsent(
                f"no answer to {self._text!r} within {show_span(self._terminal.answer_ns)}"
            )
        return False

    def _take(self, data: bytes) -> bool:
        *lines, rest = (self._typed + data).split(b"\n")
        self._typed = rest[-_LONGEST_LINE:]
        for line in lines:
            text = line[:_LONGEST_LINE].decode("utf-8", "replace").strip()
            if text.lower() in _CANCEL:
                raise OperatorAbsent(f"the operator cancelled {self._text!r}")
            asked = Interval(self._asked_at, self._terminal.clock())
            self._result = self._read(text, asked)
            if self._result is not None:
                return True
            self._terminal.say(f"{self._hint} ")
        return False


def readable(descriptor: int) -> bool:
    """Whether reading would not wait (end of input is readable, too)."""
    return bool(select.select([descriptor], [], [], 0)[0])


def ask_yes_no(terminal: Terminal, text: str) -> Action[bool]:
    """A question that only "yes" or "no" answers; an empty line is neither."""

    def read(line: str, _: Interval) -> bool | None:
        return {"y": True, "yes": True, "n": False, "no": False}.get(line.lower())

    return Question(terminal, f"{text} [yes / no]", read, "Type yes, no or cancel:")


def ask_done(terminal: Terminal, text: str) -> Action[Interval]:
    """Something to do by hand; the result is the interval in which it was done."""

    def read(line: str, asked: Interval) -> Interval | None:
        return asked if line.lower() in {"", "d", "done", "y", "yes"} else None

    return Question(terminal, f"{text}, then press Enter", read, "Press Enter or type cancel:")
