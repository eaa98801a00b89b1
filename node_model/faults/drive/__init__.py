"""Drives with one fault each, by the service that is wrong; and drives that differ."""

from node_model.faults.drive import (
    application,
    basics,
    consuming,
    edges,
    emergencies,
    error_field,
    guarding,
    heartbeat,
    lss,
    network,
    objects,
    pdo_parameters,
    rpdo,
    sdo,
    sdo_blocks,
    storing,
    sync,
    tpdo,
    variants,
)
from node_model.faults.parts import Deviation, Fault

FAULTS: tuple[type[Fault], ...] = (
    *network.FAULTS,
    *heartbeat.FAULTS,
    *guarding.FAULTS,
    *consuming.FAULTS,
    *emergencies.FAULTS,
    *error_field.FAULTS,
    *application.FAULTS,
    *sync.FAULTS,
    *rpdo.FAULTS,
    *tpdo.FAULTS,
    *pdo_parameters.FAULTS,
    *objects.FAULTS,
    *sdo.FAULTS,
    *sdo_blocks.FAULTS,
    *storing.FAULTS,
    *lss.FAULTS,
    *edges.FAULTS,
    *basics.FAULTS,
)
DEVIATIONS: tuple[type[Deviation], ...] = variants.DEVIATIONS

__all__ = ["DEVIATIONS", "FAULTS"]
