r"""A keypad node written by an outsider, from the Italian source and the control protocol alone.

It shares nothing with the bundled model: a firmware-like main loop, keys that are sampled on a
grid of 5 ms and counted, heartbeats on a timer that the reset starts. The suite must accept it
as it is, and must blame each of its faults (``--fault NAME``; ``--fault list`` names them).

    python keypad_device.py --channel vcan0 --control tcp:127.0.0.1:5555
    python keypad_device.py --interface udp_multicast --channel 239.0.0.1:43113 \
        --control unix:/tmp/k

It prints one line when it is ready, and one each time when its memory is written.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import select
import signal
import socket
import struct
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple, Protocol

KEYS = ("on_off", "aut", "k3", "k4", "k5", "k6", "k7", "k8")
SERVICE_KEYS = frozenset(("on_off", "aut"))
MS = 1_000_000
SCAN = 5 * MS
INITIALISATION = 60 * MS
EMCY_AFTER = 12 * MS
ECHO_FIRST = 30 * MS
ECHO_PERIOD = 100 * MS
STORE_AFTER = 150 * MS
BIT_RATES = {1: 500_000, 2: 250_000, 3: 125_000, 4: 100_000, 5: 50_000, 6: 20_000}
NEVER = 1 << 62
MAX_LINE = 65_536

# States of the firmware. The last three are those of the heartbeat.
OFF, BOOTING, WAITING, ECHOING = "off", "booting", "waiting", "echoing"
PRE_OPERATIONAL, OPERATIONAL, STOPPED = "pre-operational", "operational", "stopped"
HEARTBEAT_STATE = {PRE_OPERATIONAL: 0x7F, OPERATIONAL: 0x05, STOPPED: 0x04}

FAULTS = {
    # commissioning
    "echo-slow": "the echo comes every 115 ms",
    "echo-alive": "heartbeats go on while it echoes",
    "service-rate": "commissioning runs at the stored bit rate, not at 125 kbit/s",
    "service-one-key": "one of the two keys is enough for commissioning",
    "service-boot": "a boot-up is sent before it waits for parameters",
    "heartbeat-swapped": "the heartbeat time is read low byte first",
    "heartbeat-signed": "heartbeat times from 32768 ms on are taken for none",
    "code-five": "bit-rate code 5 is read as 100 kbit/s",
    "code-default": "unknown bit-rate codes keep the old rate",
    "id-three-bits": "only three bits of the node id are stored",
    "debounce-tens": "the debounce time is counted in steps of 10 ms",
    "store-slow": "parameters are stored two seconds after the first echo",
    "sync-in-echo": "the echo has 0 in the place of the sync time",
    # start
    "boot-twice": "boot-up is sent twice",
    "emcy-first": "EMCY comes before boot-up",
    "emcy-swapped": "the error code of EMCY is sent high byte first",
    "emcy-none": "no EMCY after boot-up",
    "autostart": "after power-on it becomes operational by itself",
    # NMT
    "nmt-all": "commands to all nodes are not obeyed",
    "nmt-low-bits": "only four bits of the node id in a command are compared",
    "nmt-stop-start": "from stopped, no command is obeyed",
    "nmt-long": "an NMT frame of 3 bytes for another node is obeyed",
    "nmt-reset-quiet": "reset communication leads to pre-operational without boot-up",
    "nmt-reset-memory": "reset node brings back the factory heartbeat time",
    # heartbeat
    "heartbeat-toggle": "bit 7 of the heartbeat toggles",
    "heartbeat-key": "each key frame restarts the heartbeat period",
    "heartbeat-led": "each LED frame puts the next heartbeat off by 20 ms",
    "heartbeat-fast": "the heartbeat runs 3 % fast",
    "heartbeat-stale": "the first heartbeat after a command shows the old state",
    "heartbeat-zero": "period 0 is read as 1 s",
    # keys
    "keys-reversed": "bits of the key frame are in reverse order",
    "keys-release": "releases are reported without debounce",
    "keys-shared": "one debounce timer serves all keys",
    "keys-entry": "no key frame when it becomes operational",
    "keys-pre": "key frames are sent in pre-operational, too",
    "keys-latch": "a debounced press is reported once more after 300 ms",
    "keys-bounce": "the debounce time runs from the first edge",
    "keys-backlog": "changes while stopped are sent one by one at entry",
    # LEDs
    "leds-coupled": "writing the steady map clears the blink map",
    "leds-pre": "LED frames act in pre-operational, too",
    "leds-blink-wins": "where both bits are set the LED blinks",
    "leds-or": "LED bits are only ever added",
    "leds-short": "a frame without data switches all LEDs off",
    # robustness
    "crash-empty": "an LED frame without data restarts it",
    "extended": "extended frames are taken for base frames",
    "param-open": "the commissioning frame is obeyed in operational, too",
    "remote-answers": "a remote frame of its key frame is answered in every state",
    "load-late": "each frame from the bus puts the next heartbeat off by 1 ms",
    "sdo-echo": "it answers SDO requests while it echoes",
}


def say(*words: object) -> None:
    """One line for whoever started it."""
    sys.stdout.write(" ".join(map(str, words)) + "\n")
    sys.stdout.flush()


class Frame(NamedTuple):
    """A classical CAN frame."""

    ident: int
    data: bytes = b""
    extended: bool = False
    remote: bool = False


class Line(Protocol):
    """The wire, as this program uses it."""

    def fileno(self) -> int:
        """What to select on."""
        ...

    def send(self, frame: Frame) -> None:
        """Send, or lose, one frame."""
        ...

    def drain(self) -> Iterator[Frame]:
        """Every frame that waits."""
        ...


class SocketCan:
    """A raw CAN socket of Linux."""

    LAYOUT = struct.Struct("=IB3x8s")

    def __init__(self, channel: str) -> None:
        self._socket = socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
        self._socket.bind((channel,))
        self._socket.setblocking(False)

    def fileno(self) -> int:
        """What to select on."""
        return self._socket.fileno()

    def send(self, frame: Frame) -> None:
        """Send one frame; a full queue loses it, as an overrun controller would."""
        with contextlib.suppress(OSError):
            self._socket.send(self.LAYOUT.pack(frame.ident, len(frame.data), frame.data))

    def drain(self) -> Iterator[Frame]:
        """Every frame that waits."""
        while True:
            try:
                raw = self._socket.recv(self.LAYOUT.size)
            except OSError:
                return
            ident, length, data = self.LAYOUT.unpack(raw)
            extended, remote = bool(ident & 0x8000_0000), bool(ident & 0x4000_0000)
            size = 0 if remote else min(length, 8)
            yield Frame(ident & 0x1FFF_FFFF, data[:size], extended, remote)


class PythonCan:
    """Any interface of python-can that has a file number, e.g. udp_multicast."""

    def __init__(self, interface: str, channel: str) -> None:
        import can  # noqa: PLC0415 - SocketCAN does without

        self._can = can
        group, _, port = channel.partition(":")
        more: dict[str, Any] = {"port": int(port)} if port else {}
        self._bus = can.Bus(interface=interface, channel=group, **more)

    def fileno(self) -> int:
        """What to select on."""
        return self._bus.fileno()

    def send(self, frame: Frame) -> None:
        """Send one frame."""
        with contextlib.suppress(self._can.CanError):
            self._bus.send(
                self._can.Message(
                    arbitration_id=frame.ident, data=frame.data, is_extended_id=False
                )
            )

    def drain(self) -> Iterator[Frame]:
        """Every frame that waits."""
        while (seen := self._bus.recv(0)) is not None:
            if seen.is_error_frame or seen.is_fd:
                continue
            yield Frame(
                seen.arbitration_id, bytes(seen.data), seen.is_extended_id, seen.is_remote_frame
            )


class Parameters(NamedTuple):
    """What the non-volatile memory holds: the commissioning frame."""

    node_id: int
    code: int
    heartbeat: int
    sync: int
    debounce: int

    @classmethod
    def from_bytes(cls, data: bytes, fault: str) -> Parameters:
        """As the commissioning frame brings them."""
        node_id, code, high, low, sync, debounce = data[:6]
        if fault == "heartbeat-swapped":
            high, low = low, high
        if fault == "id-three-bits":
            node_id = node_id & 7 or 8
        return cls(node_id, code, high << 8 | low, sync, debounce)


class Keypad:
    """The firmware: told the time in ns of the monotonic clock, it sends by itself."""

    def __init__(self, line: Line, memory: Parameters, fault: str) -> None:
        self.line = line
        self.memory = memory
        self.factory = memory
        self.fault = fault
        self.state = OFF
        self.wire_rate: int | None = None
        self.held: frozenset[str] = frozenset()
        self.emcy_at = self.store_at = self.again_at = NEVER
        self._use(memory)
        self._clear()

    # What the bench does -----------------------------------------------------------------

    def power(self, on: bool, now: int) -> None:
        """Switch the supply."""
        if on and self.state == OFF:
            self._reset(now)
        elif not on:
            self._clear()
            self.state = OFF

    def hold(self, keys: frozenset[str], now: int) -> None:
        """Hold exactly these keys down."""
        if keys == self.held:
            return
        self.held = keys
        if self.state in HEARTBEAT_STATE:
            self._wake_scan(now)

    def leds(self) -> dict[str, str]:
        """What an eye would see."""
        shown = {}
        for bit, key in enumerate(KEYS):
            steady, blink = self.steady >> bit & 1, self.blink >> bit & 1
            if self.fault == "leds-blink-wins" and blink:
                steady = 0
            shown[key] = "on" if steady else "blink" if blink else "off"
        return shown

    # Time --------------------------------------------------------------------------------

    def due(self) -> int:
        """When to call `run` next."""
        return min(
            self.boot_at,
            self.emcy_at,
            self.beat_at,
            self.scan_at,
            self.echo_at,
            self.store_at,
            self.again_at,
        )

    def run(self, now: int) -> None:
        """Do what is due, oldest first."""
        while (due := self.due()) <= now:
            if due == self.boot_at:
                self._boot(due)
            elif due == self.emcy_at:
                self.emcy_at = NEVER
                self._emcy()
            elif due == self.beat_at:
                self._beat()
            elif due == self.scan_at:
                self._scan(due)
            elif due == self.echo_at:
                self._echo(due)
            elif due == self.store_at:
                self.store_at = NEVER
                self._store(self.received)
            else:
                self.again_at = NEVER
                self._send_keys(due)

    # Reset and start ---------------------------------------------------------------------

    def _use(self, memory: Parameters) -> None:
        self.node_id = memory.node_id
        self.rate = BIT_RATES.get(memory.code, 250_000)
        if self.fault == "code-five" and memory.code == 5:
            self.rate = 100_000
        self.period = memory.heartbeat * MS
        if self.fault == "heartbeat-signed" and memory.heartbeat > 32_767:
            self.period = 0
        if self.fault == "heartbeat-zero" and not memory.heartbeat:
            self.period = 1000 * MS
        if self.fault == "heartbeat-fast":
            self.period = self.period * 97 // 100
        step = 10 if self.fault == "debounce-tens" else 100
        self.samples = memory.debounce * step * MS // SCAN

    def _clear(self) -> None:
        """Everything volatile."""
        self.boot_at = NEVER
        self.emcy_at = NEVER
        self.beat_at = NEVER
        self.scan_at = NEVER
        self.echo_at = NEVER
        self.store_at = NEVER
        self.again_at = NEVER
        self.reset_at = 0
        self.steady = self.blink = 0
        self.stable = 0
        self.counts = [0] * len(KEYS)
        self.counted = [0] * len(KEYS)
        self.entering = False
        self.backlog: list[int] = []
        self.received: Parameters = self.memory
        self.echo = b""
        self.toggle = 0
        self.stale: int | None = None
        self.keys_matter = True

    def _reset(self, now: int, keys_matter: bool = True) -> None:
        """From power-on or an NMT command to the end of the initialisation."""
        self._clear()
        self._use(self.memory)
        self.state = BOOTING
        self.reset_at = now
        self.boot_at = now + INITIALISATION
        self.keys_matter = keys_matter

    def _service_keys(self) -> bool:
        if self.fault == "service-one-key":
            return bool(self.held & SERVICE_KEYS)
        return self.held == SERVICE_KEYS

    def _boot(self, now: int) -> None:
        self.boot_at = NEVER
        if self.keys_matter and self._service_keys():
            self.state = WAITING
            if self.fault != "service-rate":
                self.rate = 125_000
            if self.fault == "service-boot":
                self._send(0x700 + self.node_id, bytes(1))
            return
        self.state = PRE_OPERATIONAL
        if self.fault == "emcy-first":
            self._emcy()
        elif self.fault != "emcy-none":
            self.emcy_at = now + EMCY_AFTER
        self._send(0x700 + self.node_id, bytes(1))
        if self.fault == "boot-twice":
            self._send(0x700 + self.node_id, bytes(1))
        if self.period:
            # The timer runs since the reset: beats on its grid, the first one after boot-up.
            elapsed = (now - self.reset_at) // self.period + 1
            self.beat_at = self.reset_at + elapsed * self.period
        if self.held:
            self._wake_scan(now)
        if self.fault == "autostart":
            self._enter(OPERATIONAL, now)

    def _emcy(self) -> None:
        code = b"\x50\x00" if self.fault == "emcy-swapped" else b"\x00\x50"
        self._send(0x080 + self.node_id, code + b"\x01" + bytes(5))

    def _beat(self) -> None:
        value = HEARTBEAT_STATE.get(self.state, 0x7F)
        if self.stale is not None:
            value, self.stale = self.stale, None
        if self.fault == "heartbeat-toggle":
            self.toggle ^= 0x80
            value |= self.toggle
        self._send(0x700 + self.node_id, bytes((value,)))
        self.beat_at += self.period

    # Keys --------------------------------------------------------------------------------

    def _wake_scan(self, now: int) -> None:
        """The next sample on the grid.

        A real scan never rests; where nothing moves its samples show nothing, so none is taken.
        """
        if self.scan_at == NEVER:
            self.scan_at = now + SCAN - (now - self.reset_at) % SCAN

    def _scan(self, now: int) -> None:
        self.scan_at = NEVER
        if self.state not in HEARTBEAT_STATE:
            return
        before = self.stable
        restless = False
        for bit, key in enumerate(KEYS):
            pressed = int(key in self.held)
            started = self.fault == "keys-bounce" and self.counts[bit]
            if pressed == self.stable >> bit & 1 and not started:
                self.counts[bit] = 0
                continue
            self.counts[bit] += 1
            wanted = 0 if self.fault == "keys-release" and not pressed else self.samples
            if self.counts[bit] <= wanted:
                restless = True
            else:
                self.counts[bit] = 0
                self.stable = self.stable & ~(1 << bit) | pressed << bit
        if self.fault == "keys-shared" and any(self.counts):
            most = min(count for count in self.counts if count)
            self.counts = [most if count else 0 for count in self.counts]
        if restless:
            self.scan_at = now + SCAN
        self._report(before, now)

    def _report(self, before: int, now: int) -> None:
        if self.state == OPERATIONAL:
            if self.fault == "keys-backlog":
                for value in self.backlog:
                    self._send(0x180 + self.node_id, bytes((value,)))
                self.backlog.clear()
            if self.entering and self.fault == "keys-entry":
                self.entering = False
            elif self.entering or self.stable != before:
                self.entering = False
                self._send_keys(now)
                if self.fault == "keys-latch" and self.stable & ~before:
                    self.again_at = now + 300 * MS
        elif self.stable != before:
            self.backlog.append(self.stable)
            if self.fault == "keys-pre" and self.state == PRE_OPERATIONAL:
                self._send_keys(now)

    def _send_keys(self, now: int) -> None:
        value = self.stable
        if self.fault == "keys-reversed":
            value = int(f"{value:08b}"[::-1], 2)
        self._send(0x180 + self.node_id, bytes((value,)))
        if self.fault == "heartbeat-key" and self.period:
            self.beat_at = now + self.period

    # Commissioning -----------------------------------------------------------------------

    def _echo(self, now: int) -> None:
        if self.store_at == NEVER and self.state == WAITING:
            delay = 2000 * MS if self.fault == "store-slow" else STORE_AFTER
            self.store_at = now + delay
            if self.fault == "echo-alive":
                self.beat_at = now + 1000 * MS
                self.period = 1000 * MS
        self.state = ECHOING
        self._send(0x3F8, self.echo)
        self.echo_at = now + (115 * MS if self.fault == "echo-slow" else ECHO_PERIOD)

    def _take_parameters(self, data: bytes, now: int) -> None:
        if self.echo_at != NEVER or len(data) < 6 or not 1 <= data[0] <= 15:
            return
        self.received = Parameters.from_bytes(data, self.fault)
        if self.fault == "code-default" and self.received.code not in BIT_RATES:
            self.received = self.received._replace(code=self.memory.code)
        self.echo = data[:6] + b"\x00\x00"
        if self.fault == "sync-in-echo":
            self.echo = data[:4] + b"\x00" + data[5:6] + b"\x00\x00"
        self.echo_at = now + ECHO_FIRST

    def _store(self, parameters: Parameters) -> None:
        self.memory = parameters
        say("stored", *parameters)

    # Frames ------------------------------------------------------------------------------

    def _send(self, ident: int, data: bytes) -> None:
        if self.wire_rate in {None, self.rate}:
            self.line.send(Frame(ident, data))

    def receive(self, frame: Frame, now: int) -> None:
        """One frame from the bus."""
        if self.state in {OFF, BOOTING} or self.wire_rate not in {None, self.rate}:
            return
        frame = self._misread(frame, now)
        if frame.extended or frame.remote:
            return
        if self.state == WAITING:
            if frame.ident == 0x4F8:
                self._take_parameters(frame.data, now)
        elif self.state == ECHOING:
            if self.fault == "sdo-echo" and frame.ident == 0x600 + self.node_id:
                self._send(0x580 + self.node_id, b"\x80" + bytes(7))
        elif frame.ident == 0:
            self._command(frame.data, now)
        elif frame.ident - self.node_id in {0x200, 0x300}:
            self._lamp_frame(frame, now)

    def _misread(self, frame: Frame, now: int) -> Frame:
        """The faults that any frame can set off."""
        if self.fault == "load-late" and self.beat_at != NEVER:
            self.beat_at += MS
        elif self.fault == "extended" and frame.extended:
            return frame._replace(ident=frame.ident & 0x7FF, extended=False)
        elif self.fault == "remote-answers":
            asked = frame.remote and frame.ident == 0x180 + self.node_id
            if asked and self.state in HEARTBEAT_STATE:
                self._send_keys(now)
        elif self.fault == "param-open" and frame.ident == 0x4F8 and len(frame.data) >= 6:
            self._store(Parameters.from_bytes(frame.data, ""))
        return frame

    def _lamp_frame(self, frame: Frame, now: int) -> None:
        if self.state != OPERATIONAL and not (
            self.fault == "leds-pre" and self.state == PRE_OPERATIONAL
        ):
            return
        if self.fault == "heartbeat-led" and self.beat_at != NEVER:
            self.beat_at += 20 * MS
        if not frame.data:
            if self.fault == "crash-empty":
                self._reset(now, keys_matter=False)
            elif self.fault == "leds-short":
                self.steady = self.blink = 0
            return
        value = frame.data[0]
        if frame.ident < 0x300:
            self.steady = value | (self.steady if self.fault == "leds-or" else 0)
            if self.fault == "leds-coupled":
                self.blink = 0
        else:
            self.blink = value | (self.blink if self.fault == "leds-or" else 0)

    # NMT ---------------------------------------------------------------------------------

    def _command(self, data: bytes, now: int) -> None:
        if self.fault == "nmt-long" and len(data) == 3:
            data = bytes((data[0], self.node_id))
        if len(data) != 2:
            return
        command, target = data
        mine = {self.node_id} if self.fault == "nmt-all" else {self.node_id, 0}
        if self.fault == "nmt-low-bits":
            target &= 0x0F
        if target not in mine or (self.fault == "nmt-stop-start" and self.state == STOPPED):
            return
        if command == 0x01:
            self._enter(OPERATIONAL, now)
        elif command == 0x02:
            self._enter(STOPPED, now)
        elif command == 0x80:
            self._enter(PRE_OPERATIONAL, now)
        elif command == 0x81:
            if self.fault == "nmt-reset-memory":
                self._store(self.memory._replace(heartbeat=self.factory.heartbeat))
            self._reset(now)
        elif command == 0x82:
            if self.fault == "nmt-reset-quiet":
                self._enter(PRE_OPERATIONAL, now)
            else:
                self._reset(now, keys_matter=False)

    def _enter(self, state: str, now: int) -> None:
        if self.fault == "heartbeat-stale" and state != self.state:
            self.stale = HEARTBEAT_STATE[self.state]
        if state == OPERATIONAL:
            # A start while operational sends the keys again.
            self.entering = True
            self._wake_scan(now)
        else:
            self.entering = False
            self.steady = self.blink = 0
        self.state = state


class Bench:
    """The server of the control protocol: one session at a time."""

    def __init__(self, device: Keypad, address: str, same_clock: bool) -> None:
        self.device = device
        self.same_clock = same_clock
        self.peer: socket.socket | None = None
        self._text = b""
        kind, _, rest = address.partition(":")
        if kind == "unix":
            Path(rest).unlink(missing_ok=True)
            self.listener = socket.socket(socket.AF_UNIX)
            self.listener.bind(rest)
        elif kind == "tcp":
            host, _, port = rest.rpartition(":")
            family = socket.AF_INET6 if ":" in host else socket.AF_INET
            self.listener = socket.socket(family)
            self.listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            self.listener.bind((host.strip("[]"), int(port)))
        else:
            raise SystemExit(f"--control {address}: write tcp:HOST:PORT or unix:PATH")
        self.listener.listen()

    def accept(self) -> None:
        """A new client; the old one, if any, is gone."""
        self._leave()
        self.peer, _ = self.listener.accept()
        if self.peer.family != socket.AF_UNIX:
            self.peer.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def read(self) -> None:
        """Answer every complete line."""
        assert self.peer is not None
        try:
            chunk = self.peer.recv(MAX_LINE)
        except OSError:
            chunk = b""
        if not chunk:
            self._leave()
            return
        self._text += chunk
        while b"\n" in self._text and self.peer is not None:
            line, self._text = self._text.split(b"\n", 1)
            answer = self._answer(line)
            try:
                self.peer.sendall(json.dumps(answer).encode() + b"\n")
            except OSError:
                self._leave()
                return
            if answer.get("ok") and answer.pop("bye", False):
                self._leave()

    def _leave(self) -> None:
        if self.peer is not None:
            self.peer.close()
        self.peer = None
        self._text = b""

    def _answer(self, line: bytes) -> dict[str, Any]:
        number = None
        try:
            request = json.loads(line)
            number = request["id"]
            return {"id": number, "ok": True} | self._do(request)
        except (ValueError, KeyError, TypeError, AttributeError) as error:
            return {"id": number, "ok": False, "error": f"{type(error).__name__}: {error}"}

    def _do(self, request: dict[str, Any]) -> dict[str, Any]:
        device = self.device
        match request["do"]:
            case "hello":
                can = ["power", "keys", "leds", "bus"]
                said = {"protocol": 1, "device": "independent keypad", "can": can}
                return said | ({"clock": "same"} if self.same_clock else {})
            case "state":
                rate = {} if device.wire_rate is None else {"bus": device.wire_rate}
                down = [key for key in KEYS if key in device.held]
                return {"power": device.state != OFF, "held": down} | rate
            case "power":
                on = _flag(request["on"])
                return self._timed(lambda now: device.power(on, now))
            case "keys":
                held = frozenset(request["held"])
                if held - set(KEYS):
                    raise ValueError(f"no key {', '.join(sorted(held - set(KEYS)))}")
                return self._timed(lambda now: device.hold(held, now))
            case "leds":
                if "for" in request:
                    raise ValueError("LED edges are not watched here")
                return {"leds": device.leds()}
            case "bus":
                device.wire_rate = int(request["bitrate"])
                return {}
            case "bye":
                return {"bye": True}
            case other:
                raise ValueError(f"cannot do {other!r}")

    def _timed(self, action: Any) -> dict[str, Any]:
        began = time.time()
        now = time.monotonic_ns()
        self.device.run(now)
        action(now)
        ended = time.time()
        return {"at": [began, ended]} if self.same_clock else {}


def _flag(value: object) -> bool:
    if not isinstance(value, bool):
        raise TypeError(f"true or false, not {value!r}")
    return value


def serve(device: Keypad, bench: Bench) -> None:
    """The main loop."""
    while True:
        pause = max(0, device.due() - time.monotonic_ns()) / 1e9
        watched: list[Any] = [device.line, bench.listener]
        if bench.peer is not None:
            watched.append(bench.peer)
        ready, _, _ = select.select(watched, [], [], min(pause, 3600))
        device.run(time.monotonic_ns())
        if device.line in ready:
            for frame in device.line.drain():
                now = time.monotonic_ns()
                device.run(now)
                device.receive(frame, now)
        if bench.listener in ready:
            bench.accept()
        elif bench.peer in ready:
            bench.read()


def main() -> None:
    """Read the command line and be a keypad until killed."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--interface", default="socketcan")
    parser.add_argument("--channel", default="vcan0")
    parser.add_argument("--control", default="tcp:127.0.0.1:5555", metavar="ADDRESS")
    parser.add_argument("--same-clock", action="store_true", help="vouch for the clock")
    parser.add_argument("--memory", default="1,2,1000,0,1", metavar="ID,CODE,MS,SYNC,DEBOUNCE")
    parser.add_argument("--on", action="store_true", help="powered from the start")
    parser.add_argument("--fault", default="", choices=["", "list", *FAULTS], metavar="NAME")
    given = parser.parse_args()
    if given.fault == "list":
        for name, text in FAULTS.items():
            say(f"{name:18}", text)
        return
    line: Line = (
        SocketCan(given.channel)
        if given.interface == "socketcan"
        else PythonCan(given.interface, given.channel)
    )
    device = Keypad(line, Parameters(*map(int, given.memory.split(","))), given.fault)
    bench = Bench(device, given.control, given.same_clock)
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(0))
    with contextlib.suppress(OSError, AttributeError):  # no right to: then without
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(10))
    if given.on:
        device.power(True, time.monotonic_ns())
    say("ready")
    with contextlib.suppress(KeyboardInterrupt):
        serve(device, bench)


if __name__ == "__main__":
    main()
