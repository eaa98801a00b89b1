"""SDO server: block transfers."""

from __future__ import annotations

import pytest

from node_model.od import AbortCode, ObjectDictionary
from node_model.sdo import SdoSettings
from tests.node_model.sdo_client import MS, Aborted, Client, crc, place
from tests.node_model.test_sdo import BYTE, DOMAIN, QUAD, STRING, code_of, served

SIZES = (1, 4, 5, 7, 8, 14, 41, 42, 43, 888, 889, 890, 993, 994, 995)


def filled(size: int, settings: SdoSettings | None = None) -> tuple[ObjectDictionary, Client]:
    """A domain with that many different bytes."""
    od, client = served(settings)
    od.put(DOMAIN, 0, bytes(i * 7 + 1 & 0xFF for i in range(size)))
    return od, client


@pytest.mark.parametrize("size", [0, *SIZES])
@pytest.mark.parametrize("block_size", [1, 2, 127])
def test_a_block_upload_brings_every_byte(size: int, block_size: int) -> None:
    """Sizes around seven bytes and around a block of 127 segments, with small blocks too."""
    od, client = filled(size)
    assert client.block_upload(DOMAIN, block_size=block_size) == od.get(DOMAIN)


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("block_size", [1, 2, 127])
def test_a_block_download_brings_every_byte(size: int, block_size: int) -> None:
    """The same the other way, with and without the size told."""
    for told in (None, size):
        od, client = served(SdoSettings(block_size=block_size))
        data = bytes(i * 5 + 3 & 0xFF for i in range(size))
        client.block_download(DOMAIN, 0, data, told)
        assert od.get(DOMAIN) == data


@pytest.mark.parametrize("lost", [1, 2, 3, 4])
def test_a_lost_segment_of_an_upload_is_sent_again(lost: int) -> None:
    """The first, a middle or the last segment of a block: the server goes on behind ackseq."""
    od, client = filled(50)
    value = client.block_upload(
        DOMAIN, block_size=4, heard=lambda block, got: len(got) if block else lost - 1
    )
    assert value == od.get(DOMAIN)


def test_a_lost_last_segment_of_an_upload_is_sent_again() -> None:
    """The very last segment, and its confirmation with nothing heard."""
    od, client = filled(15)
    heard = [2, 0]
    value = client.block_upload(
        DOMAIN, heard=lambda block, got: heard[block] if block < 2 else len(got)
    )
    assert value == od.get(DOMAIN)


@pytest.mark.parametrize("lost", [(1,), (2,), (1, 2), (3,)])
def test_a_lost_segment_of_a_download_is_asked_for_again(lost: tuple[int, ...]) -> None:
    """ackseq names the last segment in sequence; the block is confirmed at its end."""
    od, client = served(SdoSettings(block_size=4))
    data = bytes(range(60))
    client.block_download(DOMAIN, 0, data, losses=lambda block: lost if block == 0 else ())
    assert od.get(DOMAIN) == data


def test_a_lost_last_segment_of_a_block_is_asked_for_when_the_client_is_silent() -> None:
    """With a block time-out the server confirms what it has, once."""
    od, client = served(SdoSettings(block_size=4, block_time_out_ns=5 * MS))
    client.start_blocks(DOMAIN, 0)
    for number in (1, 2, 3):
        assert client.ask(bytes((number,)), b"abcdefg") == []
    assert client.server.deadline() == client.now + 5 * MS
    assert client.wait() == [b"\xa2\3\4" + bytes(5)]
    assert client.server.deadline() is None
    assert client.ask(b"\x81", b"hijklmn") == [b"\xa2\1\4" + bytes(5)]
    assert client.server.deadline() is None
    wanted = b"abcdefg" * 3 + b"hijklmn"
    client.one(b"\xc1", crc(wanted))
    assert od.get(DOMAIN) == wanted


def test_both_time_outs_go_together() -> None:
    """A client that never comes back is aborted, though its block was confirmed by itself."""
    _, client = served(SdoSettings(block_time_out_ns=2 * MS, time_out_ns=9 * MS))
    client.start_blocks(DOMAIN, 0)
    begun = client.now
    assert client.wait()[0][:2] == b"\xa2\0"
    assert client.wait() == [b"\x80" + place(DOMAIN, 0) + b"\0\0\4\5"]
    assert client.now == begun + 9 * MS


@pytest.mark.parametrize("block_size", [0, 128, 255])
def test_a_block_size_past_its_range_is_refused(block_size: int) -> None:
    """05040002h, at the beginning and in a confirmation."""
    _, client = filled(100)
    assert code_of(client, b"\xa0", place(DOMAIN, 0), bytes((block_size,))) == AbortCode.BLOCK_SIZE
    client.one(b"\xa0", place(DOMAIN, 0), b"\x02")
    client.ask(b"\xa3")
    assert code_of(client, bytes((0xA2, 2, block_size))) == AbortCode.BLOCK_SIZE


