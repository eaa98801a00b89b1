"""The SDO client of a bench: what each answer leads to, and which rule it is held against."""

from __future__ import annotations

from collections.abc import Sequence

import pytest

from hil_tests.bench.sdo import Sdo
from hil_tests.clients import accepted
from hil_tests.clients.sdo import Abort, Download, Upload
from hil_tests.clock import MS
from hil_tests.judge.cobs import Nmt
from hil_tests.judge.verdict import DeviceFailure, Outcome
from node_model.frame import Frame
from tests.bench.answering import SOON, AnsweringPort, Says, Script, bench_with, blamed, in_turn

WITHIN = 50 * MS
VALUE = "585#4300100001020304"
"""1000h:00 is 04030201h."""
WRITTEN = "585#6017100000000000"
REFUSED = "585#8017100002000106"
"""1017h: 0601 0002h."""
STRANGER = "585#4318100101020304"
"""Another object than 1000h."""


def client(script: Script) -> tuple[Sdo, AnsweringPort]:
    """A client, and the bus below it."""
    bench, port = bench_with(script)
    return Sdo(bench, WITHIN), port


def notes(sdo: Sdo) -> list[str]:
    """What was written down of this device."""
    found = sdo.bench.verdicts
    return [each.text for each in found if each.outcome is Outcome.CHARACTERISTIC]


def test_what_is_read_and_written() -> None:
    """The bytes of an object, its number; a write sends them."""
    sdo, port = client(in_turn(VALUE, VALUE, WRITTEN))
    assert sdo.read(0x1000) == b"\x01\x02\x03\x04"
    assert sdo.number(0x1000) == 0x0403_0201
    sdo.write(0x1017, 0, b"\x0a\x00")
    assert str(port.sent[-1]) == "605#2B1710000A000000"


def test_another_server_is_asked_under_its_own_identifiers() -> None:
    """As 1201h says; the answer of the default server is none of its."""
    bench, port = bench_with(lambda _: [(SOON, VALUE), (2 * SOON, "5C5#4300100009000000")])
    sdo = Sdo(bench, WITHIN, 0x645, 0x5C5)
    assert (sdo.request_id, sdo.answer_id) == (0x645, 0x5C5)
    assert sdo.number(0x1000) == 9
    assert port.sent[0].can_id == 0x645


@pytest.mark.parametrize(
    ("answer", "requirement", "text"),
    [
        ("", "C-OD-04", "expected an SDO answer"),
        (
            "585#8000100000000206",
            "C-OD-04",
            "read of 1000h:00 is served; it was refused with 0602",
        ),
        (STRANGER, "C-SD-01", "the answer names 1000h:00"),
        ("585#430010", "C-SD-01", "has 8 bytes"),
        ("585#6000100000000000", "C-SD-02", "an answer 4xh to a read"),
    ],
    ids=["none", "abort", "other object", "short", "other command"],
)
def test_a_read_that_goes_wrong_is_held_against_its_rule(
    answer: str, requirement: str, text: str
) -> None:
    """Missing, refused, or against the protocol."""
    sdo, _ = client(in_turn(answer))
    verdict = blamed(lambda: sdo.read(0x1000))
    assert verdict.requirement == requirement
    assert text in verdict.text


def test_a_breach_ends_the_transfer_with_an_abort() -> None:
    """The server is not left waiting."""
    sdo, port = client(in_turn(STRANGER))
    blamed(lambda: sdo.read(0x1000))
    assert str(port.sent[-1]) == "605#8000100001000405"


@pytest.mark.parametrize(("after_ms", "late"), [(49, False), (52, True)])
def test_an_answer_that_comes_late_is_another_fault(after_ms: int, late: bool) -> None:
    """Within the time that the profile says it is none (C-SD-20)."""
    sdo, _ = client(in_turn(VALUE, after_ns=after_ms * MS))
    if late:
        verdict = blamed(lambda: sdo.read(0x1000))
        assert verdict.requirement == "C-SD-20"
    else:
        sdo.read(0x1000)


@pytest.mark.parametrize(("earlier", "requirement"), [("", "C-NMT-15"), (VALUE, "C-SD-01")])
def test_a_server_that_is_silent_in_operational_breaks_the_rule_of_that_state(
    earlier: str, requirement: str
) -> None:
    """C-NMT-15, where nothing was answered since the command; else that of the answer."""
    sdo, port = client(in_turn("", earlier, ""))
    port.plays("705#00", 1 * MS)
    sdo.bench.wait(5 * MS)
    sdo.bench.nmt(Nmt.START)
    sdo.bench.wait(200 * MS)
    if earlier:
        sdo.read(0x1000)
    assert blamed(lambda: sdo.try_read(0x1000)).requirement == requirement


def test_a_command_of_a_test_before_is_not_looked_for() -> None:
    """The record begins with the test: then the rule of the answer is broken."""
    sdo, port = client(in_turn())
    port.plays("705#00", 1 * MS)
    sdo.bench.wait(5 * MS)
    sdo.bench.nmt(Nmt.START)
    sdo.bench.wait(200 * MS)
    sdo.bench.begin()
    assert blamed(lambda: sdo.try_read(0x1000)).requirement == "C-SD-01"


def test_a_silent_server_breaks_the_rule_that_asks_for_an_answer() -> None:
    """C-SD-01, where a test names no other one."""
    sdo, _ = client(in_turn())
    assert blamed(lambda: sdo.try_read(0x1000)).requirement == "C-SD-01"


