"""Expedited and segmented transfers against answers written by hand from CiA 301 (7.2.4.3)."""

from __future__ import annotations

import pytest

from hil_tests.clients.sdo import Abort, Breach, Download, Transfer, Upload, abort_in


def talk(transfer: Transfer, *answers: str) -> list[str]:
    """What a client sends from its first request on, one answer after the other."""
    sent = [data.hex().upper() for data in transfer.begin()]
    for answer in answers:
        sent += [data.hex().upper() for data in transfer.answer(bytes.fromhex(answer))]
    return sent


def breach(transfer: Transfer, *answers: str) -> Breach:
    """What the last answer breaks."""
    talk(transfer, *answers[:-1])
    with pytest.raises(Breach) as caught:
        transfer.answer(bytes.fromhex(answers[-1]))
    return caught.value


@pytest.mark.parametrize(
    ("answer", "read"),
    [
        ("4F17100001000000", "01"),
        ("4B17100001020000", "0102"),
        ("4717100001020300", "010203"),
        ("4317100001020304", "01020304"),
        ("4217100001020304", "01020304"),
    ],
)
def test_an_expedited_read_gives_the_bytes_that_count(answer: str, read: str) -> None:
    """4Fh, 4Bh, 47h and 43h tell how many bytes; 42h leaves it open, and all four are given."""
    transfer = Upload(0x1017, 0)
    assert talk(transfer, answer) == ["4017100000000000"]
    assert transfer.result == bytes.fromhex(read)


def test_a_read_in_segments_gives_them_together() -> None:
    """Ten bytes come in two segments, with toggle bits 0 and 1."""
    transfer = Upload(0x1008, 0)
    sent = talk(transfer, "410810000A000000", "0061626364656667", "1968696A00000000")
    assert sent == ["4008100000000000", "6000000000000000", "7000000000000000"]
    assert transfer.result == b"abcdefghij"


def test_a_read_in_segments_need_not_tell_its_size() -> None:
    """40h begins an upload of unknown size."""
    transfer = Upload(0x1008, 0)
    talk(transfer, "4008100000000000", "0D61000000000000")
    assert transfer.result == b"a"


def test_an_abort_is_a_result() -> None:
    """80h with the object ends the transfer; the code is kept."""
    transfer = Upload(0x1017, 0)
    assert talk(transfer, "8017100000000206") == ["4017100000000000"]
    assert transfer.result == Abort(0x0602_0000, 0x1017, 0)
    assert abort_in(bytes.fromhex("8017100000000206")) == transfer.result
    assert abort_in(bytes.fromhex("80171000000002")) is None
    assert abort_in(bytes.fromhex("4317100001020304")) is None


def test_an_unknown_command_has_no_object() -> None:
    """Servers differ in which one they name."""
    transfer = Upload(0x1017, 0)
    talk(transfer, "8000000001000405")
    assert transfer.result == Abort(0x0504_0001, 0, 0)


def test_a_write_of_up_to_four_bytes_is_expedited() -> None:
    """One request, one answer 60h."""
    transfer = Download(0x1017, 0, b"\xf4\x01")
    assert talk(transfer, "6017100000000000") == ["2B171000F4010000"]
    assert transfer.result == b""


@pytest.mark.parametrize("data", [b"", b"a", b"abcd"])
def test_a_short_write_can_go_in_segments(data: bytes) -> None:
    """Where it is wished, and always where there is nothing to write."""
    transfer = Download(0x2000, 1, data, segmented=True)
    sent = talk(transfer, "6000200100000000", "2000000000000000")
    assert sent[0] == f"21002001{len(data):02X}000000"
    assert sent[1] == (bytes((7 - len(data) << 1 | 1,)) + data.ljust(7, b"\0")).hex().upper()
    assert transfer.result == b""


def test_a_long_write_goes_in_segments() -> None:
    """Eight bytes take two, with toggle bits 0 and 1; the declared size can be a lie."""
    transfer = Download(0x2000, 1, b"abcdefgh", size=9)
    sent = talk(transfer, "6000200100000000", "2000000000000000", "3000000000000000")
    assert sent == ["2100200109000000", "0061626364656667", "1D68000000000000"]
    assert transfer.result == b""


@pytest.mark.parametrize(
    ("requirement", "answers"),
    [
        ("C-SD-01", ["43171000010203"]),
        ("C-SD-01", ["4318100001020304"]),
        ("C-SD-01", ["4317100101020304"]),
        ("C-SD-01", ["8017110000000206"]),
        ("C-SD-02", ["6017100000000000"]),
        ("C-SD-02", ["5317100000000000"]),
        ("C-SD-02", ["4E17100000000000"]),
        ("C-SD-04", ["4517100008000000"]),
        ("C-SD-04", ["4117100008000000", "6000000000000000"]),
        ("C-SD-06", ["4117100008000000", "1000000000000000"]),
        ("C-SD-06", ["4117100008000000", "0000000000000000", "0D00000000000000"]),
        ("C-SD-04", ["4117100008000000", "0D00000000000000"]),
        ("C-SD-04", ["4117100008000000", "0E00000000000000"]),
    ],
)
def test_a_read_names_the_rule_that_an_answer_breaks(requirement: str, answers: list[str]) -> None:
    """Length, object, command, toggle bit and size each have theirs."""
    assert breach(Upload(0x1017, 0), *answers).requirement == requirement


@pytest.mark.parametrize(
    ("requirement", "answers"),
    [
        ("C-SD-05", ["4000200100000000"]),
        ("C-SD-01", ["6000200200000000"]),
        ("C-SD-05", ["6000200100000000", "6000000000000000"]),
        ("C-SD-06", ["6000200100000000", "3000000000000000"]),
        ("C-SD-06", ["6000200100000000", "2000000000000000", "2000000000000000"]),
    ],
)
def test_a_write_names_the_rule_that_an_answer_breaks(
    requirement: str, answers: list[str]
) -> None:
    """Command, object and toggle bit each have theirs."""
    assert breach(Download(0x2000, 1, b"abcdefgh"), *answers).requirement == requirement


def test_an_expedited_write_has_a_rule_of_its_own() -> None:
    """An answer other than 60h breaks C-SD-03, and the text shows it."""
    broken = breach(Download(0x2000, 1, b"a"), "6100200100000000")
    assert broken.requirement == "C-SD-03"
    assert str(broken) == ("an answer 60h to a write for 2000h:01; it was 61 00 20 01 00 00 00 00")
    assert "no data has 0" in str(breach(Upload(0x1017, 0), ""))


def test_a_transfer_without_a_protocol_is_none() -> None:
    """The common part alone neither asks nor understands."""
    transfer = Transfer(0x1000, 0)
    with pytest.raises(NotImplementedError):
        transfer.begin()
    with pytest.raises(NotImplementedError):
        transfer.answer(bytes(8))
