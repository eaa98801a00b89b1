"""SDO server: expedited and segmented transfers, aborts, NMT states, time-out."""

from __future__ import annotations

import pytest

from node_model.frame import Frame
from node_model.nmt import NmtState
from node_model.od import AbortCode, Access, DataType, Entry, ObjectDictionary
from node_model.sdo import SdoServer, SdoSettings
from node_model.sdo.transfer import Upload
from tests.node_model.sdo_client import MS, NODE, Aborted, Client, place

BYTE, WORD, THREE, LONG, QUAD = 0x2001, 0x2002, 0x2003, 0x2004, 0x2008
DOMAIN, STRING, SHORT = 0x2100, 0x2101, 0x2102
SIZES = {BYTE: 1, WORD: 2, THREE: 3, LONG: 4, QUAD: 8}
TYPES = {
    BYTE: DataType.UNSIGNED8,
    WORD: DataType.UNSIGNED16,
    THREE: DataType.UNSIGNED24,
    LONG: DataType.UNSIGNED32,
    QUAD: DataType.UNSIGNED64,
}


def dictionary() -> ObjectDictionary:
    """One entry of each kind."""
    entries = [
        Entry(index, 0, "number", kind, Access.RW, bytes(range(1, kind.size + 1)))
        for index, kind in TYPES.items()
    ]
    return ObjectDictionary(
        [
            *entries,
            Entry(0x1000, 0, "device type", DataType.UNSIGNED32, Access.RO, b"\x91\1\2\0"),
            Entry(DOMAIN, 0, "domain", DataType.DOMAIN, Access.RW),
            Entry(STRING, 0, "string", DataType.VISIBLE_STRING, Access.RW, b"hello", most=10),
            Entry(SHORT, 0, "hidden", DataType.UNSIGNED8, Access.WO, b"\0"),
            Entry(0x2103, 0, "count", DataType.UNSIGNED8, Access.RO, b"\1"),
            Entry(0x2103, 1, "held", DataType.INTEGER16, Access.RW, b"\0\0", low=-5, high=9),
        ]
    )


def served(settings: SdoSettings | None = None) -> tuple[ObjectDictionary, Client]:
    """A dictionary and a client of the server that serves it."""
    od = dictionary()
    server = SdoServer(od, NODE, settings)
    server.start(0)
    return od, Client(server)


def code_of(client: Client, *parts: bytes) -> int:
    """The code with which the server aborts."""
    with pytest.raises(Aborted) as caught:
        client.one(*parts)
    return caught.value.code


@pytest.mark.parametrize("index", SIZES)
def test_numbers_are_uploaded_expedited_up_to_four_bytes(index: int) -> None:
    """A number comes at once where it has one to four bytes, else in segments with its size."""
    _, client = served()
    answer = client.one(b"\x40", place(index, 0))
    heads = {1: 0x4F, 2: 0x4B, 3: 0x47, 4: 0x43, 8: 0x41}
    assert answer[0] == heads[SIZES[index]]
    assert client.upload(index) == bytes(range(1, SIZES[index] + 1))


@pytest.mark.parametrize("index", [BYTE, WORD, THREE, LONG])
def test_numbers_are_downloaded_expedited(index: int) -> None:
    """Commands 2Fh, 2Bh, 27h and 23h write one to four bytes."""
    od, client = served()
    client.download(index, 0, b"\xfe" * SIZES[index])
    assert od.get(index) == b"\xfe" * SIZES[index]


@pytest.mark.parametrize(
    ("index", "wanted"),
    [(BYTE, b"\1"), (THREE, b"\1\2\3"), (LONG, b"\1\2\3\4"), (STRING, b"\1\2\3\4")],
)
def test_an_expedited_download_without_size_takes_what_the_type_has(
    index: int, wanted: bytes
) -> None:
    """Command 22h: a number takes its bytes, a string all four."""
    od, client = served()
    assert client.one(b"\x22", place(index, 0), b"\1\2\3\4")[0] == 0x60
    assert od.get(index) == wanted


