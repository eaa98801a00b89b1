"""EDS and DCF files as the tester reads them (CiA 306): objects, device facts, findings.

Read from the raw text, line by line, so that every value and every finding has its line. A
file with faults is read as far as it can be; `nodeproof eds` lists what is wrong with it.
"""

from hil_tests.eds.findings import Finding, Severity
from hil_tests.eds.lint import lint
from hil_tests.eds.objects import Object
from hil_tests.eds.sheet import Device, Group, Sheet, read_sheet, sheet_of_device
from hil_tests.eds.values import Value

__all__ = [
    "Device",
    "Finding",
    "Group",
    "Object",
    "Severity",
    "Sheet",
    "Value",
    "lint",
    "read_sheet",
    "sheet_of_device",
]
