"""The virtual stage and the real one: what they are made of, and how they are left."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path

import pytest

from hil_tests.bench import real
from hil_tests.bench.drivers.command import CommandPower
from hil_tests.bench.drivers.control import ControlHealth, ControlKeys, ControlPower
from hil_tests.bench.drivers.neighbour import EXACT_TIME, NeighbourHealth
from hil_tests.bench.drivers.operator import OperatorLeds
from hil_tests.bench.virtual import VirtualStage
from hil_tests.clock import MS, S, exactly
from hil_tests.config import load_bench
from hil_tests.errors import BenchError, BusUnavailable, ControlError
from hil_tests.trace import BusEvent, EventKind, Sighting
from node_model import devices
from node_model.frame import Frame
from tests.bench.fakes import HOME, PROFILE, FakePort
from tests.drivers.peers import answer, scripted


def virtual() -> VirtualStage:
    """The bundled model in virtual time."""
    return VirtualStage(devices.read("keypad", None))


def wait(stage: VirtualStage, span_ns: int) -> list[Sighting | BusEvent]:
    """Everything that happens in a while."""
    until, found = stage.port.now() + span_ns, []
    while (item := stage.port.next(until)) is not None:
        found.append(item)
    return found


def test_virtual_time_goes_on_from_world_to_world() -> None:
    """A new device does not turn the clock back, and is at the bit rate of its parameters."""
    stage = virtual()
    wait(stage, 5 * S)
    assert stage.renew(HOME)
    assert stage.port.now() > 5 * S
    assert stage.bit_rate == HOME.bit_rate
    assert wait(stage, 2 * S) == []


def test_a_virtual_stimulus_is_exact_and_causes_its_frame() -> None:
    """Supply on takes no time; boot-up follows, and its sighting is not our own."""
    stage = virtual()
    action = stage.switch(on=True)
    action.start(stage.port.now())
    assert action.poll(stage.port.now())
    assert action.result() == exactly(0)
    boot = next(item for item in wait(stage, 2 * S) if isinstance(item, Sighting))
    assert (str(boot.frame), boot.own, boot.doubt_ns) == ("701#00", False, 0)


def test_load_and_error_frames_are_to_be_had_in_virtual_time() -> None:
    """A loading station speaks until it is ended; an error frame is told as an event."""
    stage = virtual()
    assert stage.load([Frame(0x555, bytes(8))], 500_000)
    loaded = wait(stage, 1 * S)
    assert len(loaded) > 500
    stage.end_load()
    wait(stage, 10 * MS)
    assert wait(stage, 1 * S) == []
    assert stage.disturb()
    (event,) = wait(stage, 1 * S)
    assert isinstance(event, BusEvent)
    assert event.kind is EventKind.ERROR


def test_the_virtual_bench_steps_through_sequences() -> None:
    """It is exact without: nobody asks it to play one."""
    stage = virtual()
    assert not stage.timed_sequences
    with pytest.raises(NotImplementedError):
        stage.sequence([])
    stage.check()
    stage.close()
    stage.close()


def stage_on(port: FakePort) -> real.RealStage:
    """A real stage without facilities."""
    leave = ExitStack()
    leave.callback(port.close)
    return real.RealStage(
        "desk", port, 250_000, exclusive=False, writes_allowed=False, leave=leave
    )


def test_a_real_stage_is_what_it_is() -> None:
    """It renews no device, loads no bus, sends no error frames; closing twice closes once."""
    port = FakePort()
    stage = stage_on(port)
    assert not stage.renew(HOME)
    assert not stage.load([Frame(1)], 1)
    stage.end_load()
    assert not stage.disturb()
    assert stage.power is None
    stage.close()
    stage.close()
    assert port.closed == 1


def test_a_stage_asks_everything_behind_it_whether_it_is_there() -> None:
    """The plainest cause comes first; a bus that is gone is told last."""
    port = FakePort()
    stage = stage_on(port)
    stage.check()
    port.gone = "fake0 was pulled out"
    with pytest.raises(BusUnavailable, match="pulled out"):
        stage.check()

    def dead() -> None:
        raise BenchError("the model is dead")

    stage.checks.append(dead)
    with pytest.raises(BenchError, match="the model is dead"):
        stage.check()


BUS = '[bus]\ninterface = "virtual"\nchannel = "x"\n'


def fitted(folder: Path, text: str, address: str = "") -> real.RealStage:
    """A stage with the facilities of a bench file."""
    path = folder / "desk.toml"
    path.write_text(BUS + text.format(address=address), "utf-8")
    file = load_bench(str(path))
    leave = ExitStack()
    stage = stage_on(FakePort())
    session = real.open_session(stage, address, leave, real.patience(file)) if address else None
    with leave:
        real.fit_from_file(stage, file, PROFILE, session, None)
    return stage


def test_each_driver_of_a_file_is_built(tmp_path: Path) -> None:
    """Command, operator and interface: a section, a driver, and nothing else."""
    text = """