@pytest.mark.parametrize("size", [1, 4, 8])
def test_segments_carry_few_bytes_too(size: int) -> None:
    """A number may be written in segments, of four bytes or fewer as well."""
    index = {size: index for index, size in SIZES.items()}[size]
    for told in (None, size):
        od, client = served()
        client.segmented_download(index, 0, b"\xaa" * size, told)
        assert od.get(index) == b"\xaa" * size


@pytest.mark.parametrize(
    ("request_", "code"),
    [
        (b"\x40\x00\x30\x00", AbortCode.NO_OBJECT),
        (b"\x40\x00\x10\x01", AbortCode.NO_SUB_INDEX),
        (b"\x40\x02\x21\x00", AbortCode.WRITE_ONLY),
        (b"\x23\x00\x10\x00", AbortCode.READ_ONLY),
        (b"\x21\x00\x10\x00\x04", AbortCode.READ_ONLY),
        (b"\xc2\x00\x10\x00\x04", AbortCode.READ_ONLY),
        (b"\x20\x00\x30\x00", AbortCode.NO_OBJECT),
        (b"\x23\x01\x20\x00", AbortCode.TOO_LONG),
        (b"\x2f\x02\x20\x00", AbortCode.TOO_SHORT),
        (b"\x21\x01\x20\x00\x02", AbortCode.TOO_LONG),
        (b"\x21\x04\x20\x00\x03", AbortCode.TOO_SHORT),
        (b"\x22\x08\x20\x00", AbortCode.TOO_SHORT),
        (b"\x21\x01\x21\x00\x0b", AbortCode.TOO_LONG),
        (b"\x2b\x03\x21\x01\x0a\x00", AbortCode.TOO_HIGH),
        (b"\x2b\x03\x21\x01\xfa\xff", AbortCode.TOO_LOW),
        (b"\x21\x00\x21\x00\x01\x00\x00\x01", AbortCode.MEMORY),
        (b"\xa0\x00\x30\x00\x7f", AbortCode.NO_OBJECT),
    ],
)
def test_an_access_that_cannot_be_is_aborted_with_its_code(request_: bytes, code: int) -> None:
    """The abort has the multiplexer of the request and the code of CiA 301; nothing changes."""
    od, client = served(SdoSettings(memory=1 << 24))
    before = {key: entry.value for key, entry in od.entries.items()}
    with pytest.raises(Aborted) as caught:
        client.one(request_)
    assert (caught.value.code, caught.value.multiplexer) == (code, request_[1:4])
    assert {key: entry.value for key, entry in od.entries.items()} == before


@pytest.mark.parametrize("value", [9, -5])
def test_both_limits_are_allowed(value: int) -> None:
    """The least and the greatest value of an entry are taken."""
    od, client = served()
    client.download(0x2103, 1, value.to_bytes(2, "little", signed=True))
    assert od.number(0x2103, 1) == value


@pytest.mark.parametrize("command", [0xE0, 0xFF, 0x00, 0x10, 0x60, 0x70, 0xA1, 0xA2, 0xA3, 0xC1])
def test_a_request_that_belongs_to_no_transfer_is_refused(command: int) -> None:
    """Unknown commands and parts of a transfer that is not there: 05040001h for 0000h:00."""
    _, client = served()
    (answer,) = client.ask(bytes((command, 0x00, 0x10, 0)))
    assert answer == b"\x80\0\0\0\1\0\4\5"


@pytest.mark.parametrize("size", [0, 1, 7, 9])
def test_a_request_of_another_length_is_ignored(size: int) -> None:
    """Only frames of eight bytes are requests; a remote frame is none either."""
    _, client = served()
    data = b"\x40\x00\x10\x00\0\0\0\0"[:size]
    frame = Frame(0x605, data) if size < 9 else Frame(0x605, remote=True, dlc=8)
    assert list(client.server.receive(frame, 1)) == []


