"""The conformance kit passes our own benches, and finds what is wrong with others."""

from __future__ import annotations

import contextlib
import json
import socket
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from hil_tests.bench.conformance import Finding, check_server, check_stage, main, wrong
from hil_tests.bench.virtual import VirtualPort, VirtualStage
from hil_tests.clock import MS, S
from hil_tests.config import load_keypad, load_profile
from hil_tests.trace import Sighting
from node_model import devices
from node_model.frame import Frame
from tests.host.test_process import free_channel, hosted

PROFILE = load_keypad("keypad")
ALL = ["power", "keys", "leds", "bitrate"]
RATE = 250_000


def virtual() -> VirtualStage:
    """The bundled model in virtual time."""
    return VirtualStage(devices.read("keypad", None))


def test_the_virtual_stage_passes() -> None:
    """Port, supply, keys and LEDs of the virtual bench keep every law, and all were checked."""
    findings = check_stage(virtual(), PROFILE)
    assert wrong(findings) == []
    assert not [each for each in findings if each.skipped]
    assert len(findings) == 6


def test_what_a_stage_lacks_is_not_checked() -> None:
    """A bench without LEDs is not called wrong for it."""
    stage = virtual()
    stage.leds = None
    findings = check_stage(stage, PROFILE)
    assert wrong(findings) == []
    assert [each.skipped for each in findings if each.skipped] == ["the bench has no leds"] * 2


def test_the_stage_of_a_drive_passes() -> None:
    """Errors in place of keys and LEDs."""
    findings = check_stage(VirtualStage(devices.read("drive")), load_profile("drive"))
    assert wrong(findings) == []
    assert not [each for each in findings if each.skipped]
    assert [each for each in findings if each.check.startswith("Every error of the profile")]
    assert len(findings) == 4


class Twice(VirtualPort):
    """A port that hands every own frame out twice."""

    def __init__(self, port: VirtualPort) -> None:
        super().__init__(port.world)
        self.tester = port.tester
        self._again: Any = None

    def next(self, until: int, also: Any = ()) -> Any:
        """Each own frame, and again."""
        if self._again is not None:
            item, self._again = self._again, None
            return item
        item = super().next(until, also)
        self._again = item if getattr(item, "own", False) else None
        return item


class Lossy(Twice):
    """A port that never shows own frames."""

    def next(self, until: int, also: Any = ()) -> Any:
        """Frames of others only."""
        while True:
            item = VirtualPort.next(self, until, also)
            if not getattr(item, "own", False):
                return item


class Foreign(Twice):
    """A port whose stamps count from another start."""

    def next(self, until: int, also: Any = ()) -> Any:
        """Each frame an hour earlier."""
        item = VirtualPort.next(self, until, also)
        return item._replace(at=item.at - 3600 * S) if isinstance(item, Sighting) else item


class Hasty(Twice):
    """A port that does not wait at all."""

    def next(self, until: int, also: Any = ()) -> Any:
        """Long waits end too soon."""
        until -= 5 * MS if until - self.now() > 20 * MS else 0
        return VirtualPort.next(self, until, also)


@pytest.mark.parametrize(
    ("port", "found"),
    [
        (Twice, "40 came back as own"),
        (Lossy, "0 came back as own"),
        (Foreign, "stamps are on another clock"),
        (Hasty, "before its time, with nothing"),
    ],
)
def test_a_port_that_breaks_a_law_is_found(port: type[Twice], found: str) -> None:
    """Each law of a port has a port that breaks it, and the check that tells."""
    stage = virtual()
    stage.port = port(stage.port)
    assert any(found in text for text in wrong(check_stage(stage, PROFILE)))


@contextlib.contextmanager
def model_server(*arguments: str) -> Iterator[tuple[str, str]]:
    """Channel and control address of a hosted model."""
    channel = free_channel()
    options = ("--channel", channel, "--control", "tcp:127.0.0.1:0", *arguments)
    with hosted(*options) as (_, ready):
        yield channel, ready.split()[1].removeprefix("control=")


@pytest.mark.slow
def test_the_control_server_of_a_hosted_drive_passes() -> None:
    """Its errors can be raised, one by one and together; unknown ones are refused."""
    with model_server("--profile", "drive") as (_, address):
        has = ["power", "faults", "bitrate"]
        findings = check_server(address, has, load_profile("drive"), RATE)
    assert wrong(findings) == []
    assert [each for each in findings if each.check.startswith("Every error of the profile")]


