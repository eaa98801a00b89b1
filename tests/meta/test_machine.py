"""Machine-made mutants: operators, names that last, private modules, and the list of reasons.

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
from tests.meta.machine.command import HARDWARE, chosen, explained, judge, main
from tests.meta.machine.mutating import Key, Mutant, brief, mutants_of
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


def becomes(source: str) -> set[str]:
    """What the mutants of a source make of its statements."""
    return {mutant.becomes for mutant in mutants_of(source, "m")}


def found(where: str, text: str, was: str = "") -> Mutant:
    """The first mutant of a function of the keypad that reads so."""
    return next(
        mutant
        for mutant in all_mutants()
        if (mutant.function, mutant.becomes) == (where, text) and was in mutant.was
    )


# Operators.


@pytest.mark.parametrize(
    ("source", "wanted"),
    [
        ("x = a < b", {"x = a <= b", "x = a >= b"}),
        ("x = a == b", {"x = a != b"}),
        ("x = a is not None", {"x = a is None"}),
        ("x = a in b", {"x = a not in b"}),
        ("x = a + b", {"x = a - b"}),
        ("x = a ^ b", {"x = a & b", "x = a | b"}),
        ("x = -a", {"x = a"}),
        ("x += y", {"x -= y", "x = y", "pass"}),
        ("x = 5", {"x = 6", "x = 4"}),
        ("x = True", {"x = False"}),
        ("x = None", {"x = 0"}),
        ("x = b''", {"x = b'\\x00'"}),
        ("x = a.to_bytes(n, 'big')", {"x = a.to_bytes(n, 'little')"}),
        ("x = 'text'", set()),
        ("x = a and b", {"x = a or b", "x = a", "x = b"}),
        ("x = not a", {"x = a"}),
        ("x = a if b else c", {"x = a", "x = c"}),
        ("if a:\n    b()", {"if True:", "if False:", "if not a:", "pass"}),
        ("while a < b:\n    c = d", {"while False:", "while a <= b:", "while a >= b:"}),
        ("for a in b:\n    c = a", {"pass"}),
        ("x = [a for a in b if a]", {"x = [a for a in b]"}),
        ("self.a = b", {"pass"}),
        ("a = b", set()),
        ("raise ValueError('a' + 'b')", {"pass"}),
        ("x = min(a)", {"x = max(a)"}),
        ("x = (a, b)", {"x = (b, a)"}),
        ("f((a, b))", {"pass", "f((a,))", "f((b,))", "f((b, a))"}),
        ("x = {1: a}", {"x = {}", "x = {2: a}", "x = {0: a}"}),
        ("x = a[1:b]", {"x = a[:b]", "x = a[1:]", "x = a[2:b]", "x = a[0:b]"}),
        ("x = NmtState.STOPPED", {"x = NmtState.OPERATIONAL"}),
    ],
)
def test_operators_change_one_thing(source: str, wanted: set[str]) -> None:
    """Each operator makes of a statement what it should, and nothing else does anything."""
    assert becomes(source) == wanted


@pytest.mark.parametrize(
    ("annotation", "wanted"),
    [
        ("bool", {"return True", "return False"}),
        ("Frames", {"return ()", "return (*a, *a)"}),
        ("int", {"return 0"}),
        ("int | None", {"return None"}),
        ("Frame", set()),
    ],
)
def test_results_change_as_the_annotation_allows(annotation: str, wanted: set[str]) -> None:
    """A function may return another value of its type."""
    assert becomes(f"def f(a) -> {annotation}:\n    return a") == wanted


def test_what_does_not_act_is_left_alone() -> None:
    """Docstrings, annotations, decorators, imports, slots and texts of errors stay."""
    source = '''
"""Text."""
from a import b
@c(slots=True)
class D(E):
    """Text."""
    __slots__ = ("a", "b")
    f: int | None
'''
    assert becomes(source) == set()


def test_every_mutant_is_a_program() -> None:
    """Each mutant of the keypad differs from its source, and can be compiled."""
    sources = PrivateModules()
    for mutant in all_mutants()[::7]:
        tree = sources.tree(mutant.module)
        compile(mutant.applied(tree), "mutant", "exec", dont_inherit=True)
        assert mutant.was != mutant.becomes


# Names.

SOURCE = "def f(a):\n    if a < 3:\n        return a + 1\n    return a + 1\n"


def test_keys_survive_edits_elsewhere() -> None:
    """Lines, comments and functions above a mutant change its number and line, not its key."""
    above = "# a comment\nx = 3\n\n\ndef e(b):\n    return b - 1\n\n\n"
    before = {mutant.key for mutant in mutants_of(SOURCE, "m")}
    after = {mutant.key for mutant in mutants_of(above + SOURCE, "m")}
    assert before < after


def test_the_same_change_twice_is_told_apart() -> None:
    """Equal statements of one function have equal texts and count their turns."""
    turns = [each.turn for each in mutants_of(SOURCE, "m") if each.becomes == "return a - 1"]
    assert turns == [1, 2]
    assert len({mutant.key for mutant in all_mutants()}) == len(all_mutants())


def test_long_statements_are_told_around_the_change() -> None:
    """Of a long table only the neighbourhood of the changed entry is in the key."""
    was = f"x = {{{', '.join(f'name_{n}: {n}' for n in range(40))}}}"
    old, new = brief(was, was.replace("name_20: 20", "name_20: 21"))
    assert "name_20: 20" in old
    assert "name_20: 21" in new
    assert max(map(len, (old, new))) < 140
    assert "name_1:" not in old
    assert "name_39" not in old


def test_mutants_are_chosen_by_module_function_or_name() -> None:
    """A name means all that it fits; one that fits none is refused."""
    everything = all_mutants()
    assert {each.module for each in chosen(["emcy"], everything)} == {"node_model.emcy"}
    assert {each.function for each in chosen(["Operation.fire"], everything)} == {"Operation.fire"}
    assert [each.number for each in chosen(["emcy-2"], everything)] == [2]
    with pytest.raises(ValueError, match="nonesuch"):
        chosen(["nonesuch"], everything)


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
        (UNDECIDED, False, False, "UNDECIDED: m-1"),
        (UNDECIDED, True, False, "UNDECIDED: m-1"),
    ],
)
def test_the_tool_fails_on_what_nobody_explained(
    outcome: str, reason: bool, good: bool, told: str
) -> None:
    """Survivors without a reason, reasons without a survivor, and doubts make it fail."""
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
