"""Keypads with one fault each, by the requirement that they violate."""

from node_model.faults.mutants import (
    answers,
    commissioning,
    debounce,
    echo,
    heartbeat,
    keys,
    leds,
    light,
    memory,
    narrow,
    nmt,
    rare,
    request,
    robustness,
    start,
)
from node_model.faults.parts import Fault

FAULTS: tuple[type[Fault], ...] = (
    *commissioning.FAULTS,
    *request.FAULTS,
    *echo.FAULTS,
    *memory.FAULTS,
    *start.FAULTS,
    *nmt.FAULTS,
    *heartbeat.FAULTS,
    *debounce.FAULTS,
    *keys.FAULTS,
    *leds.FAULTS,
    *light.FAULTS,
    *robustness.FAULTS,
    *answers.FAULTS,
    *narrow.FAULTS,
    *rare.FAULTS,
)

__all__ = ["FAULTS"]
