"""Steps that the tests about errors share: one is raised, and what the device tells of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from hil_tests.api import (
    Abort,
    Cia301Bench,
    DeviceFault,
    Faults,
    Limits,
    Moment,
    NotApplicable,
    Sdo,
    Seen,
    cobs,
    emergencies,
    matchers,
    number,
)

QUICK = {"heartbeat_ms": 50}
ERROR_REGISTER, ERROR_FIELD = 0x1001, 0x1003
EMCY_ID, INHIBIT = 0x1014, 0x1015
RESERVED_BIT = 0x40
"""Of the error register."""
NO_ERROR = 0x0000
MOST = 254
"""Entries that an error field can have at most."""


def emcy(bench: Cia301Bench) -> matchers.Matcher:
    """Any emergency message of the device, however long it is."""
    node_id = bench.node_id
    return matchers.cob(cobs.EMCY + node_id, f"an emergency message of node {node_id}")


def told_of(bench: Cia301Bench, moment: Moment, requirement: str = "") -> Seen:
    """The emergency message that follows something in time."""
    within = bench.profile.limits.emcy_ns
    return bench.expect(emcy(bench), after=moment, within=within, requirement=requirement)


def messages_after(bench: Cia301Bench, moment: Moment) -> list[Seen]:
    """Every emergency message that follows something in time."""
    until = moment.ended_at + bench.profile.limits.emcy_ns
    bench.wait_until(until)
    return bench.collect(emcy(bench), after=moment, until=until)


def nothing_told(
    bench: Cia301Bench, since: Seen | Moment | int, span_ns: int, requirement: str = ""
) -> None:
    """No emergency message for a while, not even at once.

    Whatever was to be told of what came before has been told.
    """
    until = bench.now() + span_ns
    bench.wait_until(until)
    found = [str(seen.frame) for seen in bench.collect(emcy(bench), after=since, until=until)]
    text = f"no emergency message; there was {found[:3]}"
    bench.check(not found, text, requirement=requirement)


def change(bench: Cia301Bench, sdo: Sdo, faults: Faults, active: frozenset[str]) -> Moment:
    """From now on exactly these errors exist; register and messages are as they must be.

    The register is looked at first: where it is wrong, so is what a message says of it.

    Args:
        bench: see there.
        sdo: see there.
        faults: see there.
        active: names.
    """
    before = faults.active
    expected = emergencies.told(faults.known, before, active)
    moment = faults.exactly(*active)
    found = messages_after(bench, moment)
    expect_register(bench, sdo, faults, end=bool(before - active))
    wrong = emergencies.unexplained(expected, [one.frame for one in found])
    told = ", ".join(sorted(active)) or "no error"
    text = f"with {told} exactly that is told; {'; '.join(wrong) or 'it was'}"
    requirement = "EM-06" if before - active else "EM-01"
    bench.check(not wrong, text, requirement=requirement, since=moment)
    last = Limits(at_most_ns=bench.profile.limits.emcy_ns)
    for one in found:
        text = "error to emergency message"
        bench.measure_between(moment, one, last, text, requirement=requirement)
    return moment


def start_proven(bench: Cia301Bench, sdo: Sdo, faults: Faults) -> None:
    """A start, and a look at what tests about settings rest on: an error is told, and its end."""
    bench.start(QUICK)
    change(bench, sdo, faults, frozenset(faults.names[:1]))
    change(bench, sdo, faults, frozenset())


def expect_register(
    bench: Cia301Bench, sdo: Sdo, faults: Faults, *, end: bool = False, requirement: str = ""
) -> None:
    """1001h has the bits of the errors that there are.

    Args:
        bench: see there.
        sdo: see there.
        faults: see there.
        end: an error has gone just now, so what is wrong is wrong with that.
        requirement: which says so, if it is neither EM-03 nor EM-06.
    """
    active = faults.active
    right, found = emergencies.register_of(faults.known, active), register(sdo)
    told = ", ".join(sorted(active)) or "no error"
    text = f"1001h is {right:02X}h with {told}; it is {found:02X}h"
    rule = requirement or ("EM-06" if end else "EM-03")
    if found ^ right == RESERVED_BIT:
        rule = "C-OD-02"
    bench.check(found == right, text, requirement=rule)


def register(sdo: Sdo) -> int:
    """The error register."""
    return number(sdo.read(ERROR_REGISTER))


def count_of(sdo: Sdo) -> int:
    """How many entries the error field has."""
    return number(sdo.read(ERROR_FIELD))


def field(sdo: Sdo) -> list[int]:
    """The codes in the error field, newest first, as far as entries can be read."""
    codes = list[int]()
    while len(codes) < MOST:
        entry = sdo.try_read(ERROR_FIELD, len(codes) + 1)
        if isinstance(entry, Abort):
            break
        codes.append(number(entry) & 0xFFFF)
    return codes


def expect_field(bench: Cia301Bench, sdo: Sdo, right: Sequence[int], after: str = "") -> None:
    """1003h holds these codes, newest first, and counts them.

    Some devices answer the entries that are empty with 0: they are none.
    """
    codes, count = field(sdo), count_of(sdo)
    while len(codes) > max(count, len(right)) and not codes[-1]:
        codes.pop()
    text = f"1003h holds {shown(right)}{after and f' after {after}'}; it holds {shown(codes)}"
    bench.check(codes == list(right), text, requirement="EM-04")
    text = f"1003h:00 counts {len(right)} entries; it is {count}"
    bench.check(count == len(right), text, requirement="EM-05")


def shown(codes: Sequence[int]) -> str:
    """Codes for people."""
    return ", ".join(f"{code:04X}h" for code in codes) or "nothing"


def two_classes(known: Mapping[str, DeviceFault]) -> tuple[str, str]:
    """Two errors of different classes.

    Raises:
        NotApplicable: the profile names none.
    """
    for one in known:
        for other in known:
            if known[one].register != known[other].register:
                return one, other
    raise NotApplicable("the profile names no two errors of different classes")


def one_class(known: Mapping[str, DeviceFault]) -> tuple[str, str]:
    """Two errors of the same class.

    Raises:
        NotApplicable: the profile names none.
    """
    for one in known:
        for other in known:
            if one != other and known[one].register == known[other].register:
                return one, other
    raise NotApplicable("the profile names no two errors of one class")
