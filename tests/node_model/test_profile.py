"""The device's own reader of its profile."""

from __future__ import annotations

from pathlib import Path

import pytest

from node_model.keypad import Parameters, Profile, load, loads
from node_model.node import MS

TEXT = """
[device]
name = "panel"
[keys]
bits = { up = 3, down = 0 }
frame_bytes = 2
releases_reported = false
commissioning = ["up"]
[leds]
bits = { red = 9, green = 0 }
frame_bytes = 2
both_set = "blink"
blink_on = "100 us"
blink_off = "2 s"
[factory]
node_id = 3
bit_rate_code = 6
heartbeat_ms = 0
sync_time = 1
debounce = 2
"""


def test_the_bundled_profile_is_the_keypad_of_the_source() -> None:
    """Eight keys and LEDs; "on/off" and "aut" start commissioning; LEDs blink at 1 Hz."""
    profile = load()
    assert profile.name == "keypad"
    assert profile.keys == profile.leds
    assert sorted(profile.keys.values()) == list(range(8))
    assert profile.commissioning_keys == {"on_off", "aut"}
    assert profile.key_bytes == profile.led_bytes == 1
    assert profile.led_mask == 0xFF
    assert profile.releases_reported
    assert profile.steady_wins
    assert profile.blink_on_ns == profile.blink_off_ns == 500 * MS
    assert profile.factory == Parameters(1, 2, 1000, 0, 1)


def test_every_fact_of_a_text_is_taken() -> None:
    """A profile that differs from the bundled one in everything."""
    assert loads(TEXT) == Profile(
        name="panel",
        keys={"up": 3, "down": 0},
        key_bytes=2,
        releases_reported=False,
        commissioning_keys=frozenset({"up"}),
        leds={"red": 9, "green": 0},
        led_bytes=2,
        steady_wins=False,
        blink_on_ns=100_000,
        blink_off_ns=2_000_000_000,
        factory=Parameters(3, 6, 0, 1, 2),
    )
    assert loads(TEXT).led_mask == 0x201


def test_a_profile_is_read_from_a_file_by_its_path(tmp_path: Path) -> None:
    """A name that is not bundled is a path."""
    path = tmp_path / "panel.toml"
    path.write_text(TEXT, "utf-8")
    assert load(str(path)) == loads(TEXT)


def test_a_missing_profile_is_an_error_of_the_file(tmp_path: Path) -> None:
    """Neither bundled nor a file."""
    with pytest.raises(FileNotFoundError):
        load(str(tmp_path / "nobody.toml"))


def test_a_missing_fact_names_its_key() -> None:
    """The device needs every fact."""
    with pytest.raises(KeyError, match="frame_bytes"):
        loads(TEXT.replace("frame_bytes = 2", ""))
