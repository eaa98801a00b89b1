"""The commissioned parameters and their six bytes in 4F8h, 3F8h and memory."""

from __future__ import annotations

from dataclasses import dataclass

from node_model.node import MS

SIZE = 6
NODE_IDS = range(1, 16)

BIT_RATES = {1: 500_000, 2: 250_000, 3: 125_000, 4: 100_000, 5: 50_000, 6: 20_000}
"""Bit-rate code -> bit/s; the source lists code 5 twice with the same rate."""

DEFAULT_BIT_RATE = 250_000
"""What every other code means."""

DEBOUNCE_STEP_NS = 100 * MS


@dataclass(frozen=True, slots=True)
class Parameters:
    """What a keypad is commissioned to.

    Args:
        node_id: 1..15.
        bit_rate_code: 0..255.
        heartbeat_ms: producer time 0..65535 ms; 0 = none.
        sync_time: 0..255 in steps of 10 ms; kept, without effect.
        debounce: 0..255 in steps of 100 ms.
    """

    node_id: int = 1
    bit_rate_code: int = 2
    heartbeat_ms: int = 1000
    sync_time: int = 0
    debounce: int = 1

    @property
    def bit_rate(self) -> int:
        """Bit rate in bit/s."""
        return BIT_RATES.get(self.bit_rate_code, DEFAULT_BIT_RATE)

    def encode(self) -> bytes:
        """The six bytes: id, code, heartbeat big-endian, sync time, debounce."""
        heartbeat = self.heartbeat_ms.to_bytes(2, "big")
        return bytes((self.node_id, self.bit_rate_code, *heartbeat, self.sync_time, self.debounce))

    @classmethod
    def decode(cls, data: bytes) -> Parameters | None:
        """Parameters from six bytes or more; None where they are too few or the id is none."""
        if len(data) < SIZE or data[0] not in NODE_IDS:
            return None
        return cls(data[0], data[1], data[2] << 8 | data[3], data[4], data[5])
