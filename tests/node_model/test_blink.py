"""Blinking light is a function of time."""

from __future__ import annotations

from node_model.blink import BlinkWave


def test_on_at_the_origin_and_off_after_the_on_time() -> None:
    """Both edges belong to what follows them."""
    wave = BlinkWave(300, 700, origin=50)
    assert [wave.lit(at) for at in (50, 349, 350, 1049, 1050)] == [True, True, False, False, True]


def test_the_next_change_is_later_than_now() -> None:
    """Asked at an edge it names the next one."""
    wave = BlinkWave(300, 700, origin=50)
    assert [wave.change(at) for at in (50, 349, 350, 1049, 1050)] == [350, 350, 1050, 1050, 1350]


def test_it_has_always_blinked() -> None:
    """Before its origin the waveform is the same: it has no beginning."""
    wave = BlinkWave(300, 700, origin=50)
    assert wave.lit(50 - 1000)
    assert wave.change(49) == 50
