"""Devices that a good suite must find faulty (mutants) or must spare (variants)."""

from node_model.faults.registry import (
    DRIVE_MUTANTS,
    DRIVE_VARIANTS,
    MODELS,
    MUTANTS,
    VARIANTS,
    Mutant,
    Variant,
    find,
    make,
    mutants_of,
    variants_of,
)

__all__ = [
    "DRIVE_MUTANTS",
    "DRIVE_VARIANTS",
    "MODELS",
    "MUTANTS",
    "VARIANTS",
    "Mutant",
    "Variant",
    "find",
    "make",
    "mutants_of",
    "variants_of",
]
