"""Emergency messages: each error is told once, with code, register and the maker's bytes."""

from __future__ import annotations

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from hil_tests.acceptance.drive.error_steps import (
    ERROR_FIELD,
    ERROR_REGISTER,
    NO_ERROR,
    QUICK,
    change,
    count_of,
    emcy,
    expect_register,
    field,
    messages_after,
    nothing_told,
    one_class,
    register,
    shown,
    start_proven,
    told_of,
    two_classes,
)
from hil_tests.api import MS, Cia301Bench, Faults, Frame, S, Sdo, cobs, emergencies, u8, u32

IN_ORDER = 6
"""So many errors a test goes through; a profile may name more."""


def names_of(faults: Faults) -> tuple[str, ...]:
    """The errors that a test goes through."""
    return faults.names[:IN_ORDER]


@pytest.mark.requirement("EM-01")
def test_an_error_is_told_in_eight_bytes(bench: Cia301Bench, sdo: Sdo, faults: Faults) -> None:
    """Each error brings 80h+id with code, register and the maker's bytes, in that order."""
    for name in names_of(faults):
        bench.start(QUICK)
        moment = faults.occur(name)
        found = told_of(bench, moment)
        expect_register(bench, sdo, faults)
        error = faults.known[name]
        code, state, maker = error.code, error.register, error.manufacturer
        right = code.to_bytes(2, "little") + bytes((state,)) + maker
        text = f"{name} is told as {right.hex(' ').upper()}"
        told = found.frame.data.hex(" ").upper()
        bench.check(found.frame.data == right, f"{text}; it was {told}", since=moment)


@pytest.mark.requirement("EM-01")
def test_an_error_is_told_once(bench: Cia301Bench, faults: Faults) -> None:
    """While it lasts no second message comes, though nobody confirms the first."""
    bench.start(QUICK)
    for name in names_of(faults):
        moment = faults.occur(name)
        found = told_of(bench, moment)
        bench.never(emcy(bench), after=found, for_ns=3 * S)


@pytest.mark.requirement("EM-01")
def test_an_error_that_comes_again_is_told_again(bench: Cia301Bench, faults: Faults) -> None:
    """Each time that it occurs, with the same content."""
    bench.start(QUICK)
    name = faults.names[0]
    first = told_of(bench, faults.occur(name))
    for _ in range(3):
        messages_after(bench, faults.heal())
        again = told_of(bench, faults.occur(name))
        text = f"{name} is told as before, {first.frame}; it was {again.frame}"
        bench.check(again.frame == first.frame, text, since=again)


@pytest.mark.requirement("EM-01")
def test_errors_are_told_in_operational(bench: Cia301Bench, sdo: Sdo, faults: Faults) -> None:
    """In operational as in pre-operational."""
    bench.operational(QUICK)
    for name in names_of(faults):
        change(bench, sdo, faults, frozenset((name,)))
        change(bench, sdo, faults, frozenset())


@pytest.mark.requirement("EM-01", "EM-03")
def test_errors_that_come_together_are_all_told(
    bench: Cia301Bench, sdo: Sdo, faults: Faults
) -> None:
    """Everything at once: one message for each, and the register has every bit."""
    bench.start(QUICK)
    change(bench, sdo, faults, frozenset(names_of(faults)))


REFUSED = (
    ("read of 5FFFh:00, which is not there", b"\x40\xff\x5f\x00"),
    ("read of 1001h:07, which is not there", b"\x40\x01\x10\x07"),
    ("write to 1001h, which is read-only", b"\x2f\x01\x10\x00\x01"),
    ("write of four bytes to 1017h", b"\x23\x17\x10\x00\x01\x02\x03\x04"),
    ("write of one byte to 1017h", b"\x2f\x17\x10\x00\x01"),
    ("value 1 to 1019h, which is reserved", b"\x2f\x19\x10\x00\x01"),
    ("segment without a transfer", b"\x60"),
    ("unknown command", b"\xe0\x00\x10\x00"),
    ("abort of nothing", b"\x80\x00\x10\x00"),
    ("wrong signature to 1010h:01", b"\x23\x10\x10\x01\x73\x61\x76\x66"),
)


@pytest.mark.requirement("EM-02")
@pytest.mark.parametrize(("what", "request_"), REFUSED, ids=[what for what, _ in REFUSED])
def test_an_sdo_error_is_no_emergency(
    bench: Cia301Bench, sdo: Sdo, what: str, request_: bytes
) -> None:
    """What an SDO client does wrong leads to no emergency message and no bit in the register."""
    bench.start(QUICK)
    before, entries = register(sdo), count_of(sdo)
    sent = sdo.post(request_.ljust(8, b"\0"))
    nothing_told(bench, sent, 500 * MS)
    found = register(sdo)
    bench.check(found == before, f"1001h stays {before:02X}h after a {what}; it is {found:02X}h")
    found = count_of(sdo)
    bench.check(found == entries, f"1003h:00 stays {entries} after a {what}; it is {found}")


@pytest.mark.requirement("EM-02")
def test_an_sdo_error_in_operational_is_no_emergency(bench: Cia301Bench, sdo: Sdo) -> None:
    """Nor in operational, and however many there are."""
    bench.operational(QUICK)
    began_at = bench.now()
    for _ in range(20):
        for _, request in REFUSED:
            sdo.offer(request.ljust(8, b"\0"))
    nothing_told(bench, began_at, 500 * MS)


@pytest.mark.requirement("EM-03")
def test_an_error_sets_the_bit_of_its_class(bench: Cia301Bench, sdo: Sdo, faults: Faults) -> None:
    """1001h has the bit of each error and bit 0, by SDO as in the message."""
    for name in names_of(faults):
        bench.start(QUICK)
        expect_register(bench, sdo, faults)
        messages_after(bench, faults.exactly(name))
        expect_register(bench, sdo, faults)