def test_what_a_try_leads_to_is_not_judged() -> None:
    """Bytes, or the abort; a write that is done gives no bytes."""
    sdo, _ = client(in_turn(VALUE, REFUSED, WRITTEN))
    assert sdo.try_read(0x1000) == b"\x01\x02\x03\x04"
    assert sdo.try_write(0x1017, 0, b"\x0a\x00") == Abort(0x0601_0002, 0x1017, 0)
    assert sdo.try_write(0x1017, 0, b"\x0a\x00") == b""


def test_an_abort_must_have_a_code_of_the_set() -> None:
    """The first is no news, another accepted one is written down."""
    sdo, _ = client(in_turn())
    what = "write to 1017h:00"
    sdo.expect_abort(Abort(0x0601_0002, 0x1017, 0), accepted.READ_ONLY, what)
    assert notes(sdo) == []
    sdo.expect_abort(Abort(0x0800_0000, 0x1017, 0), accepted.READ_ONLY, what)
    assert notes(sdo) == [
        f"{what} is refused with 08000000h (general error); others say 06010002h"
    ]
    other = Abort(0x0602_0000, 0x1017, 0)
    verdict = blamed(lambda: sdo.expect_abort(other, accepted.READ_ONLY, what))
    assert "the code is 06020000h" in verdict.text
    verdict = blamed(
        lambda: sdo.expect_abort(b"", accepted.READ_ONLY, what, requirement="C-OD-05")
    )
    assert verdict.requirement == "C-OD-05"
    assert verdict.text.endswith("it was done")


class Memory:
    """1017h in a device.

    Args:
        sticks: it keeps what was written last.
    """

    def __init__(self, *, sticks: bool = False) -> None:
        self.value = "E803"
        self._sticks = sticks
        self.writes = 0

    def __call__(self, frame: Frame) -> Sequence[Says]:
        """Reads and writes, two bytes at once."""
        if frame.can_id != 0x605:
            return []
        if frame.data[0] == 0x40:
            return [(SOON, f"585#4B171000{self.value}0000")]
        self.writes += 1
        if not self._sticks or self.writes == 1:
            self.value = frame.data[4:6].hex().upper()
        return [(SOON, WRITTEN)]


def test_what_is_kept_is_as_it_was_afterwards() -> None:
    """Written back where it was changed, and only there."""
    memory = Memory()
    sdo, _ = client(memory)
    with sdo.kept((0x1017, 0)):
        sdo.write(0x1017, 0, b"\x0a\x00")
    assert (memory.value, memory.writes) == ("E803", 2)
    with sdo.kept((0x1017, 0)):
        pass
    assert memory.writes == 2


def test_what_cannot_be_put_back_is_blamed() -> None:
    """It is read back (C-OD-04)."""
    sdo, _ = client(Memory(sticks=True))

    def leave() -> None:
        with sdo.kept((0x1017, 0)):
            sdo.write(0x1017, 0, b"\x0a\x00")

    verdict = blamed(leave)
    assert verdict.requirement == "C-OD-04"
    assert "1017h:00 is put back to E8 03; it is 0A 00" in verdict.text


@pytest.mark.parametrize("sticks", [False, True])
def test_a_failure_inside_stays_the_failure(sticks: bool) -> None:
    """What was changed is put back where the device lets us, in pre-operational."""
    memory = Memory(sticks=sticks)
    sdo, port = client(memory)

    def fail() -> None:
        with sdo.kept((0x1017, 0)):
            sdo.write(0x1017, 0, b"\x0a\x00")
            raise DeviceFailure(sdo.bench.verdicts[-1])

    with pytest.raises(DeviceFailure) as caught:
        fail()
    assert "put back" not in str(caught.value)
    assert "000#8005" in [str(frame) for frame in port.sent]
    assert memory.value == ("0A00" if sticks else "E803")


@pytest.mark.parametrize("answer", ["", STRANGER, "585#8000100000000206"])
def test_a_server_that_must_serve_is_held_against_that_rule(answer: str) -> None:
    """Whatever is wrong with the answer."""
    sdo, _ = client(in_turn(answer))
    assert blamed(lambda: sdo.serves("C-RB-04")).requirement == "C-RB-04"


def test_a_server_that_serves_gives_the_bytes() -> None:
    """Those of 1000h, where no object is named."""
    sdo, _ = client(in_turn(VALUE))
    assert sdo.serves("C-RB-04") == b"\x01\x02\x03\x04"


def test_single_frames() -> None:
    """Asked, offered, and those that must find silence."""
    data = bytes.fromhex("4000100000000000")
    sdo, _ = client(in_turn(VALUE, VALUE, "", "", VALUE, "585#430010"))
    assert sdo.ask(data)[0] == 0x43
    assert (sdo.offer(data) or b"")[0] == 0x43
    assert sdo.offer(data) is None
    sdo.silence(data)
    verdict = blamed(lambda: sdo.silence(data, requirement="C-SD-09"))
    assert verdict.requirement == "C-SD-09"
    assert verdict.text.endswith("4300100001020304 came")
    assert blamed(lambda: sdo.ask(data)).requirement == "C-SD-01"


def test_many_transfers_have_one_verdict() -> None:
    """And each its outcome."""
    sdo, _ = client(in_turn(VALUE, REFUSED, VALUE))
    before = len(sdo.bench.verdicts)
    value = b"\x01\x02\x03\x04"

    def make(turn: int) -> Upload | Download:
        return Download(0x1017, 0, b"\0\0") if turn == 1 else Upload(0x1000, 0)

    assert sdo.repeat(make, 3) == [value, Abort(0x0601_0002, 0x1017, 0), value]
    assert len(sdo.bench.verdicts) == before + 1
    assert sdo.bench.verdicts[-1].text.startswith("3 SDO transfers were answered in ")
