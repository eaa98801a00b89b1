"""The bench of a device with an object dictionary: where a test starts, errors, what is set."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import attrs
import pytest

from hil_tests.bench.cia301 import Cia301Bench
from hil_tests.bench.kinds import bench_for
from hil_tests.bench.sdo import Sdo
from hil_tests.bench.tools import tool
from hil_tests.bench.virtual import VirtualStage
from hil_tests.clock import MS, S
from hil_tests.config import Cia301Parameters, Cia301Profile, load_profile
from hil_tests.judge.cobs import Nmt
from hil_tests.judge.settings import Role
from hil_tests.judge.verdict import DeviceFailure, NotRun
from node_model import devices
from tests.bench.fakes import FakePort, FakeStage

PROFILE = load_profile("drive")
assert isinstance(PROFILE, Cia301Profile)
HOME = PROFILE.factory


def virtual(profile: str = "drive") -> Cia301Bench:
    """A drive in virtual time."""
    facts = load_profile(profile)
    bench = bench_for(VirtualStage(devices.read(profile)), facts, facts.factory)
    assert isinstance(bench, Cia301Bench)
    bench.begin()
    return bench


def fake(port: FakePort | None = None, **options: Any) -> tuple[Cia301Bench, FakeStage]:
    """A drive on a fake stage."""
    assert isinstance(PROFILE, Cia301Profile)
    stage = FakeStage(port or FakePort(), **options)
    bench = Cia301Bench(stage, PROFILE, HOME)
    bench.begin()
    return bench, stage


SPEAKERS = """
[DeviceInfo]

[OptionalObjects]
SupportedObjects=4
1=0x1008
2=0x1014
3=0x1201
4=0x1804

[1008]
ObjectType=0x7
DataType=0x0009
AccessType=const
DefaultValue=name

[1014]
ObjectType=0x7
DataType=0x0007
AccessType=rw

[1201]
ObjectType=0x9
SubNumber=2

[1201sub1]
ObjectType=0x7
DataType=0x0007
AccessType=rw
DefaultValue=$NODEID+0x640

[1201sub2]
ObjectType=0x7
DataType=0x0007
AccessType=rw
DefaultValue=$NODEID+0x5C0

[1804]
ObjectType=0x9
SubNumber=1

