"""Power, keys, LEDs, bit rate: what is asked of the driver, and what the trace says of it."""

from __future__ import annotations

from typing import Any

import pytest

from hil_tests.bench.facilities import Keys, Leds, Power
from hil_tests.clock import MS
from tests.bench.fakes import HOME, PROFILE, FakeStage, bench_of


def test_power_is_in_the_trace_with_what_was_held() -> None:
    """The moment says when, on or off, and how the device will start."""
    bench, _ = bench_of()
    power, keys = bench.power, bench.keys
    assert power
    assert keys
    bench.begin()
    keys.hold("aut", "on_off")
    on = power.on()
    assert (on.began_at, on.ended_at) == (1 * MS, 2 * MS)
    assert on.detail == {"on": True, "mode": "commissioning", "held": ["aut", "on_off"]}
    assert power.off().detail == {"on": False}
    assert [moment.what for moment in bench.trace.moments()] == ["keys", "power", "power"]


def test_a_power_cycle_keeps_the_time_that_the_profile_asks_for() -> None:
    """The supply is off at least so long, counted from the latest instant it went off."""
    bench, _ = bench_of()
    assert isinstance(bench.power, Power)
    bench.begin()
    on = bench.power.cycle()
    off = next(iter(bench.trace.moments()))
    assert on.began_at - off.ended_at >= PROFILE.limits.power_off_ns
    assert bench.power.is_on is True


def test_another_device_need_not_wait_for_its_supply() -> None:
    """After a renewal the supply is off, and free to be switched on."""
    bench, _ = bench_of()
    assert bench.power
    bench.power.off()
    bench.power.forget()
    before = bench.now()
    bench.power.on()
    assert bench.now() - before == 1 * MS


def keys_of(**options: Any) -> tuple[Keys, FakeStage]:
    """The keys of a fake bench."""
    bench, stage = bench_of(**options)
    bench.begin()
    assert bench.keys
    return bench.keys, stage


def test_keys_are_held_pressed_and_released() -> None:
    """Each verb asks for the whole set that is held from then on."""
    keys, stage = keys_of()
    keys.hold("k3")
    keys.press("aut")
    assert keys.mask == 0b110
    keys.release("k3")
    keys.release()
    assert keys.held == frozenset()
    assert stage.asked == ["keys k3", "keys aut k3", "keys aut", "keys -"]


def test_names_are_in_bit_order() -> None:
    """Keys and LEDs are listed as their bits are numbered."""
    keys, _ = keys_of()
    assert keys.names == ("on_off", "aut", "k3", "k4", "k5", "k6", "k7", "k8")
    bench, _ = bench_of()
    assert bench.leds
    assert bench.leds.names == keys.names


STEPS = [(0, frozenset({"aut"})), (4 * MS, frozenset[str]()), (9 * MS, frozenset({"aut"}))]


@pytest.mark.parametrize("timed", [True, False])
def test_a_sequence_is_played_at_once_or_step_by_step(timed: bool) -> None:
    """Who can play it is asked once; else each step is asked for, never before its instant."""
    keys, stage = keys_of()
    stage.timed_sequences = timed
    moments = keys.sequence(STEPS)
    assert stage.asked == (["sequence of 3"] if timed else ["keys aut", "keys -", "keys aut"])
    assert [moment.detail["held"] for moment in moments] == [["aut"], [], ["aut"]]
    assert keys.held == {"aut"}
    for moment, (span_ns, _) in zip(moments, STEPS, strict=True):
        assert moment.began_at >= span_ns


def test_leds_are_read_and_watched() -> None:
    """What an eye sees goes into the trace; a watch takes the time that it was asked for."""
    bench, _ = bench_of()
    leds = bench.leds
    assert isinstance(leds, Leds)
    bench.begin()
    assert leds.read() == {"aut": "blink"}
    (moment,) = bench.trace.moments()
    assert (moment.what, moment.ended_at - moment.began_at) == ("leds", 3 * MS)
    leds.watch(50 * MS)
    assert bench.now() == 53 * MS
    assert not leds.sees_edges


def test_the_bit_rate_is_the_stages_from_then_on() -> None:
    """The bench remembers at which rate its own end runs."""
    bench, stage = bench_of()
    assert bench.bitrate
    bench.begin()
    moment = bench.bitrate.set(125_000)
    assert stage.bit_rate == 125_000
    assert moment.detail == {"bit_rate": 125_000}


def test_what_a_stage_lacks_the_bench_lacks() -> None:
    """A facility without a driver is None."""
    bench, _ = bench_of(without=["power", "keys", "leds", "bitrate"])
    assert (bench.power, bench.keys, bench.leds, bench.bitrate) == (None,) * 4
    assert bench.held == frozenset()


def test_a_board_is_given_the_time_to_die() -> None:
    """Where capacitors may keep it alive, switching off takes as long as a power cycle needs."""
    bench, stage = bench_of()
    assert isinstance(bench.power, Power)
    stage.fades = True
    bench.renewed(HOME, off=False)
    off = bench.power.off()
    assert bench.now() - off.ended_at == PROFILE.limits.power_off_ns
