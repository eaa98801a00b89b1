"""The oracle of errors: what they make a device tell, and leave in its history."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

from hypothesis import given
from hypothesis import strategies as st

from hil_tests.judge.emergencies import Message, history, register_of, told, unexplained
from node_model.frame import Frame


@dataclass(frozen=True)
class Known:
    """An error."""

    code: int
    register: int
    manufacturer: bytes = bytes(5)


ERRORS = {
    "over": Known(0x2310, 0x03, b"\x01\x02\x03\x04\x05"),
    "low": Known(0x3220, 0x05),
    "high": Known(0x3210, 0x05),
}


def names(*some: str) -> frozenset[str]:
    """A set of errors."""
    return frozenset(some)


def frame(code: int, register: int, maker: bytes = bytes(5)) -> Frame:
    """An emergency message of node 5."""
    return Frame(0x085, code.to_bytes(2, "little") + bytes((register,)) + maker)


def test_the_register_has_the_bits_of_all() -> None:
    """And none where there is no error."""
    assert register_of(ERRORS, ()) == 0
    assert register_of(ERRORS, ("over", "low", "high")) == 0x07


def test_one_error_is_told_with_everything() -> None:
    """Code, register as it is then, and the maker's bytes."""
    (message,) = told(ERRORS, names("low"), names("low", "over"))
    assert str(message) == "emergency 2310h, register 07h"
    assert message.fits(frame(0x2310, 0x07, b"\x01\x02\x03\x04\x05"))
    assert not message.fits(frame(0x2310, 0x03, b"\x01\x02\x03\x04\x05"))
    assert not message.fits(frame(0x2310, 0x07))
    assert not message.fits(frame(0x2311, 0x07, b"\x01\x02\x03\x04\x05"))
    assert not message.fits(Frame(0x085, bytes(7)))


def test_of_several_at_once_nobody_knows_which_came_first() -> None:
    """So the register in each message is not looked at."""
    messages = told(ERRORS, names(), names("over", "low"))
    assert [str(each) for each in messages] == ["emergency 2310h", "emergency 3220h"]
    frames = [frame(0x3220, 0x05), frame(0x2310, 0x07, b"\x01\x02\x03\x04\x05")]
    assert unexplained(messages, frames) == []


def test_the_end_of_the_last_is_told_that_of_another_may_be() -> None:
    """With what is left in the register."""
    assert told(ERRORS, names("low"), names()) == [Message(0, 0)]
    last, between = told(ERRORS, names("low", "high"), names())
    assert (last, between) == (Message(0, 0), Message(0, None, needed=False))
    assert unexplained([last, between], [frame(0, 0x05), frame(0, 0)]) == []
    assert unexplained([last, between], [frame(0, 0x05)]) == [f"{last} is missing"]
    (message,) = told(ERRORS, names("low", "over"), names("over"))
    assert message == Message(0, 0x03, needed=False)
    assert unexplained([message], []) == []
    assert unexplained([message], [frame(0, 0x03)]) == []
    assert unexplained([message], [frame(0, 0)]) == ["085#0000000000000000 was not expected"]


def test_what_is_missing_and_what_is_strange_is_told() -> None:
    """Each message explains one frame."""
    messages = told(ERRORS, names(), names("low"))
    assert unexplained(messages, []) == ["emergency 3220h, register 05h is missing"]
    twice = [frame(0x3220, 0x05)] * 2
    assert unexplained(messages, twice) == ["085#2032050000000000 was not expected"]


def test_nothing_happens_nothing_is_told() -> None:
    """The same errors as before."""
    assert told(ERRORS, names("low"), names("low")) == []


def test_the_history_has_the_newest_first() -> None:
    """The end of an error is no entry; what came at once may stand in any order."""
    timeline = [names("low"), names(), names("low"), names("low", "over", "high")]
    assert history(ERRORS, timeline) == [
        {0x2310, 0x3210},
        {0x2310, 0x3210},
        {0x3220},
        {0x3220},
    ]


@given(st.lists(st.sets(st.sampled_from(sorted(ERRORS)))))
def test_the_history_counts_every_occurrence(timeline: list[set[str]]) -> None:
    """As many entries as errors that occurred."""
    frozen = [frozenset(each) for each in timeline]
    came = sum(len(now - before) for before, now in pairwise([frozenset[str](), *frozen]))
    assert len(history(ERRORS, frozen)) == came
