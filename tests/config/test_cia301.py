"""Profiles of devices with an object dictionary: what is read, and what is refused."""

from __future__ import annotations

import tomllib
from pathlib import Path

import attrs
import pytest

import hil_tests
from hil_tests.clock import MS, US, S
from hil_tests.config import (
    Cia301Limits,
    Cia301Parameters,
    DriveProfile,
    GenericProfile,
    load_keypad,
    load_profile,
)
from hil_tests.errors import ConfigError

SHIPPED = Path(hil_tests.__file__).parents[1] / "node_model" / "profiles"
DRIVE = """
[device]
name = "axis"
kind = "drive"
eds = "axis.eds"
[factory]
node_id = 127
bit_rate = 500000
heartbeat_ms = 0
[sync]
window_unit = "us"
[axis]
control = [0x6040, 0]
status = [0x6041, 0]
set_point = [0x607A, 0]
actual = [0x6064, 0]
[faults]
hot = { code = 0x4210, register = ["temperature"], manufacturer = "42" }
"""


def written(tmp_path: Path, text: str) -> str:
    """The path of a profile with this text."""
    path = tmp_path / "axis.toml"
    path.write_text(text, "utf-8")
    return str(path)


def errors(tmp_path: Path, text: str) -> list[str]:
    """What the reader says to this text, without the file's name."""
    path = written(tmp_path, text)
    with pytest.raises(ConfigError) as caught:
        load_profile(path)
    return [line.removeprefix(f"{path}: ") for line in str(caught.value).splitlines()]


def test_the_shipped_drive_is_what_its_file_says() -> None:
    """Objects, window, errors and limits arrive; the data sheet lies beside the file."""
    drive = load_profile("drive")
    assert isinstance(drive, DriveProfile)
    assert (drive.name, drive.kind, drive.node_ids) == ("drive", "drive", range(1, 128))
    assert drive.factory == Cia301Parameters(5, 250_000, 1000)
    assert drive.factory.heartbeat_ns == 1 * S
    assert (drive.control, drive.status) == ((0x6040, 0), (0x6041, 0))
    assert (drive.set_point, drive.actual) == ((0x607A, 0), (0x6064, 0))
    assert drive.window_unit_ns == US
    assert len(drive.faults) == 6
    over = drive.faults["overcurrent"]
    assert (over.code, over.register, over.manufacturer.hex()) == (0x2310, 0x03, "0102030405")
    assert drive.faults["vendor"].register == 0x81
    assert drive.limits == Cia301Limits()
    assert drive.eds == str(SHIPPED / "drive.eds")
    assert (drive.key_bits, drive.led_bits) == ({}, {})


def test_the_other_drive_counts_its_window_in_milliseconds() -> None:
    """All else is the same (SYN-05)."""
    drive, other = load_profile("drive"), load_profile("drive-ms")
    assert isinstance(other, DriveProfile)
    assert other.window_unit_ns == MS
    same = attrs.evolve(other, window_unit_ns=US, name=drive.name, path=drive.path,
                        description=drive.description)  # fmt: skip
    assert same == drive


def test_a_generic_device_has_no_data_sheet_of_its_own() -> None:
    """The command line gives it."""
    device = load_profile("generic")
    assert isinstance(device, GenericProfile)
    assert device.eds is None
    assert device.factory == Cia301Parameters(5, 250_000, 0)


@pytest.mark.parametrize("name", ["drive", "generic"])
def test_every_limit_has_a_line_in_the_shipped_file(name: str) -> None:
    """[limits] is complete, with the defaults: users copy it to see what there is."""
    lines = tomllib.loads((SHIPPED / f"{name}.toml").read_text("utf-8"))["limits"]
    fields = {field.name.rsplit("_", 1)[0] for field in attrs.fields(Cia301Limits)}
    assert fields == set(lines)
    assert load_profile(name).limits == Cia301Limits()


def test_a_fault_without_bits_and_bytes_is_a_generic_error(tmp_path: Path) -> None:
    """Bit 0 of 1001h, and zeros from the maker."""
    drive = load_profile(written(tmp_path, DRIVE + "plain = { code = 0x1000 }\n"))
    plain = drive.faults["plain"]
    assert (plain.code, plain.register, plain.manufacturer) == (0x1000, 0x01, bytes(5))
    assert drive.eds == str(tmp_path / "axis.eds")
    assert str(drive.factory) == "node id 127, 500000 bit/s, heartbeat 0 ms"


