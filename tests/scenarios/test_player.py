"""Playing scenarios: a right keypad is spared, faulty ones are blamed, benches are respected."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise

import pytest

from hil_tests.bench.keypad import KeypadBench
from hil_tests.clock import MS
from hil_tests.config import Parameters
from hil_tests.explore.lab import Lab
from hil_tests.judge.verdict import DeviceFailure, Outcome, Verdict
from hil_tests.scenarios.contacts import held_by, order_of
from hil_tests.scenarios.play import conclude, judge, play
from hil_tests.scenarios.player import LeftOpen, Player
from hil_tests.scenarios.scenario import Step, scenario
from hil_tests.trace import BusEvent, EventKind, Moment
from tests.scenarios.labs import broken, doubted, first

LITTLE = "operational: 60ms keys 1"
KEYS = (
    "operational debounce=1: 60ms keys 1; 200ms keys 0; 200ms nmt stop; 60ms keys 11;"
    " 300ms nmt start; 200ms keys 0"
)
COMMANDS = (
    "pre-operational heartbeat_ms=50: 200ms nmt start; 110ms nmt stop all; 60ms nmt 04;"
    " 60ms nmt start other; 60ms nmt reset-node; 160ms nmt reset-communication all;"
    " 60ms send 000#02; 160ms nmt start"
)
LIGHTS = (
    "operational: 60ms led 03; 60ms blink 0C; 0ms look; 60ms led 0C; 60ms led 00; 0ms look;"
    " 60ms nmt reset-node; 60ms led 55; 100ms nmt start; 60ms look"
)
WAIT = (
    "off: 0ms keys 11; 0ms power on; 20ms nmt start; 20ms request 060200320001; 1s wait;"
    " 20ms request 0F0200320001; 1s power off; 0ms keys 0; 300ms power on; 200ms nmt start;"
    " 500ms keys 1; 200ms wait"
)
REFUSED = (
    "off: 0ms keys 11; 0ms power on; 20ms send 205#060200320001; 150ms request 000200640001;"
    " 150ms power off; 0ms keys 0; 0ms power on"
)
CUT = (
    "off node_id=6: 0ms keys 11; 0ms power on; 0ms request 0B0200320001; 3ms power off;"
    " 0ms keys 0; 300ms power on; 200ms nmt start"
)
RATES = (
    "operational: 0ms rate 500000; 50ms keys 1; 50ms nmt stop; 100ms rate own; 300ms keys 0;"
    " 100ms power off; 0ms power off; 10ms nmt start; 300ms power on; 10ms power on; 0ms rate own"
)
NOISE = (
    "operational heartbeat_ms=50: 110ms send 123#R8; 110ms send +600#4000100000000000;"
    " 110ms send 1FFFFFFF#; 110ms send 7FF#1122334455667788_F; 110ms send 4F8#060200320001;"
    " 610ms power off; 300ms power on; 50ms look"
)


@pytest.mark.parametrize(
    "text", [LITTLE, KEYS, COMMANDS, LIGHTS, WAIT, REFUSED, CUT, RATES, NOISE]
)
def test_a_right_keypad_breaks_nothing(text: str) -> None:
    """Whatever is done to it, nothing is wrong, and no doubt is left in virtual time."""
    assert broken(text) == frozenset()
    assert doubted(text) == []


@pytest.mark.parametrize(
    ("model", "text", "requirement"),
    [
        ("debounce-too-short", KEYS, "KEY-05"),
        ("entry-frame-missing", KEYS, "KEY-01"),
        ("key-bits-swapped", KEYS, "KEY-03"),
        ("reports-in-stopped", KEYS, "KEY-07"),
        ("obeys-unknown-commands", "pre-operational heartbeat_ms=50: 110ms nmt 05", "NMT-05"),
        ("ignores-stop", "operational heartbeat_ms=50: 110ms nmt stop; 60ms wait", "NMT-07"),
        ("obeys-one-byte", "operational heartbeat_ms=50: 110ms send 000#02", "NMT-05"),
        ("boot-up-twice", COMMANDS, "NMT-02"),
        ("emcy-missing", COMMANDS, "NMT-02"),
        ("emcy-without-register", COMMANDS, "NMT-20"),
        ("heartbeat-too-slow", "pre-operational heartbeat_ms=50: 300ms wait", "HB-06"),
        ("steady-ignored", "operational: 60ms led 03; 0ms look", "LED-01"),
        ("blink-ignored", LIGHTS, "LED-02"),
        ("steady-ignored", "operational: 60ms led 03; 0ms watch 2500ms", "LED-01"),
        ("leds-late", "operational: 60ms led 80; 0ms watch 2500ms", "LED-01"),
        ("blink-light-too-long", "operational: 60ms blink 05; 0ms watch 2500ms", "LED-05"),
        ("blink-out-of-phase", "operational: 60ms blink 0F; 0ms watch 2500ms", "LED-05"),
        ("steady-takes-from-blink", LIGHTS, "LED-03"),
        ("leds-in-pre-operational", "pre-operational: 0ms led 01; 60ms nmt start; 0ms look",
         "LED-04"),
        ("leds-survive-reset", LIGHTS, "LED-21"),
        ("leds-on-after-reset", LIGHTS, "LED-21"),
        ("nmt-stops-echo", WAIT.replace("1s wait", "1s nmt stop all"), "COM-20"),
        ("echo-too-slow", WAIT, "COM-05"),
        ("second-request-changes-echo", WAIT, "COM-21"),
        ("takes-any-pdo", REFUSED, "COM-03"),
        ("takes-id-zero", REFUSED, "COM-22"),
        ("heartbeats-while-waiting", REFUSED, "COM-01"),
        ("stores-in-place", CUT.replace("3ms", "50ms"), "COM-26"),
        ("extended-frame-restarts", NOISE, "ROB-01"),
        ("remote-frame-restarts", NOISE, "ROB-01"),
        ("takes-parameters-in-operation", NOISE, "ROB-01"),
    ],
)  # fmt: skip
def test_a_faulty_keypad_is_blamed_for_its_fault(model: str, text: str, requirement: str) -> None:
    """What is blamed first is what the fault breaks; the right model is spared."""
    assert first(text, model) == requirement
    assert broken(text) == frozenset()


@pytest.mark.parametrize(
    "text",
    [
        "operational: 700ms blink 02; 0ms nmt stop; 0ms look; 0ms nmt start; 0ms look",
        "pre-operational: 0ms led 01; 5ms nmt start; 100ms look",
        "operational: 700ms led 02; 0ms nmt reset-node; 0ms nmt start; 0ms look",
    ],
)
def test_a_slow_light_may_miss_or_catch_a_change_of_state(text: str) -> None:
    """An LED frame may take its limit to act, and is judged by the state at either end of it."""
    assert broken(text, "slow-leds") == frozenset()
    assert broken(text) == frozenset()


HASTE = "off: 0ms power on; 300ms power off; 200ms power on"
TWICE = (
    "off: 0ms keys 11; 0ms power on; 20ms request 060200320001; 200ms request 0F0200320001;"
    " 1s power off; 0ms keys 1; 300ms power on"
)
DARK = (
    "off: 0ms keys 11; 0ms power on; 20ms request 060200320001; 150ms look; 0ms look;"
    " 0ms send 206#03; 0ms look; 0ms power off"
)
HELD = "off: 0ms keys 1; 0ms power on"
LONG = (
    "operational debounce=200: 60ms keys 100; 20650ms wait; 20ms keys 0; 20650ms wait;"
    " 20ms keys 100; 20650ms wait"
)


@pytest.mark.parametrize(
    ("model", "text", "requirement"),
    [
        ("code-two-is-default-of-cia", LITTLE, "COM-07"),
        (
            "code-six-is-ten",
            LITTLE.replace("operational", "operational bit_rate_code=6"),
            "COM-07",
        ),
        ("wrong-oscillator", LITTLE, "COM-07"),
        ("needs-longer-pause", HASTE, "NMT-02"),
        ("needs-longer-pause", CUT.replace("300ms", "200ms"), "NMT-02"),
        ("debounce-capped", LONG, "COM-10"),
        ("debounce-signed", LONG, "COM-10"),
        ("debounce-too-short", LONG, "KEY-05"),
        ("led-frame-lights-while-echoing", DARK, "COM-12"),
        ("second-request-changes-memory", TWICE, "COM-21"),
        ("commissions-with-one-key", TWICE, "COM-27"),
        ("code-two-is-default-of-cia", HELD, "COM-07"),
    ],
)
def test_silence_and_strange_times_are_looked_into(
    model: str, text: str, requirement: str
) -> None:
    """Another bit rate or debounce time, a longer pause, a key: what is found out is blamed."""
    assert broken(text, model) == {requirement}
    assert broken(text) == frozenset()


def test_late_is_not_lost() -> None:
    """What a scenario ends too soon to show is waited for, and then it is late (KEY-05)."""
    text = "operational debounce=1 sync_time=255: 60ms keys 100"
    assert broken(text, "sync-time-adds-to-debounce") == {"KEY-05"}
    assert broken(text) == frozenset()


def test_what_follows_from_another_reading_is_not_judged() -> None:
    """A device that takes a node id it should refuse is blamed for that alone."""
    text = REFUSED + "; 200ms nmt start; 500ms wait"
    assert broken(text, "takes-id-zero") == {"COM-22"}


# How it is played.


@pytest.fixture
def bench() -> KeypadBench:
    """A virtual bench with a right keypad."""
    lab = Lab()
    lab.bench.begin_example()
    return lab.bench


def played(bench: KeypadBench, text: str) -> Player:
    """A scenario whose steps were done, to be finished."""
    story = scenario(text)
    player = Player(bench)
    player.begin(story)
    for step in story.steps:
        player.do(step)
    return player


def moments(bench: KeypadBench, what: str) -> list[Moment]:
    """What was done of one kind."""
    return [moment for moment in bench.trace.moments() if moment.what == what]


def test_steps_are_done_when_they_should(bench: KeypadBench) -> None:
    """On an exact bench each step comes its span after the one before, also among keys."""
    text = "operational debounce=1: 30ms keys 1; 5ms keys 0; 7ms keys 1; 100ms nmt stop"
    player = played(bench, text)
    assert player.finish() == []
    edges = [moment.ended_at for moment in moments(bench, "keys")]
    assert [b - a for a, b in pairwise(edges)] == [5 * MS, 7 * MS]
    (stop,) = [s for s in bench.trace.frames() if s.frame.can_id == 0 and s.frame.data[0] == 2]
    assert 100 * MS < stop.at - edges[-1] < 101 * MS


def test_masks_choose_keys_from_both_ends(bench: KeypadBench) -> None:
    """Bits 0 and 1 are the commissioning keys, further ones count from the last of the others."""
    assert held_by(order_of(bench), 0b111) == {"on_off", "aut", "k8"}
    assert held_by(order_of(bench), 0b10) == {"aut"}
    assert held_by(order_of(bench), 0b1111_1111) == set(bench.profile.key_bits)
    assert held_by(order_of(bench), 1 << 63) == frozenset()


def test_the_end_waits_for_what_still_must_show(bench: KeypadBench) -> None:
    """A key that is pressed last is reported before the scenario is judged."""
    assert played(bench, LITTLE).finish() == []
    last = max(s.at for s in bench.trace.frames() if s.frame.can_id == 0x181)
    assert last > moments(bench, "keys")[-1].ended_at + 90 * MS


def test_what_is_left_to_the_maker_ends_it_quietly(bench: KeypadBench) -> None:
    """Both commissioning keys and more at power-on: nothing after that is judged (COM-28)."""
    text = "off: 0ms keys 111; 0ms power on; 100ms nmt start; 100ms keys 0"
    assert play(bench, scenario(text)) == []
    player = Player(bench)
    player.begin(scenario("off: 0ms keys 111"))
    player.do(Step(0, "keys", "111"))
    with pytest.raises(LeftOpen, match="COM-28"):
        player.do(Step(0, "power", "on"))
    assert player.finish() == []


def test_two_sets_that_start_alike_are_left_open(bench: KeypadBench) -> None:
    """Power was cut while it stored a set with its own node id: nobody can tell which it has."""
    text = CUT.replace("0B0200320001", "060200320001")
    assert play(bench, scenario(text)) == []
    assert not any(frame.frame.can_id == 0x706 for frame in bench.trace.frames())


def test_what_was_cut_is_told_by_its_node_id(bench: KeypadBench) -> None:
    """The old set or the new one, whole; keys that are held then are held again."""
    for held in ("keys 0", "keys 100"):
        bench.begin_example()
        assert play(bench, scenario(CUT.replace("keys 0", held))) == []
        assert sum(moment.detail["on"] is True for moment in moments(bench, "power")) == 3


# As a test.


def test_every_claim_is_recorded(bench: KeypadBench) -> None:
    """A scenario in which all is well is a PASS on each of them."""
    judge(bench, scenario(KEYS), "KEY-05", "KEY-06")
    last = bench.verdicts[-2:]
    assert [(verdict.requirement, verdict.outcome) for verdict in last] == [
        ("KEY-05", Outcome.PASS),
        ("KEY-06", Outcome.PASS),
    ]


def test_a_failure_shows_its_frames_and_how_to_see_it_again() -> None:
    """The note is a command with the scenario in it."""
    lab = Lab(model="debounce-too-short")
    lab.bench.begin_example()
    with pytest.raises(DeviceFailure, match=r"KEY-05: .*too early") as caught:
        judge(lab.bench, scenario(LITTLE), "KEY-06")
    assert "key frame of node 1" in str(caught.value)
    assert caught.value.__notes__ == [
        f"to see it again: nodeproof play {str(scenario(LITTLE))!r}",
    ]


def test_another_reading_hides_no_breach() -> None:
    """What nothing follows from is told last, whenever it was seen."""
    lab = Lab(model="emcy-of-another-hardware-code")
    lab.bench.begin_example()
    player = played(lab.bench, LITTLE)
    assert [each.requirement for each in player.finish()] == ["NMT-20"]
    late = Verdict("HB-01", Outcome.FAIL, "much later", at=lab.bench.now())
    player.found.append(late)
    with pytest.raises(DeviceFailure, match="HB-01: much later"):
        conclude(lab.bench, player, scenario(LITTLE))


def test_lost_frames_make_a_fault_doubtful() -> None:
    """Where the bus cost us frames, a missing one may be among them."""
    lab = Lab(model="entry-only-first-time")
    lab.bench.begin_example()
    player = played(lab.bench, "operational: 20ms nmt stop; 100ms nmt start")
    lab.bench.take(BusEvent(EventKind.OVERFLOW, lab.bench.now(), "the reader was too slow", 3))
    found = player.finish()
    assert [(each.requirement, each.outcome) for each in found] == [
        ("KEY-01", Outcome.INCONCLUSIVE)
    ]
    assert "perhaps, for frames were lost" in found[0].text


class _Stubborn(KeypadBench):
    """Its device cannot be commissioned as a scenario asks."""

    def fresh(self, prefer: Mapping[str, int] | None = None, **needed: int) -> Parameters:
        """What a real bench says when the device does not listen."""
        raise DeviceFailure(Verdict("COM-02", Outcome.FAIL, f"nobody listens {prefer} {needed}"))


def test_a_device_that_cannot_be_brought_to_the_beginning_is_blamed_for_that() -> None:
    """On a real bench the commissioning before a scenario can fail: no more is known then."""
    lab = Lab()
    bench = _Stubborn(lab.bench.stage, lab.bench.profile, lab.bench.home)
    bench.begin()
    assert [each.requirement for each in play(bench, scenario(LITTLE))] == ["COM-02"]


@pytest.mark.parametrize(
    "reset", ["nmt reset-node", "nmt reset-communication all", "send 000#8206", "nmt 81"]
)
def test_where_a_reset_with_both_keys_held_leads_is_left_open(reset: str) -> None:
    """Such a reset is not sent, and what was played before it is judged (COM-28)."""
    text = f"operational node_id=6: 60ms keys 11; 300ms {reset}; 100ms nmt start"
    for model in (None, "commissions-after-reset", "commissions-with-more-keys"):
        assert broken(text, model) == frozenset(), model
    assert "KEY-05" in broken(text, "debounce-too-short")


def test_a_reset_with_one_of_both_keys_held_is_played() -> None:
    """Nothing is left open there."""
    text = "operational: 0ms keys 1; 300ms nmt reset-node"
    assert broken(text) == frozenset()
    assert "NMT-06" in broken(text, "ignores-reset-node")


def test_the_first_scenario_of_a_bench_is_judged_like_every_other() -> None:
    """Keys that nobody has touched have been still for ever, not since time began."""
    lab = Lab(model="debounce-capped")
    line = scenario("off debounce=23: 0ms power on; 0ms nmt start; 60ms keys 100; 6570ms keys 0")
    found = [lab.play(line), lab.play(line)]
    assert [each.requirements for each in found if each] == [frozenset({"COM-10"})] * 2
