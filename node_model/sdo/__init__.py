"""The SDO server of a device (CiA 301 4.2.0, 7.2.4): expedited, segmented and block transfers."""

from node_model.sdo.channel import Channel, Parts
from node_model.sdo.server import SdoServer
from node_model.sdo.settings import SdoSettings

__all__ = ["Channel", "Parts", "SdoServer", "SdoSettings"]
