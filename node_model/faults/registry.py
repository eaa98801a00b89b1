"""Every faulty and every different device by its name."""

from __future__ import annotations

import difflib
import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from types import MappingProxyType
from typing import Any, Protocol

from node_model.faults import drive, limit_variants
from node_model.faults.drive_parts import assemble_drive
from node_model.faults.mutants import FAULTS
from node_model.faults.parts import Deviation, Fault, assemble
from node_model.faults.variants import DEVIATIONS
from node_model.keypad import Keypad, Profile
from node_model.node import Panel

_WORD = re.compile(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])")


class Maker(Protocol):
    """Builds the device."""

    def __call__(self, profile: Any, image: bytes = b"") -> Panel:
        """A device with these facts of its kind and this content of its memory."""


class Build(Protocol):
    """Builds a device of a kind with a part in its place."""

    def __call__(self, part: Any, profile: Any, image: bytes = b"") -> Panel:
        """See `assemble`."""


@dataclass(frozen=True, slots=True)
class Mutant:
    """A device with one fault that the suite must find.

    Args:
        name: kebab-case.
        text: the fault in one sentence.
        violates: ids of the requirements it breaks, the plainest first.
        make: builds it.
        kind: of device.
    """

    name: str
    text: str
    violates: tuple[str, ...]
    make: Maker
    kind: str = "keypad"


@dataclass(frozen=True, slots=True)
class Variant:
    """A device that differs and conforms: the suite must spare it.

    Args:
        name: kebab-case.
        text: the difference in one sentence.
        allowed_by: id of the requirement that leaves room for it.
        make: builds it.
        departs: ids of derived requirements whose reading it does not share.
        kind: of device.
    """

    name: str
    text: str
    allowed_by: str
    make: Maker
    departs: tuple[str, ...] = ()
    kind: str = "keypad"


def name_of(part: type) -> str:
    """Kebab-case name of a class: EchoTooFast is "echo-too-fast", NeedsAReset "needs-a-reset"."""
    return _WORD.sub("-", part.__name__).lower()


def text_of(part: type) -> str:
    """Its docstring as one line."""
    return " ".join((part.__doc__ or "").split())


def _mutant(part: type[Fault], build: Build = assemble, kind: str = "keypad") -> Mutant:
    return Mutant(name_of(part), text_of(part), part.violates, partial(build, part), kind)


def _variant(part: type[Deviation], build: Build = assemble, kind: str = "keypad") -> Variant:
    made = partial(build, part)
    return Variant(name_of(part), text_of(part), part.allowed_by, made, part.departs, kind)


MUTANTS: Mapping[str, Mutant] = MappingProxyType({name_of(p): _mutant(p) for p in FAULTS})
"""The keypads with a fault."""

VARIANTS: Mapping[str, Variant] = MappingProxyType(
    {name_of(part): _variant(part) for part in (*DEVIATIONS, *limit_variants.DEVIATIONS)}
)
"""The keypads that differ."""

DRIVE_MUTANTS: Mapping[str, Mutant] = MappingProxyType(
    {name_of(part): _mutant(part, assemble_drive, "drive") for part in drive.FAULTS}
)
DRIVE_VARIANTS: Mapping[str, Variant] = MappingProxyType(
    {name_of(part): _variant(part, assemble_drive, "drive") for part in drive.DEVIATIONS}
)

MODELS: Mapping[str, Mutant | Variant] = MappingProxyType(
    {**MUTANTS, **VARIANTS, **DRIVE_MUTANTS, **DRIVE_VARIANTS}
)
"""All of them; no name is double."""


def mutants_of(kind: str) -> Mapping[str, Mutant]:
    """The devices of a kind that have a fault, by name; none of a kind that has no model."""
    return {"keypad": MUTANTS, "drive": DRIVE_MUTANTS}.get(kind, {})


def variants_of(kind: str) -> Mapping[str, Variant]:
    """The devices of a kind that differ, by name; none of a kind that has no model."""
    return {"keypad": VARIANTS, "drive": DRIVE_VARIANTS}.get(kind, {})


def find(name: str, kind: str) -> Mutant | Variant:
    """The mutant or variant of that name and that kind of device.

    Raises:
        ValueError: there is none; the near misses are named.
    """
    found = MODELS.get(name)
    if found is None:
        known = [each for each, model in MODELS.items() if model.kind == kind]
        near = difflib.get_close_matches(name, known)
        hint = f"did you mean {' or '.join(near)}?" if near else "no name is near it."
        raise ValueError(f"no mutant or variant {name!r}; {hint}")
    if found.kind != kind:
        raise ValueError(f"{name} is a {found.kind}, and the profile is of a {kind}")
    return found


def make(name: str | None, profile: Profile, image: bytes = b"") -> Panel:
    """The right keypad (None), or the mutant or variant of that name.

    Raises:
        ValueError: there is none; the near misses are named.
    """
    if name is None:
        return Keypad(profile, image)
    return find(name, profile.kind).make(profile, image)
