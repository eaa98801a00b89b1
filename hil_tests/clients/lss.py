"""Layer setting services as the master sees them (CiA 305, 6): frames and fast scan."""

from __future__ import annotations

from dataclasses import dataclass

from node_model.frame import Frame, data_frame

REQUEST_ID = 0x7E5
ANSWER_ID = 0x7E4

WAITING, CONFIGURATION = 0, 1
UNCONFIGURED = 255
"""Node id of a node that has none."""

SELECTED, IDENTIFIED, NOT_CONFIGURED = 0x44, 0x4F, 0x50
NODE_ID, BIT_TIMING, ACTIVATE, STORE = 0x11, 0x13, 0x15, 0x17
INQUIRE_NODE_ID = 0x5E
BIT_RATES = {
    1_000_000: 0,
    800_000: 1,
    500_000: 2,
    250_000: 3,
    125_000: 4,
    50_000: 6,
    20_000: 7,
    10_000: 8,
}
"""Index in table 0 by bit/s; 5 is reserved."""


@dataclass(frozen=True, slots=True)
class Identity:
    """The four numbers of 1018h that tell every node from every other."""

    vendor: int
    product: int
    revision: int
    serial: int

    @property
    def numbers(self) -> tuple[int, int, int, int]:
        """In the order in which LSS asks for them."""
        return (self.vendor, self.product, self.revision, self.serial)


def request(command: int, *rest: int) -> Frame:
    """A request with its bytes, filled up to eight."""
    return data_frame(REQUEST_ID, bytes((command, *rest)).ljust(8, b"\x00"))


def _with_number(command: int, number: int) -> Frame:
    return request(command, *number.to_bytes(4, "little"))


def switch_global(mode: int) -> Frame:
    """Every node to waiting or to configuration; never answered."""
    return request(0x04, mode)


def select(identity: Identity) -> list[Frame]:
    """The one node with this identity to configuration: 40h to 43h."""
    return [_with_number(0x40 + place, part) for place, part in enumerate(identity.numbers)]


def identify(low: Identity, high: Identity) -> list[Frame]:
    """Who has this vendor and product, and revision and serial number in these ranges?

    46h to 4Bh; vendor and product are those of `low`.
    """
    numbers = (
        low.vendor, low.product, low.revision, high.revision, low.serial, high.serial
    )  # fmt: skip
    return [_with_number(0x46 + place, number) for place, number in enumerate(numbers)]


def identify_unconfigured() -> Frame:
    """Is there a node without a node id?"""
    return request(0x4C)


def set_node_id(node_id: int) -> Frame:
    """Configure node id, 1 to 127, or 255 for none."""
    return request(NODE_ID, node_id)


def set_bit_timing(index: int, table: int = 0) -> Frame:
    """Configure bit timing."""
    return request(BIT_TIMING, table, index)


def activate(delay_ms: int) -> Frame:
    """Every node changes its bit rate: silence, then the change, then silence."""
    return request(ACTIVATE, *delay_ms.to_bytes(2, "little"))


def store() -> Frame:
    """Store what was configured."""
    return request(STORE)


def inquire(part: int) -> Frame:
    """Ask for part 0 to 3 of the identity, or 4 for the node id: 5Ah to 5Eh."""
    return request(0x5A + part)


class FastScan:
    """Finds one unconfigured node out of any number, bit by bit (CiA 305, 6.8.4).

    The four numbers are found from their highest bits on: "is there one whose next bit is 0?"
    Whoever matches answers; silence means that the bit is 1. `ask` gives the request, `heard`
    takes whether anybody answered; `found` is the identity once all is known.
    """

    def __init__(self) -> None:
        self.found: Identity | None = None
        self.over = False
        """Nothing more to ask: the node was found, or nobody is there."""
        self._numbers = [0, 0, 0, 0]
        self._part = 0
        self._bit = 0x80
        """The bit that is asked for; 80h = is anybody there; -1 = does the number hold."""

    def ask(self) -> Frame:
        """The next request."""
        number = self._numbers[self._part]
        bit = max(self._bit, 0)
        if self._bit == 0x80:
            return fast_scan(0, 0x80, 0, 0)
        following = self._part if self._bit >= 0 else (self._part + 1) % 4
        return fast_scan(number, bit, self._part, following)

    def heard(self, answered: bool) -> None:
        """Whether anybody answered the last request."""
        if self._bit == 0x80:
            self.over = not answered
            self._bit = 31
            return
        if self._bit >= 0:
            if not answered:
                self._numbers[self._part] |= 1 << self._bit
            self._bit -= 1
            return
        if not answered:
            self.over = True  # it went away, or answered for something else
        elif self._part == 3:
            self.found = Identity(*self._numbers)
            self.over = True
        self._part, self._bit = (self._part + 1) % 4, 31


def fast_scan(number: int, bit: int, part: int, following: int) -> Frame:
    """51h: identity number, bit checked, which of the four, and the next one."""
    return request(0x51, *number.to_bytes(4, "little"), bit, part, following)
