"""The LSS slave: finding, selecting and configuring a device (CiA 305)."""

from __future__ import annotations

from dataclasses import dataclass, field

import pytest
from hypothesis import given
from hypothesis import strategies as st

from node_model.frame import Frame
from node_model.lss import BIT_RATES, NO_NODE_ID, NO_STORAGE, STORED, LssSlave
from node_model.node import MS

IDENTITY = (0x1234, 0x0002_0003, 0x0001_0000, 0x8000_0007)


@dataclass
class FakeDevice:
    """Writes down what it is asked to do."""

    node_id: int = 5
    bit_rates: frozenset[int] = frozenset(BIT_RATES.values()) - {800_000}
    storage: int = STORED
    done: list[tuple[object, ...]] = field(default_factory=list)

    def identity(self) -> tuple[int, int, int, int]:
        """1018h."""
        return IDENTITY

    def keep(self, node_id: int | None, bit_rate: int | None, now: int) -> int:
        """Stored."""
        self.done.append(("keep", node_id, bit_rate, now))
        return self.storage

    def switch(self, bit_rate: int | None, delay_ns: int, now: int) -> None:
        """Another rate."""
        self.done.append(("switch", bit_rate, delay_ns, now))

    def begin(self, now: int) -> None:
        """A node id."""
        self.done.append(("begin", now))


class Line:
    """An LSS slave and a master that sends it bytes."""

    def __init__(self, node_id: int = 5, configuring: bool = False) -> None:
        self.device = FakeDevice(node_id)
        self.slave = LssSlave(self.device)
        self.slave.start(0)
        if configuring:
            assert self.ask(4, 1) is None

    def ask(self, *data: int, now: int = 7) -> bytes | None:
        """The answer to a request, without the zeros at its end; None = silence."""
        frames = self.slave.receive(Frame(0x7E5, bytes(data).ljust(8, b"\0")), now)
        if not frames:
            return None
        (frame,) = frames
        assert (frame.can_id, len(frame.data)) == (0x7E4, 8)
        return frame.data.rstrip(b"\0")

    def ask_number(self, command: int, number: int, *rest: int) -> bytes | None:
        """The answer to a request with a number in bytes 1 to 4."""
        return self.ask(command, *number.to_bytes(4, "little"), *rest)

    def select(self, *identity: int) -> list[bytes | None]:
        """The answers to 40h, 41h, ..."""
        return [self.ask_number(0x40 + part, value) for part, value in enumerate(identity)]

    def identify(self, *bounds: int) -> list[bytes | None]:
        """The answers to 46h, 47h, ..."""
        return [self.ask_number(0x46 + step, value) for step, value in enumerate(bounds)]


# Switching.


def test_who_matches_in_four_parts_is_selected() -> None:
    """44h after the last part; then it can be configured."""
    line = Line()
    assert line.select(*IDENTITY) == [None, None, None, b"\x44"]
    assert line.ask(0x5E) == b"\x5e\x05"


@pytest.mark.parametrize("part", range(4))
@pytest.mark.parametrize("bit", [0, 31])
def test_one_different_bit_is_silence(part: int, bit: int) -> None:
    """And no configuration."""
    line = Line()
    wrong = [value ^ (1 << bit if n == part else 0) for n, value in enumerate(IDENTITY)]
    assert line.select(*wrong) == [None] * 4
    assert line.ask(0x5E) is None


def test_parts_out_of_order_select_nobody() -> None:
    """All four, from the vendor on."""
    line = Line()
    assert line.ask_number(0x43, IDENTITY[3]) is None
    line.select(*IDENTITY[:2])
    assert line.ask_number(0x43, IDENTITY[3]) is None
    line.select(*IDENTITY[:3])
    line.select(*IDENTITY[:1])
    assert line.ask_number(0x43, IDENTITY[3]) is None


def test_switching_all_is_never_answered() -> None:
    """To configuration and back; other modes mean nothing."""
    line = Line()
    assert line.ask(0x5E) is None
    assert line.ask(4, 2) is None
    assert line.ask(0x5E) is None
    assert line.ask(4, 1) is None
    assert line.ask(0x5E) is not None
    assert line.ask(4, 7) is None
    assert line.ask(0x5E) is not None
    assert line.ask(4, 0) is None
    assert line.ask(0x5E) is None


