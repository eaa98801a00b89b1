"""Expecting, excluding, collecting: both sides of each limit, and what is not known."""

from __future__ import annotations

import pytest

from hil_tests.bench.judging import BUSY_PATIENCE_NS, LOOK_ON_NS
from hil_tests.bench.virtual import VirtualStage
from hil_tests.clock import MS, Interval, S, exactly
from hil_tests.judge import matchers
from hil_tests.judge.cobs import Nmt, State
from hil_tests.judge.matchers import cob
from hil_tests.judge.verdict import (
    DeviceFailure,
    InconclusiveResult,
    Limits,
    NotRun,
    Outcome,
)
from hil_tests.trace import BusEvent, EventKind, Sighting
from node_model import devices
from node_model.frame import Frame
from tests.bench.fakes import HOME, PROFILE, FakePort, bench_of

FRAME = "181#00"
MATCH = cob(0x181)
LIMIT = 100 * MS


@pytest.mark.parametrize(
    ("at", "outcome"),
    [
        (10 * MS - 1, DeviceFailure),
        (10 * MS, None),
        (LIMIT, None),
        (LIMIT + 1, DeviceFailure),
        (LIMIT + LOOK_ON_NS, DeviceFailure),
    ],
)
def test_expect_judges_both_ends_of_its_limits(at: int, outcome: type[Exception] | None) -> None:
    """A frame at a limit passes; one nanosecond outside fails, with the span that was measured."""
    port = FakePort()
    bench, _ = bench_of(port)
    bench.begin()
    port.plays(FRAME, at)
    within = Limits(10 * MS, LIMIT)
    if outcome is None:
        seen = bench.expect(MATCH, after=0, within=within)
        assert seen.at == at
        assert bench.verdicts[-1].outcome is Outcome.PASS
        return
    with pytest.raises(outcome) as caught:
        bench.expect(MATCH, after=0, within=within)
    assert bench.verdicts[-1].measured == exactly(at)
    assert "181" in str(caught.value)


def test_a_frame_that_stays_away_is_told_as_missing() -> None:
    """Late and missing are different words: nothing was measured, and it says how long it was."""
    bench, _ = bench_of()
    bench.begin()
    with pytest.raises(DeviceFailure, match="none came in 350 ms"):
        bench.expect(MATCH, after=0, within=LIMIT)
    assert bench.now() == LIMIT + LOOK_ON_NS
    assert bench.verdicts[-1].measured is None


@pytest.mark.parametrize(
    ("doubt_ns", "outcome"),
    [(0, Outcome.FAIL), (5 * MS, Outcome.FAIL), (10 * MS, Outcome.INCONCLUSIVE)],
)
def test_doubt_that_straddles_the_limit_is_inconclusive(doubt_ns: int, outcome: Outcome) -> None:
    """A frame 6 ms too late fails unless it may have been asked for in time."""
    port = FakePort()
    bench, _ = bench_of(port)
    bench.begin()
    port.plays(FRAME, LIMIT + 6 * MS, doubt_ns)
    with pytest.raises((DeviceFailure, InconclusiveResult)):
        bench.expect(MATCH, after=0, within=LIMIT)
    assert bench.verdicts[-1].outcome is outcome


def test_the_doubt_of_the_stimulus_counts_as_well() -> None:
    """From a stimulus in an interval the span is known to that interval."""
    port = FakePort()
    bench, _ = bench_of(port)
    bench.begin()
    port.plays(FRAME, LIMIT + 2 * MS)
    with pytest.raises(InconclusiveResult):
        bench.expect(MATCH, after=Interval(0, 5 * MS), within=LIMIT)


def test_own_frames_and_others_are_not_what_is_expected() -> None:
    """Only a frame of somebody else that matches will do."""
    port = FakePort()
    bench, _ = bench_of(port)
    bench.begin()
    bench.send(Frame(0x181, b"\x00"))
    port.plays("182#00", 20 * MS)
    port.plays(FRAME, 30 * MS)
    assert bench.expect(MATCH, after=0, within=LIMIT).at == 30 * MS


@pytest.mark.parametrize("after_frame", [False, True])
def test_first_looks_behind_what_it_counts_from(after_frame: bool) -> None:
    """After a frame comes the next one; after an instant one at that very instant counts."""
    port = FakePort()
    bench, _ = bench_of(port)
    bench.begin()
    port.plays(FRAME, 10 * MS)
    port.plays(FRAME, 20 * MS)
    bench.wait(50 * MS)
    found = bench.first(MATCH, bench.seen(0) if after_frame else 10 * MS, bench.now())
    assert found is not None
    assert found.at == (20 * MS if after_frame else 10 * MS)