[power]
driver = "command"
on = ["relay", "on"]
off = ["relay", "off"]
timeout = "3 s"
[leds]
driver = "operator"
[bitrate]
driver = "interface"
"""
    stage = fitted(tmp_path, text)
    assert isinstance(stage.power, CommandPower)
    assert isinstance(stage.leds, OperatorLeds)
    assert isinstance(stage.bitrate, real.InterfaceBitRate)
    assert stage.keys is None
    action = stage.bitrate.set(125_000)
    action.start(0)
    assert action.poll(0)
    assert action.result() == exactly(0)


CONTROLLED = """
[control]
address = "{address}"
[power]
driver = "control"
timeout = "700 ms"
[keys]
driver = "control"
timeout = "300 ms"
"""


def test_facilities_of_a_control_server(tmp_path: Path) -> None:
    """All share one session, which waits as long as the most patient section says."""
    with scripted(tmp_path, [answer()]) as address:
        stage = fitted(tmp_path, CONTROLLED, address)
    assert isinstance(stage.power, ControlPower)
    assert isinstance(stage.keys, ControlKeys)
    file = load_bench(str(tmp_path / "desk.toml"))
    assert real.patience(file) == 700 * MS


def test_a_server_that_lacks_what_the_file_says(tmp_path: Path) -> None:
    """The bench is refused at once, with what to change."""
    with (
        scripted(tmp_path, [answer()], can=["power"]) as address,
        pytest.raises(ControlError, match="its hello lacks keys"),
    ):
        fitted(tmp_path, CONTROLLED, address)


@pytest.mark.parametrize(
    ("can", "health"),
    [
        (["power", "bus"], NeighbourHealth),
        (["power", "bus", "health"], ControlHealth),
        (["power"], type(None)),
    ],
)
def test_a_simulated_device_on_this_machine_is_looked_at(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, can: list[str], health: type
) -> None:
    """Where it tells its lateness itself, it is asked; a real one has no process to look at."""
    monkeypatch.delenv(EXACT_TIME, raising=False)
    with scripted(tmp_path, [answer()], can=can) as address, ExitStack() as leave:
        stage = real.RealStage(
            "desk", FakePort(), 125_000, exclusive=True, writes_allowed=True, leave=leave
        )
        session = real.open_session(stage, address, leave)
        real.fit_control(stage, session, ["power"], [])
        assert isinstance(stage.health, health)


def test_where_time_is_exact_nobody_looks_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In the virtual machine no host makes a process late, and every look is dear."""
    monkeypatch.setenv(EXACT_TIME, "1")
    with scripted(tmp_path, [answer()], can=["power", "bus"]) as address, ExitStack() as leave:
        stage = stage_on(FakePort())
        session = real.open_session(stage, address, leave)
        real.fit_control(stage, session, ["power"], [])
        assert stage.health is None


@pytest.mark.parametrize(
    ("found", "asked"), [(True, ["state", "power True", "bye"]), (None, ["state", "bye"])]
)
def test_the_supply_is_left_as_it_was_found(
    tmp_path: Path, found: bool | None, asked: list[str]
) -> None:
    """A server that tells its state gets it back at the end; one that does not is left alone."""
    seen: list[str] = []

    def noted(request: dict[str, object]) -> bytes:
        seen.append(f"{request['do']} {request.get('on', '')}".strip())
        fields = {"power": found} if request["do"] == "state" and found is not None else {}
        return answer(**fields)(request)

    with scripted(tmp_path, [noted] * 4, can=["power"]) as address, ExitStack() as leave:
        stage = stage_on(FakePort())
        session = real.open_session(stage, address, leave)
        real.fit_control(stage, session, ["power"], [])
        real.keep_power(stage, session, leave)
        leave.close()
    assert seen == asked
