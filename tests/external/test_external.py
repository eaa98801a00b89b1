"""The suite against a device that nobody here wrote for it: spared when right, blamed when not."""

from __future__ import annotations

import json
import os
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

pytestmark = pytest.mark.slow

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
GROUP = "239.0.0.1"
HOME = "5,2,1000,0,1"
A_DEVICE_FAILED, INCONCLUSIVE = 1, 10
JUDGED = (0, A_DEVICE_FAILED, INCONCLUSIVE)

START = "test_boot_up_comes_first_then_emcy or test_boot_up_is_one_zero_byte"
SELECTION = (
    f"{START} or test_literal_example or test_next_start_uses_the_parameters"
    " or test_remote_frames_are_not_answered"
)


def free_port() -> int:
    """A UDP port of its own: a bus that no other run shares."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("", 0))
        return int(probe.getsockname()[1])


@pytest.fixture
def channel() -> str:
    """A bus over IP multicast, if this host can."""
    can = pytest.importorskip("can", reason="needs python-can")
    port = free_port()
    try:
        buses = [can.Bus(GROUP, interface="udp_multicast", port=port) for _ in range(2)]
    except Exception as error:  # noqa: BLE001 - msgpack is missing, no such network ...
        pytest.skip(f"no udp_multicast here: {error}")
    try:
        buses[0].send(can.Message(arbitration_id=1, is_extended_id=False))
        heard = buses[1].recv(2)
    except can.CanError as error:
        pytest.skip(f"no multicast here: {error}")
    finally:
        for bus in buses:
            bus.shutdown()
    if heard is None:
        pytest.skip("multicast frames do not come back on this host")
    return f"{GROUP}:{port}"


@contextmanager
def device(channel: str, control: str, fault: str, log: Path) -> Iterator[None]:
    """The independent keypad, ready; what it says goes to `log`."""
    running = subprocess.Popen(
        [sys.executable, "-m", "tests.external.device", "--interface", "udp_multicast",
         "--channel", channel, "--control", control, "--memory", HOME, "--fault", fault],
        cwd=ROOT, stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    assert running.stdout is not None
    try:
        assert "ready" in running.stdout.readline(), "the device ended before it was ready"
        yield
    finally:
        running.terminate()
        running.wait(10)
        with running.stdout as said:
            log.write_text(said.read(), encoding="utf-8")


def judge(
    folder: Path, channel: str, tests: str, fault: str = ""
) -> tuple[int, list[dict[str, Any]]]:
    """The suite's exit status, and its result of each test."""
    control = f"unix:{folder / 'control'}"
    bench = (HERE / "bench.toml").read_text(encoding="utf-8")
    bench = bench.replace("tcp:127.0.0.1:5555", control)
    (folder / "bench.toml").write_text(bench, encoding="utf-8")
    others = {k: value for k, value in os.environ.items() if not k.startswith("NODEPROOF_")}
    with device(channel, control, fault, folder / "device.log"):
        done = subprocess.run(
            [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-k", tests,
             "hil_tests/acceptance", f"--can-iface={channel}", "--can-interface=udp_multicast",
             "--can-device=external", f"--can-bench={folder / 'bench.toml'}",
             "--can-allow-writes", f"--can-reports={folder}"],
            cwd=ROOT,
            env=others,
            capture_output=True,
            text=True,
            timeout=120,
            check=False,
        )  # fmt: skip
    assert done.returncode in JUDGED, done.stdout + done.stderr
    results = json.loads((folder / "latest" / "results.json").read_text(encoding="utf-8"))
    return done.returncode, results["results"]


def failures(results: list[dict[str, Any]]) -> set[str]:
    """The requirements of all verdicts that are failures."""
    return {
        verdict["requirement"]
        for result in results
        for verdict in result["verdicts"]
        if verdict["outcome"] == "failed"
    }


def test_a_right_device_is_spared(tmp_path: Path, channel: str) -> None:
    """No test fails, and the device is left commissioned to what it was."""
    status, results = judge(tmp_path, channel, SELECTION)

    assert len(results) > 5
    assert {result["outcome"] for result in results} <= {"passed", "inconclusive", "not run"}
    assert status in {0, INCONCLUSIVE}
    log = (tmp_path / "device.log").read_text(encoding="utf-8")
    stored = [line for line in log.splitlines() if line.startswith("stored")]
    assert stored
    assert stored[-1] == "stored " + HOME.replace(",", " ")


def test_a_faulty_device_is_blamed(tmp_path: Path, channel: str) -> None:
    """An EMCY whose code is sent high byte first is held against NMT-02, and nothing else is."""
    status, results = judge(tmp_path, channel, START, fault="emcy-swapped")

    assert status == A_DEVICE_FAILED
    assert failures(results) == {"NMT-02"}