@pytest.mark.parametrize("segment", [0, 1])
def test_a_wrong_toggle_ends_a_download(segment: int) -> None:
    """The first segment has toggle 0, the second 1; else 05030000h, and all is over."""
    od, client = served()
    client.start_segments(DOMAIN, 0, 21)
    for number in range(segment):
        client.segment(b"1234567", number, last=False)
    wrong = (segment + 1 & 1) << 4
    assert code_of(client, bytes((wrong,)), b"1234567") == AbortCode.TOGGLE
    assert code_of(client, bytes((wrong ^ 0x10,)), b"1234567") == AbortCode.COMMAND
    assert od.get(DOMAIN) == b""


@pytest.mark.parametrize("segment", [0, 1])
def test_a_wrong_toggle_ends_an_upload(segment: int) -> None:
    """As in a download."""
    _, client = served()
    client.one(b"\x40", place(QUAD, 0))
    for number in range(segment):
        client.one(bytes((0x60 | number << 4,)))
    wrong = 0x60 | (segment + 1 & 1) << 4
    assert code_of(client, bytes((wrong,))) == AbortCode.TOGGLE
    assert code_of(client, bytes((wrong ^ 0x10,))) == AbortCode.COMMAND


def test_after_the_last_segment_there_is_no_other() -> None:
    """A finished upload is over."""
    _, client = served()
    client.upload(QUAD)
    assert code_of(client, b"\x60") == AbortCode.COMMAND


@pytest.mark.parametrize(("told", "sent"), [(8, 7), (7, 8), (1, 7), (14, 15)])
def test_a_size_that_was_not_told_is_refused(told: int, sent: int) -> None:
    """Fewer bytes than told: 06070010h; more: 06070012h; the object keeps its value."""
    od, client = served()
    with pytest.raises(Aborted) as caught:
        client.segmented_download(DOMAIN, 0, bytes(sent), told)
    assert caught.value.code == (AbortCode.LENGTH if sent < told else AbortCode.TOO_LONG)
    assert caught.value.multiplexer == place(DOMAIN, 0)
    assert od.get(DOMAIN) == b""


def test_segments_past_the_room_of_an_object_are_refused_at_once() -> None:
    """A string of ten bytes takes ten, not eleven; without a limit memory is one."""
    od, client = served(SdoSettings(memory=20))
    client.segmented_download(STRING, 0, b"0123456789")
    assert od.get(STRING) == b"0123456789"
    with pytest.raises(Aborted) as caught:
        client.segmented_download(STRING, 0, bytes(11))
    assert caught.value.code == AbortCode.TOO_LONG
    with pytest.raises(Aborted) as caught:
        client.segmented_download(DOMAIN, 0, bytes(21))
    assert caught.value.code == AbortCode.MEMORY


@pytest.mark.parametrize(
    "request_",
    [b"\x40\x02\x20\x00", b"\x2b\x02\x20\x00\1\2", b"\x40\x00\x30\x00", b"\xa0\x02\x20\x00\x7f"],
)
@pytest.mark.parametrize("begun", [b"\x21\x00\x21\x00\x08", b"\x40\x08\x20\x00"])
def test_a_new_request_in_the_middle_begins_anew(begun: bytes, request_: bytes) -> None:
    """An initiating request ends the transfer under way and is answered as if alone."""
    _, client = served()
    _, alone = served()
    client.one(begun)
    assert client.ask(request_) == alone.ask(request_)
    if request_[0] != 0xA0:
        assert code_of(client, b"\x60") == AbortCode.COMMAND


@pytest.mark.parametrize("command", [0xE0, 0x60, 0xA1])
def test_a_wrong_command_in_the_middle_ends_the_transfer(command: int) -> None:
    """The abort names the object of the transfer."""
    od, client = served()
    client.start_segments(DOMAIN, 0, 8)
    with pytest.raises(Aborted) as caught:
        client.one(bytes((command,)))
    assert caught.value.code == AbortCode.COMMAND
    assert caught.value.multiplexer == place(DOMAIN, 0)
    assert code_of(client, b"\0") == AbortCode.COMMAND
    assert od.get(DOMAIN) == b""


def test_a_download_segment_does_not_belong_to_an_upload() -> None:
    """Its command is unknown there."""
    _, client = served()
    client.one(b"\x40", place(QUAD, 0))
    assert code_of(client, b"\0") == AbortCode.COMMAND


