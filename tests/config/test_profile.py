"""Device profiles: what is read, what is refused, and both ends of every range."""

from __future__ import annotations

import tomllib
from pathlib import Path

import attrs
import pytest

import hil_tests
from hil_tests.clock import MS, US, S, parse_span
from hil_tests.config import KeypadLimits, Parameters, load_keypad, load_profile
from hil_tests.config.limits import SHORTEST_HEARTBEATS
from hil_tests.errors import ConfigError

MINIMAL = """
[device]
name = "pad"
kind = "keypad"
[keys]
bits = { a = 0, b = 1 }
commissioning = ["a", "b"]
frame_bytes = 1
releases_reported = true
[leds]
bits = { a = 0 }
frame_bytes = 1
both_set = "steady"
blink_on = "500 ms"
blink_off = "500 ms"
[factory]
node_id = 1
bit_rate_code = 2
heartbeat_ms = 1000
sync_time = 0
debounce = 1
"""
BITS = {"on_off": 0, "aut": 1, "k3": 2, "k4": 3, "k5": 4, "k6": 5, "k7": 6, "k8": 7}
SHIPPED = Path(hil_tests.__file__).parents[1] / "node_model" / "profiles" / "keypad.toml"


def written(tmp_path: Path, text: str) -> str:
    """The path of a profile with this text."""
    path = tmp_path / "pad.toml"
    path.write_text(text, "utf-8")
    return str(path)


def errors(tmp_path: Path, text: str) -> list[str]:
    """What the reader says to this text, without the file's name."""
    path = written(tmp_path, text)
    with pytest.raises(ConfigError) as caught:
        load_profile(path)
    lines = str(caught.value).splitlines()
    assert all(line.startswith(f"{path}: ") for line in lines)
    return [line.removeprefix(f"{path}: ") for line in lines]


def with_line(section: str, line: str) -> str:
    """The minimal profile with this line in a section, in place of the key's own line."""
    key, head = line.split(" = ", 1)[0], f"[{section}]\n"
    if head not in MINIMAL:
        return MINIMAL + head + line
    before, after = MINIMAL.split(head)
    lines = after.split("\n")
    end = next((n for n, text in enumerate(lines) if text.startswith("[")), len(lines))
    kept = [text for text in lines[:end] if not text.startswith(f"{key} = ")]
    return "\n".join([before + head + line, *kept, *lines[end:]])


def test_the_shipped_keypad_is_what_its_file_says() -> None:
    """Every value of keypad.toml arrives, in ns, ppm and bits."""
    profile = load_keypad("keypad")
    assert (profile.name, profile.kind) == ("keypad", "keypad")
    assert profile.key_bits == BITS
    assert profile.led_bits == profile.key_bits
    assert profile.commissioning_keys == {"on_off", "aut"}
    assert (profile.key_frame_bytes, profile.led_frame_bytes) == (1, 1)
    assert profile.releases_reported
    assert profile.both_set == "steady"
    assert (profile.blink_on_ns, profile.blink_off_ns) == (500 * MS, 500 * MS)
    assert profile.factory == Parameters(1, 2, 1000, 0, 1)
    assert profile.shortest_heartbeat[20_000] == 50 * MS
    assert profile.node_ids == range(1, 16)
    assert profile.path.endswith("keypad.toml")


def test_defaults_are_those_of_the_shipped_keypad(tmp_path: Path) -> None:
    """A profile that says only what it must is judged by the documented defaults."""
    pad, keypad = load_keypad(written(tmp_path, MINIMAL)), load_keypad("keypad")
    for name in ("limits", "shortest_heartbeat"):
        assert getattr(pad, name) == getattr(keypad, name)
    assert pad.shortest_heartbeat == SHORTEST_HEARTBEATS


def test_every_limit_has_a_line_in_the_shipped_file() -> None:
    """[limits] of keypad.toml is complete: users copy it to see what there is."""
    lines = tomllib.loads(SHIPPED.read_text("utf-8"))["limits"]
    fields = {field.name for field in attrs.fields(KeypadLimits)}
    assert {name.rsplit("_", 1)[0] for name in fields} == set(lines)


def test_a_profile_cannot_be_changed() -> None:
    """Profiles are session-wide: nobody may bend one for the others."""
    profile = load_keypad("keypad")
    with pytest.raises(attrs.exceptions.FrozenInstanceError):
        profile.name = "other"  # type: ignore[misc]
    with pytest.raises(TypeError):
        profile.key_bits["on_off"] = 3  # type: ignore[index]


