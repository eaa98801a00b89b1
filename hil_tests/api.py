"""The names that acceptance tests use, in one place."""

from __future__ import annotations

from hil_tests.bench.bench import COMMISSIONING_RATE, Bench, payload
from hil_tests.bench.facilities import BitRate, Keys, Leds, Power
from hil_tests.bench.judging import LOOK_ON_NS
from hil_tests.clock import MS, Interval, S, exactly, show_span
from hil_tests.config import ECHO_PERIOD_NS, DeviceProfile, Parameters
from hil_tests.errors import FrameNotCarried
from hil_tests.judge import cobs, matchers
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
from hil_tests.trace import EventKind, Moment
from node_model.frame import Frame

__all__ = [
    "COMMISSIONING_RATE",
    "ECHO_PERIOD_NS",
    "LOOK_ON_NS",
    "MS",
    "Bench",
    "BitRate",
    "DeviceFailure",
    "DeviceProfile",
    "EventKind",
    "Frame",
    "FrameNotCarried",
    "InconclusiveResult",
    "Interval",
    "Keys",
    "Leds",
    "Limits",
    "Moment",
    "Nmt",
    "NotApplicable",
    "NotRun",
    "Outcome",
    "Parameters",
    "Power",
    "S",
    "Seen",
    "State",
    "Verdict",
    "around",
    "cobs",
    "exactly",
    "judge_periodic",
    "matchers",
    "nmt_frame",
    "payload",
    "show_span",
]
