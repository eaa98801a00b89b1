"""Commissioned parameters: what each byte of 4F8h does at the next regular start.

Source: keypad specification, "Inizializzazione", the table of the bytes.
"""

from __future__ import annotations

from functools import reduce
from operator import xor

import attrs
import pytest

from hil_tests.acceptance.cadence import judge_row
from hil_tests.acceptance.commissioning_steps import (
    EXAMPLE,
    OTHER,
    anew,
    boots_as,
    expect_period,
    press_and_release,
    started_with,
)
from hil_tests.api import (
    BitRate,
    Chance,
    KeypadBench,
    Keys,
    Parameters,
    Power,
    Row,
    S,
    matchers,
    payload,
)

NAMED_RATES = {1: 500_000, 2: 250_000, 3: 125_000, 4: 100_000, 5: 50_000, 6: 20_000}
SOME_OTHER_CODES = (0, 7, 128, 255)


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


def drawn_parameters(row: Row, turn: int) -> Parameters:
    """A set that the seed draws, its heartbeat time with bytes at their borders.

    Of each three the bytes of the first add up to zero, those of the second do so without carry.
    """
    heartbeat_ms = row.randrange(1, 3) << 8 | Chance.byte(row)
    found = attrs.evolve(EXAMPLE, node_id=row.randrange(1, 16), heartbeat_ms=heartbeat_ms)
    found = attrs.evolve(found, debounce=row.randrange(1, 4))
    plain, data = row.randrange(1, 256), payload(found)
    return attrs.evolve(found, sync_time=(-sum(data) & 0xFF, reduce(xor, data), plain)[turn % 3])


@pytest.mark.requirement("COM-06", "COM-08", "COM-09", "HB-01")
def test_next_start_uses_what_the_seed_draws(
    bench: KeypadBench, power: Power, keys: Keys, bitrate: BitRate, chance: Chance
) -> None:
    """No set of parameters is special, be it one whose checksum would be zero."""
    row = chance.row("parameters")
    for turn in range(24 if bench.stage.virtual else 1):
        parameters = drawn_parameters(row, turn)
        anew(bench)
        bench.commission(parameters)

        boot = boots_as(bench, parameters, "COM-06")

        judge_row(bench, expect_period(bench, boot, parameters, "COM-09"), "HB-01")


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
    bench: KeypadBench, power: Power, keys: Keys, bitrate: BitRate, chance: Chance
) -> None:
    """Code 0 and codes 7 to 255 mean 250 kbit/s.

    All in virtual time; elsewhere some, and one that the seed draws. Another rate is stored
    before each, or a node that keeps the old one would not be found.
    """
    every = [code for code in range(256) if code not in NAMED_RATES]
    drawn = chance.row("bit-rate code").randrange(8, 255)
    for code in every if bench.stage.virtual else (*SOME_OTHER_CODES, drawn):
        bench.fresh(**attrs.asdict(EXAMPLE))
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
        0x10FF,
        65535,
    ],
)
def test_heartbeat_time_is_big_endian_milliseconds(
    bench: KeypadBench, power: Power, keys: Keys, bitrate: BitRate, heartbeat_ms: int
) -> None:
    """Bytes 2 and 3 are the heartbeat time in milliseconds, high byte first; both count."""
    parameters, boot = started_with(bench, heartbeat_ms=heartbeat_ms)

    beats = expect_period(bench, boot, parameters, "COM-09")

    if heartbeat_ms > 0xFF:
        judge_row(bench, beats, "HB-01")  # 4351 ms without its low byte are nearly 4351 ms


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
def test_sync_time_has_no_effect(
    bench: KeypadBench, power: Power, keys: Keys, bitrate: BitRate, chance: Chance
) -> None:
    """The sync time is echoed; heartbeat and debounce stay what they are, and nothing is added.

    All values in virtual time; elsewhere the ends of the range, and one that the seed draws.
    """
    bench.fresh()
    drawn = chance.row("sync time").randrange(2, 255)
    for value in (0, *(range(1, 256) if bench.stage.virtual else (1, drawn, 255))):
        parameters = attrs.evolve(EXAMPLE, sync_time=value)
        bench.commission(parameters)
        boot = boots_as(bench, parameters, "COM-06")

        expect_period(bench, boot, parameters, "COM-11" if value else "COM-09")
        bench.enter_operational()
        press_and_release(bench, keys, "COM-11" if value else "COM-10")
