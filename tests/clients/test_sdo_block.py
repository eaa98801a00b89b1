"""Block transfers against answers written by hand from CiA 301 (7.2.4.3.9 to 7.2.4.3.16)."""

from __future__ import annotations

from itertools import chain

import pytest

from hil_tests.clients.sdo import Breach, Transfer
from hil_tests.clients.sdo_block import BlockDownload, BlockUpload
from hil_tests.clients.sdo_frames import crc16

DATA = bytes(range(1, 18))
"""Three segments, the last with three bytes."""
CRC = crc16(DATA).to_bytes(2, "little").hex().upper()
SEGMENTS = ["0101020304050607", "0208090A0B0C0D0E", "830F101100000000"]


def talk(transfer: Transfer, *answers: str) -> list[list[str]]:
    """What a client sends, by the answer that it follows."""
    answered = (transfer.answer(bytes.fromhex(answer)) for answer in answers)
    return [[data.hex().upper() for data in sent] for sent in chain([transfer.begin()], answered)]


def rule(transfer: Transfer, *answers: str) -> str:
    """What the last answer breaks."""
    talk(transfer, *answers[:-1])
    with pytest.raises(Breach) as caught:
        transfer.answer(bytes.fromhex(answers[-1]))
    return caught.value.requirement


def test_a_download_goes_in_blocks_and_ends_with_a_crc() -> None:
    """Blocks of two and then of one segment; the end tells four unused bytes and the CRC."""
    transfer = BlockDownload(0x2020, 1, DATA)
    sent = talk(
        transfer,
        "A420200102000000",
        "A202010000000000",
        "A2017F0000000000",
        "A100000000000000",
    )
    assert sent == [
        ["C620200111000000"],
        SEGMENTS[:2],
        ["810F101100000000"],
        [f"D1{CRC}0000000000"],
        [],
    ]
    assert transfer.result == b""


def test_a_server_without_crc_gets_none() -> None:
    """A0h says that the server does not check."""
    transfer = BlockDownload(0x2020, 1, DATA)
    sent = talk(transfer, "A02020017F000000", "A2037F0000000000")
    assert sent[-1] == ["D100000000000000"]


def test_a_lost_segment_is_sent_again() -> None:
    """The server has the first of three: the next block begins with the second."""
    transfer = BlockDownload(0x2020, 1, DATA, lose=frozenset({2}))
    sent = talk(transfer, "A42020017F000000", "A2017F0000000000", "A2027F0000000000")
    assert sent[1] == [SEGMENTS[0], SEGMENTS[2]]
    assert sent[2] == ["0108090A0B0C0D0E", "820F101100000000"]
    assert sent[3] == [f"D1{CRC}0000000000"]


def test_a_crc_can_be_falsified_and_a_size_be_a_lie() -> None:
    """For servers that must notice."""
    transfer = BlockDownload(0x2020, 1, DATA, crc_error=0xFFFF, size=20)
    sent = talk(transfer, "A42020017F000000", "A2037F0000000000")
    assert sent[0] == ["C620200114000000"]
    assert sent[2] != [f"D1{CRC}0000000000"]
    assert sent[2][0].startswith("D1")


def test_nothing_can_be_written_in_a_block() -> None:
    """No bytes: one segment that is empty, seven unused bytes."""
    transfer = BlockDownload(0x2020, 1, b"")
    sent = talk(transfer, "A42020017F000000", "A2017F0000000000")
    assert sent[1:] == [["8100000000000000"], ["DD00000000000000"]]


@pytest.mark.parametrize(
    ("requirement", "answers"),
    [
        ("C-SD-10", ["6020200100000000"]),
        ("C-SD-01", ["A42120017F000000"]),
        ("C-SD-10", ["A420200100000000"]),
        ("C-SD-10", ["A420200180000000"]),
        ("C-SD-10", ["A42020017F000000", "A100000000000000"]),
        ("C-SD-10", ["A42020017F000000", "A2047F0000000000"]),
        ("C-SD-11", ["A42020017F000000", "A2037F0000000000", "A2037F0000000000"]),
        ("C-SD-10", ["A42020017F000000", *["A2007F0000000000"] * 16]),
    ],
)
def test_a_download_names_the_rule_that_an_answer_breaks(
    requirement: str, answers: list[str]
) -> None:
    """Command, object, block length, acknowledged segments and end each have theirs."""
    assert rule(BlockDownload(0x2020, 1, DATA), *answers) == requirement


END = f"D1{CRC}0000000000"


def test_an_upload_is_acknowledged_block_by_block() -> None:
    """Blocks of two: acknowledged after the second segment, and after the last."""
    transfer = BlockUpload(0x2020, 1, block=2)
    sent = talk(transfer, "C620200111000000", *SEGMENTS[:2], "810F101100000000", END)
    assert sent == [
        ["A420200102000000"],
        ["A300000000000000"],
        [],
        ["A202020000000000"],
        ["A201020000000000"],
        ["A100000000000000"],
    ]
    assert transfer.result == DATA
    assert not transfer.switched


@pytest.mark.parametrize(("lost", "good"), [(1, 0), (2, 1), (3, 2)])
def test_a_lost_segment_is_asked_for_again(lost: int, good: int) -> None:
    """The last one in its order is acknowledged; the rest comes again, numbered from 1."""
    transfer = BlockUpload(0x2020, 1, lose=frozenset({lost}))
    chunks = [part[2:] for part in SEGMENTS[good:]]
    again = [f"{n | (n == len(chunks)) << 7:02X}{chunk}" for n, chunk in enumerate(chunks, 1)]
    sent = talk(transfer, "C620200111000000", *SEGMENTS, *again, END)
    assert sent[4] == [f"A2{good:02X}7F0000000000"]
    assert sent[-2] == [f"A2{len(chunks):02X}7F0000000000"]
    assert transfer.result == DATA


def test_size_and_crc_may_be_missing() -> None:
    """C0h tells neither: the CRC in the end is not looked at."""
    transfer = BlockUpload(0x2020, 1)
    talk(transfer, "C020200100000000", *SEGMENTS, "D100000000000000")
    assert transfer.result == DATA


def test_a_server_may_answer_as_to_an_ordinary_read() -> None:
    """Expedited or in segments; the client follows (C-SD-13)."""
    transfer = BlockUpload(0x2020, 1, threshold=21)
    sent = talk(transfer, "4120200109000000", "0061626364656667", "1B68690000000000")
    assert sent == [
        ["A42020017F150000"],
        ["6000000000000000"],
        ["7000000000000000"],
        [],
    ]
    assert transfer.result == b"abcdefghi"
    assert transfer.switched


@pytest.mark.parametrize(
    ("requirement", "answers"),
    [
        ("C-SD-10", ["A020200100000000"]),
        ("C-SD-01", ["C621200111000000"]),
        ("C-SD-10", ["C620200111000000", SEGMENTS[1]]),
        ("C-SD-10", ["C620200111000000", *SEGMENTS, "A100000000000000"]),
        ("C-SD-10", ["C620200112000000", *SEGMENTS, END]),
        ("C-SD-11", ["C620200111000000", *SEGMENTS, "D1FFFF0000000000"]),
    ],
)
def test_an_upload_names_the_rule_that_an_answer_breaks(
    requirement: str, answers: list[str]
) -> None:
    """Command, object, order, end, size and CRC each have theirs."""
    assert rule(BlockUpload(0x2020, 1), *answers) == requirement
