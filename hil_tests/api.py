"""The names that acceptance tests use, in one place."""

from __future__ import annotations

from hil_tests.bench.bench import Bench
from hil_tests.bench.cia301 import Cia301Bench
from hil_tests.bench.facilities import BitRate, Faults, Keys, Leds, Power
from hil_tests.bench.judging import LOOK_ON_NS
from hil_tests.bench.keypad import COMMISSIONING_RATE, KeypadBench, payload
from hil_tests.bench.lss import Lss
from hil_tests.bench.master import Master
from hil_tests.bench.sdo import Sdo
from hil_tests.chance import Chance, Row
from hil_tests.clients import accepted, lss, sdo_frames
from hil_tests.clients.lss import Identity
from hil_tests.clients.sdo import Abort, Download, Upload, abort_in
from hil_tests.clients.sdo_block import BlockDownload, BlockUpload
from hil_tests.clients.values import number, u8, u16, u32
from hil_tests.clock import MS, Interval, S, exactly, show_span
from hil_tests.config import (
    ECHO_PERIOD_NS,
    Cia301Profile,
    DeviceFault,
    DeviceProfile,
    DriveProfile,
    KeypadProfile,
    Parameters,
)
from hil_tests.eds import Object as EdsObject
from hil_tests.eds import Sheet
from hil_tests.errors import FrameNotCarried
from hil_tests.judge import cobs, emergencies, matchers, window
from hil_tests.judge.causal import Seen
from hil_tests.judge.cobs import Nmt, State, nmt_frame
from hil_tests.judge.periodic import around, judge_periodic
from hil_tests.judge.verdict import (
    DeviceFailure,
    InconclusiveResult,
    Limits,
    NotApplicable,
    NotRun,
    Outcome,
    Verdict,
)
from hil_tests.manager import Event, Manager, What
from hil_tests.trace import EventKind, Moment
from node_model.frame import Frame

__all__ = [
    "COMMISSIONING_RATE",
    "ECHO_PERIOD_NS",
    "LOOK_ON_NS",
    "MS",
    "Abort",
    "Bench",
    "BitRate",
    "BlockDownload",
    "BlockUpload",
    "Chance",
    "Cia301Bench",
    "Cia301Profile",
    "DeviceFailure",
    "DeviceFault",
    "DeviceProfile",
    "Download",
    "DriveProfile",
    "EdsObject",
    "Event",
    "EventKind",
    "Faults",
    "Frame",
    "FrameNotCarried",
    "Identity",
    "InconclusiveResult",
    "Interval",
    "KeypadBench",
    "KeypadProfile",
    "Keys",
    "Leds",
    "Limits",
    "Lss",
    "Manager",
    "Master",
    "Moment",
    "Nmt",
    "NotApplicable",
    "NotRun",
    "Outcome",
    "Parameters",
    "Power",
    "Row",
    "S",
    "Sdo",
    "Seen",
    "Sheet",
    "State",
    "Upload",
    "Verdict",
    "What",
    "abort_in",
    "accepted",
    "around",
    "cobs",
    "emergencies",
    "exactly",
    "judge_periodic",
    "lss",
    "matchers",
    "nmt_frame",
    "number",
    "payload",
    "sdo_frames",
    "show_span",
    "u8",
    "u16",
    "u32",
    "window",
]
