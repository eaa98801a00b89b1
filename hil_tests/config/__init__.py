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
from hil_tests.config.limits import ECHO_PERIOD_NS, ProfileLimits
from hil_tests.config.parameters import Parameters, PartialParameters
from hil_tests.config.profile import DeviceProfile, load_profile

__all__ = [
    "ECHO_PERIOD_NS",
    "BenchFile",
    "BitRateSection",
    "BusSection",
    "ControlSection",
    "DeviceProfile",
    "DeviceSection",
    "FacilitySection",
    "Parameters",
    "PartialParameters",
    "PowerSection",
    "ProfileLimits",
    "load_bench",
    "load_profile",
]
