"""Steps that the tests about errors share: one is raised, and what the device tells of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from hil_tests.api import (
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
NO_ERROR = 0x0000


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


def change(
    bench: Cia301Bench,
    faults: Faults,
    active: frozenset[str],
    *,
    end: str = "EM-06",
) -> Moment:
    """From now on exactly these errors exist; what is told of that is as it must be.

    Args:
        bench: see there.
        faults: see there.
        active: names.
        end: which requirement says what is told when errors go.
    """
    before = faults.active
    expected = emergencies.told(faults.known, before, active)
    moment = faults.exactly(*active)
    found = messages_after(bench, moment)
    wrong = emergencies.unexplained(expected, [one.frame for one in found])
    told = ", ".join(sorted(active)) or "no error"
    text = f"with {told} exactly that is told; {'; '.join(wrong) or 'it was'}"
    requirement = end if before - active else "EM-01"
    bench.check(not wrong, text, requirement=requirement, since=moment)
    last = Limits(at_most_ns=bench.profile.limits.emcy_ns)
    for one in found:
        measured = bench.when(one).since(moment.when)
        bench.measure(measured, last, "error to emergency message", requirement=requirement)
    return moment


def register(sdo: Sdo) -> int:
    """The error register."""
    return number(sdo.read(ERROR_REGISTER))


def count_of(sdo: Sdo) -> int:
    """How many entries the error field has."""
    return number(sdo.read(ERROR_FIELD))


def field(sdo: Sdo) -> list[int]:
    """The codes in the error field, newest first."""
    entries = range(1, count_of(sdo) + 1)
    return [number(sdo.read(ERROR_FIELD, place)) & 0xFFFF for place in entries]


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
