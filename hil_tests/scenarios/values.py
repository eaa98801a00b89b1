"""Special values for scenarios: every byte of every field, limits, sums, and long counts.

Nothing here knows a fault. Faults of values hide where programmers put them: at a limit and
beside it, at powers of two, where two fields meet, where a checksum comes out as zero, at a
blank memory, or at no value that anybody would think of, which only trying all of them finds.
Faults of counts hide until a counter is full.
"""

from __future__ import annotations

from functools import cache

from hil_tests.clock import MS

BYTES = 256

_NEAR_POWERS = tuple(
    sorted({(1 << power) + by for power in range(17) for by in (-1, 0, 1)} & set(range(1 << 16)))
)
"""0, 1, and each power of two of 16 bits with its neighbours."""

_CALM_MS = (100, 200, 250, 1000)
"""Heartbeat times that every bit rate carries, and that cost little to watch."""

_FAST = (1, 2, 3)
"""Bit-rate codes that carry the shortest heartbeats."""

_SLOW = (4, 5, 6)

_UNLIKELY = (2, 3, 7)
"""Debounce times that nobody takes another one for: or it might have been kept (COM-06)."""

_SHOW_NS = 150 * MS
"""After the debounce time: scan, key frame, and some more."""

_BEATS = 21
"""So many beats have a mean."""

_LONGEST_MEAN_NS = 3_000 * MS

Row = tuple[int, int, int, int, int]
"""Node id, bit-rate code, heartbeat in ms, sync time, debounce time."""


def _of_code(byte: int) -> Row:
    """Each bit-rate code, with heartbeat times near powers of two."""
    beat_ms = 200 if byte in _SLOW else _NEAR_POWERS[byte * 7 % len(_NEAR_POWERS)]
    return 2, byte, beat_ms, byte * 77 % BYTES, _UNLIKELY[byte % 3]


def _of_beat(byte: int) -> Row:
    """Each high byte of the heartbeat time, the low one full; and each sync time."""
    return 4, _FAST[byte % 3], byte << 8 | 0xFF, byte, _UNLIKELY[byte % 3]


def _of_debounce(byte: int) -> Row:
    """Each debounce time."""
    return 9, _FAST[byte % 3], (0, 1000)[byte % 2], (0, 1, byte)[byte % 3], byte


def _neutral(byte: int) -> Row:
    """A sync time that makes the sum of all bytes zero, or their exclusive or."""
    code, beat_ms, debounce = _FAST[byte % 3], _CALM_MS[byte // 3 % 4], _UNLIKELY[byte % 3]
    node_id, high, low = 1 + byte % 15, beat_ms >> 8, beat_ms & 0xFF
    total = -(node_id + code + high + low + debounce) % BYTES
    odd = node_id ^ code ^ high ^ low ^ debounce
    return node_id, code, beat_ms, odd if byte & 1 else total, debounce


_SWEEPS = (_of_code, _of_beat, _of_debounce, _neutral)

VALUES = len(_SWEEPS) * BYTES
"""How many sets of parameters there are."""


@cache
def value(number: int) -> str:
    """The bytes of 4F8h with special parameters, in hex; the same for the same number."""
    byte, sweep = divmod(number % VALUES, len(_SWEEPS))
    node_id, code, beat_ms, sync_time, debounce = _SWEEPS[sweep](byte)
    data = bytes((node_id, code, beat_ms >> 8, beat_ms & 0xFF, sync_time, debounce))
    return data.hex().upper()


def key_span_ns(request: str) -> int:
    """How long a key of a device with these parameters must stay as it is to be shown."""
    return int(request[10:12], 16) * 100 * MS + _SHOW_NS


def beats_span_ns(request: str) -> int:
    """How long its heartbeat takes to show its period: the mean too, where that is short.

    The beat after a change of state counts for nothing: it may come sooner (HB-04).
    """
    beat_ns = int(request[4:8], 16) * MS
    return max(4 * beat_ns, _SHOW_NS, min(_BEATS * beat_ns, _LONGEST_MEAN_NS))


LSS = tuple(
    f"send 7E5#{data:<016}"
    for data in (
        *("0400", "0401"),
        *("11", "13", "15", "17"),
        *("40", "41", "42", "43"),
        *("46", "47", "48", "49", "4A", "4B", "4C"),
        *("5100000000800000", "51"),
        *("5A", "5B", "5C", "5D", "5E"),
    )
)
"""Every request of a master to LSS slaves (CiA 305 3.0.0, 5)."""

MANY = 261
"""More than a counter of eight bits holds; odd, so that acts in turn do not end as they began."""

TALLIES = (
    ("flip 1",),
    ("flip 1", "flip 100"),
    ("nmt stop", "nmt start"),
    ("nmt pre-operational all", "nmt start all"),
    ("nmt start",),
    ("nmt reset-communication",),
    ("led 0F", "led F0"),
    ("blink 55", "blink AA"),
    ("led 01", "blink 80"),
    ("nmt stop other",),
    ("send +600#4000100000000000",),
    ("send 080#",),
    ("send 123#060200320001",),
    ("send 4F8#060200320001",),
)
"""What is done again and again, in turn."""
