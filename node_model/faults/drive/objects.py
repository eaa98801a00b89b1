"""Drives whose objects are accessed wrongly (C-OD)."""

from __future__ import annotations

from node_model.drive import Drive
from node_model.faults.parts import Fault
from node_model.node import Frames
from node_model.od import AbortCode, SdoAbort
from node_model.sdo import Channel


def place_of(data: bytes) -> tuple[int, int]:
    """Index and sub-index of a request."""
    return data[1] | data[2] << 8, data[3]


class ReadOnlyIsAcknowledged(Fault, Channel):
    """Writing a read-only object is acknowledged, without effect."""

    violates = ("C-OD-05", "C-OD-04", "C-OD-01")

    def start_download(self, data: bytes, now: int) -> Frames:
        entry = self.od.entries.get(data[1] << 8 | data[2] << 16 | data[3])
        if entry is not None and not entry.access.writable:
            return self.answer(b"\x60", data, 0)
        return super().start_download(data, now)


class ReadOnlyIsWritten(Fault, Channel):
    """A refused write to a read-only object changes it all the same."""

    violates = ("C-OD-13", "C-OD-05", "C-OD-01")

    def start_download(self, data: bytes, now: int) -> Frames:
        try:
            return super().start_download(data, now)
        except SdoAbort as abort:
            if abort.code is AbortCode.READ_ONLY:
                index, sub = place_of(data)
                self.od.put(index, sub, data[4:].ljust(8, b"\0")[: len(self.od.get(index, sub))])
            raise


class WriteOnlyIsRead(Fault, Channel):
    """A write-only object can be read."""

    violates = ("C-OD-06", "C-OD-04")

    def start_upload(self, data: bytes, now: int) -> Frames:
        index, sub = place_of(data)
        entry = self.od.find(index, sub)
        if entry.access.readable:
            return super().start_upload(data, now)
        return self.answer(b"\x4f", data, entry.value[0])


class UnknownObjectIsZero(Fault, Channel):
    """Reading an object that does not exist gives 0."""

    violates = ("C-OD-07", "C-OD-16")

    def start_upload(self, data: bytes, now: int) -> Frames:
        if place_of(data)[0] not in self.od:
            return self.answer(b"\x43", data, 0)
        return super().start_upload(data, now)


class UnknownSubIndexIsTheFirst(Fault, Channel):
    """Reading a sub-index that does not exist gives sub-index 0."""

    violates = ("C-OD-08",)

    def start_upload(self, data: bytes, now: int) -> Frames:
        index, sub = place_of(data)
        if index in self.od and not self.od.has(index, sub):
            data = data[:3] + b"\0" + data[4:]
        return super().start_upload(data, now)


class UnknownObjectAbortsWrongly(Fault, Channel):
    """An object that does not exist is refused as a read-only one."""

    violates = ("C-OD-07", "C-OD-16", "C-PC-07")

    def refuse(self, multiplexer: bytes, code: AbortCode) -> Frames:
        wrong = code is AbortCode.NO_OBJECT
        return super().refuse(multiplexer, AbortCode.READ_ONLY if wrong else code)


class UpperLimitIsNotChecked(Fault, Drive):
    """A value above the upper limit of its object is accepted."""

    violates = ("C-OD-09",)

    def compose(self, image: bytes) -> None:
        super().compose(image)
        for entry in self.od.entries.values():
            entry.high = None


class LowerLimitIsNotChecked(Fault, Drive):
    """A value below the lower limit of its object is accepted."""

    violates = ("C-OD-10",)

    def compose(self, image: bytes) -> None:
        super().compose(image)
        for entry in self.od.entries.values():
            entry.low = None


class LimitsAreExclusive(Fault, Drive):
    """The limits of an object are refused themselves."""

    violates = ("C-OD-04",)

    def compose(self, image: bytes) -> None:
        super().compose(image)
        for entry in self.od.entries.values():
            entry.high = None if entry.high is None else entry.high - 1
            entry.low = None if entry.low is None else entry.low + 1


class TooManyBytesAreCut(Fault, Channel):
    """Of too many bytes the first ones are written."""

    violates = ("C-OD-11",)

    def start_download(self, data: bytes, now: int) -> Frames:
        index, sub = place_of(data)
        size = self.od.find(index, sub).data_type.size
        if data[0] & 3 == 3 and 0 < size < 4 - (data[0] >> 2 & 3):
            data = bytes((0x23 | 4 - size << 2,)) + data[1:]
        return super().start_download(data, now)


class TooFewBytesAreFilledUp(Fault, Channel):
    """Too few bytes are filled up with zeros."""

    violates = ("C-OD-12",)

    def start_download(self, data: bytes, now: int) -> Frames:
        index, sub = place_of(data)
        size = self.od.find(index, sub).data_type.size
        if data[0] & 3 == 3 and 4 - (data[0] >> 2 & 3) < size <= 4:
            data = bytes((0x23 | 4 - size << 2,)) + data[1:]
        return super().start_download(data, now)


class RegisterHasReservedBit(Fault, Drive):
    """Bit 6 of the error register is set once it is operational."""

    violates = ("C-OD-02",)

    def before(self, now: int) -> None:
        super().before(now)
        if self.state == 0x05:
            self.od.put_number(0x1001, 0, self.od.number(0x1001) | 0x40)


class IdentityChangesWithAReset(Fault, Drive):
    """The serial number is another one after each boot-up."""

    violates = ("C-OD-03",)

    def boot_frames(self) -> Frames:
        self.boots = getattr(self, "boots", 0) + 1
        self.od.put_number(0x1018, 4, self.boots)
        return super().boot_frames()


class IdentityWithoutVendor(Fault, Drive):
    """The vendor id is 0."""

    violates = ("C-OD-03", "C-EDS-08")

    def boot_frames(self) -> Frames:
        self.od.put_number(0x1018, 1, 0)
        return super().boot_frames()


class ServerShowsOtherIdentifiers(Fault, Drive):
    """Object 1200h shows the identifiers of node 1."""

    violates = ("C-OD-17", "C-EDS-09")

    def boot(self, now: int) -> Frames:
        said = super().boot(now)
        self.od.put_number(0x1200, 1, 0x601)
        self.od.put_number(0x1200, 2, 0x581)
        return said


FAULTS: tuple[type[Fault], ...] = (
    ReadOnlyIsAcknowledged,
    ReadOnlyIsWritten,
    WriteOnlyIsRead,
    UnknownObjectIsZero,
    UnknownSubIndexIsTheFirst,
    UnknownObjectAbortsWrongly,
    UpperLimitIsNotChecked,
    LowerLimitIsNotChecked,
    LimitsAreExclusive,
    TooManyBytesAreCut,
    TooFewBytesAreFilledUp,
    RegisterHasReservedBit,
    IdentityChangesWithAReset,
    IdentityWithoutVendor,
    ServerShowsOtherIdentifiers,
)
