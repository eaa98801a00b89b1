"""Recordings in any form that we read: ours, and those of other programs.

The form is told by what a file begins with, not by its name. BLF and ASC are read by
python-can, candump and pcapng here. Laws: what is wrong is a `RecordUnreadable` with file,
place and remedy, whatever the bytes; memory stays bounded, also with a file that claims to
hold more than it does.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hil_tests.clock import MS, show_span
from hil_tests.reporting.candump import read_candump
from hil_tests.reporting.files import RecordUnreadable
from hil_tests.reporting.frames import Logged
from hil_tests.reporting.pcapng_reader import read_pcapng
from hil_tests.trace import BusEvent, EventKind, Mark, Moment, Sighting
from node_model.frame import Frame

if TYPE_CHECKING:
    import can

BACK_NS = 10 * MS
"""Two ways through an adapter may swap frames by a little; further back goes no clock."""

_BLF_OBJECT = struct.Struct("<4sHHLL")
_BLF_CONTAINER = 10
_BLF_CONTAINER_HEAD = 32
_LARGEST_CONTAINER = 1 << 24
"""Vector's own tools and python-can write 128 KiB a container."""
_LONGEST_TEXT = 120
_OPENED: Mapping[bool, Any] = {
    True: {"mode": "rb"},
    False: {"mode": "r", "encoding": "utf-8", "errors": "replace"},
}


def is_pcapng(path: Path) -> bool:
    """Whether a file begins as a pcapng file does.

    Raises:
        RecordUnreadable: there is no such file.
    """
    return _head(path)[:4] == b"\x0a\x0d\x0d\x0a"


def read_foreign(path: Path, channel: str = "") -> Iterator[Sighting | BusEvent]:
    """Frames and bus events of a recording, in its order.

    Args:
        path: candump, BLF, ASC or pcapng.
        channel: only this one; "" = the only one that it holds.

    Raises:
        RecordUnreadable: no recording, damage in it, stamps that go back, or several
            channels where none is chosen.
    """
    chosen, last, count = channel, None, 0
    for entry, name, place in _read(path):
        if channel and name != channel:
            continue
        chosen = chosen or name
        where = f"recording {path}, {place}"
        if name != chosen:
            raise RecordUnreadable(
                f"{where}: a frame of channel {name!r} among those of {chosen!r}; choose one"
                " with --channel"
            )
        if last is not None and entry.at < last - BACK_NS:
            raise RecordUnreadable(
                f"{where}: the stamp is {show_span(last - entry.at)} earlier than the one before;"
                " cut the file there, or sort its lines by their stamps"
            )
        last = entry.at if last is None else max(last, entry.at)
        count += 1
        yield entry
    if not count:
        of = f" of channel {channel!r}" if channel else ""
        raise RecordUnreadable(
            f"recording {path}: no CAN frame{of} in it; candump -L, BLF, ASC and pcapng are read"
        )


def _head(path: Path) -> bytes:
    try:
        with path.open("rb") as file:
            return file.read(64)
    except OSError as error:
        raise RecordUnreadable(f"recording {path}: {error.strerror or error}") from error


def _read(path: Path) -> Iterator[Logged]:
    head = _head(path)
    if head[:4] == b"\x0a\x0d\x0d\x0a":
        return _pcapng(path)
    if head[:4] == b"LOGG":
        _check_containers(path)
        return _through_can(path, "BLFReader", binary=True)
    if head.lstrip().lower().startswith((b"date ", b"base ", b"//", b";")):
        return _through_can(path, "ASCReader", relative_timestamp=True)
    return read_candump(path)


def _pcapng(path: Path) -> Iterator[Logged]:
    for number, entry in enumerate(read_pcapng(path), 1):
        if not isinstance(entry, Moment | Mark):
            yield Logged(entry, "pcapng", f"entry {number}")


def _check_containers(path: Path) -> None:
    """Refuse a BLF file that would not fit into memory once it is unpacked."""
    with path.open("rb") as file:
        file.seek(int.from_bytes(file.read(8)[4:], "little"))
        while len(head := file.read(_BLF_OBJECT.size)) == _BLF_OBJECT.size:
            mark, _, _, size, kind = _BLF_OBJECT.unpack(head)
            where = f"recording {path}, offset {file.tell() - len(head)}"
            if mark != b"LOBJ" or not _BLF_CONTAINER_HEAD <= size <= _LARGEST_CONTAINER:
                raise RecordUnreadable(
                    f"{where}: no BLF object; the file is damaged from there on"
                )
            rest = file.read(size - len(head))
            packed = rest[_BLF_CONTAINER_HEAD - len(head) :]
            if kind == _BLF_CONTAINER and _unpacked_bytes(packed) > _LARGEST_CONTAINER:
                raise RecordUnreadable(f"{where}: a container too large to be one of a recording")
            file.read(size % 4)


def _unpacked_bytes(packed: bytes) -> int:
    """How long it is unpacked; one more than allowed where it is longer."""
    try:
        return len(zlib.decompressobj().decompress(packed, _LARGEST_CONTAINER + 1))
    except zlib.error:
        return len(packed)  # not packed, or damaged: the reader will tell


def _through_can(
    path: Path, reader: str, *, binary: bool = False, **options: bool
) -> Iterator[Logged]:
    """The frames of a file that python-can reads; whatever it raises is damage of the file."""
    import can  # noqa: PLC0415 - 0.2 s, only where such a file is read

    make: Callable[..., Any] = getattr(can, reader)
    number = 0
    try:
        with path.open(**_OPENED[binary]) as file, make(file, **options) as messages:
            for message in messages:
                number += 1
                yield Logged(_entry(message), str(message.channel), f"frame {number}")
    except RecordUnreadable:
        raise
    except Exception as error:  # readers raise whatever their bytes lead to
        said = f"{type(error).__name__}: {error}"[:_LONGEST_TEXT]
        raise RecordUnreadable(
            f"recording {path}, after frame {number}: python-can cannot read on ({said}); export"
            " it anew, or cut the file there"
        ) from error


def _entry(message: can.Message) -> Sighting | BusEvent:
    at = round(message.timestamp * 1_000_000) * 1000  # a float has no more digits
    if message.is_error_frame:
        return BusEvent(EventKind.ERROR, at)
    if message.is_fd:
        return BusEvent(EventKind.FD_FRAME, at, f"identifier {message.arbitration_id:03X}h")
    remote, data = message.is_remote_frame, bytes(message.data or b"")
    frame = Frame(
        message.arbitration_id,
        b"" if remote else data,
        remote,
        message.is_extended_id,
        message.dlc if remote or len(data) == 8 else len(data),
    )
    return Sighting(frame, at, 0, not message.is_rx)
