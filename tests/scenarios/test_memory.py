"""What a device can have stored, by what it was sent and when it lost power (COM-06, -26, -29)."""

from __future__ import annotations

from collections.abc import Sequence

import pytest

from hil_tests.clock import MS, Interval
from hil_tests.config import Parameters
from hil_tests.judge.echoes import Echo, Request
from hil_tests.scenarios.memory import decoded, stored
from node_model.frame import Frame

OLD = Parameters(node_id=1, bit_rate_code=2, heartbeat_ms=1000, sync_time=0, debounce=1)
NEW = Parameters(node_id=6, bit_rate_code=3, heartbeat_ms=0x1234, sync_time=9, debounce=5)
MESSAGE = "060312340905"


def kept(
    requests: Sequence[tuple[float, str]],
    echoes: Sequence[float | tuple[float, float]] = (),
    off_ms: float | tuple[float, float] = 10_000,
    before: Parameters = OLD,
) -> tuple[Parameters, ...]:
    """What can be stored; the store time is 500 ms."""
    return stored(
        before,
        [Request(round(at * MS), Frame(0x4F8, bytes.fromhex(data))) for at, data in requests],
        [Echo(when(at), bytes.fromhex(MESSAGE)) for at in echoes],
        when(off_ms),
        500 * MS,
    )


def when(at: float | tuple[float, float]) -> Interval:
    """An instant in ms, or one between two."""
    first, last = at if isinstance(at, tuple) else (at, at)
    return Interval(round(first * MS), round(last * MS))


def test_the_bytes_are_the_parameters() -> None:
    """Heartbeat high byte first; what follows the sixth byte means nothing."""
    assert decoded(bytes.fromhex(MESSAGE)) == NEW
    assert decoded(bytes.fromhex(MESSAGE + "AA55")) == NEW


@pytest.mark.parametrize("requests", [[], [(10, "00" + MESSAGE[2:])], [(10, MESSAGE[:10])]])
def test_without_a_message_the_old_set_stays(requests: list[tuple[float, str]]) -> None:
    """Commissioning-wait that is left changes nothing (COM-29)."""
    assert kept(requests) == (OLD,)


@pytest.mark.parametrize(
    ("off_ms", "sets"), [(520, (NEW,)), (519.999, (OLD, NEW)), (20, (OLD, NEW))]
)
def test_after_the_store_time_the_new_set_is_safe(
    off_ms: float, sets: tuple[Parameters, ...]
) -> None:
    """It counts from the first echo; before that either whole set may be there (COM-26)."""
    assert kept([(10, MESSAGE)], [20, 120], off_ms) == sets


def test_doubt_about_the_instants_leaves_both() -> None:
    """Only where power surely stayed on long enough the new set is asked for."""
    assert kept([(10, MESSAGE)], [(20, 30)], 530) == (NEW,)
    assert kept([(10, MESSAGE)], [(20, 31)], 530) == (OLD, NEW)
    assert kept([(10, MESSAGE)], [20], (520, 900)) == (NEW,)
    assert kept([(10, MESSAGE)], [20], (519, 900)) == (OLD, NEW)


def test_an_echo_before_the_message_is_none_of_it() -> None:
    """The store time counts from the first echo after it, or is not known to have begun."""
    assert kept([(100, MESSAGE)], [50], 700) == (OLD, NEW)
    assert kept([(100, MESSAGE)], [50, 300], 700) == (OLD, NEW)
    assert kept([(100, MESSAGE)], [50, 300], 800) == (NEW,)
    assert kept([(10, MESSAGE)]) == (OLD, NEW)


def test_the_first_message_is_the_one() -> None:
    """A second one changes no memory (COM-21)."""
    assert kept([(10, MESSAGE), (20, "0C0200640002")], [30]) == (NEW,)


def test_the_same_set_again_is_no_change() -> None:
    """There is nothing to tell apart, whenever power is cut."""
    assert kept([(10, MESSAGE)], [20], 21, before=NEW) == (NEW,)