def test_the_server_has_block_sizes_of_1_to_127() -> None:
    """Others cannot be set up."""
    for wrong in (0, 128):
        with pytest.raises(ValueError, match="block_size is"):
            SdoSettings(block_size=wrong)


@pytest.mark.parametrize("number", [0, 5, 127])
def test_a_segment_number_past_the_block_is_refused(number: int) -> None:
    """05040003h for 0 and for more than the block has."""
    od, client = served(SdoSettings(block_size=4))
    client.start_blocks(DOMAIN, 0)
    with pytest.raises(Aborted) as caught:
        client.one(bytes((number,)), b"1234567")
    assert (caught.value.code, caught.value.multiplexer) == (
        AbortCode.SEQUENCE,
        place(DOMAIN, 0),
    )
    assert od.get(DOMAIN) == b""


def test_a_confirmation_of_what_was_not_sent_is_refused() -> None:
    """05040003h for a number greater than that of the last segment."""
    _, client = filled(100)
    client.one(b"\xa0", place(DOMAIN, 0), b"\x02")
    client.ask(b"\xa3")
    assert code_of(client, b"\xa2\3\2") == AbortCode.SEQUENCE


@pytest.mark.parametrize("wrong", [b"\0\0", b"\xff\xff"])
def test_a_wrong_crc_is_refused(wrong: bytes) -> None:
    """05040004h; the object keeps its value."""
    od, client = served()
    client.start_blocks(DOMAIN, 0)
    client.send_block([b"1234567", b"89"], ends=True)
    assert code_of(client, b"\xd5", wrong) == AbortCode.CRC
    assert od.get(DOMAIN) == b""


def test_the_crc_is_that_of_the_clause() -> None:
    """The check value of "123456789" is 31C3h, both ways."""
    od, client = served()
    client.start_blocks(DOMAIN, 0)
    client.send_block([b"1234567", b"89"], ends=True)
    client.one(b"\xd5\xc3\x31")
    assert od.get(DOMAIN) == b"123456789"
    client.one(b"\xa4", place(DOMAIN, 0), b"\x7f")
    client.ask(b"\xa3")
    assert client.one(b"\xa2\x02\x7f") == b"\xd5\xc3\x31" + bytes(5)


@pytest.mark.parametrize("client_can", [True, False])
@pytest.mark.parametrize("server_can", [True, False])
def test_the_crc_counts_only_where_both_can(client_can: bool, server_can: bool) -> None:
    """Each side says what it can; without CRC the field is 0 and not looked at."""
    od, client = filled(20, SdoSettings(has_crc=server_can))
    assert client.block_upload(DOMAIN, with_crc=client_can) == od.get(DOMAIN)
    answer = client.start_blocks(DOMAIN, 0, with_crc=client_can)
    assert answer[0] == (0xA4 if server_can else 0xA0)
    client.send_block([b"1234567"], ends=True)
    if client_can and server_can:
        assert code_of(client, b"\xc1", b"\1\1") == AbortCode.CRC
    else:
        client.one(b"\xc1", b"\1\1")


@pytest.mark.parametrize(("told", "sent"), [(8, 7), (7, 8), (7, 14), (14, 13)])
def test_a_size_that_was_not_told_is_refused(told: int, sent: int) -> None:
    """As in segments: 06070010h or 06070012h."""
    od, client = served()
    with pytest.raises(Aborted) as caught:
        client.block_download(DOMAIN, 0, bytes(sent), told)
    assert caught.value.code == (AbortCode.LENGTH if sent < told else AbortCode.TOO_LONG)
    assert od.get(DOMAIN) == b""


def test_bytes_past_the_room_of_an_object_are_refused() -> None:
    """Ten bytes fit in two segments of a ten byte string, eleven do not."""
    od, client = served()
    client.block_download(STRING, 0, b"0123456789")
    assert od.get(STRING) == b"0123456789"
    with pytest.raises(Aborted) as caught:
        client.block_download(STRING, 0, bytes(11))
    assert caught.value.code == AbortCode.TOO_LONG


def test_the_threshold_lets_few_bytes_come_as_an_upload() -> None:
    """A value of up to the threshold is answered as a normal upload, a longer one in blocks."""
    _, client = filled(20)
    request = (b"\xa0", place(DOMAIN, 0))
    assert client.one(*request, b"\x7f\x14")[0] == 0x41
    assert client.one(*request, b"\x7f\x13")[0] == 0xC6
    assert client.one(b"\xa0", place(BYTE, 0), b"\x7f\x01")[0] == 0x4F
    assert client.block_upload(BYTE, threshold=1) == b"\1"
    _, plain = filled(20, SdoSettings(takes_switch=False))
    assert plain.one(*request, b"\x7f\x14")[0] == 0xC6
    _, empty = filled(0)
    assert empty.one(*request, b"\x7f\x00")[0] == 0xC6