@pytest.mark.parametrize(
    ("section", "line", "said"),
    [
        ("device", 'nam = "x"', "device.nam: unknown key; did you mean name?"),
        ("device", "description = 3", "device.description: 3: write a text in quotes"),
        ("device", 'description = "a\\u001bb"', "device.description: 'a\\x1bb': write 1..200"),
        ("keys", 'frame_bytes = "1"', "keys.frame_bytes: '1': write a whole number, 1..8 bytes"),
        ("keys", "frame_bytes = true", "keys.frame_bytes: true: write a whole number"),
        ("keys", "frame_bytes = 1.0", "keys.frame_bytes: 1.0: write a whole number"),
        ("keys", 'releases_reported = "yes"', "keys.releases_reported: 'yes': write true or fal"),
        ("keys", "both_set = 1", "keys.both_set: unknown key; it belongs in [leds]"),
        ("keys", "led = 1", "keys.led: unknown key; it belongs in [limits]"),
        ("leds", 'both_set = "blnk"', "leds.both_set: 'blnk': unknown word; did you mean blink?"),
        ("leds", "both_set = 1", 'leds.both_set: 1: unknown word; known: "steady", "blink"'),
        ("leds", "blink_on = 500", "leds.blink_on: 500: a time needs quotes and a unit"),
        ("leds", 'blink_on = "5 %"', "leds.blink_on: '5 %': a share, but a time belongs here"),
        ("leds", 'blink_on = "500"', "leds.blink_on: '500': is no time: write a number and one"),
        ("leds", 'blink_on = "5 MS"', "leds.blink_on: '5 MS': is no time"),
        ("leds", f'blink_on = "{"9" * 40} s"', "leds.blink_on: '999999"),
        ("factory", 'heartbeat_ms = "1 s"', "factory.heartbeat_ms: '1 s': write a whole number"),
        ("limits", 'scann = "1 ms"', "limits.scann: unknown key; did you mean scan?"),
        ("limits", 'echo_each = "5 %"', "limits.echo_each: '5 %': a share, but a time"),
        ("limits", 'heartbeat_each = "5 ms"', "limits.heartbeat_each: '5 ms': a time, but a shar"),
        ("limits", "heartbeat_each = 5", "limits.heartbeat_each: 5: a share needs quotes"),
        ("limits", 'echo_mean = "much"', "limits.echo_mean: 'much': is no share"),
        ("limits", 'echo_mean = "0.00001 %"', "limits.echo_mean: '0.00001 %': finer than 0.0001"),
        ("shortest_heartbeat", '125 = "9 ms"', "shortest_heartbeat.125: unknown bit rate; did yo"),
        ("shortest_heartbeat", '20k = "1.5 ms"', "shortest_heartbeat.20k: '1.5 ms': heartbeat pe"),
        ("shortest_heartbeat", "20k = 3", "shortest_heartbeat.20k: 3: a time needs quotes"),
        ("limts", "", "limts: unknown key; did you mean limits?"),
    ],
)
def test_one_slip_gives_one_line_with_its_remedy(
    tmp_path: Path, section: str, line: str, said: str
) -> None:
    """File, path, value, what is wrong and what to write."""
    found = errors(tmp_path, with_line(section, line))
    assert len(found) == 1
    assert found[0].startswith(said)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("b = 1", "b = 0", "keys.bits.b: 0: bit 0 is taken by 'a'; one each"),
        ("b = 1", "b = 8", "keys.bits.b: 8: does not fit into 1 byte(s): bits 0..7; raise keys."),
        ("b = 1", "b = 64", "keys.bits.b: 64: out of range; allowed: 0..63"),
        ("b = 1", "b = -1", "keys.bits.b: -1: out of range; allowed: 0..63"),
        ("b = 1", "b = false", "keys.bits.b: false: write a whole number, 0..63"),
        ("b = 1", 'b = 1, "x y" = 2', "keys.bits.'x y': 2: write names of 1..32 letters"),
        ("{ a = 0, b = 1 }", "{}", "keys.bits: {}: write a table of names and bits"),
        ("{ a = 0, b = 1 }", "[0, 1]", "keys.bits: [0, 1]: write a table of names and bits"),
        ("{ a = 0 }", "{ a = 9 }", "leds.bits.a: 9: does not fit into 1 byte(s)"),
        ('["a", "b"]', '["a", "bb"]', "keys.commissioning: 'bb': is no key of [keys] bits; did"),
        ('["a", "b"]', '["a"]', "keys.commissioning: ['a']: has 1 entries; allowed: 2"),
        ('["a", "b"]', '["a", "b", "a"]', "keys.commissioning: ['a', 'b', 'a']: has 3 entries"),
        ('["a", "b"]', '["a", "a"]', "keys.commissioning: ['a', 'a']: names one entry twice"),
        ('["a", "b"]', '["a", 1]', "keys.commissioning.1: 1: write a text in quotes"),
        ('["a", "b"]', '"a"', "keys.commissioning: 'a': write a list of texts"),
        ('kind = "keypad"', "", "device.kind: is missing; add this key to [device]"),
        ('kind = "keypad"', 'kind = "drve"', "device.kind: 'drve': unknown word; did you mean"),
        ('kind = "keypad"', 'kind = "keybad"', "device.kind: 'keybad': unknown word; did you m"),
        ("[leds]", "[[leds]]", "leds: [{'bits': {...}, 'bl"),
    ],
)
def test_what_must_fit_together_is_checked(tmp_path: Path, old: str, new: str, said: str) -> None:
    """Bits, frames, commissioning keys and sections."""
    assert old in MINIMAL
    found = errors(tmp_path, MINIMAL.replace(old, new, 1))
    assert len(found) == 1
    assert found[0].startswith(said)