@pytest.mark.requirement("EM-03")
def test_errors_of_several_classes_set_several_bits(
    bench: Cia301Bench, sdo: Sdo, faults: Faults
) -> None:
    """One after the other, 1001h collects the bits of all."""
    bench.start(QUICK)
    for name in names_of(faults):
        messages_after(bench, faults.occur(name))
        expect_register(bench, sdo, faults)


@pytest.mark.requirement("EM-06", "EM-03")
def test_a_bit_stays_until_the_last_error_of_its_class_has_gone(
    bench: Cia301Bench, sdo: Sdo, faults: Faults
) -> None:
    """Of two errors of one class one goes: the bit stays; with the other it goes."""
    one, other = one_class(faults.known)
    bench.start(QUICK)
    for left in (one, other):
        change(bench, sdo, faults, frozenset((one, other)))
        change(bench, sdo, faults, frozenset((left,)))
        change(bench, sdo, faults, frozenset())


@pytest.mark.requirement("EM-06")
def test_the_bit_of_a_class_goes_with_its_error(
    bench: Cia301Bench, sdo: Sdo, faults: Faults
) -> None:
    """Of two errors of different classes one goes: its bit with it, the other stays."""
    one, other = two_classes(faults.known)
    bench.start(QUICK)
    for left in (one, other):
        change(bench, sdo, faults, frozenset((one, other)))
        change(bench, sdo, faults, frozenset((left,)))
        change(bench, sdo, faults, frozenset())


@pytest.mark.requirement("EM-06")
def test_the_end_of_all_errors_is_told(bench: Cia301Bench, sdo: Sdo, faults: Faults) -> None:
    """When no error is left, code 0000h and register 00h follow, once; 1001h is 00h."""
    start_proven(bench, sdo, faults)
    for names in (names_of(faults)[:1], names_of(faults)[:2], names_of(faults)):
        messages_after(bench, faults.exactly(*names))
        moment = faults.heal()
        told_of(bench, moment)
        found = messages_after(bench, moment)[-1]
        data = found.frame.data
        text = f"the end of all errors is told with code 0000h, register 00h; it was {found.frame}"
        bench.check(data[:3] == bytes(3) and len(data) == 8, text, since=moment)
        bench.never(emcy(bench), after=found, for_ns=1 * S)
        left = register(sdo)
        bench.check(left == 0, f"1001h is 00h without an error; it is {left:02X}h")


@pytest.mark.requirement("EM-06")
def test_nothing_ends_that_was_not_there(bench: Cia301Bench, faults: Faults) -> None:
    """Without an error there is no message of its end: not after a start, not later."""
    boot = bench.start(QUICK)
    faults.heal()
    nothing_told(bench, boot, 1 * S)


@pytest.mark.requirement("EM-03", "EM-06")
def test_an_error_that_lasts_through_a_reset_is_still_there(
    bench: Cia301Bench, sdo: Sdo, faults: Faults
) -> None:
    """After a reset 1001h shows an error that is still there; its end is told as ever."""
    bench.start(QUICK)
    change(bench, sdo, faults, frozenset(faults.names[:1]))
    bench.nmt(cobs.Nmt.RESET_NODE)
    limits = bench.profile.limits
    bench.wait(limits.command_ns + limits.boot_up_ns + limits.emcy_ns)
    expect_register(bench, sdo, faults)
    change(bench, sdo, faults, frozenset())


STORY = st.lists(st.integers(0, 2 * IN_ORDER - 1), min_size=1, max_size=12)
"""Errors by number: below IN_ORDER one changes, from there on all go."""


@pytest.mark.requirement("EM-01", "EM-03", "EM-04", "EM-06")
@settings(max_examples=15)
@given(story=STORY)
@example(story=[0, 1, 0, 1, 2, 11, 0, 0])
@example(story=[1, 2, 1, 2, 3, 4, 5, 9, 5])
def test_whatever_comes_and_goes_is_told(
    bench: Cia301Bench, sdo: Sdo, faults: Faults, story: list[int]
) -> None:
    """Errors come and go in any order: messages, register and error field follow them."""
    bench.begin_example()
    bench.start(QUICK)
    sdo.write(ERROR_FIELD, 0, u8(0), requirement="EM-05")
    names = names_of(faults)
    timeline = [frozenset[str]()]
    for turn in story:
        active = frozenset[str]()
        if turn < len(names):
            active = timeline[-1] ^ {names[turn]}
        change(bench, sdo, faults, active)
        timeline.append(active)
    codes = field(sdo)
    right_codes = emergencies.history(faults.known, timeline)
    fits = len(codes) <= len(right_codes) and all(map(set.__contains__, right_codes, codes))
    text = f"1003h holds the newest errors, newest first; it holds {shown(codes)}"
    bench.check(fits and bool(codes) == bool(right_codes), text, requirement="EM-04")
    bench.check_monitors()


@pytest.mark.requirement("EM-01")
def test_a_frame_to_its_own_identifier_means_nothing(
    bench: Cia301Bench, sdo: Sdo, faults: Faults
) -> None:
    """A message under the device's own identifier, sent by another, changes no error of it."""
    bench.needs_exclusive()
    bench.start(QUICK)
    change(bench, sdo, faults, frozenset(faults.names[:1]))
    bench.send(Frame(cobs.EMCY + bench.node_id, u32(NO_ERROR).ljust(8, b"\0")))
    bench.wait(bench.profile.limits.emcy_ns)
    expect_register(bench, sdo, faults, requirement="EM-01")
    text = f"1001h has one byte; it has {len(sdo.read(ERROR_REGISTER))}"
    bench.check(len(sdo.read(ERROR_REGISTER)) == 1, text)
