"""The record of a run on disk: a pcapng file, written frame by frame.

Wireshark and tshark show it as CANopen (`tshark -d can.subdissector,canopen -r FILE`);
`read_pcapng` gives back exactly what was written. Laws: entries stand in the order in
which they became known; stamps are integer ns, in virtual time since 1970; a frame of the
tester is outbound; where a stamp is in doubt, the interface of the frame or a comment says
by how much.
"""

from __future__ import annotations

import errno
from io import FileIO
from pathlib import Path
from types import TracebackType
from typing import Self

from hil_tests.errors import BenchError
from hil_tests.reporting import journal
from hil_tests.reporting import pcapng_layout as layout
from hil_tests.reporting.mapped import MappedFile
from hil_tests.reporting.pcapng_frames import Recipes, direction_of, header_of
from hil_tests.reporting.pcapng_reader import read_pcapng
from hil_tests.trace import OWN, Columns, Entry, Mark, Sighting

__all__ = ["PcapngSink", "read_pcapng"]

_JOURNAL_TEXT = "what the bench did and saw, and verdicts"
_MOST_INTERFACES = 16
"""A port knows a few doubts; one interface for each costs a frame nothing."""

_NO_DOUBT = 0
_JOURNAL = 1


def _open(path: Path, flush: bool) -> MappedFile | FileIO:
    """The file; one that cannot be mapped is written piece by piece in any case."""
    if not flush:
        try:
            return MappedFile(path)
        except OSError as error:
            if error.errno not in {errno.ENODEV, errno.EOPNOTSUPP, errno.EINVAL}:
                raise
    return path.open("wb", buffering=0)


class PcapngSink:
    """Writes a trace as it comes.

    Args:
        path: the file; an old one is overwritten.
        interface: name of the CAN interface, e.g. "vcan0".
        clock: which clock stamps the frames, for people.
        flush: hand each entry to the operating system by itself, as a live reader of the file
            wants it; else it goes through shared memory, which is quick. A killed process
            loses nothing either way.

    Raises:
        BenchError: the file cannot be written.
    """

    def __init__(self, path: Path, *, interface: str, clock: str, flush: bool) -> None:
        self.path = path
        self._name = interface
        self._clock = clock
        self._recipes = {0: Recipes(_NO_DOUBT)}
        try:
            self._file = _open(path, flush)
        except OSError as error:
            raise self._lost(error) from error
        try:
            self._put(self._head())
        except BenchError:
            self._file.close()
            raise

    def _head(self) -> bytes:
        return (
            layout.section()
            + layout.interface(layout.CAN_SOCKETCAN, self._name, self._clock)
            + layout.interface(layout.UPPER_PDU, journal.INTERFACE, _JOURNAL_TEXT)
        )

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()

    def write(self, entry: Entry | Mark) -> None:
        """Store one entry, or a note of the judge.

        Raises:
            BenchError: the disk is full, or gone.
            TypeError, ValueError: the detail of a stimulus is no plain data.
        """
        if not isinstance(entry, Sighting):
            self._note(entry)
            return
        frame, at, doubt_ns, own = entry
        head = frame.head | OWN if own else frame.head
        recipes = self._recipes.get(doubt_ns)
        if recipes is None and (recipes := self._new_place(doubt_ns)) is None:
            self._commented(head, entry)
            return
        pack, start, header, shift, end = recipes[head]
        self._put(pack(start, at, header, frame.body << shift, end))

    def write_all(self, columns: Columns) -> None:
        """As `write`, of each frame in these columns.

        Raises:
            BenchError: the disk is full, or gone.
        """
        heads, bodies, instants, doubts = columns
        doubt_ns = doubts[0] if doubts else 0
        recipes = self._recipes.get(doubt_ns)
        if recipes is None:
            recipes = self._new_place(doubt_ns)
        if recipes is None or doubts.count(doubt_ns) < len(doubts):
            for sighting in columns.sightings():
                self.write(sighting)
            return
        blocks = [
            pack(start, at, header, body << shift, end)
            for (pack, start, header, shift, end), at, body in zip(
                map(recipes.__getitem__, heads), instants, bodies, strict=True
            )
        ]
        self._put(b"".join(blocks))

    def restart(self) -> None:
        """Begin again: what was written is gone, as if it had never been.

        Raises:
            BenchError: the disk is full, or gone.
        """
        self._recipes = {0: Recipes(_NO_DOUBT)}
        try:
            if isinstance(self._file, MappedFile):
                self._file.rewind()
            else:
                self._file.seek(0)
                self._file.truncate()
        except OSError as error:
            raise self._lost(error) from error
        self._put(self._head())

    def rename(self, path: Path) -> None:
        """The file is called so from now on; one of that name is gone.

        Raises:
            BenchError: it cannot be.
        """
        try:
            self.path.replace(path)
        except OSError as error:
            raise self._lost(error) from error
        self.path = path

    def close(self) -> None:
        """Hand over what is in memory; a second call does nothing."""
        try:
            self._file.close()
        except OSError as error:
            raise self._lost(error) from error

    def _note(self, note: journal.Note) -> None:
        packet, text = journal.told(note)
        if len(packet) > layout.LARGEST_BLOCK // 2:
            raise ValueError(f"{len(packet)} bytes are too many for one note in a trace")
        comment = text.encode("utf-8", "replace")
        stamp = journal.stamp(note)
        self._put(layout.packet(_JOURNAL, stamp, packet, (layout.COMMENT, comment)))

    def _new_place(self, doubt_ns: int) -> Recipes | None:
        """An interface for frames of that doubt, while there are few."""
        place = len(self._recipes) + 1
        if place > _MOST_INTERFACES:
            return None
        doubt = layout.DOUBT_TEXT.format(doubt_ns)
        link = layout.CAN_SOCKETCAN
        self._put(layout.interface(link, self._name, f"{self._clock}; {doubt}"))
        return self._recipes.setdefault(doubt_ns, Recipes(place))

    def _commented(self, head: int, sighting: Sighting) -> None:
        """A frame of rare doubt."""
        frame, at, doubt_ns, _ = sighting
        body = header_of(head) + frame.data
        doubt = layout.DOUBT_TEXT.format(doubt_ns).encode()
        flags = direction_of(head).to_bytes(4, "big")
        self._put(
            layout.packet(_NO_DOUBT, at, body, (layout.EPB_FLAGS, flags), (layout.COMMENT, doubt))
        )

    def _put(self, block: bytes) -> None:
        try:
            written = self._file.write(block)
            while written < len(block):
                block = block[written:]
                written = self._file.write(block)
        except OSError as error:
            raise self._lost(error) from error

    def _lost(self, error: OSError) -> BenchError:
        why = error.strerror or str(error)
        return BenchError(
            f"trace {self.path}: {why}; make room there or choose another place "
            "with --can-reports DIR"
        )
