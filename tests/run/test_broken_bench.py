"""A bench that breaks before or in a run: told once, never held against the device."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest

from tests.drivers.peers import Reply, answer, scripted
from tests.run.harness import ROOT, Judged, judge, judge_apart

pytest_plugins = ["pytester"]

BODY = """
@pytest.mark.requirement("NMT-02")
def test_one(bench, power):
    power.on()

@pytest.mark.requirement("NMT-02")
def test_two(bench, power):
    power.off()

@pytest.mark.requirement("NMT-02")
def test_three(bench, power):
    power.on()
"""

DESK = """
[bus]
interface = "virtual"
channel = "{channel}"
[device]
profile = "keypad"
node_id = 1
parameters = {{ bit_rate_code = 2, heartbeat_ms = 1000, sync_time = 0, debounce = 1 }}
[control]
address = "{address}"
[power]
driver = "control"
timeout = "200 ms"
"""


def desk(folder: Path, channel: str, address: str) -> str:
    """The option for a bench whose supply a control server switches."""
    path = folder / "desk.toml"
    path.write_text(DESK.format(channel=channel, address=address), "utf-8")
    return f"--can-bench={path}"


def assert_told_once(run: Judged, cause: str) -> None:
    """Exit status 11; the cause in full in one place, and a line for each test."""
    assert run.status == 11, run.text
    assert cause in run.section("bench broken"), run.text
    for bad in ("Traceback", "INTERNALERROR", "site-packages"):
        assert bad not in run.text
    assert len(run.section("ERRORS").splitlines()) <= 2 * len(run.outcomes) + 1
    assert run.results["finished"] is True
    assert run.results["summary"]["exit_status"] == 11


def test_no_control_server(pytester: pytest.Pytester) -> None:
    """A server that is not there breaks the bench before the first test; the remedy is named."""
    run = judge(pytester, BODY, desk(pytester.path, "noserver", f"unix:{pytester.path}/nobody"))
    assert_told_once(run, "start the control server, or correct [control] address")
    assert run.text.count("BENCH BROKEN") == 1
    assert set(run.outcomes.values()) == {"error"}


def garbled(_: dict[str, Any]) -> bytes:
    """An answer that is no JSON."""
    return b"on, I think\n"


def of_another(request: dict[str, Any]) -> bytes:
    """An answer to a question that was not asked."""
    return json.dumps({"id": request["id"] + 7, "ok": True}).encode() + b"\n"


@pytest.mark.parametrize(
    ("reply", "cause"),
    [
        (garbled, "with no JSON"),
        (of_another, "answers come in order"),
        (None, "it hung up on"),
        (answer(at=["now", "then"]), "is no time in seconds"),
        (answer(at=[0, 1]), "before the request, yet its hello says clock 'same'"),
    ],
)
def test_a_control_server_that_lies_or_closes_in_mid_run(
    pytester: pytest.Pytester, tmp_path: Path, reply: Reply, cause: str
) -> None:
    """What was judged before stays; from then on every test is an error with the first cause."""
    replies: Sequence[Reply] = [answer(power=False), answer(), reply]
    with scripted(tmp_path, replies, can=["power"]) as address:
        run = judge(pytester, BODY, desk(pytester.path, "liar", address))
    assert_told_once(run, cause)
    assert run.outcomes == {"test_one": "passed", "test_two": "error", "test_three": "error"}
    assert len(run.traces()) == 2
    assert "the bench is broken: control server" in run.text


@pytest.mark.slow
def test_a_control_server_that_stalls(pytester: pytest.Pytester, tmp_path: Path) -> None:
    """No answer within the time that the bench file grants: the bench is broken."""
    with scripted(tmp_path, [answer(power=False), answer(), b""], can=["power"]) as address:
        run = judge(pytester, BODY, desk(pytester.path, "stalls", address))
    assert_told_once(run, "within 0.2 s")
    assert run.outcomes == {"test_one": "passed", "test_two": "error", "test_three": "error"}


def refusal(request: dict[str, Any]) -> bytes:
    """An answer that says no."""
    text = {"id": request["id"], "ok": False, "error": "the fuse is blown"}
    return json.dumps(text).encode() + b"\n"


def test_a_refusal_costs_one_test(pytester: pytest.Pytester, tmp_path: Path) -> None:
    """A server that refuses one request is still there: the run goes on."""
    replies: Sequence[Reply] = [answer(power=False), answer(), refusal, answer(), answer()]
    with scripted(tmp_path, replies, can=["power"]) as address:
        run = judge(pytester, BODY, desk(pytester.path, "refuses", address))
    assert run.outcomes == {"test_one": "passed", "test_two": "error", "test_three": "passed"}
    assert "refused" in run.text
    assert "the fuse is blown" in run.text
    assert run.section("bench broken") == ""
    assert run.status == 11


def test_a_server_that_cannot_what_the_file_declares(
    pytester: pytest.Pytester, tmp_path: Path
) -> None:
    """A hello that lacks a facility of the bench file is a bench error with the remedy."""
    with scripted(tmp_path, [], can=["keys"]) as address:
        run = judge(pytester, BODY, desk(pytester.path, "lacks", address))
    assert_told_once(run, "its hello lacks power")
    assert "remove that section from the bench file" in run.text


ADAPTER = '''
"""An adapter of python-can that is pulled out after some frames."""

import can


class PulledBus(can.BusABC):
    def __init__(self, channel, **options):
        super().__init__(channel)
        self.channel_info = channel
        self.left = 3

    def _recv_internal(self, timeout):
        self.left -= 1
        if self.left < 0:
            raise can.CanOperationError("the adapter was pulled out")
        return None, False

    def send(self, message, timeout=None):
        raise can.CanOperationError("the adapter was pulled out")
'''

PULLED = """
@pytest.mark.requirement("NMT-02")
def test_one(bench):
    bench.wait(5 * S)

