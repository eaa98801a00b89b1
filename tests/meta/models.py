"""The devices that the suite is proved with: faulty ones and different ones of each kind."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

from hil_tests.requirements import Kind as Weight
from hil_tests.requirements import Requirement, load
from node_model.faults import (
    DRIVE_MUTANTS,
    DRIVE_VARIANTS,
    MUTANTS,
    VARIANTS,
    Mutant,
    Variant,
)

HERE = Path(__file__).parent


@dataclass(frozen=True, slots=True)
class Kind:
    """A kind of device, with the models of it.

    Args:
        name: as in profiles; also that of the profile which the models have.
        title: of the right model.
        mutants: the faulty models by name.
        variants: the different ones.
        groups: beginnings of the ids that must have a mutant each, and whose tests must find one.
        reasons: the file of what cannot be helped.
    """

    name: str
    title: str
    mutants: Mapping[str, Mutant]
    variants: Mapping[str, Variant]
    groups: tuple[str, ...]
    reasons: Path

    @property
    def everybody(self) -> tuple[str, ...]:
        """The right model first: what harms it harms everybody."""
        return ("", *self.mutants, *self.variants)

    @property
    def requirements(self) -> Mapping[str, Requirement]:
        """Its catalogue."""
        return load(self.name)

    def proven(self) -> Iterator[str]:
        """The requirements that must have a mutant."""
        for name, each in self.requirements.items():
            if name.startswith(self.groups) and each.kind is not Weight.CHOICE:
                yield name


KINDS: Mapping[str, Kind] = MappingProxyType(
    {
        "keypad": Kind(
            "keypad",
            "the keypad itself",
            MUTANTS,
            VARIANTS,
            ("COM", "NMT", "HB", "KEY", "LED", "ROB"),
            HERE / "matrix.toml",
        ),
        "drive": Kind(
            "drive",
            "the drive itself",
            DRIVE_MUTANTS,
            DRIVE_VARIANTS,
            ("EC", "SYN", "EM"),
            HERE / "matrix-drive.toml",
        ),
    }
)
"""What the matrix tries, by the name of the kind."""
