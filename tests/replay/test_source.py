"""A record told as time goes on: in order, each once, and never past what the test must do."""

from __future__ import annotations

import pytest

from hil_tests.clock import MS
from hil_tests.errors import FrameNotCarried
from hil_tests.replay.source import SLACK_NS, Departure
from hil_tests.trace import BusEvent, EventKind, Moment, Sighting
from node_model.frame import Frame
from tests.replay.records import START, beat, own, power, source


def test_frames_come_at_their_instants() -> None:
    """Time is that of the last frame, or of the wait that ended."""
    told = source(beat(100), beat(300))
    assert told.next(99) is None
    assert told.now == 99
    assert told.next(250) == beat(100)
    assert told.now == 100
    assert told.next(250) is None
    assert told.next(400) == beat(300)
    assert told.next(1000) is None
    assert told.now == 1000


def test_a_wait_for_the_past_hands_out_what_is_there() -> None:
    """And time does not go back."""
    told = source(beat(100), beat(200), beat(200))
    assert told.next(200) == beat(100)
    assert told.next(200) == beat(200)
    assert told.next(0) == beat(200)
    assert told.next(0) is None
    assert told.now == 200


def test_an_own_frame_comes_after_it_was_asked_for() -> None:
    """A wait that ends before it is nothing; one that goes on past it departs."""
    told = source(own(100), beat(200))
    assert told.next(100) is None
    with pytest.raises(Departure, match="100 ns after its beginning the record has 000#0101 sent"):
        told.next(101)
    told.send(START)
    assert told.next(500) == own(100)
    assert told.next(500) == beat(200)


def test_frames_that_are_queued_come_in_the_order_of_the_record() -> None:
    """The bus may have taken the second one first."""
    other = Frame(0x7FF)
    told = source(own(100), own(200, other))
    told.send(other)
    told.send(START)
    assert [told.next(500), told.next(500)] == [own(100), own(200, other)]


def test_another_frame_than_the_recorded_one_is_told() -> None:
    """With both."""
    told = source(own(100))
    told.send(Frame(0, b"\x02\x01"))
    with pytest.raises(
        Departure, match=r"000#0101 sent by the tester \(asked for now: 000#0201\)"
    ):
        told.next(500)


def test_time_stands_before_a_stimulus_that_was_not_given() -> None:
    """To its instant, and not a ns further."""
    told = source(power(100, on=True), beat(200))
    assert told.next(100) is None
    with pytest.raises(Departure, match=r"waits on for 1 ns; 100 ns after .* has power on"):
        told.next(101)


def test_a_stimulus_is_found_once_the_frames_before_it_are_read() -> None:
    """An action polls until then."""
    told = source(beat(50), power(100, on=True), beat(200))
    assert told.await_that("power", {"on": True}, "power on") is None
    assert told.next(1 << 62) == beat(50)
    assert told.next(1 << 62) is None
    assert told.now == 50
    assert told.await_that("power", {"on": True}, "power on") == power(100, on=True)
    assert told.now == 100
    assert told.next(500) == beat(200)


@pytest.mark.parametrize(
    ("what", "detail", "said"),
    [
        ("power", {"on": False}, "100 ns after its beginning the record has power on"),
        ("keys", {"held": []}, "the record has power on"),
    ],
)
def test_another_stimulus_than_the_recorded_one_is_told(
    what: str, detail: dict[str, object], said: str
) -> None:
    """What was asked, and what is there."""
    told = source(beat(50), power(100, on=True))
    with pytest.raises(Departure, match=f"cannot show this: it does so; .*{said}"):
        told.await_that(what, detail, "it does so")


@pytest.mark.parametrize(("end", "said"), [(1000, "record ends"), (None, "record breaks off")])
def test_past_its_end_a_record_shows_nothing(end: int | None, said: str) -> None:
    """No wait, and no stimulus; a record that breaks off ends with its last entry."""
    told = source(beat(50), end=end)
    assert told.next(end or 50) == beat(50)
    assert told.next(end or 50) is None
    with pytest.raises(Departure, match=f"waits on for 1 ns; .* the {said}"):
        told.next((end or 50) + 1)
    with pytest.raises(Departure, match=said):
        told.await_that("power", {"on": True}, "it switches power on")


