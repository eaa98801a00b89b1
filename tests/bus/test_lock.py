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
