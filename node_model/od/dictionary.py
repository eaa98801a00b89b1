"""The object dictionary: what SDO and PDO read and write, and who is told.

Laws: every change goes through `write` (a client's, with all checks) or `put` (the
device's own, unchecked); a refused write changes nothing. A guard can refuse a client's
value before it is taken, a read guard an upload; an observer is told after a change, and
before the client has its answer. An observer returns no frames: what a change causes
becomes due in its own service, at the instant that it is told.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from math import isnan

from node_model.od.abort import AbortCode, SdoAbort
from node_model.od.entry import Entry
from node_model.od.types import DataType

Guard = Callable[[int, bytes], None]
"""Called with sub-index and bytes before a client's write; raises SdoAbort to refuse."""

ReadGuard = Callable[[int], None]
"""Called with sub-index before a client's read; raises SdoAbort to refuse."""

Observer = Callable[[int, int], None]
"""Called with sub-index and instant after a client's write was taken."""

Witness = Callable[[int, bool], None]
"""Called with index, and whether the value is another one, after any client's write was taken."""


def key_of(index: int, sub: int) -> int:
    """The key of an entry in `ObjectDictionary.entries`."""
    return index << 8 | sub


class ObjectDictionary:
    """Entries by index and sub-index.

    Args:
        entries: in any order; their values are theirs from now on.
    """

    def __init__(self, entries: Iterable[Entry]) -> None:
        self.entries: dict[int, Entry] = {e.index << 8 | e.sub: e for e in entries}
        self.indices: frozenset[int] = frozenset([e.index for e in self.entries.values()])
        self._guards: dict[int, list[Guard]] = {}
        self._read_guards: dict[int, list[ReadGuard]] = {}
        self._observers: dict[int, list[Observer]] = {}
        self._witnesses: list[Witness] = []

    # What the device itself does.

    def __contains__(self, index: int) -> bool:
        return index in self.indices

    def has(self, index: int, sub: int = 0) -> bool:
        """Whether there is such an entry."""
        return key_of(index, sub) in self.entries

    def get(self, index: int, sub: int = 0) -> bytes:
        """The bytes of an entry that must be there."""
        return self.entries[key_of(index, sub)].value

    def put(self, index: int, sub: int, data: bytes) -> None:
        """Set an entry that must be there; nobody is asked or told."""
        self.entries[key_of(index, sub)].value = data

    def number(self, index: int, sub: int = 0, default: int = 0) -> int:
        """An integer entry; `default` where there is none."""
        entry = self.entries.get(index << 8 | sub)
        if entry is None:
            return default
        kind = entry.data_type
        if kind.is_real:
            return int(kind.unpack(entry.value))
        return int.from_bytes(entry.value, "little", signed=kind.is_signed)

    def put_number(self, index: int, sub: int, value: float) -> None:
        """Set a numeric entry that must be there; nobody is asked or told."""
        entry = self.entries[key_of(index, sub)]
        entry.value = entry.data_type.pack(value)

    def guard(self, index: int, guard: Guard) -> None:
        """Ask `guard` before a client writes any sub-index of `index`."""
        self._guards.setdefault(index, []).append(guard)

    def guard_reading(self, index: int, guard: ReadGuard) -> None:
        """Ask `guard` before a client reads any sub-index of `index`."""
        self._read_guards.setdefault(index, []).append(guard)

    def observe(self, index: int, observer: Observer) -> None:
        """Tell `observer` after a client wrote any sub-index of `index`."""
        self._observers.setdefault(index, []).append(observer)

    def witness(self, witness: Witness) -> None:
        """Tell `witness` after a client wrote anything, once all observers were told."""
        self._witnesses.append(witness)

    # What a client may do.

    def find(self, index: int, sub: int) -> Entry:
        """The entry that a client names.

        Raises:
            SdoAbort: no such object, or no such sub-index.
        """
        entry = self.entries.get(index << 8 | sub)
        if entry is None:
            known = index in self.indices
            raise SdoAbort(AbortCode.NO_SUB_INDEX if known else AbortCode.NO_OBJECT)
        return entry

    def read(self, index: int, sub: int) -> bytes:
        """What a client's upload gets.

        Raises:
            SdoAbort: no such entry, it is write-only, or refused by a guard.
        """
        entry = self.find(index, sub)
        if not entry.access.readable:
            raise SdoAbort(AbortCode.WRITE_ONLY)
        if index in self._read_guards:
            for guard in self._read_guards[index]:
                guard(sub)
        return entry.value

    def accepts(self, index: int, sub: int, size: int | None = None) -> Entry:
        """Whether a client's download could succeed, as far as can be known before its data.

        Args:
            index: of the entry.
            sub: of the entry.
            size: how many bytes will come; None = not told.

        Raises:
            SdoAbort: no such entry, read-only, or the wrong length.
        """
        entry = self.find(index, sub)
        if not entry.access.writable:
            raise SdoAbort(AbortCode.READ_ONLY)
        if size is not None:
            _check_length(entry, size)
        return entry

    def write(self, index: int, sub: int, data: bytes, now: int) -> None:
        """What a client's download does.

        Raises:
            SdoAbort: no such entry, read-only, wrong length, out of range, or refused by a
                guard; nothing has changed then.
        """
        entry = self.accepts(index, sub)
        kind = entry.data_type
        if len(data) != kind.size:
            _check_length(entry, len(data))
        if entry.high is not None or entry.low is not None or kind is DataType.BOOLEAN:
            _check_range(entry, data)
        if index in self._guards:
            for guard in self._guards[index]:
                guard(sub, data)
        before, entry.value = entry.value, data
        if index in self._observers:
            for observer in self._observers[index]:
                observer(sub, now)
        for witness in self._witnesses:
            witness(index, data != before)


def _check_length(entry: Entry, length: int) -> None:
    size = entry.data_type.size
    most = size or entry.most
    if most and length > most:
        raise SdoAbort(AbortCode.TOO_LONG)
    if size and length < size:
        raise SdoAbort(AbortCode.TOO_SHORT)


def _check_range(entry: Entry, data: bytes) -> None:
    low, high = entry.low, entry.high
    if high is None and entry.data_type is DataType.BOOLEAN:
        high = 1
    value = entry.data_type.unpack(data)
    if isnan(value):
        raise SdoAbort(AbortCode.VALUE)
    if high is not None and value > high:
        raise SdoAbort(AbortCode.TOO_HIGH)
    if low is not None and value < low:
        raise SdoAbort(AbortCode.TOO_LOW)