def test_what_is_done_at_once_is_passed_over_in_its_place() -> None:
    """A load, an end of loads: the frames before it may still be read."""
    told = source(beat(50), Moment("unload", 100, 100), beat(200))
    told.do("unload", {}, "unload")
    assert [told.next(500), told.next(500), told.next(500)] == [beat(50), beat(200), None]
    with pytest.raises(Departure, match="the record ends"):
        told.do("unload", {}, "unload")


def test_a_fresh_device_leaves_the_old_one_behind() -> None:
    """What it would have sent, and what waits to be sent to it."""
    renew = Moment("renew", 100, 900, {"parameters": {"node_id": 1}, "fresh": True})
    told = source(beat(50), renew, beat(950))
    told.send(START)
    told.renew({"parameters": {"node_id": 1}}, "anew")
    assert told.now == 900
    assert told.next(1000) == beat(950)
    told = source(renew)
    with pytest.raises(Departure, match="the record has a fresh device with "):
        told.renew({"parameters": {"node_id": 2}}, "anew")


def test_other_parameters_of_the_same_device_are_no_stimulus() -> None:
    """Time goes past them."""
    told = source(Moment("renew", 100, 100, {"parameters": {}, "fresh": False}), beat(200))
    assert told.next(500) == beat(200)


def test_a_frame_that_could_not_be_sent_cannot_be_sent_again() -> None:
    """Another one can."""
    refused = Moment("refused", 100, 100, {"frame": "000#0101"})
    told = source(beat(50), refused, own(200, Frame(0x80)))
    with pytest.raises(FrameNotCarried, match="000#0101"):
        told.send(START)
    told.send(Frame(0x80))
    assert [told.next(500), told.next(500)] == [beat(50), own(200, Frame(0x80))]


def test_stalls_are_left_to_the_bench() -> None:
    """Other events come as they came."""
    gap = BusEvent(EventKind.GAP, 150, "lost", 2)
    told = source(BusEvent(EventKind.STALL, 100), gap)
    assert told.next(500) == gap


def test_a_burst_ends_before_a_note_and_before_a_frame_that_was_not_sent() -> None:
    """And at the instant, and at the number that was asked for."""
    told = source(beat(1), beat(2), own(3), beat(4), beat(5), Moment("keys", 6, 6), beat(7))
    assert told.burst(100, 1).instants == [1]
    assert told.burst(100, 9).instants == [2]
    assert len(told.burst(100, 9)) == 0
    told.send(START)
    burst = told.burst(100, 9)
    assert (burst.instants, burst.own) == ([3, 4, 5], [0])
    assert len(told.burst(100, 9)) == 0
    assert told.now == 5


# Real time: the clock was read a little later than any frame says.


def test_a_wait_ends_late_where_it_did() -> None:
    """With the frames that were heard meanwhile."""
    told = source(beat(120), Moment("wait", 100, 150), beat(300), virtual=False)
    assert told.next(100) == beat(120)
    assert told.next(100) is None
    assert told.now == 150


def test_a_wait_that_the_record_has_not_is_kept_by_the_clock() -> None:
    """A shorter one ends before it, a longer one goes past it."""
    entries = (beat(150 * MS), Moment("wait", 100 * MS, 151 * MS), beat(300 * MS))
    told = source(*entries, end=500 * MS, virtual=False)
    assert told.next(50 * MS) is None
    assert told.now == 50 * MS
    told = source(*entries, end=500 * MS, virtual=False)
    assert told.next(200 * MS) == beat(150 * MS)
    assert told.next(200 * MS) is None
    assert told.now == 200 * MS
    told = source(Moment("wait", 100 * MS, 151 * MS), end=500 * MS, virtual=False)
    assert told.next(10 * MS) is None
    assert told.now == 10 * MS


def test_real_time_has_some_slack() -> None:
    """A little past a stimulus is nothing; more departs."""
    told = source(power(100, on=True), virtual=False)
    assert told.next(100 + SLACK_NS) is None
    with pytest.raises(Departure):
        told.next(200 + 2 * SLACK_NS)


