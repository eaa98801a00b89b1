"""What a device keeps of its services is what they would say if each were asked."""

from __future__ import annotations

from collections.abc import Container, Iterable, Iterator

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from node_model.agenda import NEVER, Agenda
from node_model.device import Cia301Device
from node_model.frame import data_frame
from node_model.node import MS, NOTHING, Frames, Panel, earliest
from node_model.service import QuietService
from tests.node_model.drive_scripts import drive_scripts
from tests.node_model.driving import Step, act
from tests.node_model.test_drive_laws import DEVICES, INPUTS, START

SCRIPTS = drive_scripts()


def asked(device: Cia301Device) -> None:
    """Its deadline and its acceptance filter are those of its services, each asked now."""
    row = device.agenda.row
    if row and device.bit_rate:
        assert device.deadline() == earliest(*(service.deadline() for service in row))
        heard = {0}.union(*(service.listens_to() for service in row))
        assert device.listens_to in (heard, None)


def play_asked(device: Panel, steps: Iterable[Step]) -> int:
    """Do the steps; ask after each, and at each deadline between them. How often it was."""
    if not isinstance(device, Cia301Device):
        return 0  # the fault is in its link: the device is the right one
    now = count = 0
    for step in steps:
        end = now + step.wait_ns
        while (due := device.deadline()) is not None and due <= end:
            now = due
            device.advance(now)
            asked(device)
            count += 1
        now = end
        act(device, step.what, now)
        asked(device)
        count += 1
    return count


@pytest.mark.parametrize("name", ["drive", "generic"])
@pytest.mark.parametrize(("script", "steps"), SCRIPTS, ids=[name for name, _ in SCRIPTS])
def test_whatever_happens_it_is_as_if_all_were_asked(
    name: str, script: str, steps: Iterable[Step]
) -> None:
    """Every script of frames, settings and errors, with each device."""
    assert play_asked(DEVICES[name](), steps), script


WAITS = st.sampled_from((0, 1, MS, 20 * MS))


@pytest.mark.parametrize("name", DEVICES)
@settings(max_examples=2, deadline=None)
@given(steps=st.lists(st.builds(Step, WAITS, INPUTS), min_size=10, max_size=24))
def test_parts_that_take_the_place_of_others_keep_it_so(name: str, steps: list[Step]) -> None:
    """With each fault and each difference, whatever comes."""
    play_asked(DEVICES[name](), (*START, *steps))


class Part(QuietService):
    """A service that counts how often it is asked."""

    def __init__(
        self,
        due: int | None = None,
        *,
        alone: bool = True,
        set_up_by: Container[int] = (),
        timed_by: Container[int] = (),
    ) -> None:
        self.due, self.alone = due, alone
        self.set_up_by, self.timed_by = set_up_by, timed_by
        self.can_ids: set[int] = set()
        self.questions: list[str] = []

    def listens_to(self) -> frozenset[int]:
        """What it was given."""
        self.questions.append("ids")
        return frozenset(self.can_ids)

    def deadline(self) -> int | None:
        """What it was given."""
        self.questions.append("due")
        return self.due

    def advance(self, now: int) -> Frames:
        """Once."""
        self.due = None
        return (data_frame(now, b""),)


def answers(parts: Iterable[Part]) -> Iterator[list[str]]:
    """What each was asked since the last time."""
    for part in parts:
        yield part.questions.copy()
        part.questions.clear()


def settled(*parts: Part) -> Agenda:
    """An agenda that has asked them all once."""
    agenda = Agenda(parts)
    agenda.settle()
    list(answers(parts))
    return agenda


def test_an_empty_agenda_is_never_due() -> None:
    """Nor is anything heard, whatever is said to it."""
    agenda = Agenda()
    agenda.stir()
    agenda.write(0x1005)
    assert not agenda.settle()
    assert (agenda.due, agenda.heard, agenda.act(5)) == (NEVER, frozenset(), NOTHING)


def test_only_who_acted_alone_is_asked_again() -> None:
    """A service that is not alone makes all of them be asked, once."""
    alone, other = Part(10), Part(20, alone=False)
    agenda = settled(alone, other)
    assert agenda.act(10) == (data_frame(10, b""),)
    assert not agenda.settle()
    assert list(answers((alone, other))) == [["due"], []]
    assert agenda.due == 20

    agenda.act(20)
    agenda.settle()
    assert list(answers((alone, other))) == [["due"], ["due"]]
    assert agenda.due == NEVER


def test_who_is_due_together_acts_in_the_order_of_the_row() -> None:
    """All at one instant, and nobody who is due later."""
    parts = [Part(7), Part(8), Part(7), Part()]
    agenda = settled(*parts)
    assert agenda.act(7) == (data_frame(7, b""),) * 2
    assert (agenda.due, [part.due for part in parts]) == (8, [None, 8, None, None])


def test_what_they_hear_is_asked_after_a_write_that_concerns_them() -> None:
    """A write of another object, or one that changes nothing, keeps the very set."""
    first, second = Part(set_up_by={0x1005}), Part()
    first.can_ids, second.can_ids = {0x80}, {0x80, 0x605}
    agenda = settled(first, second)
    heard = agenda.heard
    assert heard == {0x80, 0x605}
    assert [place for place, _ in agenda.listeners[0x80]] == [0, 1]

    agenda.write(0x1006)
    assert (agenda.moved, agenda.settle()) == (False, False)
    assert list(answers((first, second))) == [[], []]
    agenda.write(0x1005)
    assert agenda.moved
    assert not agenda.settle()
    assert list(answers((first, second))) == [["ids"], []]
    assert agenda.heard is heard

    first.can_ids = {0x81}
    agenda.write(0x1005)
    assert agenda.settle()
    assert agenda.heard == {0x80, 0x81, 0x605}


def test_only_who_is_timed_by_an_object_is_asked_after_a_write_of_it() -> None:
    """Its new deadline counts, also where it has none any more; a stir asks all, and once."""
    first, second = Part(10, timed_by={0x1006, 0x1007}), Part(20)
    agenda = settled(first, second)
    for due, expected in ((30, 20), (5, 5), (None, 20)):
        first.due = due
        agenda.write(0x1006)
        assert agenda.moved
        assert not agenda.settle()
        assert list(answers((first, second))) == [["due"], []]
        assert agenda.due == expected

    agenda.write(0x1007)
    agenda.stir()
    agenda.settle()
    assert list(answers((first, second))) == [["due"], ["due"]]
    agenda.settle()
    assert list(answers((first, second))) == [[], []]
