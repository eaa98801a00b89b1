"""Devices made of EDS files: they start, show every object, and bear what comes."""

from __future__ import annotations

from pathlib import Path

import pytest

from node_model.composition import Facts
from node_model.device import Cia301Device
from node_model.eds import EdsError, Sheet, load_eds, parse_eds
from node_model.frame import Frame
from node_model.node import MS, S
from node_model.service import Fault
from tests.eds.agreement import NODE_ID, real_files
from tests.eds.reading import FILES

REAL = real_files()
START, EVERY_COB_ID = Frame(0, b"\1\5"), range(0x80, 0x600)


def running(sheet: Sheet) -> Cia301Device:
    """A device of that sheet, a second after power-on."""
    device = Cia301Device(Facts(sheet.file, NODE_ID, 125_000, sheet.entries))
    device.power_on(0)
    device.advance(S)
    assert device.bit_rate == 125_000
    return device


def bears_everything(sheet: Sheet) -> None:
    """Each readable object is uploaded; then every frame of the predefined set comes."""
    device, now = running(sheet), S
    for each in sheet.objects:
        now += MS
        place = each.index.to_bytes(2, "little") + bytes((each.sub,))
        answers = [*device.receive(Frame(0x605, b"\x40" + place + bytes(4)), now)]
        (answer,) = [frame.data for frame in answers if frame.can_id == 0x585]
        assert answer[1:4] == place
        assert (answer[0] == 0x80) != each.access.readable or each.index == 0x1003
        device.advance(now)
    device.receive(START, now)
    for can_id in EVERY_COB_ID:
        now += MS
        device.advance(now)
        device.receive(Frame(can_id, bytes(8)), now)
    device.advance(now + S)


@pytest.mark.parametrize("path", sorted(FILES.iterdir()), ids=lambda path: path.name)
def test_a_device_of_each_file_here_runs(path: Path) -> None:
    """However odd its file is."""
    bears_everything(load_eds(path, NODE_ID, checked=False))


@pytest.mark.slow
@pytest.mark.skipif(not REAL, reason="no folder with EDS files of other devices is here")
@pytest.mark.parametrize("path", REAL, ids=lambda path: path.name)
def test_a_device_of_other_people_s_files_runs(path: Path) -> None:
    """Whatever objects and defaults it has; what is no file of a device is refused."""
    try:
        sheet = load_eds(path, NODE_ID, checked=False)
    except EdsError:
        return
    bears_everything(sheet)


@pytest.mark.parametrize(
    ("subs", "kept"), [((0, 1, 2, 4), 2), ((0, 2), 0), ((1, 2), 0), ((0, 1), 1), ((), 0)]
)
def test_an_error_field_with_gaps_ends_at_the_first_one(subs: tuple[int, ...], kept: int) -> None:
    """1003h holds as many errors as sub-indices follow each other, none without :00."""
    text = "[1001]\nDataType=5\nAccessType=ro\n[1014]\nDataType=7\nAccessType=rw\n"
    text += "".join(f"[1003sub{sub}]\nDataType=7\nAccessType=ro\n" for sub in subs)
    text = text.replace("[1003sub0]\nDataType=7", "[1003sub0]\nDataType=5")
    device = running(parse_eds("x.eds", text.encode(), NODE_ID))
    device.receive(Frame(0, b"\1\5"), S)
    for number in range(5):
        device.services.emcy.occur(f"cause {number}", Fault(0x1000), S)
    assert device.od.number(0x1003) == kept


@pytest.mark.parametrize(
    ("low", "high", "value"), [("3", "9", 3), ("-9", "-3", -3), ("-9", "9", 0), ("", "", 0)]
)
def test_a_number_without_a_default_is_within_its_limits(low: str, high: str, value: int) -> None:
    """0, or the limit next to it."""
    text = f"[2000]\nDataType=2\nAccessType=rw\nLowLimit={low}\nHighLimit={high}\n"
    (entry,) = parse_eds("x.eds", text.encode(), NODE_ID).entries()
    assert entry.data_type.unpack(entry.value) == value