def test_the_lateness_of_a_host_is_told_when_it_was() -> None:
    """As it is asked for, or at the latest when the record comes to it; each pair once."""
    late = Moment("late", 100, 110, {"pairs": [[1, 2], [3, 4], "odd"]})
    told = source(
        beat(50), late, beat(200), Moment("late", 900 * MS, 900 * MS, {"pairs": [[5, 6]]})
    )
    assert told.lateness() == [(1, 2), (3, 4)]
    assert told.lateness() == []
    assert [told.next(500), told.next(500)] == [beat(50), beat(200)]
    told = source(beat(50), late, beat(120), virtual=False)
    assert told.lateness() == [(1, 2), (3, 4)]
    assert told.now == 110
    told = source(late, power(150, on=True))
    assert told.await_that("power", {}, "on") == power(150, on=True)
    assert told.lateness() == [(1, 2), (3, 4)]


@pytest.mark.parametrize(("fresh", "told_of"), [(False, True), (True, False)])
def test_what_the_device_is_set_to_stands_in_nobodys_way(fresh: bool, told_of: bool) -> None:
    """The bench notes it by itself; another device is something that the test asks for."""
    renew = Moment("renew", 100, 100, {"parameters": None, "off": True, "fresh": fresh})
    late = Moment("late", 140, 150, {"pairs": [[1, 2]]})
    told = source(renew, clock(120), late, virtual=False)
    assert (told.told() == 120) is told_of
    assert bool(told.lateness()) is told_of


def test_at_its_end_time_goes_on_to_the_end_of_the_record() -> None:
    """Unless something was left to do, or it breaks off."""
    told = source(beat(50))
    told.wind_up()
    assert told.now == 1000
    assert told.next(0) == beat(50)
    late = source(beat(2000))
    late.wind_up()
    assert [late.next(0), late.now] == [beat(2000), 1000]  # read while it was looked at last
    for other in (source(power(50, on=True)), source(beat(50), end=None)):
        other.wind_up()
        assert other.now == 0


def test_a_clock_that_is_read_after_a_frame_is_later_than_its_stamp() -> None:
    """In real time; so what came before a test looked at the clock did not come after that."""
    for virtual in (True, False):
        told = source(beat(100), beat(300), virtual=virtual)
        assert told.next(200) == beat(100)
        assert told.now == (100 if virtual else 101)


def clock(at: int) -> Moment:
    """The test read the clock."""
    return Moment("clock", at, at)


def test_the_clock_shows_what_it_showed() -> None:
    """Each reading once and in its place: a test that was kept from running counts from then."""
    told = source(beat(100), clock(150), clock(160), beat(200), virtual=False)
    assert told.told() == 0
    assert told.next(500) == beat(100)
    assert [told.told(), told.told(), told.told()] == [150, 160, 160]
    assert told.next(500) == beat(200)
    assert told.told() == 201


@pytest.mark.parametrize(
    "between", [beat(300), own(300), power(300, on=True), Moment("wait", 200, 300)]
)
def test_a_reading_is_not_taken_before_its_turn(between: Sighting | Moment) -> None:
    """What comes first has to be read, sent, done or waited for."""
    told = source(beat(100), between, clock(400), virtual=False)
    assert told.next(250) == beat(100)
    assert told.told() == 101


def test_readings_that_nobody_asks_for_are_passed_over() -> None:
    """By the test as it is now: frames, waits and stimuli are told all the same."""
    late = Moment("wait", 200, 240)
    told = source(clock(50), beat(100), clock(150), late, clock(250), power(300, on=True))
    assert told.next(200) == beat(100)
    assert told.next(200) is None
    assert told.now == 240
    assert told.await_that("power", {"on": True}, "power on") == power(300, on=True)


def test_who_only_looks_takes_no_reading_away() -> None:
    """A look at the bus that ended before it leaves it to whoever reads the clock."""
    told = source(beat(100), clock(150), beat(200), virtual=False)
    assert told.next(120) == beat(100)
    assert told.next(150) is None
    assert told.told() == 150
    assert told.next(200) == beat(200)


def test_a_reading_never_sets_time_back() -> None:
    """A wait of now may be longer than the one that was recorded."""
    told = source(clock(50), virtual=False)
    assert told.next(80) is None
    assert told.told() == 80
