"""LSS slave (CiA 305 3.0.0): a device without switches gets its node id and bit rate.

Laws: a request has eight bytes, else it is none. What configures acts in LSS configuration
only; what finds devices is answered by those that match and by nobody else. A node id that
was set is pending until communication is reset; a device that has none starts as soon as
it is sent back to LSS waiting with a valid one.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from node_model.frame import Frame, data_frame
from node_model.node import MS, NOTHING, Frames
from node_model.service import QuietService

REQUEST_ID, ANSWER_ID = 0x7E5, 0x7E4
SIZE = 8

SWITCH_GLOBAL = 0x04
SET_NODE_ID, SET_BIT_TIMING, ACTIVATE_BIT_TIMING, STORE = 0x11, 0x13, 0x15, 0x17
SELECT_VENDOR, SELECT_SERIAL, SELECTED = 0x40, 0x43, 0x44
IDENTIFY_VENDOR, IDENTIFY_LAST, IDENTIFIED = 0x46, 0x4B, 0x4F
IDENTIFY_UNCONFIGURED, UNCONFIGURED = 0x4C, 0x50
FASTSCAN = 0x51
INQUIRE_VENDOR, INQUIRE_SERIAL, INQUIRE_NODE_ID = 0x5A, 0x5D, 0x5E
"""Command specifiers."""

NO_NODE_ID = 255
"""Node id of a device that has none: it takes part in LSS only."""
NODE_IDS = range(1, 128)

BIT_RATES = {
    0: 1_000_000,
    1: 800_000,
    2: 500_000,
    3: 250_000,
    4: 125_000,
    6: 50_000,
    7: 20_000,
    8: 10_000,
}
"""Bit timing table 0 of CiA 301: index -> bit/s; index 5 is reserved."""

DONE, OUT_OF_RANGE = 0, 1
STORED, NO_STORAGE, STORAGE_FAILED = 0, 1, 2
"""Error codes of the answers."""

CONFIRM_SCAN = 0x80
"""Value of the bit number of a fast scan with which it begins."""
_IDENTIFY = ((0, False), (1, False), (2, False), (2, True), (3, False), (3, True))
"""Part of the identity, and whether the value is its upper bound, of 46h..4Bh. The parts
with two bounds are the revision and the serial number."""


class LssDevice(Protocol):
    """What an LSS slave needs of its device."""

    node_id: int
    """The active one; NO_NODE_ID = none."""

    bit_rates: frozenset[int]
    """bit/s that its controller can have."""

    def identity(self) -> tuple[int, int, int, int]:
        """Vendor, product code, revision, serial number: 1018h:01 to :04."""

    def keep(self, node_id: int | None, bit_rate: int | None, now: int) -> int:
        """Put settings into the non-volatile memory; None = as it is.

        Returns:
            Error code of the answer to 17h.
        """

    def switch(self, bit_rate: int | None, delay_ns: int, now: int) -> None:
        """Change to that bit rate (None = the present one) after a silence of two delays."""

    def begin(self, now: int) -> None:
        """A device that had no node id has a pending one now: initialise communication."""


Command = Callable[[bytes, int], Frames]
"""Does a request, given its eight bytes and the instant."""


class LssSlave(QuietService):
    """One LSS slave.

    Args:
        device: its device.
    """

    def __init__(self, device: LssDevice) -> None:
        self._device = device
        self.configuring = False
        self.pending_node_id: int | None = None
        self.pending_bit_rate: int | None = None
        self._matched = 0
        self._identified = 0
        self._scan_part = 0
        finding = {
            SWITCH_GLOBAL: self.switch_global,
            **dict.fromkeys(range(IDENTIFY_VENDOR, IDENTIFY_LAST + 1), self.identify),
        }
        self._waiting: dict[int, Command] = {
            **finding,
            **dict.fromkeys(range(SELECT_VENDOR, SELECT_SERIAL + 1), self.select),
            IDENTIFY_UNCONFIGURED: self.identify_unconfigured,
            FASTSCAN: self.fastscan,
        }
        self._configuring: dict[int, Command] = {
            **finding,
            SET_NODE_ID: self.set_node_id,
            SET_BIT_TIMING: self.set_bit_timing,
            ACTIVATE_BIT_TIMING: self.activate_bit_timing,
            STORE: self.store,
            **dict.fromkeys(range(INQUIRE_VENDOR, INQUIRE_NODE_ID + 1), self.inquire),
        }

    # The verbs of a service.

    def listens_to(self) -> frozenset[int]:
        """Requests of the LSS master."""
        return frozenset((REQUEST_ID,))

    def start(self, now: int) -> Frames:
        """LSS waiting."""
        self.rest()
        return super().start(now)

    def receive(self, frame: Frame, now: int) -> Frames:
        """A request; what is no command changes nothing."""
        if not self.accepts(frame):
            return NOTHING
        commands = self._configuring if self.configuring else self._waiting
        command = commands.get(frame.data[0])
        return NOTHING if command is None else command(frame.data, now)

    def stop(self) -> None:
        """What was set and not stored stays: a reset makes it active."""
        super().stop()
        self.rest()

    def forget(self) -> None:
        """Supply is gone, and with it what is pending."""
        self.pending_node_id = self.pending_bit_rate = None

    def rest(self) -> None:
        """LSS waiting; half-done searches are over."""
        self.configuring = False
        self._matched = self._identified = self._scan_part = 0

    # What decides.

    def accepts(self, frame: Frame) -> bool:
        """A data frame of eight bytes."""
        return not frame.remote and len(frame.data) == SIZE

    def is_unconfigured(self) -> bool:
        """It has no node id, and none is pending."""
        none = {None, NO_NODE_ID}
        return self._device.node_id == NO_NODE_ID and self.pending_node_id in none

    def takes_node_id(self, node_id: int) -> bool:
        """Node ids that can be set: 1 to 127, and 255 for none."""
        return node_id in NODE_IDS or node_id == NO_NODE_ID

    def bit_rate_of(self, table: int, index: int) -> int | None:
        """bit/s of an entry of a bit timing table; None = not supported."""
        rate = BIT_RATES.get(index) if table == 0 else None
        return rate if rate in self._device.bit_rates else None

    # Commands.

    def switch_global(self, data: bytes, now: int) -> Frames:
        """04h: to LSS waiting (0) or configuration (1); never answered."""
        if data[1] == 1:
            self.configuring = True
        elif data[1] == 0:
            begins = self.configuring and self.becomes_configured()
            self.rest()
            if begins:
                self._device.begin(now)
        return NOTHING

    def becomes_configured(self) -> bool:
        """It had no node id until now, and one was set."""
        return self._device.node_id == NO_NODE_ID and self.pending_node_id in NODE_IDS

    def select(self, data: bytes, now: int) -> Frames:  # noqa: ARG002  a command
        """40h to 43h: who matches in all four parts, in order, is selected and says so."""
        part = data[0] - SELECT_VENDOR
        if part == 0:
            self._matched = 0
        expected = part == self._matched
        self._matched = part + 1 if expected and self.matches(part, data) else 0
        if self._matched <= 3:
            return NOTHING
        self.rest()
        self.configuring = True
        return self.answer(SELECTED)

    def matches(self, part: int, data: bytes) -> bool:
        """A part of the identity is the one that is asked for."""
        return self._device.identity()[part] == number_in(data)

    def identify(self, data: bytes, now: int) -> Frames:  # noqa: ARG002  a command
        """46h to 4Bh: who lies in all ranges says so."""
        step = data[0] - IDENTIFY_VENDOR
        if step == 0:
            self._identified = 0
        expected = step == self._identified
        self._identified = step + 1 if expected and self.lies_in_range(step, data) else 0
        if self._identified < len(_IDENTIFY):
            return NOTHING
        self._identified = 0
        return self.answer(IDENTIFIED)

    def lies_in_range(self, step: int, data: bytes) -> bool:
        """Vendor and product equal; revision and serial number from low to high."""
        part, is_upper = _IDENTIFY[step]
        own, bound = self._device.identity()[part], number_in(data)
        if part < 2:
            return own == bound
        return own <= bound if is_upper else own >= bound

    def identify_unconfigured(self, data: bytes, now: int) -> Frames:  # noqa: ARG002  a command
        """4Ch: who has no node id says so."""
        return self.answer(UNCONFIGURED) if self.is_unconfigured() else NOTHING

    def fastscan(self, data: bytes, now: int) -> Frames:  # noqa: ARG002  a command
        """51h: finds the identity of one device without a node id, bit by bit.

        Bytes: number (4), lowest bit that counts, part of the identity, next part.
        """
        if not self.is_unconfigured():
            return NOTHING
        bit, part, following = data[5:8]
        if bit == CONFIRM_SCAN:
            self._scan_part = 0
            return self.answer(IDENTIFIED)
        if bit > 31 or part != self._scan_part or following > 3:
            return NOTHING
        if (self._device.identity()[part] ^ number_in(data)) >> bit:
            return NOTHING
        if bit == 0 and following < part:
            self.rest()
            self.configuring = True
        else:
            self._scan_part = following
        return self.answer(IDENTIFIED)

    def set_node_id(self, data: bytes, now: int) -> Frames:  # noqa: ARG002  a command
        """11h: acts with the next reset of communication."""
        if not self.takes_node_id(data[1]):
            return self.answer(SET_NODE_ID, OUT_OF_RANGE)
        self.pending_node_id = data[1]
        return self.answer(SET_NODE_ID, DONE)

    def set_bit_timing(self, data: bytes, now: int) -> Frames:  # noqa: ARG002  a command
        """13h: acts with 15h, or once it is stored with the next power-on."""
        rate = self.bit_rate_of(data[1], data[2])
        if rate is None:
            return self.answer(SET_BIT_TIMING, OUT_OF_RANGE)
        self.pending_bit_rate = rate
        return self.answer(SET_BIT_TIMING, DONE)

    def activate_bit_timing(self, data: bytes, now: int) -> Frames:
        """15h: all devices change their bit rate together; never answered."""
        delay_ms = int.from_bytes(data[1:3], "little")
        self._device.switch(self.pending_bit_rate, delay_ms * MS, now)
        return NOTHING

    def store(self, data: bytes, now: int) -> Frames:  # noqa: ARG002  a command
        """17h: what is pending is kept for the next power-on."""
        code = self._device.keep(self.pending_node_id, self.pending_bit_rate, now)
        return self.answer(STORE, code)

    def inquire(self, data: bytes, now: int) -> Frames:  # noqa: ARG002  a command
        """5Ah to 5Eh: its identity, and its active node id."""
        command = data[0]
        if command == INQUIRE_NODE_ID:
            return self.answer(command, self._device.node_id)
        part = self._device.identity()[command - INQUIRE_VENDOR]
        return self.answer(command, *part.to_bytes(4, "little"))

    def answer(self, *data: int) -> Frames:
        """A frame to the LSS master; reserved bytes are 0."""
        return (data_frame(ANSWER_ID, bytes(data).ljust(SIZE, b"\0")),)


def number_in(data: bytes) -> int:
    """Bytes 1 to 4 of a request."""
    return int.from_bytes(data[1:5], "little")
