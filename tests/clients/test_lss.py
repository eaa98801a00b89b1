"""LSS requests byte by byte (CiA 305, 6), and the fast scan."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from hil_tests.clients import lss
from hil_tests.clients.lss import FastScan, Identity
from node_model.frame import Frame

ONE = Identity(0x01020304, 0x0A0B0C0D, 0x00010002, 0xFFFFFFFF)


def test_requests_have_these_bytes() -> None:
    """All on 7E5h with eight bytes, numbers with the low byte first."""
    requests = (
        lss.switch_global(lss.CONFIGURATION),
        *lss.select(ONE),
        lss.set_node_id(5),
        lss.set_bit_timing(lss.BIT_RATES[250_000]),
        lss.activate(500),
        lss.store(),
        lss.inquire(4),
        lss.identify_unconfigured(),
        *lss.identify(ONE, Identity(0, 0, 3, 4)),
    )
    assert [str(frame) for frame in requests] == [
        "7E5#0401000000000000",
        "7E5#4004030201000000",
        "7E5#410D0C0B0A000000",
        "7E5#4202000100000000",
        "7E5#43FFFFFFFF000000",
        "7E5#1105000000000000",
        "7E5#1300030000000000",
        "7E5#15F4010000000000",
        "7E5#1700000000000000",
        "7E5#5E00000000000000",
        "7E5#4C00000000000000",
        "7E5#4604030201000000",
        "7E5#470D0C0B0A000000",
        "7E5#4802000100000000",
        "7E5#4903000000000000",
        "7E5#4AFFFFFFFF000000",
        "7E5#4B04000000000000",
    ]


class Slave:
    """An unconfigured node, as CiA 305 (6.8.4) has it answer a fast scan."""

    def __init__(self, identity: Identity) -> None:
        self.numbers = identity.numbers
        self.part = 0

    def answers(self, frame: Frame) -> bool:
        """Whether it answers this request."""
        data = frame.data
        number, bit, part, following = (
            int.from_bytes(data[1:5], "little"), data[5], data[6], data[7],
        )  # fmt: skip
        if bit == 0x80:
            self.part = 0
            return True
        if part != self.part or number >> bit != self.numbers[part] >> bit:
            return False
        self.part = following
        return True


numbers = st.integers(0, 0xFFFFFFFF)
identities = st.builds(Identity, numbers, numbers, numbers, numbers)


def scan(slaves: list[Slave]) -> tuple[Identity | None, int]:
    """What a fast scan finds, and how many requests it takes."""
    master, count = FastScan(), 0
    while not master.over:
        request = master.ask()
        count += 1
        answers = [slave.answers(request) for slave in slaves]  # every one hears it
        master.heard(any(answers))
    return master.found, count


@given(st.lists(identities, min_size=1, max_size=5))
def test_a_fast_scan_finds_one_of_many(nodes: list[Identity]) -> None:
    """In 133 requests: one to begin, 33 for each of the four numbers."""
    found, count = scan([Slave(identity) for identity in nodes])
    assert found in nodes
    assert count == 133


def test_a_fast_scan_of_nobody_is_over_at_once() -> None:
    """Silence to the first request."""
    assert scan([]) == (None, 1)


def test_a_node_that_goes_away_is_not_found() -> None:
    """Whoever does not confirm a whole number is not taken for found."""
    master = FastScan()
    master.heard(True)
    for _ in range(33):
        master.heard(False)
    assert (master.over, master.found) == (True, None)