def test_first_gives_up_at_its_instant() -> None:
    """Nothing by then is None, not an error."""
    port = FakePort()
    bench, _ = bench_of(port)
    bench.begin()
    port.plays(FRAME, LIMIT + 1)
    assert bench.first(MATCH, 0, LIMIT) is None
    assert bench.now() == LIMIT


@pytest.mark.parametrize(
    ("at", "doubt_ns", "outcome"),
    [
        (10 * MS - 1, 0, Outcome.PASS),
        (10 * MS, 0, Outcome.FAIL),
        (10 * MS, 1, Outcome.INCONCLUSIVE),
        (60 * MS, 1, Outcome.FAIL),
        (110 * MS, 0, Outcome.FAIL),
        (110 * MS + 1, 0, Outcome.PASS),
    ],
)
def test_never_judges_both_ends_of_its_span(at: int, doubt_ns: int, outcome: Outcome) -> None:
    """A frame in the span fails; one that may lie before it is inconclusive; others are free."""
    port = FakePort()
    bench, _ = bench_of(port)
    bench.begin()
    port.plays(FRAME, at, doubt_ns)
    raises = {Outcome.FAIL: DeviceFailure, Outcome.INCONCLUSIVE: InconclusiveResult}
    if outcome is Outcome.PASS:
        bench.never(MATCH, after=10 * MS, for_ns=LIMIT)
        assert bench.now() == 10 * MS + LIMIT
    else:
        with pytest.raises(raises[outcome], match="none is allowed"):
            bench.never(MATCH, after=10 * MS, for_ns=LIMIT)
    assert bench.verdicts[-1].outcome is outcome


@pytest.mark.parametrize(("until", "count"), [(9 * MS, 0), (10 * MS, 1), (20 * MS, 2), (S, 3)])
def test_collect_takes_what_was_seen_in_a_span(until: int, count: int) -> None:
    """Both ends count; what was not waited for is not there."""
    port = FakePort()
    bench, _ = bench_of(port)
    bench.begin()
    for at in (10, 20, 30):
        port.plays(FRAME, at * MS)
    bench.wait(50 * MS)
    assert len(bench.collect(MATCH, after=1 * MS, until=until)) == count


@pytest.mark.parametrize(("patience_ns", "count"), [(20 * MS, 3), (20 * MS - 1, 1)])
def test_beats_end_where_one_stays_away(patience_ns: int, count: int) -> None:
    """A beat within patience counts; one that comes later ends the count."""
    port = FakePort()
    bench, _ = bench_of(port)
    bench.begin()
    for at in (10, 30, 50):
        port.plays(FRAME, at * MS)
    found = bench.beats(MATCH, 3, after=0, patience_ns=patience_ns)
    assert len(found) == count
    assert len({seen.at for seen in found}) == count


@pytest.mark.slow
def test_a_full_bus_is_inconclusive() -> None:
    """On a wire that was never free nobody can say that a frame was not asked for."""
    port = FakePort(timed=True)
    bench, _ = bench_of(port)
    bench.begin()
    frame = Frame(0x001, bytes(8))
    span_ns = (frame.bits + 3) * 4000
    end = LIMIT + LOOK_ON_NS + BUSY_PATIENCE_NS + S
    for at in range(span_ns, end, span_ns):
        port.coming.append(Sighting(frame, at))
    with pytest.raises(InconclusiveResult, match="the bus was never free"):
        bench.expect(MATCH, after=0, within=LIMIT)


def test_a_free_bus_is_no_excuse() -> None:
    """The same on a wire that was busy for a while and then idle is a failure."""
    port = FakePort(timed=True)
    bench, _ = bench_of(port)
    bench.begin()
    frame = Frame(0x001, bytes(8))
    for number in range(1, 50):
        port.plays(frame, number * (frame.bits + 3) * 4000)
    with pytest.raises(DeviceFailure, match="none came"):
        bench.expect(MATCH, after=0, within=LIMIT)


def test_an_error_frame_does_not_stop_the_judge() -> None:
    """Bus events between the frames are recorded, and looking goes on."""
    port = FakePort()
    bench, _ = bench_of(port)
    bench.begin()
    port.tells(BusEvent(EventKind.ERROR, 10 * MS))
    port.plays(FRAME, 20 * MS)
    assert bench.expect(MATCH, after=0, within=LIMIT).at == 20 * MS


def test_checks_leave_a_verdict_also_when_they_pass() -> None:
    """Passed, failed and characteristic are all in the results, on the requirement named."""
    bench, _ = bench_of()
    bench.begin()
    bench.check(True, "two and two are four", requirement="NMT-02")
    bench.characteristic("NMT-22", "it sends none")
    with pytest.raises(DeviceFailure, match="five"):
        bench.check(False, "two and two are five", requirement="NMT-01")
    assert [(each.requirement, each.outcome) for each in bench.verdicts] == [
        ("NMT-02", Outcome.PASS),
        ("NMT-22", Outcome.CHARACTERISTIC),
        ("NMT-01", Outcome.FAIL),
    ]


