"""Keypads with one fault each, by the requirement that they violate."""

from node_model.faults.mutants import heartbeat, start
from node_model.faults.parts import Fault

FAULTS: tuple[type[Fault], ...] = (*start.FAULTS, *heartbeat.FAULTS)

__all__ = ["FAULTS"]
