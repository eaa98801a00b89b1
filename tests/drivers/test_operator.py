"""Questions to the operator, over a pipe that stands for the terminal."""

from __future__ import annotations

import os
from collections.abc import Iterator

import pytest

from hil_tests.bench.drivers.operator import (
    OperatorFaults,
    OperatorKeys,
    OperatorLeds,
    OperatorPower,
)
from hil_tests.bench.drivers.terminal import Terminal, ask_yes_no
from hil_tests.clock import Interval, S
from hil_tests.errors import BenchError, OperatorAbsent


class Desk:
    """A terminal with an operator who types what the test says."""

    def __init__(self) -> None:
        self.now = 100 * S
        self.captured = True
        reader, self._typing = os.pipe()
        self._screen, writer = os.pipe()
        self.terminal = Terminal(lambda: self.now, reader, writer, self)
        self._open = [reader, writer, self._screen, self._typing]

    def suspend(self) -> None:
        """pytest lets go of the terminal."""
        assert self.captured
        self.captured = False

    def resume(self) -> None:
        """pytest takes it back."""
        assert not self.captured
        self.captured = True

    def types(self, text: bytes) -> None:
        """The operator types."""
        os.write(self._typing, text)

    def leaves(self) -> None:
        """End of input."""
        os.close(self._typing)
        self._open.remove(self._typing)

    def shown(self) -> str:
        """What was printed since the last look."""
        return os.read(self._screen, 65_536).decode()

    def close(self) -> None:
        """Tidy up."""
        for descriptor in self._open:
            os.close(descriptor)


@pytest.fixture
def desk() -> Iterator[Desk]:
    """A terminal with an operator."""
    made = Desk()
    yield made
    made.close()


@pytest.mark.parametrize(
    ("typed", "meant"), [(b"yes\n", True), (b"Y\n", True), (b"no\n", False), (b" n \n", False)]
)
def test_yes_and_no_are_answers(typed: bytes, meant: bool, desk: Desk) -> None:
    """Capture is off only from question to answer; the bell rings."""
    question = ask_yes_no(desk.terminal, "Does the LED shine?")
    question.start(desk.now)
    assert "\aDoes the LED shine? [yes / no] [c = cancel]" in desk.shown()
    assert not desk.captured
    assert not question.poll(desk.now)
    desk.types(typed)

    assert question.poll(desk.now)
    assert question.result() is meant
    assert desk.captured


@pytest.mark.parametrize(
    "typed", [b"\n", b"maybe\n", b"yesno\n", b"\xff\xfe\n", b"y" * 3000 + b"\n"]
)
def test_anything_else_is_asked_again(typed: bytes, desk: Desk) -> None:
    """An empty line is no yes."""
    question = ask_yes_no(desk.terminal, "Well?")
    question.start(desk.now)
    desk.shown()
    desk.types(typed)
    assert not question.poll(desk.now)
    assert "Type yes, no or cancel" in desk.shown()
    desk.types(b"y")
    assert not question.poll(desk.now)
    desk.types(b"es\n")

    assert question.poll(desk.now)
    assert question.result() is True


@pytest.mark.parametrize("typed", [b"c\n", b"cancel\n", b"CANCEL\n"])
def test_cancel_is_no_answer(typed: bytes, desk: Desk) -> None:
    """The test is not run; capture is back."""
    question = ask_yes_no(desk.terminal, "Well?")
    question.start(desk.now)
    desk.types(typed)

    with pytest.raises(OperatorAbsent, match="cancelled"):
        question.poll(desk.now)
    assert desk.captured


@pytest.mark.parametrize("typed", [b"", b"yes"])
def test_end_of_input_is_never_a_yes(typed: bytes, desk: Desk) -> None:
    """Nobody is there; not even a word without its line feed counts."""
    question = ask_yes_no(desk.terminal, "Well?")
    question.start(desk.now)
    desk.types(typed)
    desk.leaves()

    with pytest.raises(OperatorAbsent, match="end of input"):
        question.poll(desk.now)
    assert desk.captured


def test_time_out_is_no_answer(desk: Desk) -> None:
    """The action says when its time is over."""
    question = ask_yes_no(desk.terminal, "Well?")
    question.start(desk.now)

    assert question.wake_at == desk.now + 120 * S
    assert question.descriptors == (desk.terminal.read_fd,)
    assert not question.poll(question.wake_at - 1)
    with pytest.raises(OperatorAbsent, match="within 120 s"):
        question.poll(question.wake_at)
    assert desk.captured


def test_action_by_hand_lies_between_question_and_answer(desk: Desk) -> None:
    """Nobody knows it better."""
    action = OperatorPower(desk.terminal).switch(True)
    began = desk.now
    action.start(began)
    assert "Switch the supply ON, then press Enter" in desk.shown()
    desk.now += 3 * S
    desk.types(b"\n")

    assert action.poll(desk.now)
    assert action.result() == Interval(began, began + 3 * S)


@pytest.mark.parametrize(
    ("held", "text"),
    [
        (frozenset({"on_off", "aut"}), "hold exactly these keys: aut, on_off"),
        (frozenset[str](), "Release all keys"),
    ],
)
def test_keys_are_asked_for_by_name(held: frozenset[str], text: str, desk: Desk) -> None:
    """Sorted, and none at all is said as such."""
    OperatorKeys(desk.terminal).hold(held).start(desk.now)

    assert text in desk.shown()


def test_leds_are_asked_for_in_order(desk: Desk) -> None:
    """One word for each; too few, too many or unknown ones are asked again."""
    leds = OperatorLeds(desk.terminal, ("aut", "k3", "k4"))
    action = leds.read()
    action.start(desk.now)
    assert "aut k3 k4" in desk.shown()
    for typed in (b"\n", b"1 0\n", b"1 0 b 1\n", b"1 0 x\n"):
        desk.types(typed)
        assert not action.poll(desk.now)
    desk.types(b"1 OFF b\n")

    assert action.poll(desk.now)
    assert action.result() == {"aut": "on", "k3": "off", "k4": "blink"}


def test_what_no_hand_can_do_is_refused(desk: Desk) -> None:
    """Milliseconds need a machine."""
    keys, leds = OperatorKeys(desk.terminal), OperatorLeds(desk.terminal, ("aut",))

    assert not keys.timed_sequences
    assert not leds.sees_edges
    with pytest.raises(BenchError, match="timed sequence"):
        keys.sequence([(0, frozenset())])
    with pytest.raises(BenchError, match="cannot time"):
        leds.watch(S)


def test_the_operator_makes_exactly_the_errors_that_are_asked_for(desk: Desk) -> None:
    """By name, or none at all."""
    driver = OperatorFaults(desk.terminal)
    for active, said in (
        (frozenset({"hot", "encoder"}), "Make exactly these errors exist: encoder, hot"),
        (frozenset[str](), "Remove every error"),
    ):
        question = driver.fail(active)
        question.start(desk.now)
        assert said in desk.shown()
        desk.types(b"\n")
        question.poll(desk.now)