@pytest.mark.parametrize("begun", [None, b"\x21\x00\x21\x00\x08", b"\xc0\x00\x21\x00"])
def test_a_client_that_aborts_gets_no_answer(begun: bytes | None) -> None:
    """After it the server is idle."""
    _, client = served()
    if begun:
        client.one(begun)
    assert client.ask(b"\x80", place(DOMAIN, 0)) == []
    assert code_of(client, b"\0") == AbortCode.COMMAND
    assert client.upload(BYTE) == b"\1"


def test_in_stopped_the_server_is_silent() -> None:
    """What stopped cut off is not taken up again."""
    _, client = served(SdoSettings(time_out_ns=MS))
    client.start_segments(DOMAIN, 0, 8)
    client.server.enter(NmtState.STOPPED, 5)
    assert client.ask(b"\0") == []
    assert client.ask(b"\x40", place(BYTE, 0)) == []
    assert client.server.deadline() is None
    for state in (NmtState.OPERATIONAL, NmtState.PRE_OPERATIONAL):
        client.server.enter(state, 6)
        assert code_of(client, b"\0") == AbortCode.COMMAND
        assert client.upload(BYTE) == b"\1"


def test_without_supply_the_server_is_silent() -> None:
    """After stop nothing is answered and nothing is due."""
    _, client = served(SdoSettings(time_out_ns=MS))
    client.start_segments(DOMAIN, 0, 8)
    client.server.stop()
    assert client.server.deadline() is None
    assert client.ask(b"\x40", place(BYTE, 0)) == []
    client.server.start(9)
    assert client.upload(BYTE) == b"\1"


def test_a_silent_client_is_aborted_when_its_time_is_over() -> None:
    """05040000h one time-out after the client's last request, and not before."""
    _, client = served(SdoSettings(time_out_ns=7 * MS))
    assert client.server.deadline() is None
    client.start_segments(DOMAIN, 0, 14)
    client.segment(b"1234567", 0, last=False)
    due = client.now + 7 * MS
    assert client.server.deadline() == due
    assert list(client.server.advance(due - 1)) == []
    (answer,) = client.server.advance(due)
    assert answer.data == b"\x80" + place(DOMAIN, 0) + b"\0\0\4\5"
    assert client.server.deadline() is None
    assert list(client.server.advance(due + 1)) == []
    assert client.upload(BYTE) == b"\1"


def test_without_a_time_out_a_client_may_think_for_ever() -> None:
    """By default nothing is due during a transfer."""
    _, client = served()
    client.start_segments(DOMAIN, 0, 7)
    assert client.server.deadline() is None
    assert list(client.server.advance(1 << 60)) == []
    client.segment(b"1234567", 0, last=True)


def test_a_size_need_not_be_told() -> None:
    """Such a server begins an upload with 40h."""
    _, client = served(SdoSettings(tells_size=False))
    assert client.one(b"\x40", place(STRING, 0)) == b"\x40" + place(STRING, 0) + bytes(4)
    assert client.upload(STRING) == b"hello"


def test_an_empty_value_is_uploaded_in_one_empty_segment() -> None:
    """Size 0, then a last segment without bytes."""
    _, client = served()
    assert client.one(b"\x40", place(DOMAIN, 0)) == b"\x41" + place(DOMAIN, 0) + bytes(4)
    assert client.one(b"\x60") == b"\x0f" + bytes(7)
    assert client.upload(DOMAIN) == b""


def test_who_watches_an_object_is_told_at_the_instant_of_the_last_segment() -> None:
    """An observer is called once, when the value is there."""
    od, client = served()
    told: list[tuple[int, int, bytes]] = []
    od.observe(DOMAIN, lambda sub, now: told.append((sub, now, od.get(DOMAIN))))
    client.segmented_download(DOMAIN, 0, b"12345678")
    assert told == [(0, client.now, b"12345678")]


def test_a_segmented_transfer_has_nothing_of_its_own_to_send() -> None:
    """Asked though nothing is due, it stays silent."""
    transfer = Upload(b"\0\x21\0", b"12345678")
    assert transfer.due_at is None
    assert list(transfer.advance(1)) == []
