"""What a keypad is commissioned to: the six bytes of the frame 4F8h, as values.

Keypad specification, "Inizializzazione". Bit-rate codes: a table of the tester's own;
the model has another, so that a slip in one shows.
"""

from __future__ import annotations

from types import MappingProxyType
from typing import Annotated

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

NodeId = Annotated[int, Whole(NODE_IDS[0], NODE_IDS[-1])]
Byte = Annotated[int, Whole(0, 255)]
Milliseconds = Annotated[int, Whole(0, 65535, "ms")]
Steps10ms = Annotated[int, Whole(0, 255, "x 10 ms")]
Steps100ms = Annotated[int, Whole(0, 255, "x 100 ms")]


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


@attrs.frozen
class PartialParameters:
    """What a bench file knows of a board's parameters; None = not known."""

    bit_rate_code: Byte | None = None
    heartbeat_ms: Milliseconds | None = None
    sync_time: Steps10ms | None = None
    debounce: Steps100ms | None = None

    def complete(self, node_id: int | None) -> Parameters | None:
        """The whole set, or None where a part of it is not known."""
        known = {"node_id": node_id, **attrs.asdict(self)}
        values = {name: value for name, value in known.items() if value is not None}
        return Parameters(**values) if len(values) == len(known) else None
