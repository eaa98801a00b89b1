"""SDO servers as a service: default and further ones, their set-up, any bytes, every size."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from node_model.frame import Frame
from node_model.nmt import NmtState
from node_model.od import AbortCode, Access, DataType, Entry, ObjectDictionary
from node_model.sdo import SdoServer, SdoSettings
from tests.node_model.sdo_client import MS, NODE, Client, place
from tests.node_model.test_sdo import BYTE, DOMAIN, code_of, dictionary, served

OFF = 1 << 31


def number(index: int, sub: int, value: int, access: Access = Access.RW) -> Entry:
    """An UNSIGNED32."""
    data = value.to_bytes(4, "little")
    return Entry(index, sub, "COB-ID", DataType.UNSIGNED32, access, data, data)


def further(request: int = OFF, answer: int = OFF) -> tuple[SdoServer, Client]:
    """A device with one more server, and a client of its default server."""
    od = dictionary()
    more = [
        number(0x1200, 1, 0x600, Access.RO),
        number(0x1200, 2, 0x580, Access.RO),
        Entry(0x1201, 0, "highest", DataType.UNSIGNED8, Access.RO, b"\2", b"\2"),
        number(0x1201, 1, request),
        number(0x1201, 2, answer),
    ]
    od = ObjectDictionary([*od.entries.values(), *more])
    server = SdoServer(od, NODE)
    server.start(0)
    return server, Client(server)


def set_up(client: Client, request: int, answer: int) -> None:
    """Switch the further server on."""
    client.download(0x1201, 1, request.to_bytes(4, "little"))
    client.download(0x1201, 2, answer.to_bytes(4, "little"))


def test_the_default_server_shows_its_identifiers() -> None:
    """1200h:01 is 600h + node id, 1200h:02 580h + node id, whatever the dictionary said."""
    server, client = further()
    assert client.upload(0x1200, 1) == b"\x05\x06\0\0"
    assert client.upload(0x1200, 2) == b"\x85\x05\0\0"
    server.node_id = 9
    server.start(1)
    assert server.listens_to() == {0x609}
    assert Client(server, 0x609, 0x589).upload(0x1200, 1) == b"\x09\x06\0\0"


def test_a_further_server_follows_the_same_rules() -> None:
    """With both identifiers valid it serves as the default one does, and at the same time."""
    server, client = further()
    assert server.listens_to() == {0x605}
    set_up(client, 0x6A0, 0x6A1)
    assert server.listens_to() == {0x605, 0x6A0}
    other = Client(server, 0x6A0, 0x6A1)
    other.start_segments(DOMAIN, 0, 14)
    other.segment(b"1234567", 0, last=False)
    assert client.upload(BYTE) == b"\1"
    client.download(0x1201, 0x02, (0x6A1).to_bytes(4, "little"))
    other.segment(b"abcdefg", 1, last=True)
    assert client.upload(DOMAIN) == b"1234567abcdefg"


@pytest.mark.parametrize(
    ("request_", "answer"), [(0x6A0 | OFF, 0x6A1), (0x6A0, 0x6A1 | OFF), (OFF, OFF)]
)
def test_a_server_with_an_invalid_identifier_does_not_exist(request_: int, answer: int) -> None:
    """Bit 31 of either identifier switches it off."""
    server, _ = further(request_, answer)
    assert server.listens_to() == {0x605}
    assert list(server.receive(Frame(0x6A0, b"\x40\0\x10\0\0\0\0\0"), 1)) == []


def test_a_server_that_is_switched_off_forgets_its_transfer() -> None:
    """Afterwards nobody answers there; switched on again it is idle."""
    server, client = further(0x6A0, 0x6A1)
    other = Client(server, 0x6A0, 0x6A1)
    other.start_segments(DOMAIN, 0, 14)
    client.download(0x1201, 1, (0x6A0 | OFF).to_bytes(4, "little"))
    assert other.ask(b"\0") == []
    client.download(0x1201, 1, (0x6A0).to_bytes(4, "little"))
    assert code_of(other, b"\0") == AbortCode.COMMAND


def test_a_server_may_switch_itself_off() -> None:
    """The answer to that still comes on its own identifier."""
    server, _ = further(0x6A0, 0x6A1)
    other = Client(server, 0x6A0, 0x6A1)
    other.download(0x1201, 2, (0x6A1 | OFF).to_bytes(4, "little"))
    assert server.listens_to() == {0x605}


def test_reset_communication_takes_further_servers_back() -> None:
    """Restored to their power-on values and started anew, they are gone."""
    server, client = further()
    set_up(client, 0x6A0, 0x6A1)
    for sub in (1, 2):
        server.od.put_number(0x1201, sub, OFF)
    server.start(9)
    assert server.listens_to() == {0x605}


@pytest.mark.parametrize(
    "value",
    [0x000, 0x07F, 0x101, 0x180, 0x581, 0x5FF, 0x601, 0x67F, 0x6E0, 0x6FF, 0x701, 0x7FF,
     0x800, 0x2000_0400, 0x0001_0400],
)  # fmt: skip
def test_a_restricted_identifier_is_refused(value: int) -> None:
    """The ranges of CiA 301, to both ends, and whatever is no base identifier: 06090030h."""
    _, client = further()
    for sub in (1, 2):
        request = (b"\x23", place(0x1201, sub), value.to_bytes(4, "little"))
        assert code_of(client, *request) == AbortCode.VALUE


@pytest.mark.parametrize("value", [0x080, 0x100, 0x181, 0x580, 0x600, 0x680, 0x6DF, 0x700])
def test_an_identifier_beside_the_restricted_ones_is_taken(value: int) -> None:
    """The ranges of CiA 301 from outside."""
    _, client = further()
    client.download(0x1201, 1, value.to_bytes(4, "little"))


@pytest.mark.parametrize(("new", "allowed"), [(0x6A0, True), (0x6A0 | OFF, True), (0x6A1, False)])
def test_a_valid_identifier_must_be_switched_off_first(new: int, allowed: bool) -> None:
    """Bits 0 to 29 stay as they are while the server exists."""
    _, client = further(0x6A0, 0x6A1)
    request = (b"\x23", place(0x1201, 1), new.to_bytes(4, "little"))
    if allowed:
        assert client.one(*request)[0] == 0x60
    else:
        assert code_of(client, *request) == AbortCode.VALUE


def test_the_identifier_of_the_default_server_wins() -> None:
    """A further server that was stored with the same one does not take it over."""
    server, client = further(0x605, 0x6A1)
    assert server.listens_to() == {0x605}
    assert client.upload(BYTE) == b"\1"


def test_other_sub_indices_of_a_server_are_no_identifiers() -> None:
    """The client's node id, 1201h:03, takes any value."""
    od = ObjectDictionary([number(0x1201, 1, OFF), number(0x1201, 2, OFF), number(0x1201, 3, 0)])
    server = SdoServer(od, NODE)
    server.start(0)
    Client(server).download(0x1201, 3, b"\1\0\0\0")
    assert od.number(0x1201, 3) == 1


