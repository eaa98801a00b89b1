"""The EMCY producer: register, history, order, inhibit time, states, and reactions."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from node_model.emcy import EmergencyProducer
from node_model.nmt import NmtState
from node_model.node import MS, NOTHING, US
from node_model.od import AbortCode, Access, Entry, ObjectDictionary, SdoAbort
from node_model.service import Fault
from tests.node_model.services import passing, refused, told, u8, u16, u32, write

NODE = 5
OVERCURRENT = Fault(0x2310, 0x02, bytes.fromhex("0102030405"))
UNDERVOLTAGE = Fault(0x3220, 0x04, b"\x11")
OVERVOLTAGE = Fault(0x3210, 0x04, b"\x12")
HEARTBEAT_LOST = Fault(0x8130, 0x10, communication=True)
DEPTH = 4


def objects(depth: int = DEPTH) -> list[Entry]:
    """The objects of the error handling."""
    field = [u32(0x1003, sub, access=Access.RO) for sub in range(1, depth + 1)]
    return [
        u8(0x1001, access=Access.RO),
        u8(0x1003, 0),
        *field,
        u32(0x1014, 0, 0x80 + NODE),
        u16(0x1015),
        u8(0x1029, 0, 1, Access.CONST),
        u8(0x1029, 1),
    ]


class Device:
    """A producer on its dictionary, started at 0, and the state changes that it asked for."""

    def __init__(self, state: NmtState = NmtState.PRE_OPERATIONAL) -> None:
        self.od = ObjectDictionary(objects())
        self.asked: list[tuple[NmtState, int]] = []
        self.producer = EmergencyProducer(
            self.od, NODE, lambda state, now: self.asked.append((state, now))
        )
        self.producer.start(0)
        self.producer.enter(state, 0)

    @property
    def register(self) -> int:
        """1001h as a client reads it."""
        return self.od.read(0x1001, 0)[0]

    @property
    def history(self) -> list[str]:
        """1003h as a client reads it, newest first."""
        count = self.od.read(0x1003, 0)[0]
        return [self.od.read(0x1003, sub).hex() for sub in range(1, count + 1)]


def test_an_error_is_told_with_code_register_and_the_bytes_of_the_maker() -> None:
    """COB-ID 080h + node id, code little-endian, 1001h, five bytes: literal."""
    device = Device()
    assert told(device.producer.occur("axis", OVERCURRENT, 7)) == ["085#1023030102030405"]
    assert device.register == 0x03
    assert device.history == ["10230301"]


def test_missing_bytes_of_the_maker_are_zero() -> None:
    """The frame always has eight bytes, and 1003h a byte for each part."""
    device = Device()
    assert told(device.producer.occur("bus", HEARTBEAT_LOST, 7)) == ["085#3081110000000000"]
    assert device.history == ["30811100"]


def test_an_error_that_is_there_already_is_not_told_again() -> None:
    """Sent once an error: the same cause with the same fault is no news."""
    device = Device()
    device.producer.occur("axis", OVERCURRENT, 1)
    assert device.producer.occur("axis", OVERCURRENT, 2) == NOTHING
    assert device.history == ["10230301"]


def test_a_cause_with_another_fault_is_news() -> None:
    """The new fault takes the place of the old one."""
    device = Device()
    device.producer.occur("supply", UNDERVOLTAGE, 1)
    assert told(device.producer.occur("supply", OVERVOLTAGE, 2)) == ["085#1032051200000000"]
    assert told(device.producer.heal("supply", 3)) == ["085#0000000000000000"]


def test_the_end_of_the_last_error_is_told_with_code_0000h() -> None:
    """All bytes are 0, and the register is empty."""
    device = Device()
    device.producer.occur("axis", OVERCURRENT, 1)
    assert told(device.producer.heal("axis", 2)) == ["085#0000000000000000"]
    assert device.register == 0
    assert device.history == ["10230301"]


def test_the_end_of_one_of_several_errors_only_clears_its_bits() -> None:
    """A class's bit goes with the last error of the class; nothing is told."""
    device = Device()
    device.producer.occur("a", UNDERVOLTAGE, 1)
    device.producer.occur("b", OVERVOLTAGE, 2)
    device.producer.occur("c", OVERCURRENT, 3)
    assert device.register == 0x07
    assert device.producer.heal("a", 4) == NOTHING
    assert device.register == 0x07
    assert device.producer.heal("b", 5) == NOTHING
    assert device.register == 0x03


