"""A device as heartbeat consumer (CiA 301 4.2.0, 7.2.8.3.2.2 and 7.5.2.19)."""

from __future__ import annotations

import pytest

from hil_tests.acceptance.cia301.guarding_steps import (
    expect_event,
    expect_no_event,
    expect_none_while_fed,
    expect_reaction,
    expect_recovery,
    expect_register,
    prepare_reaction,
)
from hil_tests.acceptance.cia301.steps import (
    BEHAVIOUR,
    CONSUMER,
    LIFE_GUARD_CODE,
    needs_writable,
    shown,
    without_heartbeat,
)
from hil_tests.api import (
    MS,
    Abort,
    Cia301Bench,
    Frame,
    NotApplicable,
    Sdo,
    Seen,
    Sheet,
    accepted,
    cobs,
    matchers,
    number,
    u32,
)

TIME_MS = 200
OPERATIONAL = b"\x05"


def entry(node_id: int, time_ms: int) -> bytes:
    """A value of 1016h."""
    return u32(node_id << 16 | time_ms)


def watched_id(bench: Cia301Bench, turn: int = 0) -> int:
    """A node id that the device has not."""
    return (bench.node_id + 10 + turn) % 127 + 1


def watching(bench: Cia301Bench, sdo: Sdo, sheet: Sheet, time_ms: int = TIME_MS) -> int:
    """The device watches a node from its first heartbeat on; the node's id."""
    bench.needs_exclusive()
    needs_writable(sheet, (CONSUMER, 1))
    bench.start()
    other = watched_id(bench)
    sdo.write(CONSUMER, 1, entry(other, time_ms), requirement="C-HBC-01")
    return other


def beat(bench: Cia301Bench, node_id: int, data: bytes = OPERATIONAL) -> Seen:
    """A heartbeat of another node."""
    return bench.send(Frame(cobs.ERROR_CONTROL + node_id, data))


def event(bench: Cia301Bench) -> matchers.Matcher:
    """The EMCY that tells of a heartbeat event."""
    return matchers.emcy(bench.node_id, code=LIFE_GUARD_CODE)


@pytest.mark.requirement("C-HBC-01")
def test_an_entry_reads_back(bench: Cia301Bench, sdo: Sdo, sheet: Sheet) -> None:
    """Node id and time as they were written; 0 frees it."""
    other = watching(bench, sdo, sheet)
    for value in (entry(other, TIME_MS), entry(0, 0)):
        sdo.write(CONSUMER, 1, value, requirement="C-HBC-01")
        data = sdo.read(CONSUMER, 1)
        bench.check(data == value, f"1016h:01 is {value.hex()}; it is {data.hex()}")


@pytest.mark.requirement("C-HBC-01", "EC-04")
@pytest.mark.parametrize(("other", "time_ms"), [(0, 200), (42, 0)])
def test_an_entry_without_node_or_time_is_not_used(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, other: int, time_ms: int
) -> None:
    """A heartbeat and then silence lead to no event; one that is refused is as good."""
    bench.needs_exclusive()
    needs_writable(sheet, (CONSUMER, 1))
    bench.start()
    outcome = sdo.try_write(CONSUMER, 1, entry(other, time_ms))
    if isinstance(outcome, Abort):
        bench.characteristic("C-HBC-01", f"an entry {entry(other, time_ms).hex()} is refused")
        return
    sent = beat(bench, other or watched_id(bench))
    expect_no_event(bench, sent, 2000 * MS, "C-HBC-01")


@pytest.mark.requirement("C-HBC-02", "EC-04")
def test_before_the_first_heartbeat_there_is_no_event(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet
) -> None:
    """However long none comes."""
    watching(bench, sdo, sheet)
    expect_no_event(bench, bench.now(), 10 * TIME_MS * MS, "C-HBC-02")


