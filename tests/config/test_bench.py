"""Bench files: what is read, what is refused, and both ends of every range."""

from __future__ import annotations

from pathlib import Path

import pytest

from hil_tests.clock import MS, S
from hil_tests.config import Parameters, PartialParameters, load_bench
from hil_tests.errors import ConfigError

FULL = """
[bench]
name = "desk-2"
[bus]
interface = "socketcan"
channel = "can0"
bitrate = 250000
exclusive = true
[device]
profile = "keypad"
node_id = 5
parameters = { bit_rate_code = 2, heartbeat_ms = 1000, sync_time = 0, debounce = 1 }
[control]
address = "tcp:127.0.0.1:5555"
[power]
driver = "control"
timeout = "10 s"
[keys]
driver = "operator"
[leds]
driver = "operator"
[bitrate]
driver = "control"
"""


def written(tmp_path: Path, text: str) -> str:
    """The path of a bench file with this text."""
    path = tmp_path / "desk-9.toml"
    path.write_text(text, "utf-8")
    return str(path)


def errors(tmp_path: Path, text: str) -> list[str]:
    """What the reader says to this text, without the file's name."""
    path = written(tmp_path, text)
    with pytest.raises(ConfigError) as caught:
        load_bench(path)
    return [line.removeprefix(f"{path}: ") for line in str(caught.value).splitlines()]


def test_the_documented_example_is_read(tmp_path: Path) -> None:
    """Every value arrives."""
    path = written(tmp_path, FULL)
    bench = load_bench(path)
    assert (bench.name, bench.path) == ("desk-2", path)
    assert (bench.bus.interface, bench.bus.channel) == ("socketcan", "can0")
    assert (bench.bus.bitrate, bench.bus.exclusive) == (250_000, True)
    assert (bench.device.profile, bench.device.node_id) == ("keypad", 5)
    assert bench.device.commissioned == Parameters(5, 2, 1000, 0, 1)
    assert bench.control is not None
    assert bench.control.address == "tcp:127.0.0.1:5555"
    assert bench.power is not None
    assert (bench.power.driver, bench.power.timeout_ns) == ("control", 10 * S)
    assert bench.keys is not None
    assert (bench.keys.driver, bench.keys.timeout_ns) == ("operator", None)
    assert bench.facilities == ("power", "keys", "leds", "bitrate")


def test_an_empty_file_is_a_bench_without_facilities(tmp_path: Path) -> None:
    """Everything may be left out: the command line can say the rest."""
    bench = load_bench(written(tmp_path, ""))
    assert bench.name == "desk-9"
    assert bench.facilities == ()
    assert (bench.bus.interface, bench.bus.channel, bench.bus.bitrate) == (None, None, None)
    assert not bench.bus.exclusive
    assert bench.device.parameters is None
    assert bench.device.commissioned is None


def test_parameters_that_are_not_known_are_left_out(tmp_path: Path) -> None:
    """A part of the set is no set."""
    text = "[device]\nnode_id = 3\nparameters = { heartbeat_ms = 100 }"
    device = load_bench(written(tmp_path, text)).device
    assert device.parameters == PartialParameters(None, 100, None, None)
    assert device.commissioned is None


def test_the_whole_set_needs_the_node_id(tmp_path: Path) -> None:
    """Node id 0 would be a guess."""
    text = FULL.replace("node_id = 5\n", "")
    assert load_bench(written(tmp_path, text)).device.commissioned is None


def test_power_by_commands(tmp_path: Path) -> None:
    """Two argument lists, used as they stand."""
    text = '[power]\ndriver = "command"\non = ["relay", "1"]\noff = ["relay", ""]\n'
    power = load_bench(written(tmp_path, text)).power
    assert power is not None
    assert (power.on, power.off) == (("relay", "1"), ("relay", ""))


