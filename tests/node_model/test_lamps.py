"""Two independent maps, and the light that follows from them."""

from __future__ import annotations

from dataclasses import replace

import pytest

from node_model.keypad import Profile, load
from node_model.keypad.lamps import Lamps
from node_model.node import MS

PROFILE = load()
ON, OFF = 0, 500 * MS
"""Instants at which the waveform of lamps made at 0 is on and off."""


def shining(lamps: Lamps, now: int) -> set[str]:
    """Names of the LEDs that shine."""
    return {led for led in PROFILE.leds if lamps.lit(led, now)}


def test_bit_n_of_the_steady_map_lights_led_n() -> None:
    """And puts out the others."""
    lamps = Lamps(PROFILE)
    lamps.set_steady(b"\x81")
    assert shining(lamps, ON) == shining(lamps, OFF) == {"on_off", "k8"}
    lamps.set_steady(b"\x02")
    assert shining(lamps, OFF) == {"aut"}


def test_bit_n_of_the_blink_map_makes_led_n_blink() -> None:
    """All in phase, on first."""
    lamps = Lamps(PROFILE)
    lamps.set_blinking(b"\x05")
    assert shining(lamps, ON) == shining(lamps, OFF - 1) == {"on_off", "k3"}
    assert shining(lamps, OFF) == set()


def test_the_maps_are_independent() -> None:
    """Writing one leaves the other: the source's own words."""
    lamps = Lamps(PROFILE)
    lamps.set_steady(b"\x01")
    lamps.set_blinking(b"\x02")
    lamps.set_steady(b"\x04")
    assert (lamps.steady, lamps.blinking) == (4, 2)
    lamps.set_blinking(b"\x00")
    assert (lamps.steady, lamps.blinking) == (4, 0)


@pytest.mark.parametrize(("steady_wins", "at_off"), [(True, {"aut"}), (False, set())])
def test_the_profile_says_which_map_wins(steady_wins: bool, at_off: set[str]) -> None:
    """With both bits set the LED is steady, or it blinks."""
    lamps = Lamps(replace(PROFILE, steady_wins=steady_wins))
    lamps.set_steady(b"\x02")
    lamps.set_blinking(b"\x02")
    assert shining(lamps, ON) == {"aut"}
    assert shining(lamps, OFF) == at_off
    assert lamps.change(ON) == (None if steady_wins else OFF)


def test_a_short_frame_is_ignored_and_extra_bytes_mean_nothing() -> None:
    """The map is the first byte or nothing."""
    lamps = Lamps(PROFILE)
    lamps.set_steady(b"\x01\xff")
    lamps.set_blinking(b"\x02\xff")
    lamps.set_steady(b"")
    lamps.set_blinking(b"")
    assert (lamps.steady, lamps.blinking) == (1, 2)


def test_bits_without_an_led_mean_nothing() -> None:
    """A map of two bytes with two LEDs, lowest byte first."""
    profile = Profile(leds={"red": 9, "green": 0}, led_bytes=2)
    lamps = Lamps(profile)
    lamps.set_steady(b"\xff\xff")
    assert lamps.steady == 0x201
    assert lamps.map_in(b"\x01\x02") == 0x201
    assert lamps.map_in(b"\x01") is None


def test_nothing_changes_by_itself_without_blinking() -> None:
    """Steady light has no next change; blinking light does."""
    lamps = Lamps(PROFILE, 100)
    lamps.set_steady(b"\x01")
    assert lamps.change(100) is None
    lamps.set_blinking(b"\x02")
    assert lamps.change(100) == 500 * MS + 100
