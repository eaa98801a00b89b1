"""What the system knows of an interface, and setting its bit rate through `ip`."""

from __future__ import annotations

from pathlib import Path

import pytest

from hil_tests.bus import link
from hil_tests.errors import BenchError

IP = """#!/bin/sh
echo "$*" >> {folder}/log
case "$*" in
*show*) cat {folder}/show ;;
*"link set"*) exec {folder}/set "$@" ;;
esac
"""


@pytest.fixture
def net(tmp_path: Path) -> Path:
    """A sysfs with vcan0 (no hardware), can0 (a card), and an Ethernet interface."""
    for name, kind, place in (
        ("vcan0", 280, "virtual/net"),
        ("can0", 280, "pci0000:00/net"),
        ("eth0", 1, "virtual/net"),
    ):
        device = tmp_path / "devices" / place / name
        device.mkdir(parents=True)
        (device / "type").write_text(f"{kind}\n")
        (tmp_path / "net").mkdir(exist_ok=True)
        (tmp_path / "net" / name).symlink_to(device)
    return tmp_path / "net"


class Ip:
    """A stand-in for the program `ip`, with what it shows and how it takes a change."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        program = folder / "ip"
        program.write_text(IP.format(folder=folder))
        program.chmod(0o755)
        self.shows(125_000)
        self.sets("exit 0")

    def shows(self, rate: int, flags: str = '"NOARP","UP"') -> None:
        """The interface runs at that rate."""
        info = f'"info_data":{{"bittiming":{{"bitrate":{rate}}}}}' if rate else ""
        text = f'[{{"flags":[{flags}],"linkinfo":{{"info_kind":"can",{info}}}}}]'
        (self.folder / "show").write_text(text.replace(",}", "}"))

    def sets(self, script: str) -> None:
        """What happens on `ip link set`."""
        (self.folder / "set").write_text(f"#!/bin/sh\n{script}\n")
        (self.folder / "set").chmod(0o755)

    def changes(self) -> list[str]:
        """The changes asked for so far."""
        log = self.folder / "log"
        lines = log.read_text().splitlines() if log.exists() else []
        return [line for line in lines if "set" in line]


@pytest.fixture
def ip(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Ip:
    """The stand-in, found first on the PATH."""
    monkeypatch.setenv("PATH", str(tmp_path), prepend=":")
    return Ip(tmp_path)


def test_simulated_interfaces_have_no_hardware(net: Path) -> None:
    """vcan is filed under devices/virtual, a card under its bus."""
    assert link.is_simulated("vcan0", net)
    assert not link.is_simulated("can0", net)


def test_only_can_interfaces_are_listed(net: Path) -> None:
    """Type 280 is ARPHRD_CAN."""
    assert link.can_interfaces(net) == ["can0", "vcan0"]
    assert link.can_interfaces(net / "nowhere") == []


@pytest.mark.parametrize(
    ("channel", "texts"),
    [
        ("vcan1", ["'vcan1'", "there is vcan0", "ip link add dev vcan1 type vcan"]),
        ("vcan1", ["nodeproof vcan -- pytest"]),
        ("can9", ["there is can0", "plug the adapter in"]),
    ],
)
def test_missing_interface_names_near_misses_and_remedy(
    channel: str, texts: list[str], net: Path
) -> None:
    """The message says what there is and how to make what is asked for."""
    message = link.missing_text(channel, net)

    for text in texts:
        assert text in message


def test_machine_without_can_is_told(tmp_path: Path) -> None:
    """No interface at all is said, too."""
    assert "this machine has no CAN interface" in link.missing_text("vcan0", tmp_path)


def test_rate_that_is_there_already_changes_nothing(ip: Ip) -> None:
    """No interface is taken down for nothing."""
    rate = link.BitRate("can0")
    rate.ensure(125_000)
    rate.restore()

    assert ip.changes() == []


def test_interface_that_is_down_is_brought_up(ip: Ip) -> None:
    """The right rate alone is not enough."""
    ip.shows(125_000, flags='"NOARP"')
    link.BitRate("can0").ensure(125_000)

    assert ip.changes()[-1] == "link set can0 up"


def test_rate_is_set_and_restored(ip: Ip) -> None:
    """Down, set, up; and back to the rate found first, not the last one."""
    rate = link.BitRate("can0")
    rate.ensure(250_000)
    ip.shows(250_000)
    rate.ensure(500_000)
    ip.shows(500_000)
    rate.restore()
    rate.restore()

    steps = ["link set can0 down", "link set can0 type can bitrate {}", "link set can0 up"]
    assert ip.changes() == [
        step.format(wanted) for wanted in (250_000, 500_000, 125_000) for step in steps
    ]


def test_unset_rate_is_not_restored(ip: Ip) -> None:
    """An interface that had no rate keeps the one it was given."""
    ip.shows(0)
    rate = link.BitRate("can0")
    rate.ensure(250_000)
    rate.restore()

    assert len(ip.changes()) == 3


def test_refusal_tells_the_command_to_run(ip: Ip) -> None:
    """Without CAP_NET_ADMIN the user is told what to type."""
    ip.sets("echo 'RTNETLINK answers: Operation not permitted' >&2; exit 2")

    with pytest.raises(BenchError) as caught:
        link.BitRate("can0").ensure(250_000)
    assert "Operation not permitted" in str(caught.value)
    assert "sudo ip link set can0 up type can bitrate 250000" in str(caught.value)


def test_missing_program_is_told(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Without iproute2 nothing can be set."""
    monkeypatch.setenv("PATH", str(tmp_path))

    with pytest.raises(BenchError, match="iproute2"):
        link.BitRate("can0").current()


@pytest.mark.parametrize("text", ["", "no json", "[]", "[1]", '[{"linkinfo":{}}]'])
def test_strange_output_is_an_unknown_rate(text: str, ip: Ip) -> None:
    """Another version of `ip` may print something else."""
    (ip.folder / "show").write_text(text)

    assert link.BitRate("can0").current() is None
