"""Machine-made mutants: private modules that serve them, killing, and the list of reasons.

`tox -e machine` tries them all; these hold the parts of that tool.
"""

from __future__ import annotations

import io
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TextIO

import pytest

from hil_tests.acceptance import test_keys, test_leds, test_start_and_nmt
from hil_tests.bench.keypad import KeypadBench
from hil_tests.bench.virtual import VirtualStage
from hil_tests.config import load_keypad
from hil_tests.judge.verdict import DeviceFailure
from node_model import emcy, keypad
from node_model.devices import KEYPAD, Blueprint, memory_with
from node_model.frame import Frame
from node_model.keypad import Keypad, Parameters
from node_model.node import MS, NOTHING, Frames, Panel, S
from tests.meta.machine.command import HARDWARE, explained, judge, main
from tests.meta.machine.mutating import Key, Mutant, mutants_of
from tests.meta.machine.serving import (
    LEFT_OUT,
    OF_OTHERS,
    PARTS,
    Maker,
    PrivateModules,
    all_mutants,
    source_of,
)
from tests.meta.machine.still import ENDLESS
from tests.meta.machine.trial import HUNG, KILLED, SURVIVED, UNDECIDED, Result

ROOT = Path(__file__).parents[2]


def found(where: str, text: str, was: str = "") -> Mutant:
    """The first mutant of a function of the keypad that reads so."""
    return next(
        mutant
        for mutant in all_mutants()
        if (mutant.function, mutant.becomes) == (where, text) and was in mutant.was
    )


# Serving.


def life_of(device: Panel) -> list[tuple[int, Frame]]:
    """Power-on, start, a key, an LED, reset: what a device says, and when."""
    said: list[tuple[int, Frame]] = []

    def note(now: int, frames: Frames) -> None:
        said.extend((now, frame) for frame in frames)

    inputs: dict[int, Callable[[int], Frames]] = {
        0: device.power_on,
        2 * S: lambda now: device.receive(Frame(0, b"\x01\x01"), now),
        3 * S: lambda now: device.hold(frozenset((device.keys[0],)), now),
        4 * S: lambda now: device.receive(Frame(0x201, b"\xff"), now),
        5 * S: lambda now: device.receive(Frame(0, b"\x81\x00"), now),
    }
    for until in (*inputs, 8 * S):
        while (due := device.deadline()) is not None and due <= until:
            note(due, device.advance(due))
        if until in inputs:
            note(until, inputs[until](until))
    return said


def test_the_right_keypad_lives_the_same_in_private() -> None:
    """Served from private modules, unchanged, the keypad says what it says elsewhere."""
    profile = keypad.load()
    private = Maker(PrivateModules())(profile)
    assert not isinstance(private, Keypad)
    assert life_of(private) == life_of(Keypad(profile))


def test_a_mutant_is_seen_by_nobody_else() -> None:
    """The modules of the interpreter stay as they are while a mutant is served."""
    before = {name: sys.modules[name] for name in PARTS}
    maker = Maker(PrivateModules(found("", "HARDWARE_ERROR = 20481")))
    assert life_of(maker(keypad.load()))[1][1].data[:2] == b"\x01\x50"
    assert emcy.HARDWARE_ERROR == 0x5000
    assert {name: sys.modules[name] for name in PARTS} == before


def test_memory_is_in_the_form_of_the_device() -> None:
    """A mutant that stores in another form starts with the parameters it comes with."""
    image = memory_with(Parameters(node_id=9).encode())
    device = Maker(PrivateModules(found("", "MARK = 166")))(keypad.load(), image)
    assert {frame.can_id & 0x7F for _, frame in life_of(device)} == {9}


@pytest.mark.parametrize(
    ("mutant", "what"),
    [
        (found("Debouncer.__init__", "pass", "due_at"), "AttributeError in Operation.deadline"),
        (found("Operation.advance", "while False:"), "spins"),
        (found("Keypad.__init__", "pass", "self.store"), "AttributeError"),
        (found("Keypad.__init__", "pass", "self.parts ="), "AttributeError in Keypad.__init__"),
    ],
)
def test_a_crashed_device_stands_still(mutant: Mutant, what: str) -> None:
    """A device whose program raises an error or never ends says no more until power is cut."""
    maker = Maker(PrivateModules(mutant))
    device = maker(keypad.load())
    device.power_on(0)
    for _ in range(ENDLESS + 2):
        device.advance(50 * MS)
    assert what in maker.crashes.first
    assert device.deadline() is None
    assert device.advance(9 * S) == NOTHING
    assert device.bit_rate == 0


# Killing.

Case = Callable[[KeypadBench], None]


def boots(bench: KeypadBench) -> None:
    """The acceptance test of the boot-up."""
    assert bench.power is not None
    test_start_and_nmt.test_boot_up_is_one_zero_byte(bench, bench.power)


def enters(bench: KeypadBench) -> None:
    """The acceptance test of the key frame on entry."""
    assert bench.keys is not None
    test_keys.test_every_key_has_its_bit(bench, bench.keys)


def shines(bench: KeypadBench) -> None:
    """The acceptance test of each LED by itself."""
    assert bench.leds is not None
    test_leds.test_every_led_alone_is_steady(bench, bench.leds)


def bench_with(maker: Maker) -> KeypadBench:
    """A virtual bench with devices of that maker."""
    profile = load_keypad("keypad")
    stage = VirtualStage(Blueprint(KEYPAD, keypad.load(), maker))
    bench = KeypadBench(stage, profile, profile.factory)
    bench.begin()
    return bench


