"""Process data objects (CiA 301 4.2.0, 7.2.2): mapping, TPDOs, RPDOs, and the service of all."""

from node_model.pdo.mapping import Direction, Mapping
from node_model.pdo.receive import Rpdo
from node_model.pdo.service import PdoService
from node_model.pdo.transmit import Tpdo

__all__ = ["Direction", "Mapping", "PdoService", "Rpdo", "Tpdo"]
