"""What a device is made of: its facts, the classes of its parts, and its services in a row."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

from node_model.emcy import COB_ID as EMCY_COB_ID
from node_model.emcy import EmergencyProducer, StateRequest
from node_model.guarding import NodeGuarding
from node_model.heartbeat import HeartbeatService
from node_model.heartbeat_consumer import HeartbeatConsumer
from node_model.line_settings import LineSettings
from node_model.lss import BIT_RATES, LssSlave
from node_model.node import US
from node_model.nonvolatile import NonVolatile
from node_model.od import Entry, ObjectDictionary
from node_model.pdo import PdoService, Rpdo, Tpdo
from node_model.pdo.service import Applied
from node_model.sdo import SdoServer, SdoSettings
from node_model.service import Fault, Service
from node_model.sync import SyncService
from node_model.time_of_day import TimeOfDay


@dataclass(frozen=True, slots=True)
class Facts:
    """What a device is.

    Args:
        name: for people.
        node_id: as it leaves the factory; 255 = none, it waits for LSS.
        bit_rate: bit/s, as it leaves the factory.
        entries: its objects for a node id, with the values of the factory; new ones each time.
        bit_rates: bit/s that it can have.
        lss: it is an LSS slave.
        window_unit_ns: what one step of 1007h is.
        turnaround_ns: from a SYNC to the first synchronous TPDO, and from each to the next.
        sdo: choices of its SDO server.
        faults: errors that a bench can raise, by name.
    """

    name: str
    node_id: int
    bit_rate: int
    entries: Callable[[int], Iterable[Entry]]
    bit_rates: frozenset[int] = frozenset(BIT_RATES.values())
    lss: bool = True
    window_unit_ns: int = US
    turnaround_ns: int = 0
    sdo: SdoSettings = field(default_factory=SdoSettings)
    faults: Mapping[str, Fault] = field(default_factory=lambda: MappingProxyType({}))


@dataclass(frozen=True, slots=True)
class Parts:
    """The classes of the services: where a faulty or different device differs."""

    emcy: type[EmergencyProducer] = EmergencyProducer
    lss: type[LssSlave] = LssSlave
    sdo: Callable[..., SdoServer] = SdoServer
    heartbeat: type[HeartbeatService] = HeartbeatService
    guarding: type[NodeGuarding] = NodeGuarding
    consumer: type[HeartbeatConsumer] = HeartbeatConsumer
    time: type[TimeOfDay] = TimeOfDay
    sync: type[SyncService] = SyncService
    pdo: type[PdoService] = PdoService
    tpdo: type[Tpdo] = Tpdo
    rpdo: type[Rpdo] = Rpdo
    nonvolatile: type[NonVolatile] = NonVolatile
    line: type[LineSettings] = LineSettings


class Unsaid(EmergencyProducer):
    """Error handling of a device that has no EMCY."""

    def is_valid(self) -> bool:
        """Nothing is sent."""
        return False


class Services:
    """The services of a device with one node id.

    Args:
        parts: their classes.
        od: its objects.
        node_id: 1..127.
        facts: what it is.
        image: content of the memory of its parameters.
        change: asked to change the NMT state.
        applied: told of what RPDOs write.
    """

    def __init__(
        self,
        parts: Parts,
        od: ObjectDictionary,
        node_id: int,
        facts: Facts,
        image: bytes,
        change: StateRequest,
        applied: Applied,
    ) -> None:
        emcy = parts.emcy if EMCY_COB_ID in od else Unsaid
        self.od = od
        self.emcy = emcy(od, node_id, change)
        self.sdo = parts.sdo(od, node_id, facts.sdo)
        self.sync = parts.sync(od, self.emcy, facts.window_unit_ns)
        self.pdo = parts.pdo(
            od,
            self.emcy,
            self.sync,
            applied,
            facts.turnaround_ns,
            tpdo=parts.tpdo,
            rpdo=parts.rpdo,
        )
        self.nonvolatile = parts.nonvolatile(od, image)
        self.row: tuple[Service, ...] = (
            self.emcy,
            self.sdo,
            parts.heartbeat(od, node_id),
            parts.guarding(od, node_id, self.emcy),
            parts.consumer(od, self.emcy),
            parts.time(od),
            self.sync,
            self.pdo,
            self.nonvolatile,
        )
        """All of them, the error handler first."""