@pytest.mark.slow
def test_the_hosted_model_passes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The command prints a line a check, every one ok, and ends with 0."""
    with model_server() as (channel, address):
        desk = tmp_path / "desk.toml"
        sections = "".join(f'[{name}]\ndriver = "control"\n' for name in ALL)
        desk.write_text(
            f'[bus]\ninterface = "udp_multicast"\nchannel = "{channel}"\nexclusive = true\n'
            f'[control]\naddress = "{address}"\n{sections}',
            "utf-8",
        )
        status = main([f"--can-bench={desk}"])
    out, err = capsys.readouterr()
    assert (status, err) == (0, ""), out
    lines = out.splitlines()
    assert len(lines) == 16
    assert all(line.startswith("ok     ") for line in lines), out


Answerer = Callable[[dict[str, Any]], dict[str, Any]]


def ideal(request: dict[str, Any], state: dict[str, Any]) -> dict[str, Any]:
    """What a good server answers, without instants."""
    do = request.get("do")
    names = list(PROFILE.key_bits)
    if do == "hello":
        can = ["power", "keys", "leds", "bus", "key-sequences", "led-edges"]
        return {"protocol": 1, "device": "ideal", "can": can}
    if do == "power":
        state["power"] = request["on"]
    elif do == "keys" and "held" in request:
        if set(request["held"]) - set(names):
            raise ValueError("no such key")
        state["held"] = request["held"]
    elif do == "leds" and "for" in request:
        threading.Event().wait(request["for"])
        return {"start": dict.fromkeys(names, False), "edges": []}
    elif do == "leds":
        return {"leds": dict.fromkeys(names, "off")}
    elif do == "state":
        return dict(state)
    elif do not in {"keys", "bus", "bye"}:
        raise ValueError("what?")
    return {}


@contextlib.contextmanager
def server(folder: Path, change: Callable[[dict[str, Any], dict[str, Any]], Any]) -> Iterator[str]:
    """A good server, but for what `change` makes of its answers (None = hang up)."""
    path = folder / "control"
    over = threading.Event()
    with socket.socket(socket.AF_UNIX) as listener:
        listener.bind(str(path))
        listener.listen()
        thread = threading.Thread(target=_serve, args=(listener, change, over))
        thread.start()
        try:
            yield f"unix:{path}"
        finally:
            over.set()
            with contextlib.suppress(OSError), socket.socket(socket.AF_UNIX) as waker:
                waker.connect(str(path))
            thread.join()


def _serve(listener: socket.socket, change: Any, over: threading.Event) -> None:
    state: dict[str, Any] = {"power": False, "held": []}
    while not over.is_set():
        peer, _ = listener.accept()
        with peer, peer.makefile("rb") as lines, contextlib.suppress(OSError):
            for line in lines:
                answer = _answer(line, state, change)
                if answer is None:
                    break
                peer.sendall(answer)
                if b'"bye"' in line:
                    break


def _answer(line: bytes, state: dict[str, Any], change: Any) -> bytes | None:
    try:
        request = json.loads(line) if len(line) <= 65_537 else None
        if not isinstance(request, dict):
            raise ValueError("no object")
    except ValueError as error:
        request, fields = {}, {"ok": False, "error": str(error)}
    else:
        try:
            fields = {"id": request.get("id"), "ok": True, **ideal(request, state)}
        except ValueError as error:
            fields = {"id": request.get("id"), "ok": False, "error": str(error)}
    changed = change(request, fields)
    return None if changed is None else json.dumps(changed).encode() + b"\n"


def same(_: dict[str, Any], fields: dict[str, Any]) -> dict[str, Any]:
    """The answer as it is."""
    return fields


def on(do: str, **wrong_fields: Any) -> Callable[..., Any]:
    """Answers to `do` with some fields changed; None as a value removes one."""

    def change(request: dict[str, Any], fields: dict[str, Any]) -> dict[str, Any]:
        if request.get("do") != do:
            return fields
        mixed = {**fields, **wrong_fields}
        return {key: value for key, value in mixed.items() if value is not None}

    return change


def yes_man(_: dict[str, Any], fields: dict[str, Any]) -> dict[str, Any]:
    """Whatever was asked, it is ok."""
    return {**fields, "ok": True}


def leaver(request: dict[str, Any], fields: dict[str, Any]) -> dict[str, Any] | None:
    """Hangs up on what it does not understand."""
    return fields if request else None


@pytest.mark.slow
def test_an_ideal_server_passes(tmp_path: Path) -> None:
    """Without instants and with the least of answers a server is fine."""
    with server(tmp_path, same) as address:
        findings = check_server(address, ALL, PROFILE, RATE)
    assert wrong(findings) == []


@pytest.mark.slow
@pytest.mark.parametrize(
    ("change", "found"),
    [
        (on("hello", protocol=2), "protocol 2"),
        (on("hello", device=None), "device None"),
        (on("hello", can=["power"]), "lacks keys, leds, bus"),
        (on("hello", can="power"), "a list of names"),
        (yes_man, "it must be refused"),
        (leaver, "it hung up instead of answering"),
        (on("power", at=[2, 1]), "is no [began, ended]"),
        (on("power", ok=False, error="no"), "refused power"),
        (on("state", power=None, held=["k3"]), "state says held ['k3']"),
        (on("keys", ok=True), "a key that the device does not have was accepted"),
        (on("keys", at=[[0, 1]]), "one [began, ended] a step"),
        (on("leds", leds={"aut": "on"}), "of the profile are missing"),
        (on("leds", leds=dict.fromkeys(PROFILE.led_bits, "dim")), "write off, on or blink"),
        (on("leds", edges=[[1, "aut", True], [0, "aut", False]]), "before the one"),
        (on("leds", edges=[[1, "aut", False]]), "changes nothing"),
        (on("bus", ok=False, error="no"), "refused bus"),
        (on("bye", ok=False, error="stay"), "ready for another"),
    ],
)
def test_a_server_that_breaks_the_protocol_is_found(
    tmp_path: Path, change: Callable[..., Any], found: str
) -> None:
    """Each rule of the protocol has a server that breaks it, and the check that tells."""
    with server(tmp_path, change) as address:
        findings = check_server(address, ALL, PROFILE, RATE)
    assert any(found in text for text in wrong(findings)), wrong(findings)


@pytest.mark.slow
def test_instants_of_another_clock_are_found(tmp_path: Path) -> None:
    """A server that says clock same and stamps with its uptime is told so."""

    def change(request: dict[str, Any], fields: dict[str, Any]) -> dict[str, Any]:
        if request.get("do") == "hello":
            return {**fields, "clock": "same"}
        return {**fields, "at": [17.0, 17.1]} if request.get("do") == "power" else fields

    with server(tmp_path, change) as address:
        findings = check_server(address, ALL, PROFILE, RATE)
    assert any("before the request, yet hello says" in text for text in wrong(findings))


def test_a_server_that_is_not_there(tmp_path: Path) -> None:
    """One finding with the remedy, and no other check."""
    (finding,) = check_server(f"unix:{tmp_path}/nobody", ALL, PROFILE, RATE)
    assert "start it, or correct [control] address" in finding.wrong[0]


@pytest.mark.parametrize(
    ("finding", "text"),
    [
        (Finding("All is well."), "ok     All is well."),
        (Finding("It is."), "ok     It is."),
        (Finding("It is.", ("it is not", "nor that")), "WRONG  It is.\n         it is not"),
        (Finding("It is.", skipped="no LEDs"), "-      It is. (not checked: no LEDs)"),
    ],
)
def test_a_finding_is_a_line(finding: Finding, text: str) -> None:
    """What a technician reads begins with ok, WRONG or a dash."""
    assert str(finding).startswith(text)


@pytest.mark.parametrize(
    ("text", "status", "hint"),
    [
        ("[bus]\nchanel = 'x'\n", 4, "bus.chanel"),
        ("[bus]\nchannel = 'can77'\n", 11, "bench unavailable: "),
    ],
)
def test_the_command_tells_what_it_cannot_open(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], text: str, status: int, hint: str
) -> None:
    """A wrong file gives 4, a missing bus 11, each with its cause."""
    desk = tmp_path / "desk.toml"
    desk.write_text(text, "utf-8")
    assert main([f"--can-bench={desk}"]) == status
    assert hint in capsys.readouterr().err


@pytest.mark.slow
def test_the_command_has_a_help_text() -> None:
    """`python -m hil_tests.bench.conformance --help` says what it does to the device."""
    done = subprocess.run(
        [sys.executable, "-m", "hil_tests.bench.conformance", "--help"],
        capture_output=True,
        text=True,
        check=True,
    )
    assert "nothing is stored" in " ".join(done.stdout.split())


def test_frames_of_the_kit_concern_nobody() -> None:
    """The identifier lies in no service of CiA 301 (4.2.0, table 39) for any node id."""
    from hil_tests.bench.conformance_stage import UNUSED_ID  # noqa: PLC0415

    assert Frame(UNUSED_ID).can_id == 0x6FE
    taken = [range(base, base + 0x80) for base in (0x580, 0x600, 0x700)]
    assert not any(UNUSED_ID in each for each in taken)
