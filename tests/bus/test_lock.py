"""One run at a time on a channel."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from hil_tests.bus.lock import ChannelLock
from hil_tests.errors import BusUnavailable


def test_second_holder_is_refused_and_told_who_is_first(tmp_path: Path) -> None:
    """The message names channel, interface and process."""
    first = ChannelLock("socketcan", "can0", tmp_path)

    with pytest.raises(BusUnavailable, match=rf"'can0' \(socketcan\).* pid {os.getpid()}"):
        ChannelLock("socketcan", "can0", tmp_path)
    first.release()


def test_released_lock_can_be_taken_again(tmp_path: Path) -> None:
    """Releasing, also twice, frees the channel."""
    first = ChannelLock("socketcan", "can0", tmp_path)
    first.release()
    first.release()

    ChannelLock("socketcan", "can0", tmp_path).release()


def test_other_channels_and_interfaces_are_free(tmp_path: Path) -> None:
    """A lock is for one channel of one interface type."""
    held = [
        ChannelLock("socketcan", "can0", tmp_path),
        ChannelLock("socketcan", "can1", tmp_path),
        ChannelLock("virtual", "can0", tmp_path),
    ]

    for lock in held:
        lock.release()


@pytest.mark.parametrize("channel", ["239.0.0.2", "239.0.0.1:43113", "[ff15::1]:43113", "ff15::1"])
def test_groups_on_one_port_exclude_each_other(channel: str, tmp_path: Path) -> None:
    """Every socket on a UDP port hears all groups on it: the other run and a way out are told."""
    first = ChannelLock("udp_multicast", "239.0.0.1", tmp_path)

    with pytest.raises(BusUnavailable) as told:
        ChannelLock("udp_multicast", channel, tmp_path)

    assert f"another run, pid {os.getpid()} on 239.0.0.1; groups on one UDP port (43113)" in (
        text := str(told.value)
    )
    address = "239.0.0." if "239" in channel else "[ff15::1]"
    assert f"a port of its own, e.g. --can-iface {address}" in text
    assert ":43114; or wait for it to end" in text
    first.release()


def test_groups_on_ports_of_their_own_are_free(tmp_path: Path) -> None:
    """The port decides, not the group; the last port's neighbour is the one before it."""
    held = [ChannelLock("udp_multicast", f"239.0.0.1:{port}", tmp_path) for port in (1, 65535)]

    with pytest.raises(BusUnavailable, match=r"--can-iface 239\.0\.0\.3:65534;"):
        ChannelLock("udp_multicast", "239.0.0.3:65535", tmp_path)
    for lock in held:
        lock.release()


def test_lock_dies_with_its_holder(tmp_path: Path) -> None:
    """A process that is killed leaves a file but no lock."""
    program = (
        "import os, pathlib, signal, sys\n"
        "from hil_tests.bus.lock import ChannelLock\n"
        "ChannelLock('socketcan', 'can0', pathlib.Path(sys.argv[1]))\n"
        "os.kill(os.getpid(), signal.SIGKILL)\n"
    )
    done = subprocess.run([sys.executable, "-c", program, str(tmp_path)], check=False)

    assert done.returncode == -9
    assert list(tmp_path.iterdir())
    ChannelLock("socketcan", "can0", tmp_path).release()


@pytest.mark.parametrize("channel", ["../../etc/x", "PCAN USB/1", "ü" * 300, "a\0b"])
def test_strange_channel_names_make_harmless_file_names(channel: str, tmp_path: Path) -> None:
    """The lock file stays in its folder whatever the channel is called."""
    lock = ChannelLock("pcan", channel, tmp_path)

    assert lock.path.parent == tmp_path
    assert lock.path.exists()
    lock.release()


def test_link_in_the_place_of_the_file_is_refused(tmp_path: Path) -> None:
    """In a folder that all may write to, a symbolic link could point anywhere."""
    (tmp_path / "nodeproof-socketcan-can0.lock").symlink_to(tmp_path / "victim")

    with pytest.raises(BusUnavailable, match="cannot be opened"):
        ChannelLock("socketcan", "can0", tmp_path)
    assert not (tmp_path / "victim").exists()


def test_holder_that_wrote_nonsense_is_unknown(tmp_path: Path) -> None:
    """What the file says is shown only if it is a number."""
    first = ChannelLock("socketcan", "can0", tmp_path)
    first.path.write_bytes(b"\x1b[2Jhello")

    with pytest.raises(BusUnavailable, match="pid unknown"):
        ChannelLock("socketcan", "can0", tmp_path)
    first.release()
