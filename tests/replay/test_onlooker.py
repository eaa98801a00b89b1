"""A recording without stimuli: what it shows is judged, what it cannot show is no blame."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import pytest

from hil_tests.bench.terms import expected_of
from hil_tests.clock import MS, US, S
from hil_tests.config import load_profile
from hil_tests.judge.expected import Expected, Family
from hil_tests.judge.verdict import Outcome
from hil_tests.replay.onlooker import Findings, Onlooker, grain, nodes
from hil_tests.replay.shown import Shown, shown
from hil_tests.requirements import load
from hil_tests.trace import BusEvent, EventKind, Sighting
from node_model.frame import Frame

GENERIC = load_profile("generic")


def device(period_ns: int | None = 100 * MS) -> Expected:
    """Node 5, with others on the bus."""
    known = expected_of(GENERIC, None, exclusive=False, family=Family.CIA301)
    known = replace(known, node_id=5)
    return known if period_ns is None else known.beating(period_ns)


def sent(at: int, text: str, *, own: bool = False) -> Sighting:
    """A frame, as text: "705#05"."""
    can_id, _, data = text.partition("#")
    if data == "R":
        return Sighting(Frame(int(can_id, 16), remote=True), at, own=own)
    return Sighting(Frame(int(can_id, 16), bytes.fromhex(data)), at, own=own)


def beats(since: int, count: int, state: str = "05", period: int = 100 * MS) -> list[Sighting]:
    """A row of heartbeats."""
    return [sent(since + number * period, f"705#{state}") for number in range(count)]


def watch(
    *entries: Sighting | BusEvent,
    expected: Expected | None = None,
    bit_ns: int = 0,
    doubt_ns: int = MS,
) -> Findings:
    """What is found in a recording."""
    onlooker = Onlooker(expected or device(), bit_ns, doubt_ns)
    assert len(list(onlooker.see_all(entries))) == len(entries)
    return onlooker.finish()


def told(found: Findings, expected: Expected | None = None) -> dict[str, Shown]:
    """What that says of each requirement."""
    rows = shown(load("generic"), expected or device(), found)
    return {row.requirement: row for row in rows}


def failed(found: Findings) -> list[str]:
    """The requirements that are broken for certain."""
    return [each.requirement for each in found.verdicts if each.outcome is Outcome.FAIL]


def test_a_right_heartbeat_passes_with_its_measure() -> None:
    """Enough undisturbed intervals, each and their mean."""
    rows = told(watch(*beats(0, 30)))
    assert rows["C-HB-04"].outcome is Outcome.PASS
    assert rows["C-HB-04"].verdicts[0].measured is not None
    assert rows["C-HB-02"].outcome is Outcome.PASS
    few = told(watch(*beats(0, 20)))["C-HB-04"]
    assert few.outcome is Outcome.INCONCLUSIVE


@pytest.mark.parametrize(
    ("period", "wrong"), [(105 * MS, False), (107 * MS, True), (93 * MS, True)]
)
def test_a_heartbeat_out_of_its_limits_fails(period: int, wrong: bool) -> None:
    """For certain: the doubt of the stamps is in it."""
    assert ("C-HB-04" in failed(watch(*beats(0, 3, period=period)))) is wrong


def test_a_heartbeat_of_unknown_period_is_measured_and_not_judged() -> None:
    """The text says what it is, and how to have it judged."""
    unknown = device(None)
    row = told(watch(*beats(0, 30), expected=unknown), unknown)["C-HB-04"]
    assert row.outcome is Outcome.NOT_RUN
    assert "29 intervals, mean 99.966 ms .. 100.034 ms; say what it should be" in row.text


def test_silence_of_everybody_may_not_be_recorded() -> None:
    """A missing beat counts where somebody else was heard meanwhile."""
    before, after = beats(0, 5), beats(S, 5)
    assert failed(watch(*before, *after)) == []
    assert watch(*before, *after).counts["gaps"] == 1
    other = [sent(at, "701#05") for at in range(450 * MS, 1000 * MS, 100 * MS)]
    assert "C-HB-04" in failed(watch(*before, *other, *after))


def test_marks_of_lost_frames_are_heeded() -> None:
    """What is missing may be among them."""
    lost = BusEvent(EventKind.GAP, 450 * MS, "", 3)
    other = [sent(at, "701#05") for at in range(450 * MS, 1000 * MS, 100 * MS)]
    assert failed(watch(*beats(0, 5), lost, *other, *beats(S, 5))) == []


def test_the_end_of_a_recording_is_no_silence() -> None:
    """Others may go on after the device has lost its supply."""
    other = [sent(at, "701#05") for at in range(450 * MS, 3 * S, 100 * MS)]
    assert failed(watch(*beats(0, 5), *other)) == []


def test_a_busy_bus_excuses_a_late_beat_where_bit_times_are_not_known() -> None:
    """With the bit rate the judge works out whether the bus was free."""
    crowd = [sent(at, "001#") for at in range(401 * MS, 520 * MS, 1 * MS)]
    entries = [*beats(0, 5), *crowd, *beats(520 * MS, 3)]
    found = watch(*entries)
    assert failed(found) == []
    assert any("say the bit rate" in each.text for each in found.verdicts)
    timed = watch(*entries, bit_ns=2 * US, doubt_ns=10 * US)
    assert "C-HB-04" in failed(timed)  # each takes 0.1 ms: there was room


def test_a_boot_up_may_follow_power_on() -> None:
    """The first one always; a later one, without a command, is doubtful."""
    start = [sent(0, "705#00"), *beats(100 * MS, 5, "7F")]
    again = [sent(5 * S, "705#00"), *beats(5 * S + 100 * MS, 5, "7F")]
    assert told(watch(*start))["C-NMT-13"].outcome is Outcome.NOT_RUN
    row = told(watch(*start, *again))["C-NMT-13"]
    assert row.outcome is Outcome.INCONCLUSIVE
    assert "1 boot-ups follow no command" in str(row.verdicts[0])
    assert told(watch(*start))["C-NMT-19"].outcome is Outcome.PASS


def test_commanded_resets_and_their_boot_ups() -> None:
    """Each passes; one that nobody followed is doubtful; one that was not obeyed fails."""
    reset = sent(550 * MS, "000#8105")
    boot = [sent(700 * MS, "705#00"), *beats(800 * MS, 5, "7F")]
    assert told(watch(*beats(0, 6), reset, *boot))["C-NMT-13"].outcome is Outcome.PASS
    assert told(watch(*beats(0, 6), reset))["C-NMT-13"].outcome is Outcome.INCONCLUSIVE
    deaf = [*beats(0, 6), reset, *beats(600 * MS, 30)]
    assert "C-NMT-13" in failed(watch(*deaf))


def test_commands_to_a_device_that_is_not_heard_are_none() -> None:
    """It may be without supply: no boot-up is owed for them."""
    entries = [sent(at * S, "000#8200") for at in range(5)]
    start = [sent(9 * S, "705#00"), *beats(9 * S + 100 * MS, 3, "7F")]
    found = watch(*entries, *start)
    assert failed(found) == []
    assert found.counts["unheard"] == 5
    assert found.counts["resets"] == 0


def test_a_boot_up_long_after_a_reset_is_explained_by_nothing() -> None:
    """Its supply may have been switched meanwhile: nobody can say that it is late."""
    reset = sent(600 * MS, "000#8105")
    for boot_ms, unexplained in ((1600, 0), (1601, 1)):
        boot = [sent(boot_ms * MS, "705#00"), sent((boot_ms + 100) * MS, "705#7F")]
        found = watch(*beats(0, 6), reset, *boot, expected=device(None))
        assert failed(found) == []
        assert found.counts["unexplained"] == unexplained


def test_the_state_that_is_shown_must_be_one_that_a_command_led_to() -> None:
    """Wherever the command came from."""
    start = [sent(0, "705#00"), *beats(100 * MS, 3, "7F")]
    command = sent(350 * MS, "000#0105")
    assert failed(watch(*start, command, *beats(400 * MS, 9))) == []
    assert "C-NMT-19" in failed(watch(*start, *beats(400 * MS, 9)))
    stop = sent(1250 * MS, "000#0205")
    wrong = watch(*start, command, *beats(400 * MS, 9), stop, *beats(1300 * MS, 9))
    assert "C-NMT-04" in failed(wrong)


def test_all_commands_must_be_there_for_a_pass() -> None:
    """One that was not given was not obeyed either."""
    entries = [*beats(0, 3, "7F")]
    for number, (command, state) in enumerate(
        (("01", "05"), ("02", "04"), ("80", "7F"), ("81", ""), ("82", ""))
    ):
        at = (number + 1) * S
        entries.append(sent(at, f"000#{command}05"))
        if not state:
            entries.append(sent(at + 50 * MS, "705#00"))
        entries += beats(at + 100 * MS, 9, state or "7F")
    row = told(watch(*entries, expected=device(None)), device(None))["C-NMT-04"]
    assert (row.outcome, row.text) == (Outcome.PASS, "")
    row = told(watch(*entries[:13], expected=device(None)), device(None))["C-NMT-04"]
    assert "no command stop, pre operational, reset node" in row.text


@pytest.mark.parametrize(
    ("frame", "broken"),
    [
        ("085#8130010000000000", []),
        ("085#8130", ["C-RB-02"]),
        ("585#4300100091010F00", []),
        ("585#43", ["C-RB-02"]),
        ("185#0102", ["C-TP-01"]),
        ("705#0505", ["C-RB-02", "C-HB-04"]),
        ("186#0102", []),
        ("185#R", []),
        ("080#", []),
        ("100#000000000000", []),
    ],
)
def test_frames_of_the_device_are_well_formed_and_in_their_state(
    frame: str, broken: list[str]
) -> None:
    """In pre-operational; requests, SYNC and frames of others are not the device's."""
    start = [sent(0, "705#00"), *beats(100 * MS, 3, "7F")]
    assert failed(watch(*start, sent(350 * MS, frame))) == broken