@pytest.mark.parametrize(
    "address", ["tcp:localhost:1", "tcp:lab-3.local:65535", "tcp:[::1]:5555", "unix:/run/x"]
)
def test_addresses_that_are_right(tmp_path: Path, address: str) -> None:
    """Names, IPv4, IPv6 in brackets, paths."""
    bench = load_bench(written(tmp_path, f'[control]\naddress = "{address}"'))
    assert bench.control is not None
    assert bench.control.address == address


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[bux]\n", "bux: unknown key; did you mean bus?"),
        ("bus = 3\n", "bus: 3: write a table: a [section], or { key = value }"),
        ("channel = 3\n", "channel: unknown key; it belongs in [bus]"),
        ("[bus]\nchanel = 'can0'\n", "bus.chanel: unknown key; did you mean channel?"),
        ("[bus]\nchannel = 0\n", "bus.channel: 0: write a text in quotes"),
        ("[bus]\nbitrate = '250k'\n", "bus.bitrate: '250k': write a whole number, 10000..1000"),
        ("[bus]\nexclusive = 1\n", "bus.exclusive: 1: write true or false"),
        ("[bench]\nname = ''\n", "bench.name: '': write 1..60 printable characters"),
        ("[device]\nparameters = 3\n", "device.parameters: 3: write a table"),
        (
            "[device]\nparameters = { node_id = 3 }\n",
            "device.parameters.node_id: unknown key; it belongs in [device]",
        ),
        (
            "[device]\nparameters = { heartbeat = 3 }\n",
            "device.parameters.heartbeat: unknown key; did you mean heartbeat_ms?",
        ),
        ("[control]\n", "control.address: is missing; add this key to [control]"),
        ("[control]\naddress = 'can0'\n", "control.address: 'can0': write tcp:HOST:PORT"),
        ("[control]\naddress = 'tcp:::1:80'\n", "control.address: 'tcp:::1:80': write tcp:HOST"),
        ("[control]\naddress = 'tcp:a:x'\n", "control.address: 'tcp:a:x': write tcp:HOST:PORT"),
        ("[control]\naddress = 'tcp:a:0'\n", "control.address: 'tcp:a:0': port out of range"),
        ("[control]\naddress = 'tcp:a:65536'\n", "control.address: 'tcp:a:65536': port out of"),
        ("[control]\naddress = 'unix:'\n", "control.address: 'unix:': the path has 0 bytes"),
        ("[control]\naddress = 7\n", "control.address: 7: write a text in quotes"),
        ("[power]\n", "power.driver: is missing; add this key to [power]"),
        ("[power]\ndriver = 'relay'\n", "power.driver: 'relay': unknown word; known: command,"),
        ("[power]\ndriver = 'labgrid'\n", "power.driver: 'labgrid': not built into this version;"),
        ("[power]\ndriver = 'scpi'\n", "power.driver: 'scpi': not built into this version; use "),
        ("[power]\ndriver = 'control'\n", "power.driver: 'control': needs [control] with address"),
        ("[keys]\ndriver = 'control'\n", "keys.driver: 'control': needs [control] with address"),
        ("[keys]\ndriver = 'command'\n", "keys.driver: 'command': unknown word; known: control"),
        ("[leds]\ndriver = 'operatr'\n", "leds.driver: 'operatr': unknown word; did you mean op"),
        ("[bitrate]\ndriver = ['x']\n", "bitrate.driver: ['x']: unknown word; known:"),
        ("[keys]\ndriver = 'operator'\ntimeout = 5\n", "keys.timeout: 5: a time needs quotes"),
        ("[keys]\ndriver = 'operator'\non = ['x']\n", "keys.on: unknown key; it belongs in [pow"),
        ("[power]\ndriver = 'command'\non = ['x']\n", "power.off: is missing; the driver"),
        (
            "[power]\ndriver = 'command'\non = []\noff = ['x']\n",
            "power.on: []: has 0 entries; allowed: 1..50",
        ),
        (
            "[power]\ndriver = 'command'\non = 'relay on'\noff = ['x']\n",
            "power.on: 'relay on': write a list of texts",
        ),
        (
            "[power]\ndriver = 'command'\non = ['a\\u0000']\noff = ['x']\n".replace(
                "'a", '"a'
            ).replace("0']", '0"]'),
            "power.on.0: 'a\\x00': write a text in quotes",
        ),
        (
            "[power]\ndriver = 'operator'\non = ['x']\n",
            "power.on: ['x']: belongs to the driver \"command\"; remove it",
        ),
    ],
)
def test_one_slip_gives_one_line_with_its_remedy(tmp_path: Path, text: str, said: str) -> None:
    """Path, value, what is wrong and what to write."""
    found = errors(tmp_path, text)
    assert len(found) == 1
    assert found[0].startswith(said)