def test_a_size_need_not_be_told_in_blocks() -> None:
    """Such a server leaves bit and size out."""
    od, client = filled(20, SdoSettings(tells_size=False))
    answer = client.one(b"\xa0", place(DOMAIN, 0), b"\x7f")
    assert answer == b"\xc4" + place(DOMAIN, 0) + bytes(4)
    assert client.block_upload(DOMAIN) == od.get(DOMAIN)


def test_a_server_without_blocks_says_so() -> None:
    """05040001h with the multiplexer of the request."""
    _, client = served(SdoSettings(has_blocks=False))
    for command in (b"\xa0", b"\xc0"):
        with pytest.raises(Aborted) as caught:
            client.one(command, place(DOMAIN, 0), b"\x7f")
        assert caught.value.code == AbortCode.COMMAND
        assert caught.value.multiplexer == place(DOMAIN, 0)


@pytest.mark.parametrize("wrong", [b"\xa1", b"\xa2\1\x7f", b"\x60", b"\xe0"])
def test_an_upload_that_was_not_started_takes_nothing_else(wrong: bytes) -> None:
    """Only the start may follow the initiation."""
    _, client = filled(20)
    client.one(b"\xa0", place(DOMAIN, 0), b"\x7f")
    assert code_of(client, wrong) == AbortCode.COMMAND


@pytest.mark.parametrize("wrong", [b"\xc0\x00\x21\x00", b"\x40\x01\x20\x00"])
def test_a_new_request_after_the_last_block_begins_anew(wrong: bytes) -> None:
    """When all segments are confirmed, the next byte is a command again."""
    od, client = served()
    client.start_blocks(DOMAIN, 0)
    client.send_block([b"1234567"], ends=True)
    assert client.one(wrong)[1:4] == wrong[1:4]
    assert od.get(DOMAIN) == b""


def test_the_end_of_a_download_has_its_own_command() -> None:
    """A segment of another transfer in its place is refused."""
    _, client = served()
    client.start_blocks(DOMAIN, 0)
    client.send_block([b"1234567"], ends=True)
    assert code_of(client, b"\x01") == AbortCode.COMMAND


def test_segments_may_keep_a_distance() -> None:
    """The first comes at once, each other one gap later, until the block is out."""
    od, client = filled(24, SdoSettings(segment_gap_ns=3 * MS, time_out_ns=5 * MS))
    client.one(b"\xa4", place(DOMAIN, 0), b"\x03")
    (first,) = client.ask(b"\xa3")
    assert first[0] == 1
    began = client.now
    assert client.server.deadline() == began + 3 * MS
    assert list(client.server.advance(began + 3 * MS - 1)) == []
    assert [frame.data[0] for frame in client.server.advance(began + 6 * MS)] == [2, 3]
    assert client.server.deadline() == began + 11 * MS
    client.now = began + 6 * MS
    (last,) = client.ask(b"\xa2\x03\x03")
    assert last[0] == 0x81
    _, other = filled(24, SdoSettings(segment_gap_ns=3 * MS))
    assert other.block_upload(DOMAIN) == od.get(DOMAIN)


def test_a_confirmation_stops_the_segments_that_were_still_to_come() -> None:
    """A client that missed one need not wait for the rest of the block."""
    _, client = filled(70, SdoSettings(segment_gap_ns=3 * MS))
    client.one(b"\xa4", place(DOMAIN, 0), b"\x05")
    client.ask(b"\xa3")
    client.wait()
    assert client.ask(b"\xa2\0\5")[0][0] == 1
    assert client.wait()[0][0] == 2


def test_a_number_comes_in_blocks_too() -> None:
    """Block transfer is not for domains alone."""
    od, client = served()
    client.block_download(QUAD, 0, b"8 bytes!", 8)
    assert od.get(QUAD) == b"8 bytes!"
    assert client.block_upload(BYTE) == b"\1"


@pytest.mark.parametrize(("bit_rate", "gap_ns"), [(1_000_000, 151_800), (10_000, 15_180_000)])
def test_a_paced_server_leaves_room_on_the_wire(bit_rate: int, gap_ns: int) -> None:
    """Segments keep the distance of the longest frame and a tenth more."""
    _, client = filled(24)
    client.server.pace(bit_rate)
    client.server.start(0)
    client.one(b"\xa4", place(DOMAIN, 0), b"\x03")
    client.ask(b"\xa3")
    assert client.server.deadline() == client.now + gap_ns
