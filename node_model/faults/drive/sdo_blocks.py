"""Drives whose SDO block transfers are wrong (C-SD-09 to C-SD-12)."""

from __future__ import annotations

from node_model.faults.parts import Fault
from node_model.node import Frames
from node_model.sdo import Channel
from node_model.sdo.block import BlockDownload, BlockUpload
from node_model.sdo.transfer import SEGMENT


class BlockSizeIsNotChecked(Fault, Channel):
    """A block upload with 0 or more than 127 segments a block is begun."""

    violates = ("C-SD-09",)

    def start_block_upload(self, data: bytes, now: int) -> Frames:
        size = data[4] if 1 <= data[4] <= 127 else 127
        return super().start_block_upload(data[:4] + bytes((size,)) + data[5:], now)


class BlockOfOneIsRefused(Fault, Channel):
    """A block upload with one segment a block is refused."""

    violates = ("C-SD-09",)

    def start_block_upload(self, data: bytes, now: int) -> Frames:
        size = 0 if data[4] == 1 else data[4]
        return super().start_block_upload(data[:4] + bytes((size,)) + data[5:], now)


class BlockTakesSegmentsInAnyOrder(Fault, BlockDownload):
    """A segment that was lost in a block download is not noticed."""

    violates = ("C-SD-10",)

    def segment(self, data: bytes) -> list[bytes]:
        self.good = (data[0] & 0x7F) - 1
        return list(super().segment(data))


class BlockConfirmsAll(Fault, BlockDownload):
    """The confirmation of a block always names its last segment."""

    violates = ("C-SD-10",)

    def confirm(self) -> bytes:
        size = self.block_size
        answer = super().confirm()
        return answer[:1] + bytes((size,)) + answer[2:]


class BlockGoesOnAfterALoss(Fault, BlockUpload):
    """What the client did not confirm of a block is not sent again."""

    violates = ("C-SD-10",)

    def confirmed(self, number: int) -> None:
        super().confirmed(number)
        self.position += (self.sent - number) * SEGMENT


class BlockNumbersFromZero(Fault, BlockUpload):
    """The segments of an uploaded block are numbered from 0."""

    violates = ("C-SD-10",)

    def segment(self) -> bytes:
        segment = super().segment()
        return bytes((segment[0] - 1,)) + segment[1:]


class BlockCrcIsNotChecked(Fault, BlockDownload):
    """A block download with a wrong CRC is taken."""

    violates = ("C-SD-11",)

    def check_crc(self, told: int) -> None:
        pass


class BlockCrcOfZero(Fault, BlockUpload):
    """The CRC of a block upload is always 0."""

    violates = ("C-SD-11",)

    def end(self) -> bytes:
        return super().end()[:1] + bytes(7)


class BlockTailNotTold(Fault, BlockUpload):
    """The end of a block upload does not tell how many of the last bytes count."""

    violates = ("C-SD-15", "C-SD-16", "C-SD-10")

    def end(self) -> bytes:
        answer = super().end()
        return bytes((answer[0] & ~0x1C,)) + answer[1:]


class BlockNumberIsNotChecked(Fault, BlockDownload):
    """A segment with the number 0 in a block download is passed over in silence."""

    violates = ("C-SD-12",)

    def check_number(self, number: int) -> None:
        pass


FAULTS: tuple[type[Fault], ...] = (
    BlockSizeIsNotChecked,
    BlockOfOneIsRefused,
    BlockTakesSegmentsInAnyOrder,
    BlockConfirmsAll,
    BlockGoesOnAfterALoss,
    BlockNumbersFromZero,
    BlockCrcIsNotChecked,
    BlockCrcOfZero,
    BlockTailNotTold,
    BlockNumberIsNotChecked,
)