@pytest.mark.parametrize(
    ("section", "key", "least", "most", "below", "above"),
    [
        ("factory", "node_id", "1", "15", "0", "16"),
        ("factory", "bit_rate_code", "0", "255", "-1", "256"),
        ("factory", "heartbeat_ms", "0", "65535", "-1", "65536"),
        ("factory", "sync_time", "0", "255", "-1", "256"),
        ("factory", "debounce", "0", "255", "-1", "256"),
        ("keys", "frame_bytes", "1", "8", "0", "9"),
        ("leds", "frame_bytes", "1", "8", "0", "9"),
        ("leds", "blink_on", '"1 ms"', '"60 s"', '"999999 ns"', '"60001 ms"'),
        ("leds", "blink_off", '"1 ms"', '"60 s"', '"999999 ns"', '"60001 ms"'),
        ("limits", "heartbeat_floor", '"0 ms"', '"1 h"', None, '"3601 s"'),
        ("limits", "echo_each", '"0 ms"', '"1 h"', None, '"3601 s"'),
        ("limits", "heartbeat_each", '"0 %"', '"100 %"', None, '"100.0001 %"'),
        ("limits", "heartbeat_mean", '"0.0001%"', '"100.00 %"', None, '"101 %"'),
        ("limits", "echo_mean", '"0 %"', '"100 %"', None, '"100.0001 %"'),
        *(
            ("limits", key, '"1 us"', '"1 h"', '"999 ns"', '"3601 s"')
            for key in ("boot_up", "emcy", "power_off", "store", "command", "scan", "key_frame")
        ),
        ("limits", "led", '"1 us"', '"1 h"', '"999 ns"', '"3601 s"'),
        ("shortest_heartbeat", "500k", '"1 ms"', '"65535 ms"', '"999 us"', '"65536 ms"'),
    ],
)
def test_each_range_is_kept_from_both_sides(
    tmp_path: Path, section: str, key: str, least: str, most: str, below: str | None, above: str
) -> None:
    """The ends of a range are allowed, the next value outside is not."""
    for value in (least, most):
        load_profile(written(tmp_path, with_line(section, f"{key} = {value}")))
    for value in filter(None, (below, above)):
        found = errors(tmp_path, with_line(section, f"{key} = {value}"))
        assert len(found) == 1
        assert found[0].startswith(f"{section}.{key}: ")
        assert "out of range; allowed: " in found[0]


def test_bits_fill_the_frame_to_its_last_bit(tmp_path: Path) -> None:
    """Bit 63 is the last one of eight bytes."""
    text = with_line("keys", "frame_bytes = 8").replace("b = 1", "b = 63")
    assert load_keypad(written(tmp_path, text)).key_bits == {"a": 0, "b": 63}


def test_all_errors_are_told_at_once(tmp_path: Path) -> None:
    """Every slip in every section, so that one round mends the file."""
    text = """
    [device]
    name = 3
    knd = "keypad"
    [keys]
    bits = { a = 0, b = 0, c = 9 }
    commissioning = ["a", "x"]
    frame_bytes = 1
    [leds]
    blink_on = 5
    [limits]
    led = "5 %"
    """
    paths = [line.split(": ")[0] for line in errors(tmp_path, text)]
    assert sorted(paths) == [
        "device.kind",
        "device.knd",
        "device.name",
        "factory",
        "keys.bits.b",
        "keys.bits.c",
        "keys.commissioning",
        "keys.releases_reported",
        "leds.bits",
        "leds.blink_off",
        "leds.blink_on",
        "leds.both_set",
        "leds.frame_bytes",
        "limits.led",
    ]


