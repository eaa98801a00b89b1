"""Devices by profile: their kind, a fault, a memory, a node id."""

from __future__ import annotations

from pathlib import Path

import pytest

from node_model import devices
from node_model.devices import UnknownDeviceError, make_device
from node_model.drive import Drive
from node_model.frame import Frame
from node_model.keypad import Keypad
from node_model.node import Node, S


def said(node: Node, until: int = 3 * S) -> list[tuple[int, Frame]]:
    """What a node says by itself after power-on, with the instants."""
    found = [(0, frame) for frame in node.power_on(0)]
    while (due := node.deadline()) is not None and due <= until:
        found += [(due, frame) for frame in node.advance(due)]
    return found


def test_the_profile_decides_the_kind() -> None:
    """A keypad and a drive come with the package."""
    assert type(make_device("keypad")) is Keypad
    assert type(make_device("drive")) is Drive
    assert devices.read("drive").kind is devices.DRIVE


@pytest.mark.parametrize(("profile", "node_id"), [("keypad", 1), ("keypad", 15), ("drive", 127)])
def test_a_device_is_made_with_another_node_id(profile: str, node_id: int) -> None:
    """It announces itself under that id."""
    _, boot_up = said(make_device(profile, node_id=node_id))[0]
    assert boot_up == Frame(0x700 + node_id, b"\0")


@pytest.mark.parametrize(
    ("profile", "node_id", "ids"),
    [
        ("keypad", 0, "1..15"),
        ("keypad", 16, "1..15"),
        ("drive", 0, "1..127"),
        ("drive", 128, "1..127"),
        ("drive", -1, "1..127"),
    ],
)
def test_an_impossible_node_id_is_refused(profile: str, node_id: int, ids: str) -> None:
    """The text says which there are."""
    with pytest.raises(UnknownDeviceError, match=ids.replace(".", r"\.")):
        make_device(profile, node_id=node_id)


def test_settings_live_in_memory() -> None:
    """A keypad that was commissioned, and a drive that was set up."""
    words = {"bit_rate_code": 3, "sync_time": 0, "debounce": 1}
    pad = make_device("keypad", settings={"node_id": 7, "heartbeat_ms": 500, **words})
    axis = make_device("drive", settings={"node_id": 9, "bit_rate": 125_000, "heartbeat_ms": 500})
    for device, node_id in ((pad, 7), (axis, 9)):
        beats = [at for at, frame in said(device) if frame == Frame(0x700 + node_id, b"\x7f")]
        assert device.bit_rate == 125_000
        assert beats[1] - beats[0] == S // 2


def test_memory_goes_from_life_to_life() -> None:
    """What a device remembers is an image, and another device made of it is set up alike."""
    image = devices.read("drive").memory({"node_id": 9, "bit_rate": 50_000, "heartbeat_ms": 0})
    assert make_device("drive", image=image).image() == image
    assert [frame for _, frame in said(make_device("drive", image=image))] == [Frame(0x709, b"\0")]


def test_a_setting_that_the_kind_has_not_is_refused() -> None:
    """A drive has no debounce time."""
    with pytest.raises(UnknownDeviceError, match=r"a drive is not set up so: .*debounce"):
        make_device("drive", settings={"debounce": 1})


def test_a_fault_is_made_by_name() -> None:
    """Of the kind that the profile is of."""
    frames = [frame for _, frame in said(make_device("keypad", model="boot-up-twice"))]
    assert frames.count(Frame(0x701, b"\0")) == 2
    with pytest.raises(UnknownDeviceError, match="'no-such-fault'"):
        make_device("keypad", model="no-such-fault")
    with pytest.raises(UnknownDeviceError, match=r"boot-up-twice is a keypad, .* of a drive"):
        make_device("drive", model="boot-up-twice")


def test_a_file_is_a_profile_too(tmp_path: Path) -> None:
    """Its kind is in it."""
    path = tmp_path / "mine.toml"
    path.write_text(
        Path("node_model/profiles/drive.toml").read_text("utf-8").replace("= 5", "= 6")
    )
    assert said(make_device(str(path)))[0][1].can_id == 0x706


def test_an_unknown_profile_is_refused() -> None:
    """Neither bundled nor a file."""
    with pytest.raises(UnknownDeviceError, match="'keypadd'"):
        make_device("keypadd")


@pytest.mark.parametrize(
    "text", ["[device]\n", "no toml", "[device]\nkind = 'robot'", "[device]\nkind = 'drive'"]
)
def test_an_unusable_profile_is_refused(tmp_path: Path, text: str) -> None:
    """A file that is no profile, or none of a kind that there is."""
    path = tmp_path / "x.toml"
    path.write_text(text)
    with pytest.raises(UnknownDeviceError, match="not usable"):
        make_device(str(path))