@pytest.mark.parametrize(
    ("line", "broken", "said"),
    [
        ("node_id = 127", "node_id = 128", "factory.node_id: 128: out of range"),
        ("node_id = 127", "node_id = 0", "factory.node_id: 0: out of range"),
        ('"us"', '"s"', "sync.window_unit: 's': unknown word"),
        ("[0x6040, 0]", "[0x6040]", "axis.control: [24640]: write [index, sub-index]"),
        ("[0x6040, 0]", "0x6040", "axis.control: 24640: write [index, sub-index]"),
        ("[0x6040, 0]", "[0x6040, 255]", "axis.control: 255: out of range; allowed: 0..254"),
        ("[0x6040, 0]", "[0x0FFF, 0]", "axis.control: 4095: out of range"),
        ("code = 0x4210", "code = 0", "faults.hot.code: 0: out of range"),
        ("code = 0x4210", "cod = 0x4210", "faults.hot.cod: unknown key; did you mean code?"),
        ('["temperature"]', '["temprature"]', "faults.hot.register: 'temprature': no bit of"),
        ('["temperature"]', '"temperature"', "faults.hot.register: 'temperature': write a list"),
        ('"42"', '"4"', "faults.hot.manufacturer: '4': write up to 5 bytes"),
        ('"42"', '"010203040506"', "faults.hot.manufacturer: '010203040506': write up to 5"),
        ("hot = ", '"a b" = ', 'faults."a b": write names of 1..32'),
    ],
)
def test_what_is_wrong_is_told_with_its_place(
    tmp_path: Path, line: str, broken: str, said: str
) -> None:
    """Key, value, remedy."""
    found = errors(tmp_path, DRIVE.replace(line, broken))
    assert any(each.replace("'a b'", '"a b"').startswith(said) for each in found), found


@pytest.mark.parametrize("entry", ["hot = 3", ""])
def test_errors_of_a_device_are_tables(tmp_path: Path, entry: str) -> None:
    """A number is none; no error at all is a drive without any."""
    text = DRIVE.partition("[faults]")[0] + f"[faults]\n{entry}\n"
    if entry:
        (said,) = errors(tmp_path, text)
        assert said.startswith("faults.hot: 3: write { code = 0x2310, register = [")
    else:
        assert load_profile(written(tmp_path, text)).faults == {}


def test_a_list_of_errors_is_no_table(tmp_path: Path) -> None:
    """The remedy shows one."""
    text = DRIVE.partition("[faults]")[0].replace("[device]", "faults = []\n[device]")
    assert errors(tmp_path, text)[0].startswith("faults: []: write a table of errors, e.g. over =")


def test_a_kind_that_is_misspelt_is_told_with_all_the_rest(tmp_path: Path) -> None:
    """Its sections tell what was meant; where they do not, the kind alone is told."""
    text = DRIVE.replace('kind = "drive"', 'kind = "drve"').replace('"us"', '"s"')
    assert [line.split(": ")[0] for line in errors(tmp_path, text)] == [
        "device.kind",
        "sync.window_unit",
    ]
    bare = errors(tmp_path, '[device]\nname = "x"\nkind = "genric"\n[limits]\nx = 1\n')
    assert bare == ["device.kind: 'genric': unknown word; did you mean generic?"]


@pytest.mark.parametrize("table", ["sync", "axis", "factory", "faults"])
def test_facts_of_a_drive_have_no_defaults(tmp_path: Path, table: str) -> None:
    """A fact that is guessed would be a verdict that is guessed."""
    before, _, after = DRIVE.partition(f"[{table}]\n")
    rest = after[after.index("\n[") :] if "\n[" in after else ""
    assert errors(tmp_path, before + rest) == [f"{table}: is missing; add this section"]


def test_what_is_for_keypads_alone_refuses_a_drive() -> None:
    """It says what the profile is."""
    with pytest.raises(ConfigError, match="'drive': is a drive; this is for keypads alone"):
        load_keypad("drive")
