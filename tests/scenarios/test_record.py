"""Reading a life of a device from a trace, in the words of the oracles."""

from __future__ import annotations

from dataclasses import replace

import pytest

from hil_tests.bench.keypad import KeypadBench
from hil_tests.bench.virtual import VirtualStage
from hil_tests.clock import FOREVER, MS
from hil_tests.config import load_keypad
from hil_tests.explore.lab import Lab
from hil_tests.judge.cobs import Nmt
from hil_tests.judge.lights import Chance, Leave, Look, Restart, Write
from hil_tests.scenarios.play import play
from hil_tests.scenarios.record import Life
from hil_tests.scenarios.scenario import scenario
from hil_tests.trace import BusEvent, EventKind, Moment
from node_model import devices
from node_model.frame import Frame
from node_model.keypad.keypad import Keypad
from tests.bench.fakes import bench_of


def running(model: str | None = None) -> KeypadBench:
    """A virtual bench whose keypad, node 1, has just become operational, for certain."""
    bench = Lab(model=model).bench
    bench.begin_example()
    bench.operational(heartbeat_ms=50)
    bench.wait(60 * MS)
    return bench


def life(bench: KeypadBench) -> Life:
    """Everything since the power-on."""
    bench.settle()
    return Life(bench, bench.node_id, (0, 0), 0)


def test_a_power_on_is_a_full_start() -> None:
    """With its boot-up and its EMCY, which only a later command can keep back."""
    bench = running()
    found = life(bench)
    (start,) = found.starts
    (emcy,) = found.emergencies
    assert start.boot.latest <= emcy.wanted.latest <= start.boot.latest + 100 * MS
    sent = next(s.at for s in bench.trace.frames() if s.own and not s.frame.can_id)
    assert start.disturbed_at == sent
    assert found.lights[0] == Restart()


@pytest.mark.parametrize(
    ("command", "starts"), [(Nmt.RESET_NODE, 2), (Nmt.RESET_COMMUNICATION, 1)]
)
def test_only_reset_node_is_a_full_start(command: Nmt, starts: int) -> None:
    """After reset communication an EMCY is the maker's choice (NMT-22)."""
    bench = running()
    bench.nmt(command)
    bench.wait(200 * MS)
    found = life(bench)
    assert len(found.starts) == starts
    assert [turn.operational for turn in found.turns] == [False, True, False]
    assert found.lights[-1] == Restart()


def test_a_reset_that_may_have_been_lost_is_none_for_certain() -> None:
    """A command right after a reset finds the device starting: it may miss it."""
    bench = running()
    bench.nmt(Nmt.RESET_NODE)
    bench.nmt(Nmt.RESET_NODE)
    bench.wait(200 * MS)
    found = life(bench)
    assert [each for each in found.lights if isinstance(each, Restart)] == [
        Restart(),
        Restart(),
        Restart(Chance.PERHAPS),
    ]
    assert len(found.starts) == 1


def test_a_longer_command_may_act() -> None:
    """What a device makes of it is its own choice (NMT-21): no turn, and perhaps a restart."""
    bench = running()
    bench.send(Frame(0, bytes((Nmt.RESET_NODE, 1, 0))))
    bench.wait(200 * MS)
    found = life(bench)
    assert [turn.operational for turn in found.turns] == [False, True]
    assert found.lights[-1] == Restart(Chance.PERHAPS)
    bench.send(Frame(0, bytes((Nmt.STOP, 1, 0))))
    assert life(bench).lights[-1] == Leave()


def test_commands_for_others_are_nothing() -> None:
    """Another node id, an unknown command, an extended or remote frame."""
    bench = running()
    before = life(bench)
    for frame in (
        Frame(0, bytes((Nmt.STOP, 2))),
        Frame(0, bytes((0x05, 1))),
        Frame(0, bytes((Nmt.STOP, 1)), extended=True),
        Frame(0, remote=True, dlc=2),
    ):
        bench.send(frame)
    after = life(bench)
    assert after.turns == before.turns
    assert after.lights == before.lights


def test_led_frames_act_by_the_state_in_which_they_take_effect() -> None:
    """For certain, perhaps, or not at all; maps of other nodes and formats are none."""
    bench = running()
    first = len(life(bench).lights)
    bench.send(Frame(0x201, b"\x01"))
    bench.wait(60 * MS)
    bench.send(Frame(0x301, b"\x02"))
    bench.nmt(Nmt.STOP)
    bench.wait(60 * MS)
    bench.send(Frame(0x201, b"\x04"))
    for frame in (Frame(0x202, b"\x01"), Frame(0x201, b"\x01", extended=True),
                  Frame(0x201, remote=True, dlc=1)):  # fmt: skip
        bench.send(frame)
    bench.wait(60 * MS)
    assert life(bench).lights[first:] == [
        Write(blink=False, data=b"\x01", acts=Chance.SURE),
        Write(blink=True, data=b"\x02", acts=Chance.PERHAPS),
        Leave(),
        Write(blink=False, data=b"\x04", acts=Chance.NO),
    ]