@pytest.mark.parametrize(
    ("where", "text", "case"),
    [
        ("", "HEARTBEAT_BASE = 1793", boots),
        ("", "KEY_BASE = 385", enters),
        ("Operation.boot_frames", "return (self.emcy(),)", boots),
        ("Debouncer.advance", "self.settled |= ripe", enters),
        ("Lamps.set_steady", "pass", shines),
    ],
)
def test_a_handful_of_mutants_is_killed(where: str, text: str, case: Case) -> None:
    """The acceptance tests fail these mutants, and pass the keypad in the same clothes."""
    case(bench_with(Maker(PrivateModules())))
    with pytest.raises(DeviceFailure):
        case(bench_with(Maker(PrivateModules(found(where, text)))))


# The list of reasons.


def test_every_reason_is_for_a_mutant_that_exists() -> None:
    """No explained mutant, and no function that is left out, has gone from the sources."""
    known = {mutant.key for mutant in all_mutants()}
    assert [key for key in explained() if key not in known] == []
    functions = {
        (module, each.function)
        for module in PARTS
        for each in mutants_of(source_of(module), module)
    }
    assert [left for left in LEFT_OUT if left not in functions] == []


def test_what_is_of_other_devices_is_left_out_and_exists() -> None:
    """Each name in the list stands in its module, and no mutant changes it."""
    for module, names in OF_OTHERS.items():
        assert not [name for name in names if name.rpartition(".")[2] not in source_of(module)]
    kept = {each.function.partition(".")[0] for each in all_mutants()}
    assert not kept & {"EmergencyProducer", "HeartbeatService", "LongRecordStore"}
    assert {"HeartbeatProducer", "RecordStore", "emcy_frame"} <= kept


def test_a_reason_is_given_once_and_in_words(tmp_path: Path) -> None:
    """An entry without a reason and an entry that stands there twice are refused."""
    entry = '[[equivalent]]\nwhere = "emcy emcy_frame"\nwas = "a"\nbecomes = "b"\nwhy = "{}"\n'
    file = tmp_path / "list.toml"
    file.write_text(entry.format("no bus shows it"))
    assert explained(file) == {("node_model.emcy", "emcy_frame", "a", "b", 1): "no bus shows it"}
    file.write_text(entry.format(" "))
    with pytest.raises(ValueError, match="without a reason"):
        explained(file)
    file.write_text(entry.format("one") + entry.format("two"))
    with pytest.raises(ValueError, match="twice"):
        explained(file)


MUTANTS = mutants_of("x = 5\ny = a < b\n", "m")


@pytest.mark.parametrize(
    ("outcome", "reason", "good", "told"),
    [
        (KILLED, False, True, "1 killed"),
        (HUNG, False, True, "1 hung"),
        (SURVIVED, True, True, "1 survive with a reason"),
        (SURVIVED, False, False, "SURVIVES without a reason: m-1"),
        (KILLED, True, False, "STALE reason: m-1"),
        (UNDECIDED, False, False, "UNDECIDED without a reason: m-1"),
        (UNDECIDED, True, True, "1 undecided with a reason"),
    ],
)
def test_the_tool_fails_on_what_nobody_explained(
    outcome: str, reason: bool, good: bool, told: str
) -> None:
    """Survivors and doubts without a reason make it fail, and reasons without any of these."""
    reasons = {MUTANTS[0].key: "why not"} if reason else {}
    verdict = judge([(MUTANTS[0], Result(outcome))], reasons, MUTANTS)
    assert verdict.good is good
    assert told in "\n".join(verdict.lines)


def test_a_reason_for_no_mutant_is_stale() -> None:
    """What is explained and does not exist any more makes the tool fail."""
    gone = replace(MUTANTS[0], was="x = 7").key
    verdict = judge([(MUTANTS[0], Result(KILLED))], {gone: "why not"}, MUTANTS)
    assert not verdict.good
    assert "no such mutant" in "\n".join(verdict.lines)


def test_survivors_are_tried_on_other_hardware() -> None:
    """What the usual keypad hides is looked for on another one; the rest is not tried again."""
    tried: list[tuple[str, int]] = []

    def trial(profile: str, mutants: Sequence[Mutant], out: TextIO) -> Iterator[Result]:
        out.write("a row\n")
        tried.append((profile, len(mutants)))
        for number, _ in enumerate(mutants):
            yield Result(SURVIVED if number < 3 and len(tried) == 1 else KILLED)

    out = io.StringIO()
    reasons: Mapping[Key, str] = {}
    assert main(["emcy"], trial, reasons, out) == 0
    assert [profile for profile, _ in tried] == list(HARDWARE.values())
    assert tried[1][1] == 3
    assert "SURVIVES" not in out.getvalue()


# The whole, as it is used.


@pytest.mark.slow
def test_the_tool_kills_a_mutant() -> None:
    """The command collects the acceptance suite, tries a mutant, and says who killed it."""
    command = [sys.executable, "-m", "tests.meta.machine", "emcy-5", "blink-2"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert "killed    emcy-5" in done.stdout, done.stdout + done.stderr
    assert "NMT-20" in done.stdout
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.slow
def test_other_hardware_is_spared() -> None:
    """No acceptance test fails a right panel whose hardware differs from the usual keypad's."""
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "--can-strict"]
    command.append(f"--can-profile={HARDWARE['other hardware']}")
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr
