"""EDS files as a device takes them: values, formulas, traps, refusals, bounded time."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from node_model.eds import EdsError, Sheet, load_eds, parse_eds
from node_model.eds.second import opinion
from node_model.eds.text import LARGEST
from node_model.od import Access, DataType, Entry, ObjectDictionary
from tests.eds.reading import FILES, line_of

HEAD = "[DeviceInfo]\nVendorName=x\n"
WORD = "ParameterName=Thing\nObjectType=0x7\nDataType=0x0006\nAccessType=rw\n"


def parsed(text: str, node_id: int | None = 5) -> Sheet:
    """What a text says."""
    return parse_eds("x.eds", text.encode(), node_id)


def entry_of(name: str, index: int, sub: int = 0, node_id: int = 5) -> Entry:
    """An entry of a test file."""
    od = ObjectDictionary(load_eds(FILES / name).entries(node_id))
    return od.find(index, sub)


def refusal(text: str) -> str:
    """With which words a text is refused."""
    with pytest.raises(EdsError) as caught:
        parsed(text)
    return str(caught.value)


@pytest.mark.parametrize(
    ("index", "value"),
    [
        (0x2000, b"\7\0"),
        (0x2001, b"\x08\0"),
        (0x2002, b"\x85\1\0\0"),
        (0x2003, b"\5"),
        (0x2004, b"\0\0\x80"),
        (0x2005, b"\xef\xcd\xab"),
        (0x2006, b"\0\0\xc0\xbf"),
        (0x2007, b"\0\0\xc0\x3f"),
        (0x2008, b"\0" * 6 + b"\xf8\x3f"),
        (0x2009, bytes.fromhex("F1DEBC0A89674523")),
        (0x200A, b"\x0c"),
        (0x200B, b"\xfe"),
        (0x200C, b"\0"),
        (0x200D, b"\1"),
        (0x200E, b"\5"),
    ],
)
def test_numbers_are_read_as_they_are_written(index: int, value: bytes) -> None:
    """Zeros in front, formulas, 24 bits, reals in either form, C's suffixes, comments."""
    entry = entry_of("numbers.eds", index)
    assert entry.value == entry.default == value


@pytest.mark.parametrize(
    ("index", "low", "high"),
    [
        (0x2004, -8388608, 8388607),
        (0x2005, 0, 16777215),
        (0x2006, -2.5, 1000),
        (0x200B, -128, 127),
        (0x200C, None, None),
        (0x200E, 2, 9),
    ],
)
def test_limits_are_read(index: int, low: float | None, high: float | None) -> None:
    """Also of 24 bits, of reals and of a type of the file's own; none where none can be kept."""
    entry = entry_of("numbers.eds", index)
    assert (entry.low, entry.high) == (low, high)


@pytest.mark.parametrize("node_id", [1, 127])
def test_a_formula_follows_the_node_id(node_id: int) -> None:
    """One sheet makes devices with different node ids, each with entries of its own."""
    sheet = load_eds(FILES / "numbers.eds")
    first, second = sheet.entries(node_id), sheet.entries(node_id)
    od = ObjectDictionary(first)
    assert od.number(0x2002) == 0x180 + node_id
    assert od.number(0x2003) == node_id
    assert first[0] is not second[0]


@pytest.mark.parametrize(
    ("index", "kind", "value"),
    [
        (0x2000, DataType.VISIBLE_STRING, b"one ; two;three"),
        (0x2001, DataType.VISIBLE_STRING, b"a=b [c]"),
        (0x2002, DataType.OCTET_STRING, b"\x01\xab\xcd"),
        (0x2003, DataType.UNICODE_STRING, b"a\0b\0"),
        (0x2004, DataType.DOMAIN, b""),
        (0x2005, DataType.DOMAIN, b""),
        (0x2006, DataType.DOMAIN, b""),
        (0x2007, DataType.TIME_OF_DAY, b"\6\5\4\3\2\1"),
        (0x2008, DataType.TIME_DIFFERENCE, bytes(6)),
        (0x2009, DataType.DOMAIN, b""),
    ],
)
def test_what_is_no_number_is_read_too(index: int, kind: DataType, value: bytes) -> None:
    """A semicolon belongs to a string; a domain may be empty; an unknown type is a domain."""
    entry = entry_of("strings.eds", index)
    assert (entry.data_type, entry.value) == (kind, value)


def test_a_domain_object_needs_no_type() -> None:
    """Where it has one, and an access, they count."""
    assert entry_of("strings.eds", 0x2006).access is Access.RW
    assert entry_of("strings.eds", 0x200A).access is Access.WO


def test_sections_come_in_any_order() -> None:
    """Sub-index before its parent, no type of object, hexadecimal counts, compact objects."""
    od = ObjectDictionary(load_eds(FILES / "order.eds").entries(1))
    assert od.number(0x2000, 1) == 8
    assert od.find(0x2001, 0).data_type is DataType.UNSIGNED16
    assert od.number(0x2002) == 16
    assert [od.number(0x2002, sub) for sub in (1, 4, 15, 16)] == [7, 44, 7, 255]
    assert od.find(0x2002, 1).name == "First"
    assert od.find(0x2002, 16).name == "Last"
    assert od.find(0x2002, 2).name == "Row2"
    assert not od.has(0x2002, 17)
    assert od.has(0x2003)


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("cp1252.eds", "byte E4h is read as Windows 1252"),
        ("bom.eds", "byte order mark of utf-8"),
        ("utf16.eds", "byte order mark of utf-16-le"),
    ],
)
def test_other_encodings_are_read(name: str, said: str) -> None:
    """With a remark and its line."""
    sheet = load_eds(FILES / name)
    assert "Gerät" in sheet.info.product_name
    (remark,) = sheet.remarks
    assert said in remark.text
    assert remark.line > 0


def test_big_endian_utf_16_is_read() -> None:
    """After its byte order mark."""
    data = b"\xfe\xff" + (HEAD + "[2000]\n" + WORD).encode("utf-16-be")
    assert len(parse_eds("x.eds", data).objects) == 1


def test_case_does_not_matter() -> None:
    """Of sections, options, hexadecimal digits and access types."""
    assert entry_of("lower.eds", 0x1018).value == b"\xab\0\0\0"
    entry = entry_of("lower.eds", 0x1019, 1)
    assert (entry.access, entry.pdo) == (Access.RWR, True)


def test_what_is_there_twice_leaves_a_remark() -> None:
    """The first value counts, and what only the second section says is added."""
    sheet = load_eds(FILES / "duplicates.eds")
    od = ObjectDictionary(sheet.entries(1))
    assert (od.number(0x1017), od.find(0x1017, 0).low) == (1000, 10)
    assert od.number(0x2001) == 3
    said = [remark.text for remark in sheet.remarks]
    assert sum("is there twice" in text for text in said) == 1
    assert sum("is ignored" in text for text in said) == 2
    assert "pdomapping was there in line" in said[-1]


def test_a_dcf_says_how_the_device_is_set_up() -> None:
    """Node id, bit rate, facts, and values that count instead of the defaults."""
    sheet = load_eds(FILES / "commissioned.dcf")
    info = sheet.info
    assert (sheet.node_id, info.node_id, info.bit_rate) == (32, 32, 250_000)
    assert (info.vendor, info.product, info.revision, info.order_code) == (0x11, 2, 3, "7-B")
    assert (info.lss, info.granularity, info.rx_pdos, info.tx_pdos) == (True, 1, 2, 3)
    assert (set(info.bit_rates), set(info.dummies)) == ({125_000}, {5})
    od = ObjectDictionary(sheet.entries())
    assert (od.number(0x1017), od.number(0x1014)) == (250, 0x80 + 32)
    assert load_eds(FILES / "commissioned.dcf", 9).entries()[0].value == b"\x89\0\0\0"


@pytest.mark.parametrize("node_id", [None, 0, 128, 254])
def test_entries_need_a_node_id(node_id: int | None) -> None:
    """1..127, from the file or from who asks."""
    sheet = parsed(HEAD + "[2000]\n" + WORD, node_id)
    with pytest.raises(EdsError, match=f"node id is {node_id}"):
        sheet.entries()


@pytest.mark.parametrize(
    ("text", "line", "what", "remedy"),
    [
        ("[2000]\nAccessType=rw\n", 3, "[2000] has no DataType", "DataType=0x0007"),
        ("[2000]\nDataType=5\n", 3, "[2000] has no AccessType", "AccessType=rw"),
        ("[2000]\nDataType=x\n", 4, "DataType is 'x'", "0x0C"),
        ("[2000]\nDataType=5\nAccessType=wr\n", 5, "AccessType is 'wr'", "one of ro, wo"),
        ("[2000]\nDataType=5\nAccessType=rw\nPDOMapping=yes\n", 6, "pdomapping is 'yes'", "0x0C"),
        (f"[2000]\n{WORD}DefaultValue=many\n", 8, "'many' is no UNSIGNED16", "0x0C"),
        (f"[2000]\n{WORD}DefaultValue=65536\n", 8, "is no UNSIGNED16", "cannot hold it"),
        (f"[2000]\n{WORD}DefaultValue=-1\n", 8, "is no UNSIGNED16", "cannot hold it"),
        (f"[2000]\n{WORD}DefaultValue=0xFFC0+$NODEID\n", 8, "is no UNSIGNED16", "cannot hold"),
        (f"[2000]\n{WORD}DefaultValue=$NODEID*2\n", 8, "is no UNSIGNED16", "$NODEID+0x180"),
        (f"[2000]\n{WORD}DefaultValue={'1' * 41}\n", 8, "is no UNSIGNED16", "shorten"),
        (f"[2000]\n{WORD}HighLimit=much\n", 8, "limit 'much' is no UNSIGNED16", "0x0C"),
        (f"[2000]\n{WORD.replace('6', '8')}DefaultValue=1,5\n", 8, "is no REAL32", "1.5"),
        (f"[2000]\n{WORD.replace('6', '8')}DefaultValue=1.5.5\n", 8, "is no REAL32", "1.5"),
        (f"[2000]\n{WORD.replace('6', '8')}DefaultValue=1e99\n", 8, "is no REAL32", "hold"),
        (f"[2000]\n{WORD.replace('6', '8')}DefaultValue=0x123456789\n", 8, "REAL32", "32 bits"),
        (f"[2000]\n{WORD.replace('6', 'A')}DefaultValue=0x1\n", 8, "OCTET_STRING", "01 AB"),
        (f"[2000]\n{WORD.replace('6', 'C')}DefaultValue=-1\n", 8, "TIME_OF_DAY", "6 bytes"),
        ("[2000]\nObjectType=seven\n", 4, "ObjectType is 'seven'", "0x0C"),
        ("[2000\n", 3, "'[2000' is no section", "[name]"),
        ("[]\n", 3, "is no section", "[name]"),
        ("x\0y\n", 3, "00h", "plain text"),
        ("", 0, "there is no object", "is this an EDS?"),
    ],
)
def test_what_cannot_be_read_is_refused(text: str, line: int, what: str, remedy: str) -> None:
    """With file, line, value and remedy."""
    said = refusal(HEAD + text)
    assert said.startswith(f"x.eds:{line}: ")
    assert what in said
    assert remedy in said.partition("; ")[2]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (f"stray\n[2000]\n{WORD}", "'stray' belongs to nothing"),
        (f"[2000]\n{WORD}=5\n", "'=5' belongs to nothing"),
        (f"[2000]\n{WORD}[2001]\nObjectType=8\nDataType=5\nAccessType=ro\nCompactSubObj=255\n",
         "CompactSubObj is 255"),
        (f"[2000]\n{WORD}[2001]\nObjectType=8\nDataType=5\nAccessType=ro\nCompactSubObj=-1\n",
         "CompactSubObj is -1"),
        (f"[2000sub1]\n{WORD}[2000sub01]\n{WORD}", "[2000sub01] is there twice"),
        (f"[2000]\n{WORD.replace('0x0006', '0xA1')}[A1sub1]\nDefaultValue=0x99\n",
         "data type '0xA1' is read as DOMAIN"),
        (f"[2000]\n{WORD.replace('0x0006', '0xA1')}[A1sub1]\nAccessType=ro\n",
         "data type '0xA1' is read as DOMAIN"),
        (f"[2000]\n{WORD.replace('0x0006', '-1')}", "data type '-1' is read as DOMAIN"),
    ],
)  # fmt: skip
def test_what_is_odd_leaves_a_remark(text: str, said: str) -> None:
    """And the file is read."""
    sheet = parsed(HEAD + text)
    assert any(said in remark.text and remark.line for remark in sheet.remarks)
    assert sheet.entries()


def test_a_device_may_wait_for_its_node_id() -> None:
    """255 stands for none; formulas count with 0."""
    od = ObjectDictionary(load_eds(FILES / "numbers.eds").entries(255))
    assert (od.number(0x2002), od.number(0x2003)) == (0x180, 0)


def test_the_second_reader_need_not_be_asked() -> None:
    """A bundled file is checked by tests; devices are made of it without that."""
    path = FILES / "numbers.eds"
    plain, asked = load_eds(path, checked=False), load_eds(path)
    assert plain.corrections == ()
    assert plain.objects == asked.objects


def test_device_info_may_be_missing() -> None:
    """Nothing is known then but the objects; what was stray before them is told."""
    sheet = parsed(f"Name=lost\n[2000]\n{WORD}[A0sub2]\n[20000]\n[2000subxyz]\n[2000sub123]\n")
    assert "no section [DeviceInfo]" in sheet.remarks[0].text
    assert (sheet.info.vendor, sheet.info.granularity) == (0, 8)


def test_an_own_type_may_have_one_limit() -> None:
    """The other is that of the type."""
    text = f"[2000]\n{WORD.replace('0x0006', '0xA1')}[A1sub1]\nDefaultValue=5\n"
    (entry,) = parsed(
        HEAD + text + "[A1sub3]\nDefaultValue=9\n[A1sub2]\nDefaultValue=\n"
    ).entries()
    assert (entry.data_type, entry.low, entry.high) == (DataType.UNSIGNED8, None, 9)


def test_the_second_reader_is_corrected_where_it_is_wrong() -> None:
    """What canopen reads otherwise is noted with its line, and nothing else."""
    sheet = load_eds(FILES / "numbers.eds")
    said = {remark.text.partition(";")[0] for remark in sheet.corrections}
    assert said == {
        "2000h:00 default is '7'",
        "2001h:00 default is '8'",
        "2003h:00 default is '1'",
        "2004h:00 low limit is '-8388608'",
        "2004h:00 high limit is '8388607'",
        "2006h:00 low limit is '-2.5'",
        "2006h:00 high limit is '1000.0'",
        "2007h:00 default is '1.5'",
        "2008h:00 default is '1.5'",
        "2009h:00 default is '2541551403008843505'",
        "200Bh:00 default is '-2'",
        "200Ch:00 low limit is 'None'",
        "200Ch:00 high limit is 'None'",
        "200Eh:00 low limit is '2'",
        "200Eh:00 high limit is '9'",
    }
    text = (FILES / "numbers.eds").read_text()
    assert sheet.corrections[0].line == line_of("[2000]", text)
    said = {remark.text for remark in load_eds(FILES / "strings.eds").corrections}
    assert any("canopen reads 'one'" in text for text in said)
    assert load_eds(FILES / "sound.eds").corrections == ()


def test_a_second_reader_that_gives_up_is_no_harm() -> None:
    """It is told; the device is made of what the text says."""
    (each,) = parsed(HEAD + "[2000]\n" + WORD).objects
    (remark,) = opinion([each, each])
    assert "canopen cannot read the objects: " in remark.text


def test_a_file_that_cannot_be_opened_is_named(tmp_path: Path) -> None:
    """A missing one, a folder, a path that is none."""
    for path in (tmp_path / "none.eds", tmp_path, "a\0b"):
        with pytest.raises(EdsError, match="cannot be opened"):
            load_eds(path)


@pytest.mark.slow
def test_hostile_files_are_refused_at_once(tmp_path: Path) -> None:
    """A file without end, and a few lines that describe millions of objects."""
    path = tmp_path / "big.eds"
    with path.open("wb") as file:
        file.truncate(LARGEST + 1)
    with pytest.raises(EdsError, match="an EDS has less than 8 MiB"):
        load_eds(path)
    bomb = "".join(
        f"[{index:X}]\nObjectType=8\nDataType=5\nAccessType=ro\nCompactSubObj=254\n"
        for index in range(0x2000, 0x2100)
    )
    assert "more than 50000 objects" in refusal(bomb)


PARTS = """[2000]~|[2000sub1]|[|]|=|~|DataType|=0x0007~|$NODEID|ObjectType=8~|DefaultValue=|
CompactSubObj=99999~|[1A00]~|[1A00sub0]~DataType=5~AccessType=RW~DefaultValue=|1=|64~|
[DeviceInfo]~|AccessType=rw~|SupportedObjects=|[DeviceCommissioning]~|[2000Value]~|NodeID="""


@pytest.mark.slow
@given(
    st.lists(
        st.one_of(
            st.sampled_from(PARTS.replace("~", "\n").split("|")), st.text(max_size=6)
        ),
        max_size=40,
    )
)  # fmt: skip
def test_a_text_is_read_or_refused(words: list[str]) -> None:
    """Whatever it says, with the words of this reader."""
    data = (f"[2FFF]\n{WORD}" + "".join(words)).encode("utf-8", "replace")
    try:
        sheet = parse_eds("x.eds", data, 5)
    except EdsError as error:
        assert str(error).startswith("x.eds:")
    else:
        assert ObjectDictionary(sheet.entries()).indices


@pytest.mark.slow
@given(st.binary(max_size=300))
def test_bytes_are_read_or_refused(data: bytes) -> None:
    """The same with bytes, of which few make an object."""
    with pytest.raises(EdsError, match="eds:"):
        parse_eds("x.eds", data, 5)
