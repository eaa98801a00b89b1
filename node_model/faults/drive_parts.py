"""How a drive is built from a fault or a deviation: which part it takes the place of."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from types import MappingProxyType
from typing import Any

from node_model.drive import Axis, Drive, DriveParts, Profile
from node_model.emcy import EmergencyProducer
from node_model.faults.link import DeviceLink, Effect
from node_model.faults.parts import Deviation, Fault
from node_model.guarding import NodeGuarding
from node_model.heartbeat import HeartbeatService
from node_model.heartbeat_consumer import HeartbeatConsumer
from node_model.line_settings import LineSettings
from node_model.lss import LssSlave
from node_model.node import Panel
from node_model.nonvolatile import NonVolatile
from node_model.pdo import PdoService, Rpdo, Tpdo
from node_model.pdo.parameters import PdoParameters
from node_model.sdo import SdoServer
from node_model.sdo.block import BlockDownload, BlockUpload
from node_model.sdo.channel import Channel, Parts
from node_model.sdo.transfer import Download, Inlet, Upload
from node_model.sync import SyncService
from node_model.time_of_day import TimeOfDay

SEAMS: Mapping[type, str] = MappingProxyType(
    {
        EmergencyProducer: "emcy",
        LssSlave: "lss",
        SdoServer: "sdo",
        HeartbeatService: "heartbeat",
        NodeGuarding: "guarding",
        HeartbeatConsumer: "consumer",
        TimeOfDay: "time",
        SyncService: "sync",
        PdoService: "pdo",
        Tpdo: "tpdo",
        Rpdo: "rpdo",
        NonVolatile: "nonvolatile",
        LineSettings: "line",
        Axis: "axis",
    }
)
"""Part -> its place in the table of a drive's parts."""

TRANSFERS: Mapping[type, str] = MappingProxyType(
    {
        Inlet: "inlet",
        Download: "download",
        Upload: "upload",
        BlockDownload: "block_download",
        BlockUpload: "block_upload",
    }
)
"""Part -> its place in the table of an SDO server's parts."""


def parts_with(part: type) -> DriveParts | None:
    """The table of parts with `part` in its place; None = it has no place there."""
    places: dict[str, Any] = {name: part for seam, name in SEAMS.items() if issubclass(part, seam)}
    if issubclass(part, Channel):
        places["sdo"] = partial(SdoServer, channel=part)
    transfers: dict[str, Any] = {
        n: part for seam, n in TRANSFERS.items() if issubclass(part, seam)
    }
    if transfers:
        places["sdo"] = partial(SdoServer, parts=Parts(**transfers))
    if issubclass(part, PdoParameters):
        places["tpdo"] = type("ParametersTpdo", (Tpdo,), {"parameters_type": part})
        places["rpdo"] = type("ParametersRpdo", (Rpdo,), {"parameters_type": part})
    return DriveParts(**places) if places else None


def assemble_drive(part: type[Fault | Deviation], profile: Profile, image: bytes = b"") -> Panel:
    """A drive in which `part` takes the place of the part that it is derived from.

    Raises:
        TypeError: it is derived from none.
    """
    if issubclass(part, Drive):
        return part(profile, image)
    if issubclass(part, Effect):
        return DeviceLink(Drive(profile, image), part())
    parts = parts_with(part)
    if parts is None:
        raise TypeError(
            f"{part.__name__} replaces no part of a drive; derive it from Drive, Effect, "
            f"{', '.join(seam.__name__ for seam in (*SEAMS, *TRANSFERS, Channel, PdoParameters))}"
        )
    return Drive(profile, image, parts)