@pytest.mark.requirement("NMT-02")
def test_two(bench):
    bench.wait(1)
"""


@pytest.mark.slow
def test_an_adapter_that_goes_away_in_mid_run(tmp_path: Path) -> None:
    """The first test that meets it and all others are errors; the results are kept."""
    (tmp_path / "pulled_adapter.py").write_text(ADAPTER, "utf-8")
    facts = tmp_path / "pulled_adapter-1.dist-info"
    facts.mkdir()
    (facts / "METADATA").write_text("Name: pulled-adapter\nVersion: 1\n", "utf-8")
    entry = "[can.interface]\npulled = pulled_adapter:PulledBus\n"
    (facts / "entry_points.txt").write_text(entry, "utf-8")
    options = ["--can-interface=pulled", "--can-iface=usb0", "--can-device=external"]
    path = f"{ROOT}:{tmp_path}"
    run = judge_apart(tmp_path, PULLED, *options, PYTHONPATH=path)
    assert_told_once(run, "the adapter was pulled out")
    assert set(run.outcomes.values()) == {"error"}


def write_and_fill(pytester: pytest.Pytester, sabotage: str) -> Judged:
    """A run in whose middle something happens to its folder."""
    body = f"""
import os, pathlib

@pytest.mark.requirement("NMT-02")
def test_one(bench):
    bench.start()
    latest = pathlib.Path("reports/latest").resolve()
    {sabotage}

@pytest.mark.requirement("NMT-02")
def test_two(bench):
    bench.start()
"""
    return judge(pytester, body)


FULL = """
    for file in pathlib.Path("/proc/self/fd").iterdir():
        if ".results.json." in os.path.realpath(file):
            os.dup2(os.open("/dev/full", os.O_RDWR), int(file.name))
"""


@pytest.mark.parametrize(
    "sabotage",
    [
        "import shutil; shutil.rmtree(latest)",
        "os.rename(latest / 'traces', latest / 'gone')",
    ],
)
def test_a_folder_that_goes_away_is_no_failure_of_the_device(
    pytester: pytest.Pytester, sabotage: str
) -> None:
    """Who cannot write a record says so, with the remedy, and ends with 11."""
    run = write_and_fill(pytester, sabotage)
    assert run.status == 11
    assert "choose another place with --can-reports DIR" in run.text
    assert "INTERNALERROR" not in run.text


def test_a_full_disk_is_told_once(pytester: pytest.Pytester) -> None:
    """Results that cannot be written are a problem of the run, and cost its good end."""
    run = write_and_fill(pytester, FULL)
    assert run.status == 11
    assert "No space left on device" in run.section("problems of the bench")
    assert run.section("problems of the bench").count("No space left") == 1
    assert "INTERNALERROR" not in run.text


LEFT = """
@pytest.mark.requirement("NMT-02")
def test_leaves_it_elsewhere(bench):
    bench.forget()
"""


def test_a_device_that_cannot_be_put_back_is_a_problem_of_its_own(
    pytester: pytest.Pytester, tmp_path: Path
) -> None:
    """Tests that passed stay passed; a section says what was left behind, and the run ends 11."""
    with scripted(tmp_path, [answer(power=True), answer(), answer()], can=["power"]) as address:
        run = judge(pytester, LEFT, desk(pytester.path, "left", address))
    assert run.outcomes == {"test_leaves_it_elsewhere": "passed"}
    problem = run.section("problems of the bench")
    assert "the device could not be put back as it was: commissioning: bench 'desk'" in problem
    assert run.section("not run") == ""
    assert run.status == 11
    assert run.results["summary"]["exit_status"] == 11
    assert problem.strip() in run.results["summary"]["problems"]
