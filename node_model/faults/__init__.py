"""Devices that a good suite must find faulty (mutants) or must spare (variants)."""

from node_model.faults.registry import MUTANTS, VARIANTS, Mutant, Variant, find, make

__all__ = ["MUTANTS", "VARIANTS", "Mutant", "Variant", "find", "make"]