def test_each_server_has_its_own_deadline() -> None:
    """The soonest counts; each is aborted at its own."""
    od = ObjectDictionary([*dictionary().entries.values(), number(0x1201, 1, 0x6A0),
                           number(0x1201, 2, 0x6A1)])  # fmt: skip
    server = SdoServer(od, NODE, SdoSettings(time_out_ns=50 * MS))
    server.start(0)
    one, two = Client(server), Client(server, 0x6A0, 0x6A1)
    two.now = 7 * MS
    two.start_segments(DOMAIN, 0, 7)
    one.start_segments(DOMAIN, 0, 7)
    assert server.deadline() == one.now + 50 * MS
    assert [f.can_id for f in server.advance(one.now + 50 * MS)] == [0x585]
    assert [f.can_id for f in server.advance(two.now + 50 * MS)] == [0x6A1]


def test_a_frame_of_another_identifier_is_nobody_s() -> None:
    """The server answers its own requests only."""
    server, _ = further()
    assert list(server.receive(Frame(0x606, b"\x40\0\x10\0\0\0\0\0"), 1)) == []


PIECE = st.one_of(st.binary(max_size=8), st.builds(
    lambda command, rest: bytes((command,)) + rest,
    st.sampled_from([0x20, 0x21, 0x23, 0x40, 0x60, 0x70, 0, 0x10, 1, 0x81, 0xA0, 0xA1, 0xA2,
                     0xA3, 0xA4, 0xC0, 0xC1, 0xC6, 0xE0]),
    st.sampled_from([b"\x00\x21\x00\x0e\0\0\0", b"\x08\x20\0\x02\0\0\0", b"\2\2\0\0\0\0\0"]),
))  # fmt: skip