def looks(bench: KeypadBench) -> list[Look]:
    """What was seen of the LEDs."""
    return [each for each in life(bench).lights if isinstance(each, Look)]


def test_a_look_counts_where_nothing_changed_under_the_eye() -> None:
    """Nor right after a write, nor while the device may be starting."""
    bench = running()
    assert bench.leds is not None
    bench.leds.read()
    (seen,) = looks(bench)
    assert seen.operational
    bench.send(Frame(0x201, b"\x01"))
    bench.leds.read()
    assert len(looks(bench)) == 1
    bench.wait(60 * MS)
    bench.leds.read()
    assert looks(bench)[1].lights["on_off"] == "on"
    bench.nmt(Nmt.STOP)
    bench.wait(60 * MS)
    bench.leds.read()
    assert [each.operational for each in looks(bench)] == [True, True, False]


def test_leds_that_are_watched_are_read_while_it_is_operational() -> None:
    """With the last frame before the end, the beginning, and what they came to show."""
    bench = running()
    assert bench.leds is not None
    bench.send(Frame(0x301, b"\x01"))
    sent_at = bench.now()
    bench.leds.watch(2500 * MS)
    (stretch,) = life(bench).watched
    assert (stretch.written_at, stretch.blink) == (sent_at, True)
    assert [led for led, lit in stretch.start.items() if lit] == ["on_off"]
    assert [lit for _, _, lit in stretch.edges[:3]] == [False, True, False]
    assert [each.lights["on_off"] for each in looks(bench)] == ["blink"]
    bench.leds.watch(300 * MS)
    assert len(life(bench).watched) == 2
    assert len(looks(bench)) == 1
    bench.nmt(Nmt.STOP)
    bench.leds.watch(2500 * MS)
    assert len(life(bench).watched) == 2


def test_what_came_at_another_rate_is_not_read() -> None:
    """A tester that heard nobody cannot say what was sent."""
    bench = running()
    assert bench.bitrate is not None
    assert bench.keys is not None
    bench.bitrate.set(500_000)
    bench.keys.hold("k3")
    bench.wait(200 * MS)
    found = life(bench)
    assert [edge.held for edge in found.edges] == [0]


def test_a_loss_is_kept_and_disturbs() -> None:
    """The EMCY of a start may be among what was lost; an error frame loses nothing."""
    bench = Lab().bench
    bench.begin_example()
    bench.start(heartbeat_ms=50)
    bench.take(BusEvent(EventKind.ERROR, bench.now()))
    assert life(bench).starts[0].disturbed_at == FOREVER
    assert life(bench).losses == []
    loss = BusEvent(EventKind.GAP, bench.now())
    bench.take(loss)
    found = life(bench)
    assert found.losses == [loss]
    assert found.starts[0].disturbed_at == loss.at


def test_frames_that_only_look_like_the_devices_are_none() -> None:
    """Extended and remote ones, an EMCY of seven bytes, a beat that is no boot-up."""
    bench, stage = bench_of()
    bench.note(Moment("power", 0, 0, {"on": True, "mode": "regular"}))
    for index, frame in enumerate(
        (
            Frame(0x181, b"\x01", extended=True),
            Frame(0x181, remote=True, dlc=1),
            Frame(0x081, bytes(7)),
            Frame(0x701, b"\x7f"),
            Frame(0x182, b"\x01"),
        )
    ):
        stage.port.plays(frame, (index + 1) * MS)
    bench.wait(100 * MS)
    found = life(bench)
    assert (found.reports, found.emergencies, found.starts, found.echoes) == ([], [], [], [])


def test_what_the_device_sent_before_its_start_is_of_another_life() -> None:
    """Key frames and boot-ups count from the first start on."""
    bench, stage = bench_of()
    for text, at_ms in (("701#00", 1), ("181#01", 2)):
        stage.port.plays(text, at_ms * MS)
    bench.wait(10 * MS)
    bench.note(Moment("power", bench.now(), bench.now(), {"on": True, "mode": "regular"}))
    stage.port.plays("181#02", 20 * MS)
    bench.wait(100 * MS)
    found = life(bench)
    assert [report.mask for report in found.reports] == [2]
    assert found.starts == []


class AtOnce(Keypad):
    """A right keypad that initialises in a microsecond."""

    def start_ns(self) -> int:
        """From power-on."""
        return 1_000


def test_what_a_device_sends_at_once_after_power_on_is_of_that_life() -> None:
    """It can have been asked for before the supply came only by a device that had some."""
    profile = load_keypad("keypad")
    blueprint = replace(devices.read(profile.path, None), maker=AtOnce)
    bench = KeypadBench(VirtualStage(blueprint), profile, profile.factory)
    bench.begin()
    waits = "off: 0ms keys 11; 0ms power on; 0ms request 090103E80001; 502ms power off; "
    line = f"{waits}0ms keys 0; 0ms power on; 0ms nmt start; 60ms keys 100; 300ms keys 0"
    assert play(bench, scenario(line)) == []