def test_a_reset_leads_back_to_waiting() -> None:
    """What was set and not yet stored stays pending; a power cut ends that."""
    line = Line(configuring=True)
    line.ask(0x11, 9)
    line.slave.stop()
    line.slave.start(9)
    assert line.ask(0x5E) is None
    assert line.slave.pending_node_id == 9
    line.slave.forget()
    assert line.slave.pending_node_id is None


# Finding.


@pytest.mark.parametrize(
    ("change", "found"),
    [
        ((0, 0, 0, 0, 0, 0), True),
        ((1, 0, 0, 0, 0, 0), False),
        ((0, -1, 0, 0, 0, 0), False),
        ((0, 0, -5, 5, -5, 5), True),
        ((0, 0, 1, 0, 0, 0), False),
        ((0, 0, 0, -1, 0, 0), False),
        ((0, 0, 0, 0, 1, 0), False),
        ((0, 0, 0, 0, 0, -1), False),
    ],
)
def test_who_lies_in_all_ranges_says_so(change: tuple[int, ...], found: bool) -> None:
    """Vendor and product equal, revision and serial number between their bounds."""
    vendor, product, revision, serial = IDENTITY
    bounds = (vendor, product, revision, revision, serial, serial)
    wanted = [bound + delta for bound, delta in zip(bounds, change, strict=True)]
    for line in (Line(), Line(configuring=True)):
        assert line.identify(*wanted) == [*[None] * 5, b"\x4f" if found else None]


def test_an_incomplete_search_finds_nobody() -> None:
    """The last step alone, or a step left out."""
    line = Line()
    assert line.ask_number(0x4B, IDENTITY[3]) is None
    line.identify(*IDENTITY[:2])
    assert line.ask_number(0x4B, IDENTITY[3]) is None


@pytest.mark.parametrize(("node_id", "answer"), [(5, None), (NO_NODE_ID, b"\x50")])
def test_who_has_no_node_id_says_so(node_id: int, answer: bytes | None) -> None:
    """4Ch is answered by those alone; not once a node id is pending."""
    line = Line(node_id)
    assert line.ask(0x4C) == answer
    line.slave.pending_node_id = 9
    assert line.ask(0x4C) is None


def scan(line: Line) -> list[int]:
    """The identity that a fast scan finds, as a master looks for it."""
    assert line.ask(0x51, 0, 0, 0, 0, 0x80) == b"\x4f"
    found = []
    for part in range(4):
        number = 0
        for bit in range(31, -1, -1):
            if line.ask_number(0x51, number, bit, part, part) is None:
                number |= 1 << bit
        found.append(number)
        assert line.ask_number(0x51, number, 0, part, (part + 1) % 4) == b"\x4f"
    return found


def test_a_fast_scan_finds_the_identity() -> None:
    """In the end the device is in configuration."""
    line = Line(NO_NODE_ID)
    assert scan(line) == list(IDENTITY)
    assert line.ask(0x11, 9) == b"\x11"


def test_a_fast_scan_is_for_devices_without_node_id() -> None:
    """Others are silent."""
    assert Line(5).ask(0x51, 0, 0, 0, 0, 0x80) is None


@pytest.mark.parametrize(
    ("bit", "part", "following"), [(32, 0, 0), (0, 1, 1), (31, 0, 4), (0x81, 0, 0)]
)
def test_a_fast_scan_out_of_range_is_ignored(bit: int, part: int, following: int) -> None:
    """No such bit, the wrong part, no such part."""
    line = Line(NO_NODE_ID)
    line.ask(0x51, 0, 0, 0, 0, 0x80)
    assert line.ask_number(0x51, IDENTITY[part], bit, part, following) is None


# Configuring.


