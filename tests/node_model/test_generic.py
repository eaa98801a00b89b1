"""Devices that an EDS file describes."""

from __future__ import annotations

from pathlib import Path

import pytest

from node_model import generic
from node_model.devices import UnknownDeviceError, make_device, read
from node_model.frame import Frame
from node_model.node import MS, US
from node_model.sheets import entries_of, located, shipped
from tests.node_model.rig import Rig

SMALL = """
[DeviceInfo]
VendorNumber=1
BaudRate_125=1
LSS_Supported=0
[MandatoryObjects]
SupportedObjects=2
1=0x1000
2=0x1001
[1000]
ParameterName=Device type
ObjectType=0x7
DataType=0x0007
AccessType=ro
DefaultValue=0x191
PDOMapping=0
[1001]
ParameterName=Error register
ObjectType=0x7
DataType=0x0005
AccessType=ro
DefaultValue=0
PDOMapping=0
"""


def small(folder: Path) -> str:
    """A data sheet of a device that has next to nothing."""
    path = folder / "small.eds"
    path.write_text(SMALL)
    return str(path)


def test_a_device_of_an_eds_serves_its_objects(tmp_path: Path) -> None:
    """Boot-up and SDO; no heartbeat, no EMCY and no LSS where the sheet has none."""
    rig = Rig(make_device("generic", eds=small(tmp_path), node_id=9), 9)
    assert rig.power_on(100) == [Frame(0x709, b"\0")]
    assert rig.read(0x1000) == 0x191
    assert rig.device.listens_to is not None
    assert 0x7E5 not in rig.device.listens_to
    assert rig.send(0x080, 1, 2, 3) == []
    assert rig.read(0x1001) == 0x11
    assert rig.device.bit_rate == 250_000
    assert rig.device.faults == ()


def test_the_drives_sheet_makes_a_device_without_its_axis() -> None:
    """All communication services, and objects that nobody moves."""
    rig = Rig(make_device("generic", eds=shipped("drive.eds")))
    rig.power_on()
    rig.nmt(1)
    rig(100)
    assert rig.sync() == [Frame(0x185, b"\x40\x02\0\0\0\0")]
    rig.write(0x1017, 0, 10, 2)
    assert Frame(0x705, b"\5") in rig(150)


def test_settings_live_in_its_memory() -> None:
    """As those of a drive."""
    blueprint = read("generic", eds=shipped("drive.eds"))
    image = blueprint.memory({"node_id": 7, "bit_rate": 125_000, "heartbeat_ms": 20})
    assert blueprint.memory({"heartbeat_ms": 20, "bit_rate": 125_000, "node_id": 7}) is image
    rig = Rig(blueprint.make(image), 7)
    assert rig.power_on(75)[-1] == Frame(0x707, b"\x7f")
    assert rig.device.bit_rate == 125_000


def test_a_device_without_heartbeat_is_set_to_none(tmp_path: Path) -> None:
    """Zero it has; anything else it cannot be set to."""
    blueprint = read("generic", eds=small(tmp_path))
    rig = Rig(blueprint.make(blueprint.memory({"node_id": 7, "heartbeat_ms": 0})), 7)
    assert rig.power_on(2000) == [Frame(0x707, b"\0")]
    with pytest.raises(UnknownDeviceError, match="has no 1017h, and so no heartbeat_ms 20"):
        blueprint.memory({"heartbeat_ms": 20})


def test_a_profile_names_its_sheet(tmp_path: Path) -> None:
    """Beside it, or one that is shipped; and the unit of its window."""
    small(tmp_path)
    assert located("small.eds", tmp_path) == str(tmp_path / "small.eds")
    assert located("drive.eds", tmp_path) == shipped("drive.eds")
    profile = '[device]\nname = "x"\nkind = "generic"\neds = "small.eds"\n[factory]\nnode_id = 3\n'
    path = tmp_path / "x.toml"
    path.write_text(profile)
    assert Rig(make_device(str(path)), 3).power_on() == [Frame(0x703, b"\0")]
    assert generic.loads(profile).window_unit_ns == US
    assert generic.loads(profile + '[sync]\nwindow_unit = "ms"\n').window_unit_ns == MS


def test_without_a_sheet_there_is_no_device() -> None:
    """The text says how to give one."""
    with pytest.raises(
        UnknownDeviceError, match="'generic' names no EDS file: give one with --eds"
    ):
        make_device("generic")


def test_a_sheet_that_cannot_be_read_is_refused(tmp_path: Path) -> None:
    """With file and remedy."""
    with pytest.raises(UnknownDeviceError, match=r"none\.eds:0: it cannot be opened"):
        make_device("generic", eds=str(tmp_path / "none.eds"))


def test_a_keypad_may_be_given_a_sheet(tmp_path: Path) -> None:
    """It takes the place of the one that comes with it, and has to be one."""
    sheet = small(tmp_path)
    assert read("keypad").facts.eds == ""
    assert read("keypad", eds=sheet).facts.eds == sheet
    with pytest.raises(UnknownDeviceError, match=r"none\.eds:0: it cannot be opened"):
        make_device("keypad", eds=str(tmp_path / "none.eds"))


def test_each_device_has_its_own_objects() -> None:
    """New entries each time; a device without node id has some, too."""
    first, second = (entries_of(shipped("drive.eds"), 255) for _ in range(2))
    assert first == second
    assert all(one is not other for one, other in zip(first, second, strict=True))
