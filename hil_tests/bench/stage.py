"""What stands behind a bench: the virtual world, or a real bus with its drivers."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Protocol

from hil_tests.bench.action import (
    BitRateDriver,
    FaultsDriver,
    HealthDriver,
    KeysDriver,
    LedsDriver,
    PowerDriver,
)
from hil_tests.bus.port import Port
from node_model.frame import Frame

if TYPE_CHECKING:
    from hil_tests.config import Setup


class Stage(Protocol):
    """The part of a bench that differs between virtual and real time.

    A driver that is None is a facility that this bench does not have.
    """

    name: str
    power: PowerDriver | None
    keys: KeysDriver | None
    leds: LedsDriver | None
    faults: FaultsDriver | None
    bitrate: BitRateDriver | None
    health: HealthDriver | None

    virtual: bool
    """Time is virtual: waiting costs nothing, and every start can be had at will."""

    exclusive: bool
    """Nothing but the device and the tester is on the bus."""

    writes_allowed: bool
    """Tests may write the device's non-volatile memory."""

    fades: bool
    """Capacitors keep the device alive for a while when its supply is cut."""

    bit_rate: int
    """At which the tester's end runs now, bit/s."""

    @property
    def port(self) -> Port:
        """The tester's end of the bus."""

    def renew(self, parameters: Setup) -> bool:
        """A fresh device that is set to `parameters`, without power.

        Returns:
            False where this stage cannot (a real one): the bench then does what it can.
        """

    def load(self, frames: Sequence[Frame], share_ppm: int) -> bool:
        """Load the bus with these frames from another station until the next renewal.

        Returns:
            False where this stage cannot load the bus to a known share.
        """

    def end_load(self) -> None:
        """End every load."""

    def disturb(self) -> bool:
        """Put an error frame on the bus now; False where this stage cannot."""

    def check(self) -> None:
        """Whether the bench can go on after an error.

        Raises:
            BenchError: the bus, the control server or the model is gone; with its cause.
        """

    def close(self) -> None:
        """Leave everything as it was found; may be called twice."""