@pytest.mark.requirement("C-HBC-02", "C-HBC-07")
def test_a_boot_up_does_not_begin_the_watch(bench: Cia301Bench, sdo: Sdo, sheet: Sheet) -> None:
    """A node that was never heard boots up and is silent: no event when the time is over."""
    other = watching(bench, sdo, sheet)
    booted = beat(bench, other, b"\x00")
    at_once = bench.first(event(bench), booted, booted.at + TIME_MS * MS // 2)
    if at_once:
        bench.characteristic("C-HBC-07", "the boot-up of a watched node is an event at once")
        return
    expect_no_event(bench, booted, 5 * TIME_MS * MS, "C-HBC-02")


@pytest.mark.requirement("C-HBC-03", "C-HBC-06", "EC-04", "C-EM-03", "C-EM-21")
@pytest.mark.parametrize("time_ms", [50, 200, 1000])
def test_a_heartbeat_that_stays_away_is_an_event(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, time_ms: int
) -> None:
    """EMCY 8130h when the consumer time is over, counted from the last beat, and once."""
    other = watching(bench, sdo, sheet, time_ms)
    for _ in range(2):
        beat(bench, other)
        bench.wait(time_ms * MS // 2)
    last = beat(bench, other)
    emcy = expect_event(bench, last, time_ms * MS, "C-HBC-03", "C-HBC-06")
    expect_register(bench, sdo, emcy, "C-EM-21")
    expect_no_event(bench, emcy, 5 * time_ms * MS, "C-EM-02")


@pytest.mark.requirement("C-HBC-06", "EC-04")
def test_a_producer_that_is_a_little_faster_never_leads_to_one(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet
) -> None:
    """Twenty beats with 95 % of the consumer time between them."""
    other = watching(bench, sdo, sheet)
    time_ns = TIME_MS * MS
    pause_ns = time_ns * 95 // 100
    expect_none_while_fed(bench, lambda: beat(bench, other), 20, pause_ns, time_ns, "C-HBC-06")


@pytest.mark.requirement("C-HBC-08", "EC-04")
def test_heartbeats_that_come_again_end_the_event(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet
) -> None:
    """EMCY 0000h, and the next silence is an event again."""
    other = watching(bench, sdo, sheet)
    expect_event(bench, beat(bench, other), TIME_MS * MS, "C-HBC-03", "C-HBC-06")
    again = beat(bench, other)
    expect_recovery(bench, again, "C-HBC-08")
    expect_event(bench, again, TIME_MS * MS, "C-HBC-03", "C-HBC-06")


@pytest.mark.requirement("C-EM-22", "EC-04", "C-HBC-03")
@pytest.mark.parametrize("behaviour", [0, 1, 2])
def test_a_missing_heartbeat_leads_where_1029h_says(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, behaviour: int
) -> None:
    """From operational: 0 to pre-operational, 1 nowhere, 2 to stopped."""
    needs_writable(sheet, (BEHAVIOUR, 1))
    other = watching(bench, sdo, sheet)
    without_heartbeat(sdo, sheet)  # it would show a state that no command led to
    prepare_reaction(bench, sdo, behaviour)
    expect_event(bench, beat(bench, other), TIME_MS * MS, "C-HBC-03", "C-HBC-06")
    expect_reaction(bench, sdo, behaviour, "C-EM-22")


def second_entry(sheet: Sheet) -> None:
    """The device must have two entries."""
    if sheet.get(CONSUMER, 2) is None:
        raise NotApplicable(f"the device has no {shown(CONSUMER, 2)}")


@pytest.mark.requirement("C-HBC-04")
def test_a_node_is_watched_by_one_entry_alone(bench: Cia301Bench, sdo: Sdo, sheet: Sheet) -> None:
    """A second active entry for it is refused."""
    second_entry(sheet)
    other = watching(bench, sdo, sheet)
    outcome = sdo.try_write(CONSUMER, 2, entry(other, TIME_MS))
    sdo.expect_abort(outcome, accepted.INCOMPATIBLE, "a second entry for the same node")


@pytest.mark.requirement("C-HBC-05")
def test_an_entry_can_be_written_again(bench: Cia301Bench, sdo: Sdo, sheet: Sheet) -> None:
    """The same node in the same sub-index, with another time."""
    other = watching(bench, sdo, sheet)
    sdo.write(CONSUMER, 1, entry(other, TIME_MS), requirement="C-HBC-05")
    sdo.write(CONSUMER, 1, entry(other, 2 * TIME_MS), requirement="C-HBC-05")


@pytest.mark.requirement("C-HBC-07")
def test_what_a_boot_up_means_is_written_down(bench: Cia301Bench, sdo: Sdo, sheet: Sheet) -> None:
    """The boot-up of a watched node, between two beats."""
    other = watching(bench, sdo, sheet)
    beat(bench, other)
    sent = beat(bench, other, b"\x00")
    seen = bench.first(event(bench), sent, sent.at + TIME_MS * MS // 2)
    told = "is an event at once" if seen else "is no event by itself"
    bench.characteristic("C-HBC-07", f"the boot-up of a watched node {told}")


@pytest.mark.requirement("C-HBC-09", "EC-04")
@pytest.mark.parametrize("silent", [1, 2])
def test_every_entry_works_by_itself(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, silent: int
) -> None:
    """Two nodes are watched; either falls silent while the other goes on."""
    second_entry(sheet)
    nodes = [watching(bench, sdo, sheet), watched_id(bench, 1)]
    expect_event(bench, beat(bench, nodes[0]), TIME_MS * MS, "C-HBC-03", "C-HBC-06")
    sdo.write(CONSUMER, 2, entry(nodes[1], TIME_MS), requirement="C-HBC-01")
    lost = nodes.pop(silent - 1)
    (other,) = nodes
    beat(bench, other)
    last = beat(bench, lost)
    for _ in range(6):
        beat(bench, other)
        bench.wait(TIME_MS * MS // 4)
    limits = bench.profile.limits
    within = TIME_MS * MS + limits.life_ns + limits.emcy_ns
    bench.expect(event(bench), after=last, within=within, requirement="C-HBC-09")


@pytest.mark.requirement("C-HBC-09", "EC-04")
def test_an_entry_that_is_freed_leads_to_no_late_event(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet
) -> None:
    """0 is written while the time runs."""
    other = watching(bench, sdo, sheet)
    sent = beat(bench, other)
    sdo.write(CONSUMER, 1, entry(0, 0), requirement="C-HBC-01")
    value = number(sdo.read(CONSUMER, 1))
    bench.check(value == 0, f"1016h:01 is 0; it is {value:08X}h", requirement="C-HBC-01")
    expect_no_event(bench, sent, 5 * TIME_MS * MS, "C-HBC-09")