def test_the_end_of_what_was_not_there_is_no_news() -> None:
    """No EMCY when an error that was not set is cleared."""
    assert Device().producer.heal("axis", 1) == NOTHING


def test_a_generic_error_sets_bit_0_alone() -> None:
    """A fault without a class."""
    device = Device()
    device.producer.occur("what", Fault(0x1000), 1)
    assert device.register == 0x01


# 1003h


def test_the_history_has_the_newest_first_and_loses_the_oldest() -> None:
    """Five errors, four places."""
    device = Device()
    for number in range(5):
        device.producer.occur(f"{number}", Fault(0x1000 + number), number)
    assert [text[:4] for text in device.history] == ["0410", "0310", "0210", "0110"]


@pytest.mark.parametrize("sub", [1, 2, DEPTH])
def test_an_entry_that_holds_no_error_cannot_be_read(sub: int) -> None:
    """0800 0024h, no data available; :00 can always be read."""
    device = Device()
    assert device.od.read(0x1003, 0) == b"\x00"
    with pytest.raises(SdoAbort) as refusal:
        device.od.read(0x1003, sub)
    assert refusal.value.code is AbortCode.NO_DATA


def test_writing_0_clears_the_history_and_nothing_else() -> None:
    """The error stays, its bits stay, nothing is sent."""
    device = Device()
    device.producer.occur("axis", OVERCURRENT, 1)
    write(device.od, 0x1003, 0, 0, 2)
    assert device.history == []
    assert device.register == 0x03
    assert device.producer.deadline() is None
    device.producer.occur("supply", UNDERVOLTAGE, 3)
    assert device.history == ["20320711"]


@pytest.mark.parametrize("value", [1, 2, 0xFF])
def test_writing_anything_else_to_the_count_is_refused(value: int) -> None:
    """0609 0030h, and the list is kept."""
    device = Device()
    device.producer.occur("axis", OVERCURRENT, 1)
    assert refused(device.od, 0x1003, 0, value) is AbortCode.VALUE
    assert len(device.history) == 1


# 1014h, 1015h


@pytest.mark.parametrize("gap", [1, 10, 500])
def test_the_inhibit_time_keeps_emergencies_apart_and_in_order(gap: int) -> None:
    """The object counts in 100 us; what waits goes when it is over, not before."""
    device = Device()
    write(device.od, 0x1015, 0, gap)
    span = gap * 100 * US
    assert told(device.producer.occur("a", UNDERVOLTAGE, 50)) == ["085#2032051100000000"]
    assert device.producer.occur("b", OVERCURRENT, 60) == NOTHING
    assert device.producer.heal("b", 70) == NOTHING
    assert device.producer.heal("a", 80) == NOTHING
    assert device.producer.advance(50 + span - 1) == NOTHING
    assert passing(device.producer, 10 * span) == [
        (50 + span, "085#1023070102030405"),
        (50 + 2 * span, "085#0000000000000000"),
    ]


def test_after_the_inhibit_time_an_error_is_told_at_once() -> None:
    """The time is a gap, no period."""
    device = Device()
    write(device.od, 0x1015, 0, 10)
    device.producer.occur("a", UNDERVOLTAGE, 0)
    assert len(device.producer.occur("b", OVERCURRENT, MS)) == 1


def test_a_new_inhibit_time_holds_for_what_waits() -> None:
    """Without it, what waits is due at once."""
    device = Device()
    write(device.od, 0x1015, 0, 100)
    device.producer.occur("a", UNDERVOLTAGE, 0)
    device.producer.occur("b", OVERCURRENT, 1)
    write(device.od, 0x1015, 0, 0, 2)
    assert len(device.producer.advance(2)) == 1


