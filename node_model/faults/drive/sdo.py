"""Drives whose SDO server is wrong, up to segments (C-SD)."""

from __future__ import annotations

from node_model.faults.link import Delay
from node_model.faults.parts import Fault
from node_model.frame import Frame
from node_model.node import MS, Frames
from node_model.od import AbortCode, SdoAbort
from node_model.sdo import Channel
from node_model.sdo.transfer import Download, Inlet, Upload


class SdoAnswersLate(Fault, Delay):
    """SDO answers come 60 ms late."""

    violates = ("C-SD-20",)

    span_ns = 60 * MS

    def picks(self, frame: Frame) -> bool:
        return frame.can_id & 0x780 == 0x580


class SdoAbortWithoutObject(Fault, Channel):
    """An abort does not name the object that was asked for."""

    violates = ("C-SD-01",)

    def refuse(self, multiplexer: bytes, code: AbortCode) -> Frames:
        return super().refuse(bytes(3), code)


class SdoAnswerOfFourBytes(Fault, Channel):
    """The acknowledgement of a download has four bytes."""

    violates = ("C-SD-01", "C-RB-02")

    def start_download(self, data: bytes, now: int) -> Frames:
        (answer,) = super().start_download(data, now)
        return (Frame(answer.can_id, answer.data[:4]),)


class SdoUploadAlwaysFourBytes(Fault, Channel):
    """An expedited upload tells four bytes whatever the size of the object."""

    violates = ("C-SD-02", "C-OD-04")

    def start_upload(self, data: bytes, now: int) -> Frames:
        (answer,) = super().start_upload(data, now)
        if answer.data[0] & 2:
            return (Frame(answer.can_id, b"\x43" + answer.data[1:]),)
        return (answer,)


class SdoDownloadAlwaysFourBytes(Fault, Channel):
    """The size that an expedited download tells is not looked at."""

    violates = ("C-SD-03", "C-OD-11", "C-OD-12", "C-SD-15", "C-SD-16")

    def start_download(self, data: bytes, now: int) -> Frames:
        if data[0] & 3 == 3:
            data = bytes((data[0] & ~1,)) + data[1:]
        return super().start_download(data, now)


class SdoSegmentsTellWrongSize(Fault, Channel):
    """A segmented upload tells one byte more than it has."""

    violates = ("C-SD-04",)

    def start_upload(self, data: bytes, now: int) -> Frames:
        (answer,) = super().start_upload(data, now)
        if answer.data[0] == 0x41:
            size = int.from_bytes(answer.data[4:], "little") + 1
            return self.answer(b"\x41", data, size)
        return (answer,)


class SdoLastSegmentIsFull(Fault, Upload):
    """The last segment of an upload does not tell how many of its bytes count."""

    violates = ("C-SD-04", "C-SD-15", "C-SD-16")

    def segment(self, data: bytes) -> bytes:
        answer = super().segment(data)
        return bytes((answer[0] & ~0x0E,)) + answer[1:]


class SdoNoShortSegmentedDownload(Fault, Channel):
    """A segmented download of four bytes or less is refused."""

    violates = ("C-SD-05", "C-OD-04")

    def start_download(self, data: bytes, now: int) -> Frames:
        if data[0] & 3 == 1 and int.from_bytes(data[4:], "little") <= 4:
            raise SdoAbort(AbortCode.COMMAND)
        return super().start_download(data, now)


class SdoDownloadToggleIgnored(Fault, Download):
    """A segment of a download with the wrong toggle bit is taken."""

    violates = ("C-SD-06",)

    def check_toggle(self, toggle: int) -> None:
        pass


class SdoUploadToggleIgnored(Fault, Upload):
    """A request for a segment with the wrong toggle bit is served."""

    violates = ("C-SD-06",)

    def check_toggle(self, toggle: int) -> None:
        pass


class SdoToggleAnsweredWrongly(Fault, Download):
    """The confirmations of segments always have the toggle bit 0."""

    violates = ("C-SD-06", "C-SD-05")

    def answer(self) -> bytes:
        return b"\x20" + bytes(7)


class SdoUnknownCommandIsSilent(Fault, Channel):
    """An unknown command specifier is not answered."""

    violates = ("C-SD-07",)

    def unknown(self, data: bytes, now: int) -> Frames:
        return ()


class SdoClientAbortIsAnswered(Fault, Channel):
    """The abort of a client is answered with an abort."""

    violates = ("C-SD-08",)

    def client_abort(self, data: bytes, now: int) -> Frames:
        return self.refuse(data[1:4], AbortCode.GENERAL)


class SdoClientAbortIsIgnored(Fault, Channel):
    """The abort of a client does not end its transfer."""

    violates = ("C-SD-08",)

    def client_abort(self, data: bytes, now: int) -> Frames:
        return ()


class SdoNoNewStartInATransfer(Fault, Channel):
    """A new request in the middle of a transfer is refused."""

    violates = ("C-SD-08",)

    def _within(self, transfer: object, data: bytes, now: int) -> Frames:
        if data[0] == 0x40:
            return self.refuse(data[1:4], AbortCode.DEVICE_STATE)
        return super()._within(transfer, data, now)  # type: ignore[arg-type]


class SdoFewerBytesThanTold(Fault, Inlet):
    """A download of fewer bytes than the client told is taken."""

    violates = ("C-SD-14",)

    def check_size(self, size: int) -> None:
        pass


class SdoMoreBytesThanTold(Fault, Inlet):
    """A download of more bytes than the client told is taken."""

    violates = ("C-SD-14",)

    def check_growth(self, size: int) -> None:
        self.size = None


class SdoLosesTheTail(Fault, Inlet):
    """Of a download of more than 888 bytes the rest is lost."""

    violates = ("C-SD-15", "C-SD-16")

    def finish(self, now: int) -> None:
        self.check_size(len(self.data))
        self.od.write(self.index, self.sub, bytes(self.data[:888]), now)


class SdoStopsAfterManyRequests(Fault, Channel):
    """Every hundredth request is not answered."""

    violates = ("C-RB-09", "C-SD-01")

    requests = 0

    def receive(self, frame: Frame, now: int) -> Frames:
        self.requests += 1
        return super().receive(frame, now) if self.requests % 100 else ()


FAULTS: tuple[type[Fault], ...] = (
    SdoAnswersLate,
    SdoAbortWithoutObject,
    SdoAnswerOfFourBytes,
    SdoUploadAlwaysFourBytes,
    SdoDownloadAlwaysFourBytes,
    SdoSegmentsTellWrongSize,
    SdoLastSegmentIsFull,
    SdoNoShortSegmentedDownload,
    SdoDownloadToggleIgnored,
    SdoUploadToggleIgnored,
    SdoToggleAnsweredWrongly,
    SdoUnknownCommandIsSilent,
    SdoClientAbortIsAnswered,
    SdoClientAbortIsIgnored,
    SdoNoNewStartInATransfer,
    SdoFewerBytesThanTold,
    SdoMoreBytesThanTold,
    SdoLosesTheTail,
    SdoStopsAfterManyRequests,
)