def test_a_failure_shows_the_frames_in_between() -> None:
    """The evidence begins where the check counted from; without frames it says so."""
    port = FakePort()
    bench, _ = bench_of(port)
    bench.begin()
    assert "no frame was seen" in bench.evidence(None)
    port.plays("701#7F", 1 * MS)
    port.plays("701#05", 2 * MS)
    bench.wait(5 * MS)
    assert "701#05" in bench.evidence(2 * MS)
    assert "701#7F" not in bench.evidence(2 * MS)


@pytest.mark.parametrize(
    ("byte", "state"),
    [("7F", State.PRE_OPERATIONAL), ("05", State.OPERATIONAL), ("04", State.STOPPED)],
)
def test_the_state_is_read_from_the_first_heartbeat_after_the_effect(
    byte: str, state: State
) -> None:
    """A beat that may still show the old state is passed over."""
    port = FakePort()
    bench, _ = bench_of(port)
    bench.begin()
    command = bench.nmt(Nmt.START)
    settled = command.at + PROFILE.limits.command_ns
    port.plays("701#00", settled - 1)
    port.plays(f"701#{byte}", settled + 1)
    assert bench.shown_state(command) is state


def test_a_heartbeat_that_shows_no_state_fails() -> None:
    """A byte that stands for no state is a failure of HB-02."""
    port = FakePort()
    bench, _ = bench_of(port)
    bench.begin()
    command = bench.nmt(Nmt.START)
    port.plays("701#33", command.at + PROFILE.limits.command_ns + 1)
    with pytest.raises(DeviceFailure, match="shows no NMT state"):
        bench.shown_state(command)
    assert bench.verdicts[-1].requirement == "HB-02"


@pytest.mark.parametrize(
    ("before", "requirement"), [("00", "HB-06"), ("7F", "HB-01"), (None, "HB-01")]
)
@pytest.mark.parametrize("comes", [True, False])
def test_a_late_first_heartbeat_is_no_fault_of_the_period(
    before: str | None, requirement: str, comes: bool
) -> None:
    """From boot-up to the first beat there is HB-06; the period begins with that beat."""
    port = FakePort()
    bench, _ = bench_of(port)
    bench.begin()
    if before is not None:
        port.plays(f"701#{before}", 1 * MS)
    bench.wait(2 * MS)
    bench.send(Frame(0x701, b"\x05"))  # our own tell nothing
    command = bench.nmt(Nmt.START)
    if comes:
        port.plays("701#05", command.at + 2 * HOME.heartbeat_ns)
    with pytest.raises(DeviceFailure):
        bench.shown_state(command)
    assert bench.verdicts[-1].requirement == requirement


def test_without_heartbeat_no_state_can_be_seen() -> None:
    """A device that is commissioned without heartbeat is not blamed for it."""
    import attrs  # noqa: PLC0415

    bench, _ = bench_of(parameters=attrs.evolve(HOME, heartbeat_ms=0))
    bench.begin()
    with pytest.raises(NotRun, match="without heartbeat"):
        bench.shown_state(0)


def test_an_nmt_command_goes_to_the_device_unless_told_otherwise() -> None:
    """The node id of the device is the default; 0 means all."""
    port = FakePort()
    bench, _ = bench_of(port)
    bench.begin()
    bench.nmt(Nmt.STOP)
    bench.nmt(Nmt.START, 0)
    assert [str(frame) for frame in port.sent] == ["000#0201", "000#0100"]


def test_what_monitors_found_ends_an_example() -> None:
    """A property can ask in the middle; the finding is on the monitor's own requirement."""
    from hil_tests.bench.keypad import KeypadBench  # noqa: PLC0415

    stage = VirtualStage(devices.read("keypad", "heartbeat-of-two-bytes"))
    bench = KeypadBench(stage, PROFILE, HOME)
    bench.begin()
    bench.start()
    bench.wait(5 * S)
    with pytest.raises(DeviceFailure) as caught:
        bench.check_monitors()
    assert caught.value.verdict.requirement in {"HB-02", "ROB-02"}


def test_a_named_requirement_is_blamed_instead_of_the_tests_own() -> None:
    """The verdict of an expectation carries the id that it was given."""
    bench, _ = bench_of()
    bench.begin()
    with pytest.raises(DeviceFailure):
        bench.expect(matchers.boot_up(1), after=0, within=LIMIT, requirement="NMT-02")
    assert bench.verdicts[-1].requirement == "NMT-02"
