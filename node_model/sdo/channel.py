"""One SDO channel: a request identifier, an answer identifier, at most one transfer.

Laws: a request of any length but eight bytes is ignored. Every other request has one
answer, but for abort, the end of a block upload and the segments inside a block. What goes
wrong ends the transfer with an abort; an initiating request always begins anew.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from node_model.frame import Frame, data_frame
from node_model.node import NOTHING, Frames, earliest
from node_model.od import AbortCode, ObjectDictionary, SdoAbort
from node_model.sdo.block import BlockDownload, BlockUpload, check_block_size
from node_model.sdo.settings import SdoSettings
from node_model.sdo.transfer import Download, Inlet, Payloads, Transfer, Upload

Command = Callable[[bytes, int], Frames]

ABORT = 0x80
_NOWHERE = bytes(3)
"""Multiplexer of an abort that belongs to no object."""
_EXPEDITED = (b"", b"\x4f", b"\x4b", b"\x47", b"\x43")
"""Command of an expedited upload's answer, by the number of bytes."""
_EXPEDITED_DOWNLOAD, _SIZED = 0x02, 0x01
_CLIENT_CRC, _BLOCK_SIZED = 0x04, 0x02


@dataclass(frozen=True, slots=True)
class Parts:
    """The classes that transfers are made of: where a faulty server differs."""

    inlet: type[Inlet] = Inlet
    download: type[Download] = Download
    upload: type[Upload] = Upload
    block_download: type[BlockDownload] = BlockDownload
    block_upload: type[BlockUpload] = BlockUpload


def _command_name(command: int) -> str:
    """Which method handles a request that begins with this byte."""
    specifier = command >> 5
    if specifier == 5 and command & 3 == 0:
        return "start_block_upload"
    if specifier == 6 and command & 1 == 0:
        return "start_block_download"
    return _BY_SPECIFIER[specifier]


_BY_SPECIFIER = (
    "proceed",
    "start_download",
    "start_upload",
    "proceed",
    "client_abort",
    "proceed",
    "proceed",
    "unknown",
)
_COMMANDS = tuple(_command_name(command) for command in range(256))
_METHODS = tuple(dict.fromkeys(_COMMANDS))
_PLACES = bytes(_METHODS.index(name) for name in _COMMANDS)
"""Which of the methods handles a request, by its first byte."""


