"""Readers of device profiles and bench files.

Importing this package imports attrs and cattrs: do it when a file is to be read, not
when the plugin is loaded.
"""

from __future__ import annotations

from hil_tests.config.bench import (
    BenchFile,
    BitRateSection,
    BusSection,
    ControlSection,
    DeviceSection,
    FacilitySection,
    PowerSection,
    load_bench,
)
from hil_tests.config.cia301 import (
    Cia301Profile,
    DriveProfile,
    GenericProfile,
)
from hil_tests.config.device import DeviceFault, DeviceProfile
from hil_tests.config.keypad import KeypadProfile
from hil_tests.config.limits import ECHO_PERIOD_NS, Cia301Limits, DeviceLimits, KeypadLimits
from hil_tests.config.parameters import Cia301Parameters, Parameters, PartialParameters, Setup
from hil_tests.config.profile import load_keypad, load_profile

__all__ = [
    "ECHO_PERIOD_NS",
    "BenchFile",
    "BitRateSection",
    "BusSection",
    "Cia301Limits",
    "Cia301Parameters",
    "Cia301Profile",
    "ControlSection",
    "DeviceFault",
    "DeviceLimits",
    "DeviceProfile",
    "DeviceSection",
    "DriveProfile",
    "FacilitySection",
    "GenericProfile",
    "KeypadLimits",
    "KeypadProfile",
    "Parameters",
    "PartialParameters",
    "PowerSection",
    "Setup",
    "load_bench",
    "load_keypad",
    "load_profile",
]