def test_what_the_recorder_sent_is_not_the_devices() -> None:
    """Where the recording says who sent it."""
    start = [sent(0, "705#00"), *beats(100 * MS, 3, "7F")]
    assert failed(watch(*start, sent(350 * MS, "185#0102", own=True))) == []


def test_what_takes_stimuli_is_not_run_and_says_so() -> None:
    """Every requirement of the catalogue has a row, each with a verdict or a reason."""
    rows = told(watch(*beats(0, 30)))
    assert list(rows) == list(load("generic"))
    for row in rows.values():
        assert row.verdicts or row.text
    keypad = dict.fromkeys(["KEY-01"], load("keypad")["KEY-01"])
    (row,) = shown(keypad, device(), Findings())
    assert row.text == "it takes stimuli (keys); a recording does not say when they were given"


def test_many_findings_are_told_up_to_a_number() -> None:
    """The others are counted."""
    found = watch(*(sent(at * 10 * MS, "085#81") for at in range(50)))
    row = told(found)["C-RB-02"]
    assert (len(row.verdicts), row.text) == (20, "and 30 more of the kind")


def test_error_frames_interrupt_the_cadence() -> None:
    """They are counted, and nothing is blamed for what they kept back."""
    found = watch(*beats(0, 5), BusEvent(EventKind.ERROR, 450 * MS), *beats(640 * MS, 5))
    assert failed(found) == []
    assert found.counts["errors"] == 1


def test_who_is_there_and_how_fine_stamps_are() -> None:
    """Node ids of error control; the unit in which stamps count."""
    entries: Iterable[Sighting | BusEvent] = [
        sent(1 * MS, "705#05"),
        sent(2 * MS, "705#05"),
        sent(3 * MS, "77F#00"),
        sent(4 * MS, "706#R"),
        sent(5 * MS, "185#00"),
        BusEvent(EventKind.ERROR, 6 * MS),
    ]
    assert nodes(entries) == {5: 2, 127: 1}
    assert grain(entries) == MS
    assert grain([sent(1 * MS, "705#"), sent(7 * US, "705#")]) == US
    assert grain([sent(1 * MS, "705#"), sent(7, "705#"), sent(7 * US, "705#")]) == 1
