"""The object dictionary of a device (CiA 301 4.2.0, 7.4): types, entries, access, abort codes."""

from node_model.od.abort import AbortCode, SdoAbort
from node_model.od.dictionary import ObjectDictionary
from node_model.od.entry import Access, Entry
from node_model.od.types import DataType

__all__ = ["AbortCode", "Access", "DataType", "Entry", "ObjectDictionary", "SdoAbort"]
