"""The firmware of the independent keypad: one loop of timers, and faults where they act."""

from __future__ import annotations

import sys
from typing import NamedTuple

from tests.external.device.wires import Frame, Line

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

# States of the firmware. The last three are those of the heartbeat.
OFF, BOOTING, WAITING, ECHOING = "off", "booting", "waiting", "echoing"
PRE_OPERATIONAL, OPERATIONAL, STOPPED = "pre-operational", "operational", "stopped"
HEARTBEAT_STATE = {PRE_OPERATIONAL: 0x7F, OPERATIONAL: 0x05, STOPPED: 0x04}


def say(*words: object) -> None:
    """One line for whoever started it."""
    sys.stdout.write(" ".join(map(str, words)) + "\n")
    sys.stdout.flush()


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