@pytest.mark.parametrize(
    ("section", "key", "least", "most", "below", "above"),
    [
        ("bus", "bitrate", "10000", "1000000", "9999", "1000001"),
        ("device", "node_id", "1", "127", "0", "128"),
        ("device.parameters", "bit_rate_code", "0", "255", "-1", "256"),
        ("device.parameters", "heartbeat_ms", "0", "65535", "-1", "65536"),
        ("device.parameters", "sync_time", "0", "255", "-1", "256"),
        ("device.parameters", "debounce", "0", "255", "-1", "256"),
        ("leds", "driver='operator'\ntimeout", '"1 ms"', '"24 h"', '"1 us"', '"25 h"'),
    ],
)
def test_each_range_is_kept_from_both_sides(
    tmp_path: Path, section: str, key: str, least: str, most: str, below: str, above: str
) -> None:
    """The ends of a range are allowed, the next value outside is not."""
    for value in (least, most):
        load_bench(written(tmp_path, f"[{section}]\n{key} = {value}\n"))
    for value in (below, above):
        found = errors(tmp_path, f"[{section}]\n{key} = {value}\n")
        assert len(found) == 1
        assert "out of range; allowed: " in found[0]


def test_the_longest_unix_path_is_107_bytes(tmp_path: Path) -> None:
    """Longer ones fail at bind() with a message that nobody understands."""
    load_bench(written(tmp_path, f'[control]\naddress = "unix:{"x" * 107}"'))
    found = errors(tmp_path, f'[control]\naddress = "unix:{"x" * 108}"')
    assert "the path has 108 bytes; allowed: 1..107" in found[0]


def test_time_outs_are_ns(tmp_path: Path) -> None:
    """As everywhere in the program."""
    text = '[keys]\ndriver = "operator"\ntimeout = "1.5 s"'
    keys = load_bench(written(tmp_path, text)).keys
    assert keys is not None
    assert keys.timeout_ns == 1500 * MS


def test_all_errors_are_told_at_once(tmp_path: Path) -> None:
    """Slips in five sections: one round mends the file."""
    text = """
    [bus]
    bitrate = 3
    exclusiv = true
    [device]
    parameters = { debounce = 999 }
    [power]
    driver = "labgrid"
    [keys]
    driver = "control"
    [leds]
    """
    paths = [line.split(": ")[0] for line in errors(tmp_path, text)]
    assert sorted(paths) == [
        "bus.bitrate",
        "bus.exclusiv",
        "device.parameters.debounce",
        "keys.driver",
        "leds.driver",
        "power.driver",
    ]


def test_errors_of_a_device_are_raised_by_a_server_or_by_a_person(tmp_path: Path) -> None:
    """A facility like the others; other drivers there are none."""
    bench = load_bench(written(tmp_path, '[faults]\ndriver = "operator"\ntimeout = "3 min"\n'))
    assert bench.facilities == ("faults",)
    assert bench.faults is not None
    assert (bench.faults.driver, bench.faults.timeout_ns) == ("operator", 180 * S)
    with pytest.raises(ConfigError, match=r"faults.driver: 'interface': unknown word"):
        load_bench(written(tmp_path, '[faults]\ndriver = "interface"\n'))
