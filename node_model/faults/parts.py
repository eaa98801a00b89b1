"""What a faulty or a different device says about itself, and how a keypad is built from it.

A fault and a deviation are classes: each replaces one part of the keypad (or stands between
it and the wire) and overrides one seam. Their docstring is their text for people.
"""

from __future__ import annotations

from typing import ClassVar

from node_model.faults.link import Effect, PanelLink
from node_model.keypad import Keypad, Parts, Profile
from node_model.keypad.commissioning import Commissioning
from node_model.keypad.operation import Operation
from node_model.node import Panel
from node_model.storage import RecordStore


class Fault:
    """Mixed into the part of a device that violates its requirements."""

    violates: ClassVar[tuple[str, ...]] = ()
    """Ids of the requirements that the device breaks, the plainest first."""


class Deviation:
    """Mixed into the part of a device that differs and still conforms."""

    allowed_by: ClassVar[str] = ""
    """Id of the requirement that leaves room for it."""

    departs: ClassVar[tuple[str, ...]] = ()
    """Ids of derived requirements whose reading it does not share (observations)."""


def assemble(part: type[Fault | Deviation], profile: Profile, image: bytes = b"") -> Panel:
    """A keypad in which `part` takes the place of the part that it is derived from.

    Raises:
        TypeError: it is derived from none.
    """
    if issubclass(part, Keypad):
        return part(profile, image)
    if issubclass(part, Operation):
        return Keypad(profile, image, Parts(operation=part))
    if issubclass(part, Commissioning):
        return Keypad(profile, image, Parts(commissioning=part))
    if issubclass(part, RecordStore):
        return Keypad(profile, image, Parts(store=part))
    if issubclass(part, Effect):
        return PanelLink(Keypad(profile, image), part())
    raise TypeError(
        f"{part.__name__} replaces no part of a keypad; derive it from Keypad, Operation, "
        "Commissioning, RecordStore or Effect"
    )