[1804sub1]
ObjectType=0x7
DataType=0x0007
AccessType=rw
DefaultValue={tpdo}
"""


@pytest.mark.parametrize(
    ("tpdo", "more"),
    [("0x1C7", [(0x1C7, Role.PDO)]), ("0x800001C7", []), ("0x200001C7", []), ("0", [])],
    ids=["valid", "invalid", "29 bits", "none"],
)
def test_the_judge_knows_the_identifiers_of_the_data_sheet(
    tmp_path: Path, tpdo: str, more: list[tuple[int, Role]]
) -> None:
    """Further SDO servers and PDOs, as they are by default with the node id that it has."""
    eds = tmp_path / "device.eds"
    eds.write_text(SPEAKERS.format(tpdo=tpdo), "utf-8")
    assert isinstance(PROFILE, Cia301Profile)
    bench = Cia301Bench(FakeStage(FakePort()), attrs.evolve(PROFILE, eds=str(eds)), HOME)
    for node_id in (5, 9):
        told = bench.expected(attrs.evolve(HOME, node_id=node_id)).speaks
        assert list(told) == [(0x5C0 + node_id, Role.SDO), *more]


def test_without_a_data_sheet_it_knows_the_default_ones() -> None:
    """There is nothing to read."""
    assert isinstance(PROFILE, Cia301Profile)
    bench = Cia301Bench(FakeStage(FakePort()), attrs.evolve(PROFILE, eds=None), HOME)
    assert bench.expected(HOME).speaks == ()


def test_a_drive_has_no_keys_and_no_leds() -> None:
    """But errors, with what each means."""
    bench = virtual()
    assert (bench.keys, bench.leds) == (None, None)
    assert bench.faults is not None
    assert bench.faults.names == tuple(PROFILE.faults)
    assert bench.faults.known["vendor"].code == 0xFF01


def test_a_fresh_device_is_another_one_in_virtual_time() -> None:
    """With the settings that a test asks for, without an error."""
    bench = virtual()
    bench.start()
    assert bench.faults is not None
    bench.faults.occur("encoder")
    found = bench.fresh({"heartbeat_ms": 50}, node_id=127)
    assert found == Cia301Parameters(127, 250_000, 50)
    assert bench.faults.active == frozenset()
    boot = bench.boot()
    assert str(boot.frame) == "77F#00"
    bench.wait(1 * S)
    assert bench.end() == []


def test_a_real_device_is_what_it_is() -> None:
    """Errors are healed, the supply is cut; settings that it has not cannot be had."""
    bench, stage = fake()
    assert bench.faults is not None
    bench.faults.occur("encoder")
    assert bench.fresh({"heartbeat_ms": 50}) == HOME
    assert stage.asked == ["faults encoder", "faults -", "power off"]
    with pytest.raises(NotRun, match="needs node_id 9; only a virtual device is made so"):
        bench.fresh(node_id=9)


def test_without_power_and_errors_a_reset_is_all() -> None:
    """The boot-up is that of a reset."""
    port = FakePort()
    bench, stage = fake(port, without=("power", "faults"))
    assert bench.faults is None
    port.plays("705#00", 60 * MS)
    port.plays("705#7F", 1055 * MS)
    bench.start()
    assert stage.asked == []
    assert [str(frame) for frame in port.sent] == ["000#8105"]


def test_errors_are_moments_of_the_record() -> None:
    """Each verb asks for the whole set that exists from then on."""
    bench, stage = fake()
    faults = bench.faults
    assert faults is not None
    faults.occur("encoder")
    faults.occur("vendor")
    faults.heal("encoder")
    faults.exactly("overcurrent")
    faults.heal()
    assert stage.asked == [
        "faults encoder",
        "faults encoder vendor",
        "faults vendor",
        "faults overcurrent",
        "faults -",
    ]
    moments = [each for each in bench.trace.moments() if each.what == "faults"]
    assert [each.detail["active"] for each in moments] == [
        ["encoder"],
        ["encoder", "vendor"],
        ["vendor"],
        ["overcurrent"],
        [],
    ]


def test_operational_is_seen_in_the_heartbeat_where_there_is_one() -> None:
    """Without one the command is given the time that it has."""
    bench = virtual()
    command = bench.operational({"heartbeat_ms": 20})
    assert str(command.frame) == "000#0105"
    bench.fresh(heartbeat_ms=0)
    bench.boot()
    command = bench.enter_operational()
    assert bench.now() - command.at == PROFILE.limits.command_ns
    bench.enter(Nmt.STOP)
    assert bench.end() == []


def test_what_is_set_over_sdo_outlasts_a_test_and_no_start() -> None:
    """The next test watches by the period that is set; after a start it is the old one."""
    bench = virtual()
    bench.start()
    sdo = tool(bench, "sdo")
    assert isinstance(sdo, Sdo)
    sdo.write(0x1017, 0, b"\x32\x00")
    assert bench.watch.expected.heartbeat_ns == 50 * MS
    bench.begin()
    assert bench.watch.expected.heartbeat_ns == 50 * MS
    bench.wait(1 * S)
    assert bench.end() == []
    bench.start()
    assert bench.watch.expected.heartbeat_ns == HOME.heartbeat_ns
    bench.wait(3 * S)
    assert bench.end() == []


def test_a_drive_that_does_not_obey_is_blamed_for_it() -> None:
    """By the rule of CiA 301."""
    port = FakePort()
    bench, _ = fake(port)
    port.plays("705#00", 300 * MS)
    for turn in range(1, 9):
        port.plays("705#7F", (300 + 1000 * turn) * MS)
    with pytest.raises(DeviceFailure, match="C-NMT-04"):
        bench.operational()


def test_home_is_a_new_start() -> None:
    """A virtual device has none; a real one is switched off and on, without an error."""
    bench = virtual()
    now = bench.now()
    bench.go_home()
    assert bench.now() == now
    port = FakePort()
    bench, stage = fake(port)
    assert bench.faults is not None
    bench.faults.occur("encoder")
    port.plays("705#00", 260 * MS)
    bench.go_home()
    assert stage.asked[1:] == ["faults -", "power off", "power on"]


@pytest.mark.parametrize("name", ["bench", "profile", "limits", "sdo", "lss", "manager", "sheet"])
def test_every_tool_can_be_had(name: str) -> None:
    """By the name of its fixture."""
    assert tool(virtual(), name) is not None


def test_a_facility_is_had_like_a_tool() -> None:
    """It is the bench's own."""
    bench = virtual()
    assert tool(bench, "faults") is bench.faults


def test_where_no_data_sheet_is_named_its_tests_are_not_run() -> None:
    """The remedy says where to name one."""
    bench = virtual()
    bench.profile = attrs.evolve(bench.profile, eds=None)
    with pytest.raises(NotRun, match="names no EDS; add eds = FILE"):
        tool(bench, "sheet")