def test_bit_31_switches_emergencies_off_and_nothing_else() -> None:
    """Register and history follow; an error of that time is never told."""
    device = Device()
    write(device.od, 0x1014, 0, 1 << 31 | 0x85)
    assert device.producer.occur("axis", OVERCURRENT, 1) == NOTHING
    assert (device.register, device.history) == (0x03, ["10230301"])
    write(device.od, 0x1014, 0, 0x85)
    assert device.producer.deadline() is None
    assert told(device.producer.heal("axis", 2)) == ["085#0000000000000000"]


def test_what_waits_is_dropped_when_emergencies_are_switched_off() -> None:
    """It is not sent when they are switched on again."""
    device = Device()
    write(device.od, 0x1015, 0, 100)
    device.producer.occur("a", UNDERVOLTAGE, 0)
    device.producer.occur("b", OVERCURRENT, 1)
    write(device.od, 0x1014, 0, 1 << 31 | 0x85, 2)
    write(device.od, 0x1014, 0, 0x85, 3)
    assert passing(device.producer, 1000 * MS) == []


def test_the_identifier_changes_only_while_emergencies_are_off() -> None:
    """0609 0030h; after the change frames have the new one."""
    device = Device()
    assert refused(device.od, 0x1014, 0, 0x86) is AbortCode.VALUE
    write(device.od, 0x1014, 0, 0x85)
    write(device.od, 0x1014, 0, 1 << 31)
    assert refused(device.od, 0x1014, 0, 0) is AbortCode.VALUE
    write(device.od, 0x1014, 0, 1 << 31 | 0x86)
    write(device.od, 0x1014, 0, 0x86)
    assert told(device.producer.occur("axis", OVERCURRENT, 1)) == ["086#1023030102030405"]


def test_without_its_objects_a_device_still_tells_its_errors() -> None:
    """COB-ID 080h + node id; there is no inhibit time, register or history to keep."""
    producer = EmergencyProducer(ObjectDictionary([]), NODE)
    producer.start(0)
    assert told(producer.occur("bus", HEARTBEAT_LOST, 7)) == ["085#3081110000000000"]


# States


def test_an_error_in_stopped_is_told_on_leaving_it() -> None:
    """Register and history at once, the frames in order at the change of state."""
    device = Device(NmtState.STOPPED)
    assert device.producer.occur("axis", OVERCURRENT, 10) == NOTHING
    assert device.producer.occur("supply", UNDERVOLTAGE, 20) == NOTHING
    assert device.register == 0x07
    assert device.producer.deadline() is None
    assert told(device.producer.enter(NmtState.OPERATIONAL, 30)) == [
        "085#1023030102030405",
        "085#2032071100000000",
    ]


def test_the_inhibit_time_counts_from_leaving_stopped() -> None:
    """The first goes at once, the second one inhibit time later."""
    device = Device(NmtState.STOPPED)
    write(device.od, 0x1015, 0, 10)
    device.producer.occur("axis", OVERCURRENT, 10)
    device.producer.occur("supply", UNDERVOLTAGE, 20)
    assert len(device.producer.enter(NmtState.PRE_OPERATIONAL, 50 * MS)) == 1
    assert passing(device.producer, 99 * MS) == [(51 * MS, "085#2032071100000000")]


def test_a_start_forgets_all_errors_without_a_word() -> None:
    """Who still has one reports it again, and that is told."""
    device = Device()
    device.producer.occur("axis", OVERCURRENT, 1)
    device.producer.stop()
    assert device.producer.heal("axis", 2) == NOTHING
    assert device.producer.start(3) == NOTHING
    assert device.register == 0
    assert told(device.producer.occur("axis", OVERCURRENT, 3)) == ["085#1023030102030405"]


def test_a_start_drops_what_waits_and_the_inhibit_time() -> None:
    """The first error after it is told at once, and nothing of the time before."""
    device = Device()
    write(device.od, 0x1015, 0, 100)
    device.producer.occur("a", UNDERVOLTAGE, 0)
    device.producer.occur("b", OVERCURRENT, 1)
    device.producer.stop()
    assert device.producer.deadline() is None
    device.producer.start(2)
    assert device.producer.deadline() is None
    assert told(device.producer.occur("a", UNDERVOLTAGE, 3)) == ["085#2032051100000000"]


