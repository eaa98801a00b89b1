"""The drive as a whole: a CiA 301 device with an axis."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

from node_model.composition import Facts, Parts
from node_model.device import Cia301Device
from node_model.drive.axis import Axis
from node_model.drive.profile import Profile
from node_model.nmt import NmtCommand
from node_model.node import MS, US, Frames, S
from node_model.sdo import SdoSettings
from node_model.sheets import entries_of

TURNAROUND_NS = 300 * US
"""From a SYNC to TPDO 1, and from each to the next: four of them need more than one ms."""

SDO = SdoSettings(time_out_ns=S, block_time_out_ns=100 * MS, segment_gap_ns=500 * US)
"""Segments of a block leave room for what has a higher identifier."""


@dataclass(frozen=True, slots=True)
class DriveParts(Parts):
    """The classes a drive is made of."""

    axis: type[Axis] = Axis


def facts_of(profile: Profile) -> Facts:
    """What a drive with that profile is."""
    return Facts(
        profile.name,
        profile.factory.node_id,
        profile.factory.bit_rate,
        partial(entries_of, profile.eds),
        window_unit_ns=profile.window_unit_ns,
        turnaround_ns=TURNAROUND_NS,
        sdo=SDO,
        faults=profile.faults,
    )


class Drive(Cia301Device):
    """A drive that keeps the laws of a node.

    Args:
        profile: facts of the hardware.
        image: content of its memory, e.g. from an earlier life; b"" = as it left the factory.
        parts: the classes it is made of.
    """

    def __init__(
        self, profile: Profile, image: bytes = b"", parts: DriveParts | None = None
    ) -> None:
        parts = parts or DriveParts()
        self.axis = parts.axis(profile, self.tell)
        super().__init__(facts_of(profile), image, parts)

    def compose(self, image: bytes) -> None:
        """The axis works on the same objects."""
        super().compose(image)
        self.axis.attach(self.od)

    def tell(self, index: int, sub: int, now: int) -> None:
        """The axis has changed an object: PDOs may carry it."""
        self.services.pdo.written(index, sub, now)
        self.agenda.stir()

    def power_on(self, now: int) -> Frames:
        """The axis stands still, disabled."""
        if not self.powered:
            frames = super().power_on(now)
            self.axis.reset(now)
            return frames
        return super().power_on(now)

    def reset(self, command: NmtCommand, now: int) -> Frames:
        """Reset node ends a motion, reset communication does not."""
        frames = super().reset(command, now)
        if command is NmtCommand.RESET_NODE:
            self.axis.reset(now)
        return frames

    def before(self, now: int) -> None:
        """The position is as it is now."""
        self.axis.update(now)

    def applied(self, index: int, sub: int, now: int) -> None:
        """An RPDO has written an object of the axis."""
        self.axis.written(index, sub, now)

    def report(self, now: int) -> Frames:
        """Errors that went meanwhile are no errors of the axis any more."""
        for name in self.axis.codes.keys() - self.active:
            self.axis.heal(name)
        return super().report(now)

    def occur(self, name: str, now: int) -> Frames:
        """The axis stops; then the error is told."""
        self.axis.fail(name, self.facts.faults[name].code, now)
        return super().occur(name, now)

    def heal(self, name: str, now: int) -> Frames:
        """The axis can be started again, once the fault is acknowledged."""
        self.axis.heal(name)
        return super().heal(name, now)