@pytest.mark.parametrize(
    ("node_id", "code"), [(1, 0), (127, 0), (255, 0), (0, 1), (128, 1), (254, 1)]
)
def test_a_node_id_is_set_in_its_range(node_id: int, code: int) -> None:
    """1 to 127, and 255 for none; error 1 else."""
    line = Line(configuring=True)
    assert line.ask(0x11, node_id) == bytes((0x11, code)).rstrip(b"\0")
    assert line.slave.pending_node_id == (None if code else node_id)


@pytest.mark.parametrize("index", range(12))
def test_a_bit_timing_is_one_of_the_table(index: int) -> None:
    """Table 0; 5 is reserved, and this device cannot have 800 kbit/s."""
    line = Line(configuring=True)
    good = index in BIT_RATES and index != 1
    assert line.ask(0x13, 0, index) == (b"\x13" if good else b"\x13\x01")
    assert line.slave.pending_bit_rate == (BIT_RATES[index] if good else None)


def test_another_table_of_bit_timings_is_not_supported() -> None:
    """Error 1."""
    assert Line(configuring=True).ask(0x13, 1, 2) == b"\x13\x01"


def test_bit_timing_is_activated_after_a_delay() -> None:
    """In ms, little-endian; no answer."""
    line = Line(configuring=True)
    line.ask(0x13, 0, 2)
    assert line.ask(0x15, 0x2C, 0x01) is None
    assert line.device.done == [("switch", 500_000, 300 * MS, 7)]


@pytest.mark.parametrize(("storage", "answer"), [(STORED, b"\x17"), (NO_STORAGE, b"\x17\x01")])
def test_what_is_set_is_stored(storage: int, answer: bytes) -> None:
    """The device says how it went."""
    line = Line(configuring=True)
    line.device.storage = storage
    line.ask(0x11, 9)
    assert line.ask(0x17) == answer
    assert line.device.done == [("keep", 9, None, 7)]


def test_the_identity_can_be_asked_for() -> None:
    """5Ah to 5Dh, and the active node id with 5Eh, whatever is pending."""
    line = Line(configuring=True)
    line.ask(0x11, 9)
    for part, value in enumerate(IDENTITY):
        answer = line.ask(0x5A + part)
        assert answer == bytes((0x5A + part, *value.to_bytes(4, "little"))).rstrip(b"\0")
    assert line.ask(0x5E) == b"\x5e\x05"


def test_a_device_that_gets_its_first_node_id_begins() -> None:
    """When it is sent back to waiting; others wait for a reset."""
    line = Line(NO_NODE_ID, configuring=True)
    line.ask(4, 0)
    line.ask(4, 1)
    line.ask(0x11, 9)
    assert line.device.done == []
    line.ask(4, 0, now=44)
    assert line.device.done == [("begin", 44)]

    other = Line(5, configuring=True)
    other.ask(0x11, 9)
    other.ask(4, 0)
    assert other.device.done == []


def test_configuring_needs_configuration_state() -> None:
    """In LSS waiting these are no commands."""
    line = Line()
    for command in (0x11, 0x13, 0x15, 0x17, 0x5A, 0x5E):
        assert line.ask(command, 1) is None
    assert line.device.done == []


@pytest.mark.parametrize(
    "frame",
    [
        Frame(0x7E5, b"\x04\x01"),
        Frame(0x7E5, bytes((4, 1, 0, 0, 0, 0, 0))),
        Frame(0x7E5, remote=True, dlc=8),
        Frame(0x7E5),
    ],
)
def test_another_length_is_no_request(frame: Frame) -> None:
    """Eight bytes of data, exactly."""
    line = Line()
    assert not line.slave.receive(frame, 7)
    assert not line.slave.configuring


@given(requests=st.lists(st.binary(min_size=8, max_size=8)), node_id=st.sampled_from((5, 255)))
def test_whatever_comes_the_next_request_is_served(requests: list[bytes], node_id: int) -> None:
    """Any bytes: no exception, one answer at most, and then it can still be selected."""
    line = Line(node_id)
    for request in requests:
        assert len(line.slave.receive(Frame(0x7E5, request), 7)) <= 1
    line.ask(4, 0)
    assert line.select(*IDENTITY)[-1] == b"\x44"


def test_it_listens_to_its_master() -> None:
    """7E5h."""
    assert Line().slave.listens_to() == {0x7E5}
