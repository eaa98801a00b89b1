"""Drives whose LSS slave is wrong (C-LS)."""

from __future__ import annotations

from node_model.drive import Drive
from node_model.faults.parts import Fault
from node_model.frame import Frame
from node_model.lss import (
    DONE,
    IDENTIFIED,
    INQUIRE_NODE_ID,
    NO_NODE_ID,
    STORE,
    SWITCH_GLOBAL,
    UNCONFIGURED,
    LssSlave,
)
from node_model.node import Frames


class LssSwitchIsAnswered(Fault, LssSlave):
    """The switch of all devices is answered."""

    violates = ("C-LS-01",)

    def switch_global(self, data: bytes, now: int) -> Frames:
        return (*super().switch_global(data, now), *self.answer(SWITCH_GLOBAL))


class LssTakesShortRequests(Fault, LssSlave):
    """A request with fewer than eight bytes is filled up with zeros."""

    violates = ("C-LS-01",)

    def receive(self, frame: Frame, now: int) -> Frames:
        if frame.data and not frame.remote:
            frame = Frame(frame.can_id, frame.data.ljust(8, b"\0"))
        return super().receive(frame, now)


class LssSelectsWithoutSerial(Fault, LssSlave):
    """The serial number does not matter when a device is selected."""

    violates = ("C-LS-02",)

    def matches(self, part: int, data: bytes) -> bool:
        return part == 3 or super().matches(part, data)


class LssSelectsWithoutVendor(Fault, LssSlave):
    """The vendor id does not matter when a device is selected."""

    violates = ("C-LS-02",)

    def matches(self, part: int, data: bytes) -> bool:
        return part == 0 or super().matches(part, data)


class LssSelectionIsSilent(Fault, LssSlave):
    """Who is selected does not say so."""

    violates = ("C-LS-02",)

    def select(self, data: bytes, now: int) -> Frames:
        super().select(data, now)
        return ()


class LssTakesNodeIdZero(Fault, LssSlave):
    """The node id 0 can be set."""

    violates = ("C-LS-03",)

    def takes_node_id(self, node_id: int) -> bool:
        return node_id == 0 or super().takes_node_id(node_id)


class LssTakesNodeIdAboveTheLast(Fault, LssSlave):
    """The node id 128 can be set."""

    violates = ("C-LS-03",)

    def takes_node_id(self, node_id: int) -> bool:
        return node_id == 128 or super().takes_node_id(node_id)


class LssRefusesTheLastNodeId(Fault, LssSlave):
    """The node id 127 cannot be set."""

    violates = ("C-LS-03",)

    def takes_node_id(self, node_id: int) -> bool:
        return node_id != 127 and super().takes_node_id(node_id)


class LssTakesReservedBitTiming(Fault, LssSlave):
    """The reserved entry of the bit timing table can be set."""

    violates = ("C-LS-04",)

    def bit_rate_of(self, table: int, index: int) -> int | None:
        return super().bit_rate_of(table, 4 if index == 5 else index)


class LssTakesOtherTables(Fault, LssSlave):
    """The table of bit timings does not matter."""

    violates = ("C-LS-04",)

    def bit_rate_of(self, table: int, index: int) -> int | None:
        return super().bit_rate_of(0, index)


class LssStoresNothing(Fault, LssSlave):
    """Storing is acknowledged and stores nothing."""

    violates = ("C-LS-06",)

    def store(self, data: bytes, now: int) -> Frames:
        return self.answer(STORE, DONE)


class LssTellsPendingNodeId(Fault, LssSlave):
    """Asked for its node id it tells the pending one."""

    violates = ("C-LS-07",)

    def inquire(self, data: bytes, now: int) -> Frames:
        if data[0] == INQUIRE_NODE_ID and self.pending_node_id is not None:
            return self.answer(INQUIRE_NODE_ID, self.pending_node_id)
        return super().inquire(data, now)


class LssTellsPartsInOtherOrder(Fault, LssSlave):
    """Asked for its product code it tells its revision, and the other way round."""

    violates = ("C-LS-07",)

    def inquire(self, data: bytes, now: int) -> Frames:
        swapped = {0x5B: 0x5C, 0x5C: 0x5B}.get(data[0], data[0])
        (answer,) = super().inquire(bytes((swapped,)) + data[1:], now)
        return (Frame(answer.can_id, data[:1] + answer.data[1:]),)


class BootsWithoutNodeId(Fault, Drive):
    """Without a node id it sends a boot-up all the same."""

    violates = ("C-LS-08",)

    def boot(self, now: int) -> Frames:
        said = super().boot(now)
        return (*self.boot_frames(), *said) if self.node_id == NO_NODE_ID else said


class LssFirstNodeIdNeedsAReset(Fault, LssSlave):
    """With its first node id it does not start when it is sent back to waiting."""

    violates = ("C-LS-08",)

    def becomes_configured(self) -> bool:
        return False


class LssUnconfiguredWithNodeId(Fault, LssSlave):
    """Who has a node id answers the question for devices without one."""

    violates = ("C-LS-09",)

    def identify_unconfigured(self, data: bytes, now: int) -> Frames:
        return self.answer(UNCONFIGURED)


class LssScannedWithNodeId(Fault, LssSlave):
    """Who has a node id takes part in a fast scan."""

    violates = ("C-LS-09",)

    def is_unconfigured(self) -> bool:
        return True


class LssScanMatchesAlways(Fault, LssSlave):
    """Each step of a fast scan is answered."""

    violates = ("C-LS-09",)

    def fastscan(self, data: bytes, now: int) -> Frames:
        said = super().fastscan(data, now)
        return said or (self.answer(IDENTIFIED) if self.is_unconfigured() else ())


class LssScanDoesNotSelect(Fault, LssSlave):
    """The device that a fast scan has found is not in configuration."""

    violates = ("C-LS-09",)

    def fastscan(self, data: bytes, now: int) -> Frames:
        said = super().fastscan(data, now)
        self.configuring = False
        return said


class LssNodeIdAtOnce(Fault, LssSlave):
    """A new node id acts at once, with a boot-up."""

    violates = ("C-LS-10", "C-LS-03")

    def set_node_id(self, data: bytes, now: int) -> Frames:
        said = super().set_node_id(data, now)
        if self._device.node_id != NO_NODE_ID and not said[0].data[1]:
            self._device.begin(now)
        return said


class LssNodeIdNeedsPower(Fault, LssSlave):
    """A new node id does not act with a reset of communication."""

    violates = ("C-LS-10",)

    def set_node_id(self, data: bytes, now: int) -> Frames:
        before = self.pending_node_id
        said = super().set_node_id(data, now)
        if self._device.node_id != NO_NODE_ID:
            self.pending_node_id = before
        return said


FAULTS: tuple[type[Fault], ...] = (
    LssSwitchIsAnswered,
    LssTakesShortRequests,
    LssSelectsWithoutSerial,
    LssSelectsWithoutVendor,
    LssSelectionIsSilent,
    LssTakesNodeIdZero,
    LssTakesNodeIdAboveTheLast,
    LssRefusesTheLastNodeId,
    LssTakesReservedBitTiming,
    LssTakesOtherTables,
    LssStoresNothing,
    LssTellsPendingNodeId,
    LssTellsPartsInOtherOrder,
    BootsWithoutNodeId,
    LssFirstNodeIdNeedsAReset,
    LssUnconfiguredWithNodeId,
    LssScannedWithNodeId,
    LssScanMatchesAlways,
    LssScanDoesNotSelect,
    LssNodeIdAtOnce,
    LssNodeIdNeedsPower,
)