def test_nothing_is_told_before_the_start() -> None:
    """While it initialises a device has no voice."""
    producer = EmergencyProducer(ObjectDictionary(objects()), NODE)
    assert producer.occur("axis", OVERCURRENT, 1) == NOTHING
    assert producer.deadline() is None


# 1029h


@pytest.mark.parametrize(
    ("behaviour", "state", "asked"),
    [
        (0, NmtState.OPERATIONAL, NmtState.PRE_OPERATIONAL),
        (0, NmtState.PRE_OPERATIONAL, None),
        (0, NmtState.STOPPED, None),
        (1, NmtState.OPERATIONAL, None),
        (1, NmtState.PRE_OPERATIONAL, None),
        (2, NmtState.OPERATIONAL, NmtState.STOPPED),
        (2, NmtState.PRE_OPERATIONAL, NmtState.STOPPED),
        (2, NmtState.STOPPED, None),
    ],
)
def test_a_communication_error_changes_the_state_as_1029h_says(
    behaviour: int, state: NmtState, asked: NmtState | None
) -> None:
    """0 from operational to pre-operational, 1 no change, 2 stopped."""
    device = Device(state)
    write(device.od, 0x1029, 1, behaviour)
    device.producer.occur("bus", HEARTBEAT_LOST, 9)
    assert device.asked == ([] if asked is None else [(asked, 9)])


def test_other_errors_never_change_the_state() -> None:
    """Not even those with bit 4 of the register, such as a short PDO."""
    device = Device(NmtState.OPERATIONAL)
    device.producer.occur("axis", OVERCURRENT, 9)
    device.producer.occur("pdo", Fault(0x8210, 0x10), 9)
    assert device.asked == []


def test_a_device_that_cannot_change_its_state_tells_the_error() -> None:
    """Without somebody to ask, 1029h has no effect."""
    producer = EmergencyProducer(ObjectDictionary(objects()), NODE)
    producer.start(0)
    producer.enter(NmtState.OPERATIONAL, 0)
    assert told(producer.occur("bus", HEARTBEAT_LOST, 9)) == ["085#3081110000000000"]


@pytest.mark.parametrize("value", [3, 0x7F, 0xFF])
def test_a_reserved_error_behaviour_is_refused(value: int) -> None:
    """0609 0030h; 2 is the greatest."""
    device = Device()
    assert refused(device.od, 0x1029, 1, value) is AbortCode.VALUE
    write(device.od, 0x1029, 1, 2)


# Any sequence


FAULTS = [OVERCURRENT, UNDERVOLTAGE, OVERVOLTAGE, HEARTBEAT_LOST, Fault(0xFF01, 0x80)]
STEPS = st.lists(st.tuples(st.booleans(), st.integers(0, 4)), max_size=40)


@pytest.mark.slow
@settings(max_examples=150, deadline=None)
@given(steps=STEPS)
def test_any_sequence_of_errors_leaves_the_history_that_it_was(
    steps: list[tuple[bool, int]],
) -> None:
    """Oracle: frames, register and history are functions of the whole sequence."""
    device = Device()
    present: set[int] = set()
    expected_frames: list[str] = []
    events: list[str] = []
    frames: list[str] = []
    for now, (occurs, which) in enumerate(steps):
        fault = FAULTS[which]
        if occurs:
            frames += told(device.producer.occur(f"{which}", fault, now))
        else:
            frames += told(device.producer.heal(f"{which}", now))
        if occurs == (which in present):
            continue
        present ^= {which}
        bits = 0
        for each in present:
            bits |= FAULTS[each].register
        bits |= bool(present)
        if occurs:
            maker = (fault.manufacturer + bytes(5))[:5]
            code = bytes((fault.code & 0xFF, fault.code >> 8))
            expected_frames.append("085#" + (code + bytes((bits,)) + maker).hex().upper())
            events.append((code + bytes((bits,)) + maker[:1]).hex())
        elif not present:
            expected_frames.append("085#" + "00" * 8)
        assert device.register == bits
    assert frames == expected_frames
    assert device.history == events[::-1][:DEPTH]
