"""Object dictionaries from EDS and DCF files (CiA 306): what a device has, and its facts.

The file is read leniently here, and once more by the canopen package; where the two differ
the raw text decides. What cannot be read is refused with file, line, value and remedy.
"""

from node_model.eds.errors import EdsError, Remark
from node_model.eds.sheet import Info, Sheet, load_eds, parse_eds

__all__ = ["EdsError", "Info", "Remark", "Sheet", "load_eds", "parse_eds"]
