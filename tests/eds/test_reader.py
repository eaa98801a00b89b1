"""The tester's reader of EDS files: texts, numbers, objects, device facts."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hil_tests.eds import lint, read_sheet
from hil_tests.eds.values import KINDS, Unreadable, number_of, value_of
from hil_tests.errors import ConfigError
from tests.eds.reading import FILES, SOUND, changed, found, line_of, sheet

CODES = {kind.name: code for code, kind in KINDS.items()}


def test_the_sound_file_says_what_the_device_is() -> None:
    """Names, numbers, bit rates, PDOs, LSS, granularity and dummies."""
    device = read_sheet(FILES / "sound.eds").device
    assert device.vendor_name == "Somebody"
    assert device.product_name == "Small thing; with a semicolon"
    assert (device.vendor, device.product, device.revision) == (0x11, 0x22, 0x10003)
    assert device.bit_rates == (125_000, 250_000, 1_000_000)
    assert (device.rx_pdos, device.tx_pdos, device.lss, device.granularity) == (1, 1, True, 8)
    assert device.dummies == {5}
    assert (device.node_id, device.bit_rate) == (None, None)


def test_objects_have_type_access_and_line() -> None:
    """Each with the line of its section, in order of index and sub-index."""
    read = sheet(SOUND)
    vendor = read.objects[0x1018, 1]
    assert (vendor.name, vendor.kind.name, vendor.access) == ("Vendor", "UNSIGNED32", "const")
    assert (vendor.readable, vendor.writable, vendor.pdo) == (True, False, False)
    assert vendor.line == line_of("[1018sub1]")
    assert vendor.default is not None
    assert vendor.default.bytes_at(5) == b"\x11\0\0\0"
    assert vendor.place == "1018h:01"
    assert list(read.objects) == sorted(read.objects)
    assert read.get(0x1018, 5) is None
    assert read.objects[0x2002, 0].kind.name == "DOMAIN"


@pytest.mark.parametrize(("index", "base"), [(0x1014, 0x80), (0x1400, 0x200)])
def test_formulas_follow_the_node_id(index: int, base: int) -> None:
    """In any order, case and spacing."""
    found_ = sheet(SOUND).get(index, 1 if index == 0x1400 else 0)
    assert found_ is not None
    assert found_.default is not None
    assert found_.default.follows_node
    assert found_.default.at(5) == base + 5
    assert found_.default.bytes_at(127) == (base + 127).to_bytes(4, "little")


def test_a_compact_object_has_all_its_sub_indices() -> None:
    """CompactSubObj makes sub-index 0 and the others; names and values may differ."""
    read = sheet(SOUND)
    group = read.groups[0x2000]
    assert [each.sub for each in group.objects] == [0, 1, 2, 3]
    assert [each.name for each in group.objects[1:]] == ["Outputs1", "Second output", "Outputs3"]
    assert group.objects[0].default is not None
    assert group.objects[0].default.at(1) == 3
    assert group.objects[0].access == "ro"
    assert group.objects[3].default is not None
    assert group.objects[3].default.at(1) == 10
    assert all(each.pdo and each.access == "rww" for each in group.objects[1:])


@pytest.mark.parametrize(
    ("text", "number"),
    [
        ("12", 12),
        ("0x0C", 12),
        ("0XfF", 255),
        ("-3", -3),
        ("+7", 7),
        ("007", 7),
        ("010", 8),
        ("09", 9),
        ("0", 0),
        ("0x10 ; sixteen", 16),
        ("0x1234567890ABCDEFLL", 0x1234567890ABCDEF),
        ("-0x80", -128),
    ],
)
def test_numbers_are_decimal_hexadecimal_or_octal(text: str, number: int) -> None:
    """With a sign, with a comment, with the suffix of C."""
    assert number_of(text) == number


@pytest.mark.parametrize("text", ["", "x", "0x", "1.5", "1 2", "$NODEID", "--1", "1" * 50, "٣"])
def test_what_is_no_number_is_refused(text: str) -> None:
    """With a word on how to write one."""
    with pytest.raises(Unreadable, match="write a number"):
        number_of(text)


@pytest.mark.parametrize(
    ("kind", "text", "data"),
    [
        ("INTEGER8", "0xFF", b"\xff"),
        ("INTEGER8", "-128", b"\x80"),
        ("INTEGER24", "0x800000", b"\0\0\x80"),
        ("INTEGER24", "-1", b"\xff\xff\xff"),
        ("UNSIGNED24", "0x123456", b"\x56\x34\x12"),
        ("INTEGER64", "0xFFFFFFFFFFFFFFFF", b"\xff" * 8),
        ("REAL32", "1.5", b"\0\0\xc0\x3f"),
        ("REAL32", "0x3FC00000", b"\0\0\xc0\x3f"),
        ("REAL64", "1e0", b"\0" * 6 + b"\xf0\x3f"),
        ("VISIBLE_STRING", "a;b", b"a;b"),
        ("UNICODE_STRING", "ab", b"a\0b\0"),
        ("OCTET_STRING", "01 AB", b"\x01\xab"),
        ("DOMAIN", "0x01AB", b"\x01\xab"),
        ("TIME_OF_DAY", "0x010203040506", b"\6\5\4\3\2\1"),
        ("BOOLEAN", "1", b"\1"),
    ],
)
def test_values_become_bytes(kind: str, text: str, data: bytes) -> None:
    """Little-endian, as the type asks for."""
    assert value_of(text, 1, KINDS[CODES[kind]]).bytes_at(9) == data


@pytest.mark.parametrize(
    ("kind", "text"),
    [
        ("INTEGER8", "255"),
        ("REAL32", "1,5"),
        ("REAL32", "0x100000000"),
        ("OCTET_STRING", "0"),
        ("TIME_OF_DAY", "-1"),
        ("UNSIGNED32", "$NODEID+$NODEID"),
        ("UNSIGNED32", "$NODEID+1+2"),
        ("UNSIGNED32", "$NODEID*2"),
        ("VISIBLE_STRING", "x" * (1 + (1 << 20))),
    ],
)
def test_values_that_are_none_are_refused(kind: str, text: str) -> None:
    """Each with what to write instead."""
    with pytest.raises(Unreadable):
        value_of(text, 1, KINDS[CODES[kind]])


@pytest.mark.parametrize(("text", "fits"), [("255", True), ("256", False), ("-1", False)])
def test_a_number_fits_its_type_or_not(text: str, fits: bool) -> None:
    """Both ends of an UNSIGNED8, from both sides."""
    assert value_of(text, 1, KINDS[CODES["UNSIGNED8"]]).fits(1) == fits


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (SOUND.replace("Somebody", "Gr\xfc\xdfe").encode("cp1252"), "byte FCh is not ASCII"),
        (SOUND.replace("Somebody", "Gr\xfc\xdfe").encode(), "byte C3h is not ASCII"),
        (SOUND.encode("utf-8-sig"), "byte order mark"),
        (SOUND.encode("utf-16"), "UTF-16"),
    ],
)
def test_texts_in_other_encodings_are_read(data: bytes, said: str) -> None:
    """The objects are the same; the lint warns."""
    read = sheet(data)
    assert read.objects.keys() == sheet(SOUND).objects.keys()
    (finding,) = lint(read)
    assert said in finding.text


def test_line_ends_and_case_do_not_matter() -> None:
    """CR, CRLF and LF; sections and options in any case; spaces around them."""
    for text in (
        SOUND.replace("\n", "\r\n"),
        SOUND.replace("\n", "\r"),
        SOUND.lower().replace("somebody", "Somebody"),
        SOUND.replace("=", "  = "),
    ):
        read = sheet(text)
        assert read.objects.keys() == sheet(SOUND).objects.keys()
        assert found(read) == []


def test_a_dcf_says_how_a_device_is_set_up() -> None:
    """Node id and bit rate, spelt rightly or as CiA 306 once did; values beside the defaults."""
    for name in ("DeviceCommissioning", "DeviceComissioning"):
        read = sheet(
            SOUND.replace("DefaultValue=1000", "DefaultValue=1000\nParameterValue=50")
            + f"\n[{name}]\nNodeID=0x20\nBaudrate=250\n"
        )
        assert (read.device.node_id, read.device.bit_rate) == (32, 250_000)
        beat = read.objects[0x1017, 0]
        assert beat.default is not None
        assert beat.configured is not None
        assert (beat.default.at(1), beat.configured.at(1)) == (1000, 50)


def test_a_type_of_the_file_s_own_is_looked_up() -> None:
    """[A0] with the type in sub-index 1 and the limits in 2 and 3."""
    text = SOUND.replace("DataType=0x0003", "DataType=0x00A0").replace("=-1", "=3")
    for sub, value in ((1, 5), (2, 2), (3, 9)):
        text += f"\n[A0sub{sub}]\nDefaultValue={value}\n"
    read = sheet(text)
    each = read.objects[0x2001, 0]
    assert each.kind.name == "UNSIGNED8"
    assert each.low is not None
    assert each.high is not None
    assert (each.low.at(1), each.high.at(1)) == (2, 9)


def test_sub_indices_may_come_first() -> None:
    """The order of sections does not matter, and a missing parent is a finding."""
    head, _, rest = SOUND.partition("[1018]\n")
    parent, _, rest = rest.partition("\n\n")
    read = sheet(head + rest + "\n\n[1018]\n" + parent)
    assert found(read) == []
    read = sheet(head + rest)
    assert 0x1018 in read.groups
    assert any("has no section [1018]" in text for text in found(read))


def test_a_file_that_cannot_be_opened_is_named(tmp_path: Path) -> None:
    """A missing file, a folder, a path that is none."""
    for path in (tmp_path / "none.eds", tmp_path, "a\0b"):
        with pytest.raises(ConfigError, match="cannot be read"):
            read_sheet(path)


def test_a_file_without_end_is_refused(tmp_path: Path) -> None:
    """More than 8 MiB is no EDS."""
    path = tmp_path / "big.eds"
    with path.open("wb") as file:
        file.truncate(1 + (8 << 20))
    with pytest.raises(ConfigError, match="8 MiB"):
        read_sheet(path)


@pytest.mark.slow
def test_a_few_lines_cannot_describe_millions_of_objects() -> None:
    """Past 50 000 the reader stops and says so; a compact object without type is none."""
    bomb = "".join(
        f"[{index:X}]\nObjectType=8\nDataType=5\nAccessType=ro\nCompactSubObj=254\n"
        for index in range(0x2000, 0x2100)
    )
    read = sheet(bomb)
    assert 50_000 <= len(read.objects) < 50_300
    assert "more than 50000 objects" in read.findings[0].text
    assert sheet("[2000]\nObjectType=8\nCompactSubObj=254\n").objects == {}


PARTS = """[1000]~|[1000sub1]|[|]|=|~|DataType|=0x0007~|\0|$NODEID|ObjectType=8~|DefaultValue=|
CompactSubObj=999999999999~|[1A00]~|[1A00sub0]~DataType=5~AccessType=RW~DefaultValue=|1=|64~|
[DeviceInfo]~|AccessType=rw~|SupportedObjects=|[OptionalObjects]~|[1000Value]~"""
WORDS = st.lists(
    st.one_of(st.sampled_from(PARTS.replace("~", "\n").split("|")), st.text(max_size=6)),
    max_size=40,
)


@pytest.mark.slow
@given(WORDS)
def test_no_text_breaks_the_reader(words: list[str]) -> None:
    """Whatever it says, there is a sheet and there are findings."""
    assert lint(sheet("".join(words).encode("utf-8", "replace")))


@pytest.mark.slow
@given(st.binary(max_size=300))
def test_no_bytes_break_the_reader(data: bytes) -> None:
    """The same with bytes."""
    assert lint(sheet(data))


@pytest.mark.parametrize(
    ("old", "new", "left"),
    [
        ("DataType=0x0006\n", "", "[1017] has no DataType"),
        ("DataType=0x0006\n", "DataType=six\n", "DataType is 'six'"),
        ("AccessType=rw\nLowLimit", "LowLimit", "[1017] has no AccessType"),
        ("AccessType=rw\nLowLimit", "AccessType=wr\nLowLimit", "AccessType is 'wr'"),
        ("DataType=0x0006", "DataType=0x0040", "data type 0040h is not known"),
        ("CompactSubObj=4", "CompactSubObj=255", "CompactSubObj is 255"),
        ("DefaultValue=1000", "DefaultValue=many", "DefaultValue is 'many', no UNSIGNED16"),
        ("[Comments]", "stray\n[Comments]", "'stray' is no option"),
        ("[FileInfo]", "stray=1\n[FileInfo]", "'stray=1' stands before any section"),
        ("[Comments]", "[Comments", "is no section"),
        ("[Comments]", "[Comments] here", "'here' stands behind a section"),
        ("[Comments]", "[1000]\n[Comments]", "section [1000] was there in line"),
        ("SubNumber=5", "SubNumber=5\nSubNumber=6", "SubNumber is '6' here and '5' in line"),
        ("Lines=1", "Lines=1\nLine0=\0", "a byte is 00h"),
    ],
)
def test_what_cannot_be_understood_is_said(old: str, new: str, left: str) -> None:
    """With its line, and the rest of the file is read."""
    read = changed((old, new))
    said = [text for text in found(read) if left in text]
    assert len(said) == 1
    assert int(said[0].partition(":")[0]) > 0
    assert 0x2002 in read.groups
