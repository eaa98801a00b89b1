"""The smallest node."""

from __future__ import annotations

from node_model.beacon import Beacon
from node_model.frame import Frame

BOOT_UP, BEAT = Frame(0x70A, b"\x00"), Frame(0x70A, b"\x7f")


def test_it_boots_and_beats_on_a_grid() -> None:
    """Boot-up at power-on, then 7Fh each period."""
    beacon = Beacon(10, 100, 125_000)
    assert beacon.bit_rate == 0
    assert beacon.deadline() is None
    assert beacon.power_on(5) == (BOOT_UP,)
    assert beacon.bit_rate == 125_000
    assert beacon.deadline() == 105
    assert beacon.advance(104) == ()
    assert beacon.advance(105) == (BEAT,)
    assert beacon.deadline() == 205


def test_a_late_host_gets_all_beats_that_were_due() -> None:
    """Two thousand of them; once, so many calls within one another ended the interpreter."""
    beacon = Beacon(10, 100, 125_000)
    beacon.power_on(0)
    assert beacon.advance(200_099) == (BEAT,) * 2_000
    assert beacon.deadline() == 200_100


def test_it_heeds_nothing_and_falls_silent_without_power() -> None:
    """Power-on twice is power-on once."""
    beacon = Beacon(10, 100, 125_000)
    beacon.power_on(0)
    assert beacon.power_on(50) == ()
    assert beacon.receive(Frame(0, b"\x81\x00"), 60) == ()
    assert beacon.power_off(70) == ()
    assert beacon.deadline() is None
    assert beacon.advance(1000) == ()
    assert beacon.power_on(2000) == (BOOT_UP,)