@pytest.mark.parametrize("section", ["device", "keys", "leds", "factory"])
def test_facts_of_a_device_have_no_defaults(tmp_path: Path, section: str) -> None:
    """A fact that is guessed would be a verdict that is guessed; each missing one is told."""
    lines, inside = [], ""
    for line in MINIMAL.splitlines():
        inside = line if line.startswith("[") else inside
        if inside != f"[{section}]":
            lines.append(line)
    assert errors(tmp_path, "\n".join(lines)) == [f"{section}: is missing; add this section"]
    hollow = "\n".join([*lines, f"[{section}]"])
    facts = tomllib.loads(MINIMAL)[section]
    told = [line.split(": ")[0] for line in errors(tmp_path, hollow)]
    assert sorted(told) == sorted(f"{section}.{key}" for key in facts)


def test_a_hopeless_file_is_not_listed_in_full(tmp_path: Path) -> None:
    """Fifty lines and a count."""
    found = errors(tmp_path, MINIMAL + "[limits]\n" + "".join(f"x{n} = 1\n" for n in range(80)))
    assert len(found) == 51
    assert found[-1] == "and 30 more problems"


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("keypd", "profile: 'keypd': no such profile; did you mean keypad?; or give a TOML"),
        ("oven", "profile: 'oven': no such profile; known: drive, drive-ms, generic, keypad; or"),
        ("", "profile: '': no such profile; known: drive, drive-ms, generic, keypad"),
        ("no/such.toml", "no/such.toml: no such file"),
        ("nul\0.toml", "'nul\\x00.toml': is no file name"),
        ("x" * 5000, "profile: 'xxx"),
        ("x" * 5000 + ".toml", "xxxxx"),
    ],
)
def test_an_unknown_profile_names_those_there_are(name: str, said: str) -> None:
    """Near miss, list, next step."""
    with pytest.raises(ConfigError) as caught:
        load_profile(name)
    assert str(caught.value).startswith(said)


def test_any_spelling_of_a_time_means_the_same(tmp_path: Path) -> None:
    """Units and decimals are exact."""
    for text in ("50 ms", "0.05 s", "50000us", "50000000 ns"):
        profile = load_keypad(written(tmp_path, with_line("limits", f'led = "{text}"')))
        assert profile.limits.led_ns == parse_span("50 ms") == 50 * MS


def test_heartbeat_interval_is_the_share_or_the_floor_whichever_is_more() -> None:
    """5 % or 5 ms: they meet at 100 ms."""
    limits = KeypadLimits()
    assert limits.heartbeat_each_ns(1 * S) == (950 * MS, 1050 * MS)
    assert limits.heartbeat_each_ns(100 * MS) == (95 * MS, 105 * MS)
    assert limits.heartbeat_each_ns(101 * MS) == (95_950 * US, 106_050 * US)
    assert limits.heartbeat_each_ns(99 * MS) == (94 * MS, 104 * MS)
    assert limits.heartbeat_each_ns(1 * MS) == (0, 6 * MS)


def test_means_and_echo_have_limits_of_their_own() -> None:
    """The mean is narrower than the single interval; the echo's period is 100 ms."""
    limits = KeypadLimits()
    assert limits.heartbeat_mean_ns(1 * S) == (980 * MS, 1020 * MS)
    assert limits.echo_each() == (90 * MS, 110 * MS)
    assert limits.echo_mean() == (98 * MS, 102 * MS)
    assert KeypadLimits(heartbeat_mean_ppm=1).heartbeat_mean_ns(1_999_999) == (1999998, 2000000)


@pytest.mark.parametrize("period_ns", [0, -1])
def test_no_period_has_no_limits(period_ns: int) -> None:
    """Heartbeat time 0 means none: asking for its limits is a slip of the caller."""
    with pytest.raises(ValueError, match="no intervals to judge"):
        KeypadLimits().heartbeat_each_ns(period_ns)


@pytest.mark.parametrize(
    ("code", "rate"),
    [
        (0, 250_000),
        (1, 500_000),
        (2, 250_000),
        (3, 125_000),
        (4, 100_000),
        (5, 50_000),
        (6, 20_000),
        (7, 250_000),
        (255, 250_000),
    ],
)
def test_bit_rate_codes_are_those_of_the_source(code: int, rate: int) -> None:
    """Inizializzazione, Byte 2: every other code means 250k."""
    assert Parameters(1, code, 0, 0, 0).bit_rate == rate


def test_parameters_give_their_times_in_ns() -> None:
    """Milliseconds, and steps of 100 ms."""
    parameters = Parameters(1, 2, 65535, 0, 255)
    assert parameters.heartbeat_ns == 65_535 * MS
    assert parameters.debounce_ns == 25_500 * MS