class Channel:
    """The server's end of one SDO channel.

    Args:
        od: the dictionary it serves.
        request_id: identifier of the client's frames.
        answer_id: identifier of its own frames.
        settings: the maker's choices.
        parts: classes of the transfers.
    """

    def __init__(
        self,
        od: ObjectDictionary,
        request_id: int,
        answer_id: int,
        settings: SdoSettings,
        parts: Parts,
    ) -> None:
        self.od = od
        self.request_id = request_id
        self.answer_id = answer_id
        self.settings = settings
        self.parts = parts
        self.transfer: Transfer | None = None
        self.expires_at: int | None = None
        self._commands: tuple[Command, ...] = tuple(getattr(self, name) for name in _METHODS)

    # The verbs.

    def receive(self, frame: Frame, now: int) -> Frames:
        """A frame with this channel's request identifier."""
        data = frame.data
        if len(data) != 8:
            return NOTHING
        transfer = self.transfer
        if transfer is None:
            try:
                frames = self._commands[_PLACES[data[0]]](data, now)
            except SdoAbort as abort:
                return self.refuse(data[1:4], abort.code)
            if self.transfer is not None:
                self._await(now)
            return frames
        return self._within(transfer, data, now)

    def advance(self, now: int) -> Frames:
        """Segments that are due, or the abort of a client that said nothing for too long."""
        transfer = self.transfer
        if transfer is None:
            return NOTHING
        if transfer.due_at is not None and transfer.due_at <= now:
            frames = self.framed(transfer.advance(now))
            if not transfer.takes_any:  # the client waits for us
                self._await(now)
            return frames
        if self.expires_at is not None and self.expires_at <= now:
            return self.refuse(transfer.multiplexer, AbortCode.TIME_OUT)
        return NOTHING

    def deadline(self) -> int | None:
        """The next segment that is due, or the time-out."""
        transfer = self.transfer
        return None if transfer is None else earliest(transfer.due_at, self.expires_at)

    def forget(self) -> None:
        """A transfer is over; nothing more is due."""
        self.transfer = None
        self.expires_at = None

    # What begins.

    def start_upload(self, data: bytes, now: int) -> Frames:  # noqa: ARG002  a command
        """Initiate upload (CiA 301 4.2.0, 7.2.4.3.6): up to four bytes at once, or segments."""
        value = self.od.read(data[1] | data[2] << 8, data[3])
        size = len(value)
        if 0 < size <= 4:
            answer = _EXPEDITED[size] + data[1:4] + value + bytes(4 - size)
            return (data_frame(self.answer_id, answer),)
        self.transfer = self.parts.upload(data[1:4], value)
        if self.settings.tells_size:
            return self.answer(b"\x41", data, size)
        return self.answer(b"\x40", data, 0)

    def start_download(self, data: bytes, now: int) -> Frames:
        """Initiate download (CiA 301 4.2.0, 7.2.4.3.3)."""
        command = data[0]
        if command & _EXPEDITED_DOWNLOAD:
            index, sub = data[1] | data[2] << 8, data[3]
            if command & _SIZED:
                value = data[4 : 8 - (command >> 2 & 3)]
            else:
                value = self.unsized(index, sub, data[4:])
            self.od.write(index, sub, value, now)
        else:
            size = int.from_bytes(data[4:], "little") if command & _SIZED else None
            inlet = self.parts.inlet(self.od, data[1:4], size, self.settings.memory)
            self.transfer = self.parts.download(data[1:4], inlet)
        return (data_frame(self.answer_id, b"\x60" + data[1:4] + b"\0\0\0\0"),)

    def unsized(self, index: int, sub: int, data: bytes) -> bytes:
        """The bytes of an expedited download that does not tell how many count."""
        size = self.od.find(index, sub).data_type.size
        return data[:size] if size else data

    def start_block_download(self, data: bytes, now: int) -> Frames:
        """Initiate block download (CiA 301 4.2.0, 7.2.4.3.9)."""
        self.check_blocks()
        settings = self.settings
        size = int.from_bytes(data[4:], "little") if data[0] & _BLOCK_SIZED else None
        inlet = self.parts.inlet(self.od, data[1:4], size, settings.memory)
        with_crc = settings.has_crc and data[0] & _CLIENT_CRC != 0
        transfer = self.parts.block_download(data[1:4], inlet, settings, with_crc, now)
        self.transfer = transfer
        command = 0xA0 | (_CLIENT_CRC if settings.has_crc else 0)
        return self.answer(bytes((command,)), data, transfer.block_size)

    def start_block_upload(self, data: bytes, now: int) -> Frames:
        """Initiate block upload (CiA 301 4.2.0, 7.2.4.3.12)."""
        self.check_blocks()
        settings = self.settings
        block_size = check_block_size(data[4])
        value = self.od.read(data[1] | data[2] << 8, data[3])
        size = len(value)
        if settings.takes_switch and data[5] and size <= data[5]:
            return self.start_upload(data, now)
        with_crc = settings.has_crc and data[0] & _CLIENT_CRC != 0
        self.transfer = self.parts.block_upload(
            data[1:4], value, block_size, settings.segment_gap_ns, with_crc
        )
        command = 0xC0 | (_CLIENT_CRC if settings.has_crc else 0)
        command |= _BLOCK_SIZED if settings.tells_size else 0
        return self.answer(bytes((command,)), data, size if settings.tells_size else 0)

    def check_blocks(self) -> None:
        """Refuse block transfers where the server cannot do them."""
        if not self.settings.has_blocks:
            raise SdoAbort(AbortCode.COMMAND)

    # What goes on.

    def proceed(self, data: bytes, now: int) -> Frames:
        """A request that belongs to a transfer; without one it is none of ours."""
        if self.transfer is None:
            return self.unknown(data, now)
        return self.framed(self.transfer.receive(data, now))

    def client_abort(self, data: bytes, now: int) -> Frames:  # noqa: ARG002  a command
        """The client gives up: no answer."""
        self.forget()
        return NOTHING

    def unknown(self, data: bytes, now: int) -> Frames:  # noqa: ARG002  a command
        """A command specifier that does not exist, or not here."""
        known = self.transfer
        return self.refuse(known.multiplexer if known else _NOWHERE, AbortCode.COMMAND)

    def refuse(self, multiplexer: bytes, code: AbortCode) -> Frames:
        """End with an abort."""
        self.forget()
        return (data_frame(self.answer_id, b"\x80" + multiplexer + code.to_bytes(4, "little")),)

    def answer(self, command: bytes, data: bytes, number: int) -> Frames:
        """An answer with the multiplexer of the request and a number."""
        return (Frame(self.answer_id, command + data[1:4] + number.to_bytes(4, "little")),)

    def framed(self, payloads: Payloads) -> Frames:
        """Answers of a transfer as frames."""
        return [Frame(self.answer_id, payload) for payload in payloads]

    def _within(self, transfer: Transfer, data: bytes, now: int) -> Frames:
        """A request while a transfer is under way."""
        begins = not transfer.takes_any and _COMMANDS[data[0]].startswith("start")
        multiplexer = data[1:4] if begins else transfer.multiplexer
        if begins:
            self.forget()
        try:
            if transfer.takes_any and data[0] != ABORT:
                frames = self.framed(transfer.receive(data, now))
            else:
                frames = self._commands[_PLACES[data[0]]](data, now)
        except SdoAbort as abort:
            return self.refuse(multiplexer, abort.code)
        if transfer.done and self.transfer is transfer:
            self.forget()
        elif self.transfer is not None:
            self._await(now)
        return frames

    def _await(self, now: int) -> None:
        """The client has some time for its next request."""
        span = self.settings.time_out_ns
        self.expires_at = now + span if span else None
