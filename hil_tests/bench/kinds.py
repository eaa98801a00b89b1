"""The bench of each kind of device."""

from __future__ import annotations

from hil_tests.bench.bench import Bench
from hil_tests.bench.cia301 import Cia301Bench
from hil_tests.bench.keypad import KeypadBench
from hil_tests.bench.stage import Stage
from hil_tests.config import (
    Cia301Parameters,
    Cia301Profile,
    DeviceProfile,
    KeypadProfile,
    Parameters,
    Setup,
)


def bench_for(stage: Stage, profile: DeviceProfile, setup: Setup | None) -> Bench:
    """The bench for a device of that profile.

    Args:
        stage: what stands behind it.
        profile: of the device.
        setup: what the device is set to; None = not known.
    """
    if isinstance(profile, KeypadProfile):
        assert setup is None or isinstance(setup, Parameters)
        return KeypadBench(stage, profile, setup)
    assert isinstance(profile, Cia301Profile)
    assert isinstance(setup, Cia301Parameters)
    return Cia301Bench(stage, profile, setup)
