"""What a device is set to: node id, bit rate and heartbeat, and what its kind has besides.

A keypad is commissioned to the six bytes of the frame 4F8h (keypad specification,
"Inizializzazione"). Bit-rate codes: a table of the tester's own; the model has another, so
that a slip in one shows.
"""

from __future__ import annotations

from types import MappingProxyType
from typing import Annotated, Protocol

import attrs

from hil_tests.clock import MS
from hil_tests.config.rules import Whole

BIT_RATE_CODES = MappingProxyType(
    {1: 500_000, 2: 250_000, 3: 125_000, 4: 100_000, 5: 50_000, 6: 20_000}
)
"""bit/s by code."""

OTHER_BIT_RATE = 250_000
"""Every code that the table lacks."""

NODE_IDS = range(1, 16)
_DEBOUNCE_STEP_NS = 100 * MS

CIA301_NODE_IDS = range(1, 128)
"""CiA 301 4.2.0, 7.1.3: node ids of a CANopen network."""

NodeId = Annotated[int, Whole(NODE_IDS[0], NODE_IDS[-1])]
AnyNodeId = Annotated[int, Whole(CIA301_NODE_IDS[0], CIA301_NODE_IDS[-1])]
BitRate = Annotated[int, Whole(10_000, 1_000_000, "bit/s")]
Byte = Annotated[int, Whole(0, 255)]
Milliseconds = Annotated[int, Whole(0, 65535, "ms")]
Steps10ms = Annotated[int, Whole(0, 255, "x 10 ms")]
Steps100ms = Annotated[int, Whole(0, 255, "x 100 ms")]


class Setup(Protocol):
    """What is known of every device that can be tested: where and how it speaks."""

    @property
    def node_id(self) -> int:
        """1..127."""

    @property
    def bit_rate(self) -> int:
        """bit/s."""

    @property
    def heartbeat_ms(self) -> int:
        """Heartbeat period; 0 = no heartbeat."""

    @property
    def heartbeat_ns(self) -> int:
        """The same in ns."""

    def __hash__(self) -> int:
        """It is a value, and never changes."""

    def __str__(self) -> str:
        """All of it, for people."""


@attrs.frozen
class Cia301Parameters:
    """What a device with an object dictionary starts with."""

    node_id: AnyNodeId
    bit_rate: BitRate
    heartbeat_ms: Milliseconds

    @property
    def heartbeat_ns(self) -> int:
        """Heartbeat period in ns; 0 = no heartbeat."""
        return self.heartbeat_ms * MS

    def __str__(self) -> str:
        return _where(self)


@attrs.frozen
class Parameters:
    """One complete set of parameters.

    A file is held to the ranges; an instance made in code is not, because tests send
    values outside them on purpose.
    """

    node_id: NodeId
    bit_rate_code: Byte
    heartbeat_ms: Milliseconds
    sync_time: Steps10ms
    debounce: Steps100ms

    @property
    def bit_rate(self) -> int:
        """bit/s that the code stands for."""
        return BIT_RATE_CODES.get(self.bit_rate_code, OTHER_BIT_RATE)

    @property
    def heartbeat_ns(self) -> int:
        """Heartbeat period in ns; 0 = no heartbeat."""
        return self.heartbeat_ms * MS

    @property
    def debounce_ns(self) -> int:
        """Debounce time of press and release in ns; 0 = no filtering."""
        return self.debounce * _DEBOUNCE_STEP_NS

    def __str__(self) -> str:
        return f"{_where(self)}, debounce {self.debounce_ns // MS} ms"


def _where(setup: Setup) -> str:
    """What every device has, for people."""
    return f"node id {setup.node_id}, {setup.bit_rate} bit/s, heartbeat {setup.heartbeat_ms} ms"


@attrs.frozen
class PartialParameters:
    """What a bench file knows of a device's parameters; None = not known."""

    bit_rate_code: Byte | None = None
    heartbeat_ms: Milliseconds | None = None
    sync_time: Steps10ms | None = None
    debounce: Steps100ms | None = None

    def complete(self, node_id: int | None) -> Parameters | None:
        """The whole set of a keypad, or None where a part of it is not known."""
        known = {"node_id": node_id, **attrs.asdict(self)}
        values = {name: value for name, value in known.items() if value is not None}
        return Parameters(**values) if len(values) == len(known) else None

    def strange_to_cia301(self) -> list[str]:
        """What stands in the file and no device with an object dictionary has."""
        return [
            name
            for name, value in attrs.asdict(self).items()
            if value is not None and name != "heartbeat_ms"
        ]
