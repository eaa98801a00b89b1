"""Commissioned parameters: what each byte of 4F8h does at the next regular start.

Source: keypad specification, "Inizializzazione", the table of the bytes.
"""

from __future__ import annotations

import attrs
import pytest

from hil_tests.acceptance.commissioning_steps import (
    EXAMPLE,
    OTHER,
    boots_as,
    expect_period,
    press_and_release,
    started_with,
)
from hil_tests.api import BitRate, KeypadBench, Keys, Parameters, Power, S, matchers

NAMED_RATES = {1: 500_000, 2: 250_000, 3: 125_000, 4: 100_000, 5: 50_000, 6: 20_000}
SOME_OTHER_CODES = (0, 7, 8, 128, 255)


@pytest.mark.requirement("COM-06", "COM-08", "COM-09")
@pytest.mark.parametrize("parameters", [EXAMPLE, OTHER], ids=["example", "other"])
def test_next_start_uses_the_parameters(
    bench: KeypadBench, power: Power, keys: Keys, bitrate: BitRate, parameters: Parameters
) -> None:
    """At the next regular power-up node id, bit rate and heartbeat are the new ones."""
    bench.fresh()
    bench.commission(parameters)

    boot = boots_as(bench, parameters, "COM-06")

    expect_period(bench, boot, parameters, "COM-06")


@pytest.mark.requirement("COM-06")
def test_commissions_again_and_again(
    bench: KeypadBench, power: Power, keys: Keys, bitrate: BitRate
) -> None:
    """The last of several commissionings counts, and it outlasts several power-ups."""
    bench.fresh()
    for parameters in (EXAMPLE, OTHER, EXAMPLE, OTHER):
        bench.commission(parameters)
        boots_as(bench, parameters, "COM-06")
    for _ in range(3):
        power.off()
        boots_as(bench, OTHER, "COM-06")


@pytest.mark.requirement("COM-07")
@pytest.mark.parametrize("code", NAMED_RATES)
def test_each_named_bit_rate(
    bench: KeypadBench, power: Power, keys: Keys, bitrate: BitRate, code: int
) -> None:
    """Codes 1 to 6 mean 500, 250, 125, 100, 50 and 20 kbit/s."""
    bench.fresh()
    parameters = attrs.evolve(EXAMPLE, bit_rate_code=code)
    bench.commission(parameters)
    bench.check(bench.stage.bit_rate == NAMED_RATES[code], f"the tester runs at code {code}")

    boots_as(bench, parameters, "COM-07")


@pytest.mark.requirement("COM-07")
def test_every_other_code_means_250_kbit(
    bench: KeypadBench, power: Power, keys: Keys, bitrate: BitRate
) -> None:
    """Code 0 and codes 7 to 255 mean 250 kbit/s (all in virtual time, some elsewhere).

    Another rate is stored before each, or a node that keeps the old one would not be found.
    """
    bench.fresh()
    every = [code for code in range(256) if code not in NAMED_RATES]
    for code in every if bench.stage.virtual else SOME_OTHER_CODES:
        bench.commission(EXAMPLE)
        parameters = attrs.evolve(EXAMPLE, bit_rate_code=code)
        bench.commission(parameters)
        bench.check(bench.stage.bit_rate == 250_000, f"the tester runs at 250 kbit/s for {code}")
        boots_as(bench, parameters, "COM-07")


@pytest.mark.requirement("COM-08")
@pytest.mark.parametrize("node_id", range(1, 16))
def test_each_node_id(
    bench: KeypadBench, power: Power, keys: Keys, bitrate: BitRate, node_id: int
) -> None:
    """Every node id from 1 to 15 is taken, announced, and listened to."""
    bench.fresh()
    parameters = attrs.evolve(EXAMPLE, node_id=node_id)
    bench.commission(parameters)

    boots_as(bench, parameters, "COM-08")

    bench.enter_operational()


@pytest.mark.requirement("COM-09")
@pytest.mark.parametrize(
    "heartbeat_ms",
    [
        pytest.param(1, marks=pytest.mark.virtual("1 ms is faster than a hosted model can be")),
        10,
        255,
        256,
        1000,
        0x1234,
        65535,
    ],
)
def test_heartbeat_time_is_big_endian_milliseconds(
    bench: KeypadBench, power: Power, keys: Keys, bitrate: BitRate, heartbeat_ms: int
) -> None:
    """Bytes 2 and 3 are the heartbeat time in milliseconds, high byte first."""
    parameters, boot = started_with(bench, heartbeat_ms=heartbeat_ms)

    expect_period(bench, boot, parameters, "COM-09")


@pytest.mark.requirement("COM-09", "HB-05")
def test_heartbeat_time_zero_is_none(
    bench: KeypadBench, power: Power, keys: Keys, bitrate: BitRate
) -> None:
    """Heartbeat time 0 means no heartbeat."""
    parameters, boot = started_with(bench, heartbeat_ms=0)

    bench.never(matchers.heartbeat(parameters.node_id), after=boot, for_ns=10 * S)


@pytest.mark.requirement("COM-10")
@pytest.mark.parametrize("debounce", [1, 2, 5, 20, 255])
def test_debounce_time_is_tenths_of_a_second(
    bench: KeypadBench, power: Power, keys: Keys, bitrate: BitRate, debounce: int
) -> None:
    """Byte 5 times 100 ms is how long a press or a release must last."""
    started_with(bench, debounce=debounce)
    bench.enter_operational()

    press_and_release(bench, keys, "COM-10")


@pytest.mark.requirement("COM-23")
def test_debounce_zero_filters_nothing(
    bench: KeypadBench, power: Power, keys: Keys, bitrate: BitRate
) -> None:
    """With debounce time 0 every press and release is reported at once."""
    started_with(bench, debounce=0)
    bench.enter_operational()

    press_and_release(bench, keys, "COM-23")


@pytest.mark.requirement("COM-11")
@pytest.mark.parametrize("sync_time", [1, 10, 255])
def test_sync_time_has_no_effect(
    bench: KeypadBench, power: Power, keys: Keys, bitrate: BitRate, sync_time: int
) -> None:
    """The sync time is echoed; heartbeat and debounce stay what they are, and nothing is added."""
    for value, heartbeat_by, keys_by in ((0, "COM-09", "COM-10"), (sync_time, "COM-11", "COM-11")):
        parameters, boot = started_with(bench, sync_time=value)

        expect_period(bench, boot, parameters, heartbeat_by)
        bench.enter_operational()
        press_and_release(bench, keys, keys_by)
