"""An SDO client for tests of the server, written from the clause (CiA 301 4.2.0, 7.2.4.3)."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from crccheck.crc import CrcXmodem

from node_model.frame import Frame
from node_model.sdo import SdoServer

NODE = 5
MS = 1_000_000


class Aborted(Exception):
    """The server ended the transfer."""

    def __init__(self, answer: bytes) -> None:
        self.code = int.from_bytes(answer[4:], "little")
        self.multiplexer = answer[1:4]
        super().__init__(f"{self.code:08X}h")


def crc(data: bytes) -> bytes:
    """CRC-16 with 1021h begun with 0, as a block transfer sends it."""
    return int(CrcXmodem.calc(data)).to_bytes(2, "little")


def place(index: int, sub: int) -> bytes:
    """A multiplexer."""
    return index.to_bytes(2, "little") + bytes((sub,))


class Client:
    """A client that checks each answer to the bit.

    Args:
        server: whom it asks.
        request_id: identifier of its frames.
        answer_id: identifier of the answers.
    """

    def __init__(
        self, server: SdoServer, request_id: int = 0x600 + NODE, answer_id: int = 0x580 + NODE
    ) -> None:
        self.server = server
        self.request_id = request_id
        self.answer_id = answer_id
        self.now = 0

    def ask(self, *parts: bytes) -> list[bytes]:
        """Send one request, filled up with zeros; all that the server says to it."""
        self.now += MS
        data = b"".join(parts).ljust(8, b"\0")
        frames = list(self.server.receive(Frame(self.request_id, data), self.now))
        return self._data(frames)

    def wait(self) -> list[bytes]:
        """Let the server's next deadline come."""
        due = self.server.deadline()
        assert due is not None
        self.now = max(self.now, due)
        return self._data(list(self.server.advance(self.now)))

    def one(self, *parts: bytes) -> bytes:
        """Send a request that has exactly one answer.

        Raises:
            Aborted: the answer is an abort.
        """
        (answer,) = self.ask(*parts)
        if answer[0] == 0x80:
            raise Aborted(answer)
        return answer

    def _data(self, frames: Sequence[Frame]) -> list[bytes]:
        assert {frame.can_id for frame in frames} <= {self.answer_id}
        assert {len(frame.data) for frame in frames} <= {8}
        return [frame.data for frame in frames]

    # Uploads.

    def upload(self, index: int, sub: int = 0) -> bytes:
        """Expedited or in segments, as the server likes."""
        return self._uploaded(self.one(b"\x40", place(index, sub)), place(index, sub))

    def _uploaded(self, answer: bytes, multiplexer: bytes) -> bytes:
        assert answer[1:4] == multiplexer
        command = answer[0]
        if command & 2:
            assert command & 0xF3 == 0x43
            used = 4 - (command >> 2 & 3)
            assert answer[4 + used :] == bytes(4 - used)
            return answer[4 : 4 + used]
        assert command in {0x40, 0x41}
        data, toggle = bytearray(), 0
        while True:
            answer = self.one(bytes((0x60 | toggle,)))
            assert answer[0] & 0xF0 == toggle
            used = 7 - (answer[0] >> 1 & 7)
            assert answer[1 + used :] == bytes(7 - used)
            data += answer[1 : 1 + used]
            toggle ^= 0x10
            if answer[0] & 1:
                break
        if command == 0x41:
            assert answer is not None
            self.told_size = len(data)
        return bytes(data)

    def block_upload(
        self,
        index: int,
        sub: int = 0,
        block_size: int = 127,
        with_crc: bool = True,
        threshold: int = 0,
        heard: Callable[[int, list[bytes]], int] | None = None,
    ) -> bytes:
        """In blocks.

        Args:
            index: of the object.
            sub: of the object.
            block_size: segments of each block.
            with_crc: the client can do it.
            threshold: protocol switch threshold.
            heard: given the number of the block and its segments, how many of them came.
        """
        command = 0xA4 if with_crc else 0xA0
        answer = self.one(bytes((command,)), place(index, sub), bytes((block_size, threshold)))
        if answer[0] >> 5 == 2:
            return self._uploaded(answer, place(index, sub))
        assert answer[0] & 0xF9 == 0xC0
        assert answer[1:4] == place(index, sub)
        told = int.from_bytes(answer[4:], "little") if answer[0] & 2 else None
        data, block, last = bytearray(), 0, False
        answers = self.ask(b"\xa3")
        while not last:
            limit = block_size
            while len(answers) < limit and answers[-1][0] < 0x80:
                answers += self.wait()
            assert [a[0] & 0x7F for a in answers] == list(range(1, len(answers) + 1))
            assert all(a[0] < 0x80 for a in answers[:-1])
            came = len(answers) if heard is None else heard(block, answers)
            block += 1
            data += b"".join(a[1:] for a in answers[:came])
            last = came == len(answers) and answers[-1][0] >= 0x80
            answers = self.ask(bytes((0xA2, came, block_size)))
        (end,) = answers
        assert end[0] & 0xE3 == 0xC1
        unused = end[0] >> 2 & 7
        assert unused < 8
        value = bytes(data[: len(data) - unused])
        crc_on = with_crc and answer[0] & 4
        assert end[1:3] == (crc(value) if crc_on else b"\0\0")
        assert told in {None, len(value)}
        assert self.ask(b"\xa1") == []
        return value

    # Downloads.

    def download(self, index: int, sub: int, data: bytes) -> None:
        """Expedited, 1 to 4 bytes."""
        command = 0x23 | (4 - len(data)) << 2
        answer = self.one(bytes((command,)), place(index, sub), data)
        assert answer == b"\x60" + place(index, sub) + bytes(4)

    def start_segments(self, index: int, sub: int, size: int | None) -> None:
        """Begin a segmented download."""
        told = b"" if size is None else size.to_bytes(4, "little")
        command = b"\x20" if size is None else b"\x21"
        answer = self.one(command, place(index, sub), told)
        assert answer == b"\x60" + place(index, sub) + bytes(4)

    def segment(self, data: bytes, toggle: int, last: bool) -> None:
        """One segment of a download."""
        command = toggle << 4 | (7 - len(data)) << 1 | last
        assert self.one(bytes((command,)), data) == bytes((0x20 | toggle << 4,)) + bytes(7)

    def segmented_download(
        self, index: int, sub: int, data: bytes, size: int | None = None
    ) -> None:
        """In segments."""
        self.start_segments(index, sub, size)
        pieces = [data[at : at + 7] for at in range(0, len(data), 7)] or [b""]
        for number, piece in enumerate(pieces):
            self.segment(piece, number & 1, number == len(pieces) - 1)

    def start_blocks(
        self, index: int, sub: int, size: int | None = None, with_crc: bool = True
    ) -> bytes:
        """Begin a block download; the server's answer."""
        command = 0xC0 | (4 if with_crc else 0) | (0 if size is None else 2)
        answer = self.one(bytes((command,)), place(index, sub), (size or 0).to_bytes(4, "little"))
        assert answer[0] & 0xFB == 0xA0
        assert answer[1:4] == place(index, sub)
        assert answer[5:] == bytes(3)
        return answer

    def send_block(self, pieces: Sequence[bytes], ends: bool, lost: Sequence[int] = ()) -> bytes:
        """Segments 1, 2, ... but for the lost numbers; the confirmation."""
        said: list[bytes] = []
        for number, piece in enumerate(pieces, start=1):
            if number not in lost:
                assert said == []
                last = 0x80 if ends and number == len(pieces) else 0
                said = self.ask(bytes((number | last,)), piece)
        (answer,) = said
        if answer[0] == 0x80:
            raise Aborted(answer)
        assert answer[0] == 0xA2
        assert answer[3:] == bytes(5)
        return answer

    def block_download(
        self,
        index: int,
        sub: int,
        data: bytes,
        size: int | None = None,
        with_crc: bool = True,
        losses: Callable[[int], Sequence[int]] = lambda _: (),
    ) -> None:
        """In blocks.

        Args:
            index: of the object.
            sub: of the object.
            data: one byte or more.
            size: told size; None = not told.
            with_crc: the client can do it.
            losses: given the number of the block, which segments do not arrive.
        """
        answer = self.start_blocks(index, sub, size, with_crc)
        most, at, block = answer[4], 0, 0
        crc_on = with_crc and answer[0] & 4
        while at < len(data):
            room = data[at : at + 7 * most]
            pieces = [room[i : i + 7] for i in range(0, len(room), 7)]
            ends = at + len(room) == len(data)
            answer = self.send_block(pieces, ends, losses(block))
            block += 1
            at += 7 * answer[1]
            most = answer[2]
        unused = -len(data) % 7
        told = crc(data) if crc_on else b"\0\0"
        assert self.one(bytes((0xC1 | unused << 2,)), told) == b"\xa1" + bytes(7)