@pytest.mark.slow
@settings(max_examples=150)
@given(st.lists(PIECE, max_size=25), st.booleans())
def test_after_any_bytes_the_next_request_is_served(pieces: list[bytes], paced: bool) -> None:
    """No exception, eight bytes an answer, laws of deadlines kept, then a normal upload."""
    _, client = served(
        SdoSettings(time_out_ns=40 * MS, block_time_out_ns=9 * MS, segment_gap_ns=MS * paced)
    )
    server = client.server
    for now, piece in enumerate(pieces):
        at = now * 5 * MS
        while (due := server.deadline()) is not None and due <= at:
            assert all(len(f.data) == 8 for f in server.advance(due))
            after = server.deadline()
            assert after is None or after > due
        assert all(len(f.data) == 8 for f in server.receive(Frame(0x605, piece), at))
    client.ask(b"\x80")
    assert client.upload(BYTE) == b"\1"


@pytest.mark.slow
@settings(max_examples=60)
@given(
    st.binary(min_size=1, max_size=2000),
    st.integers(1, 127),
    st.lists(st.integers(1, 127), max_size=3),
)
def test_every_way_gives_the_same_bytes(data: bytes, block_size: int, lost: list[int]) -> None:
    """Segments or blocks, either way, with segments lost: what was written is read."""
    od, client = served(SdoSettings(block_size=block_size))
    client.segmented_download(DOMAIN, 0, data, len(data))
    assert od.get(DOMAIN) == data
    assert client.upload(DOMAIN) == data
    assert client.block_upload(DOMAIN, block_size=block_size) == data
    od.put(DOMAIN, 0, b"")

    def losses(block: int) -> list[int]:
        most = min(block_size, -(-len(data) // 7)) - 1
        return [n for n in lost if n <= most] if block == 0 else []

    client.block_download(DOMAIN, 0, data, losses=losses)
    assert od.get(DOMAIN) == data
    if len(data) <= 4:
        client.download(DOMAIN, 0, data)
        assert od.get(DOMAIN) == data


@pytest.mark.slow
def test_many_sizes_go_every_way() -> None:
    """Up to 2000 bytes, segmented and in blocks: all small ones, all around a full block."""
    data = bytes(i * 31 + (i >> 8) & 0xFF for i in range(2000))
    od, client = served()
    for size in (*range(1, 150), *range(882, 903), *range(903, 2001, 61), 2000):
        value = data[:size]
        client.segmented_download(DOMAIN, 0, value, size)
        assert od.get(DOMAIN) == value
        assert client.upload(DOMAIN) == client.block_upload(DOMAIN) == value
        od.put(DOMAIN, 0, b"")
        client.block_download(DOMAIN, 0, value, size)
        assert od.get(DOMAIN) == value


@pytest.mark.slow
def test_a_megabyte_goes_in_blocks_both_ways() -> None:
    """1 048 576 bytes down and up again."""
    data = bytes(range(256)) * 4096
    od, client = served()
    client.block_download(DOMAIN, 0, data, len(data))
    assert od.get(DOMAIN) == data
    assert client.block_upload(DOMAIN) == data


def test_the_state_before_start_is_silence() -> None:
    """A server that was never started answers nothing, in no state."""
    server = SdoServer(dictionary(), NODE)
    server.enter(NmtState.OPERATIONAL, 1)
    assert list(server.receive(Frame(0x605, b"\x40\0\x10\0\0\0\0\0"), 1)) == []
    assert server.listens_to() == frozenset()
