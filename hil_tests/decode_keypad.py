"""Frames of the keypad in one line of words: keys, LED maps, commissioning.

From the keypad's source; where it lists bit-rate code 5 twice both mean 50 kbit/s.
"""

from __future__ import annotations

from hil_tests.decode_sdo import count_bytes, show_bytes
from node_model.frame import Frame

_BIT_RATES = {1: 500, 2: 250, 3: 125, 4: 100, 5: 50, 6: 20}
_OTHER_BIT_RATE = 250
"""The keypad's codes, in kbit/s; every other code means 250."""

_COMMISSION, _ECHO = 0x4F8, 0x3F8
_KEYPAD_FIXED = {_COMMISSION: "commissioning 4F8h", _ECHO: "echo 3F8h"}
_KEYPAD_MAPS = {
    0x180: "key frame of",
    0x200: "LED steady map to",
    0x300: "LED blink map to",
}
_KEYPAD_IDS = range(1, 16)


def decode_keypad(frame: Frame, node_id: int | None) -> str:
    """What a keypad means by it; "" = nothing of its own."""
    if frame.remote:
        return ""
    name = _KEYPAD_FIXED.get(frame.can_id)
    if name:
        return _commissioning(frame.data, name)
    base, node = frame.can_id & 0x780, frame.can_id & 0x7F
    name = _KEYPAD_MAPS.get(base)
    if name is None or (node != node_id if node_id is not None else node not in _KEYPAD_IDS):
        return ""
    return f"{name} node {node}: {_bits(frame.data)}"


def _commissioning(data: bytes, name: str) -> str:
    if len(data) < 6:
        return f"{name} ({count_bytes(len(data))}, at least 6 are needed): {show_bytes(data)}"
    rate = _BIT_RATES.get(data[1], _OTHER_BIT_RATE)
    heartbeat = int.from_bytes(data[2:4], "big")
    more = f", then {show_bytes(data[6:])}" if data[6:] else ""
    return (
        f"{name}: node id {data[0]}, {rate} kbit/s (code {data[1]}), heartbeat {heartbeat} ms, "
        f"sync {data[4] * 10} ms, debounce {data[5] * 100} ms{more}"
    )


def _bits(data: bytes) -> str:
    return " ".join(f"{byte:08b}" for byte in data) or "no data"
