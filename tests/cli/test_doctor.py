"""`nodeproof doctor`: one line for each fact, with its remedy."""

from __future__ import annotations

import socket
import threading
from collections.abc import Iterator
from importlib import metadata
from pathlib import Path

import pytest

from hil_tests import cli, doctor
from hil_tests.config import load_bench, load_keypad
from hil_tests.doctor import Sign

BENCH = """
[bus]
interface = "virtual"
channel = "doctor"
[control]
address = "tcp:127.0.0.1:{port}"
[power]
driver = "control"
[bitrate]
driver = "control"
"""

Output = pytest.CaptureFixture[str]


@pytest.fixture
def desk(tmp_path: Path) -> Path:
    """A bench file whose control server does not run."""
    with socket.create_server(("127.0.0.1", 0)) as once:
        port = once.getsockname()[1]
    path = tmp_path / "desk.toml"
    path.write_text(BENCH.format(port=port))
    return path


@pytest.fixture
def served(tmp_path: Path) -> Iterator[Path]:
    """A bench file whose control server says hello and bye, once, and can all but `bus`."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        path = tmp_path / "served.toml"
        path.write_text(BENCH.format(port=server.getsockname()[1]))
        host = threading.Thread(target=greet, args=(server,))
        host.start()
        yield path
        host.join(timeout=5)


def greet(server: socket.socket) -> None:
    """Answers hello and bye."""
    server.settimeout(5)
    peer, _ = server.accept()
    with peer, peer.makefile("rw") as lines:
        lines.readline()
        lines.write('{"id": 1, "ok": true, "protocol": 1, "device": "box", "can": ["power"]}\n')
        lines.flush()
        lines.readline()
        lines.write('{"id": 2, "ok": true}\n')


def test_a_finding_is_one_line_with_its_remedy() -> None:
    """Sign, topic, text, remedy."""
    finding = doctor.Finding(Sign.LACKING, "thing", "is missing", "buy one")

    assert str(finding) == "--  thing           is missing; buy one"
    assert not finding.is_needed


def test_this_machine_is_examined(capsys: Output) -> None:
    """Without a bench file every line stands on its own, and nothing is opened."""
    status = cli.main(["doctor"])

    lines = capsys.readouterr().out.splitlines()
    topics = [line[4:20].strip() for line in lines]
    assert topics[0] == "python"
    assert {"packages", "pytest plugin", "socketcan", "adapters", "receive buffer"} <= {*topics}
    assert status == (11 if any(line.startswith("!!") for line in lines) else 0)


def test_a_missing_package_is_named() -> None:
    """What cannot be imported keeps a run from starting."""

    def version(name: str) -> str:
        if name == "cattrs":
            raise metadata.PackageNotFoundError(name)
        return "1"

    missing, rest = doctor.packages(version)
    assert missing.is_needed
    assert "cattrs" in missing.text
    assert "cattrs" not in rest.text


def test_a_stale_installation_is_told() -> None:
    """Where the entry point is missing, pytest loads the plugin in the checkout only."""
    assert doctor.plugin(frozenset({"hil_tests.plugin"})).sign is Sign.GOOD
    assert "pip install -e ." in str(doctor.plugin(frozenset({"xdist.plugin"})))


def test_no_way_to_vcan_is_lacking_not_wrong() -> None:
    """Virtual time needs no SocketCAN."""
    finding = doctor.socketcan_finding("no interface", "nothing: this kernel has no SocketCAN.")
    assert finding.sign is Sign.LACKING
    assert "this kernel has no SocketCAN" in finding.text


@pytest.mark.parametrize("way", ["native: vcan0 on this kernel", "virtual machine with 6.1: no"])
def test_a_way_to_vcan_is_told(way: str) -> None:
    """This kernel, or a machine."""
    finding = doctor.socketcan_finding("interfaces: can0", way)
    assert finding.sign is Sign.GOOD
    assert way in finding.text


@pytest.mark.parametrize(
    ("may_force", "limit", "sign"),
    [
        (True, 0, Sign.GOOD),
        (False, 8 << 20, Sign.GOOD),
        (False, (8 << 20) - 1, Sign.LACKING),
        (False, 0, Sign.LACKING),
    ],
)
def test_the_receive_buffer_is_granted_by_right_or_by_limit(
    may_force: bool, limit: int, sign: Sign
) -> None:
    """Either the right to exceed the limit, or a limit that is high enough."""
    assert doctor.receive_buffer(may_force=may_force, limit=limit).sign is sign


def test_what_multicast_lacks_has_a_remedy() -> None:
    """The extra is named."""
    assert "[multicast]" in doctor.multicast(has_msgpack=False).remedy
    assert doctor.multicast(has_msgpack=True).sign is Sign.GOOD


def test_a_terminal_is_needed_for_an_operator() -> None:
    """Standard input decides."""
    assert doctor.terminal(True).sign is Sign.GOOD
    assert "operator" in doctor.terminal(False).remedy


def test_a_wrong_bench_file_is_wrong_use(tmp_path: Path, capsys: Output) -> None:
    """All errors of the file are told, with pytest's status for wrong use."""
    path = tmp_path / "wrong.toml"
    path.write_text("[bus]\nchanel = 'can0'\n[power]\ndriver = 'control'\n")

    assert cli.main(["doctor", "--can-bench", str(path)]) == 4
    told = capsys.readouterr().err
    assert "did you mean channel?" in told
    assert "[control]" in told


def test_a_control_server_that_is_not_there_ends_with_11(desk: Path, capsys: Output) -> None:
    """The file is sound, the bus is open, the server is missing: that is a broken bench."""
    assert cli.main(["doctor", "--can-bench", str(desk)]) == 11
    told = capsys.readouterr().out
    assert "ok  bench file" in told
    assert "ok  bus" in told
    assert "!!  control server" in told


def test_a_control_server_that_lacks_a_facility_is_told(served: Path) -> None:
    """Its hello is held against the file, as before a run."""
    finding = doctor.control_finding(load_bench(str(served)), load_keypad("keypad"))
    assert finding.is_needed
    assert "its hello lacks bus" in finding.text


def test_a_control_server_that_can_all_is_greeted(served: Path) -> None:
    """Hello and bye; what it can do is told."""
    text = served.read_text().replace('[bitrate]\ndriver = "control"', "")
    served.write_text(text)

    finding = doctor.control_finding(load_bench(str(served)), load_keypad("keypad"))
    assert finding.sign is Sign.GOOD
    assert "'box'" in finding.text


def test_a_bus_that_is_not_there_is_told(tmp_path: Path) -> None:
    """The text is the port's own, remedy included."""
    path = tmp_path / "desk.toml"
    path.write_text("[bus]\ninterface = 'virtul'\nchannel = 'x'\n")

    finding = doctor.bus_finding(load_bench(str(path)))
    assert finding.is_needed
    assert "did you mean virtual" in finding.text


def test_a_bench_without_channel_leaves_it_to_the_command_line(tmp_path: Path) -> None:
    """A file may leave the bus to --can-iface; what it is commissioned to is asked for."""
    path = tmp_path / "desk.toml"
    path.write_text("[bench]\nname = 'bare'\n")

    _, parameters, bus = doctor.bench_findings(str(path))
    assert "--can-allow-writes" in parameters.remedy
    assert bus.sign is Sign.LACKING
    assert "--can-iface" in bus.remedy
