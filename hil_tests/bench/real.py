"""The real stage: a port on a real bus, and the drivers that the bench file names."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack, suppress
from typing import TYPE_CHECKING

from hil_tests.bench.action import (
    BitRateDriver,
    FaultsDriver,
    HealthDriver,
    KeysDriver,
    LedsDriver,
    PowerDriver,
)
from hil_tests.bench.drivers.command import TIMEOUT_NS as COMMAND_NS
from hil_tests.bench.drivers.command import CommandPower
from hil_tests.bench.drivers.control import (
    ControlBitRate,
    ControlFaults,
    ControlHealth,
    ControlKeys,
    ControlLeds,
    ControlPower,
)
from hil_tests.bench.drivers.neighbour import EXACT_TIME, NeighbourHealth
from hil_tests.bench.drivers.operator import (
    OperatorFaults,
    OperatorKeys,
    OperatorLeds,
    OperatorPower,
)
from hil_tests.bench.drivers.peer import TIMEOUT_NS, ControlSession
from hil_tests.bench.drivers.terminal import ANSWER_NS, Capture, Terminal, ask_done
from hil_tests.bus.port import Port
from hil_tests.clock import Interval
from hil_tests.errors import BenchError, ControlError
from node_model.frame import Frame

if TYPE_CHECKING:
    from hil_tests.bench.action import Action
    from hil_tests.config import BenchFile, DeviceProfile, Setup


class RealStage:
    """A bus and what moves the device on it. Built empty; `fit` adds the facilities.

    Args:
        name: of the bench.
        port: the tester's end.
        bit_rate: at which it runs, bit/s.
        exclusive: nothing else lives on the bus.
        writes_allowed: non-volatile memory may be written.
        fades: capacitors keep the device alive for a while when its supply is cut.
        leave: closes what stands behind it, last opened first.
    """

    virtual = False

    def __init__(
        self,
        name: str,
        port: Port,
        bit_rate: int,
        *,
        exclusive: bool,
        writes_allowed: bool,
        leave: ExitStack,
        fades: bool = True,
    ) -> None:
        self.name = name
        self.port = port
        self.bit_rate = bit_rate
        self.exclusive = exclusive
        self.writes_allowed = writes_allowed
        self.fades = fades
        self.power: PowerDriver | None = None
        self.keys: KeysDriver | None = None
        self.leds: LedsDriver | None = None
        self.faults: FaultsDriver | None = None
        self.bitrate: BitRateDriver | None = None
        self.health: HealthDriver | None = None
        self.checks: list[Callable[[], object]] = []
        """Ask whether what stands behind the bench is still there, the plainest cause first."""
        self._leave = leave

    def renew(self, parameters: Setup) -> bool:  # noqa: ARG002  the stage's verb
        """A real device is what it is: the bench does what it can."""
        return False

    def load(self, frames: Sequence[Frame], share_ppm: int) -> bool:  # noqa: ARG002
        """A tester's adapter cannot hold a known share of a bus."""
        return False

    def end_load(self) -> None:
        """There is none."""

    def disturb(self) -> bool:
        """An adapter sends no error frames at will."""
        return False

    def check(self) -> None:
        """Whether model, control server and bus are still there."""
        for check in self.checks:
            check()
        while self.port.next(self.port.now()) is not None:
            pass

    def at_end(self, do: Callable[[], object]) -> None:
        """Do this when the bench is closed, before all that was asked for earlier."""
        self._leave.callback(do)

    def close(self) -> None:
        """Close everything, in reverse order."""
        self._leave.close()


class InterfaceBitRate:
    """Sets the bit rate on the adapter itself."""

    def __init__(self, port: Port) -> None:
        self._port = port

    def set(self, bit_rate: int) -> Action[Interval]:
        """See BitRateDriver."""
        return _Immediate(self._port, lambda: self._port.set_bit_rate(bit_rate))


class OperatorBitRate:
    """Asks a person to set the adapter's bit rate."""

    def __init__(self, terminal: Terminal) -> None:
        self._terminal = terminal

    def set(self, bit_rate: int) -> Action[Interval]:
        """See BitRateDriver."""
        return ask_done(self._terminal, f"Set the CAN adapter to {bit_rate} bit/s")


class _Immediate:
    """An action that is done while it starts."""

    descriptors: Sequence[int] = ()
    wake_at = 0

    def __init__(self, port: Port, do: Callable[[], None]) -> None:
        self._port = port
        self._do = do
        self._when = Interval(0, 0)

    def start(self, now: int) -> None:
        """Do it."""
        self._do()
        self._when = Interval(now, self._port.now())

    def poll(self, now: int) -> bool:  # noqa: ARG002  the verb of an action
        """It is done."""
        return True

    def result(self) -> Interval:
        """When it was done."""
        return self._when


def open_session(
    stage: RealStage, address: str, leave: ExitStack, timeout_ns: int | None = None
) -> ControlSession:
    """Connect to a control server; `leave` says bye.

    Args:
        stage: learns to ask whether the server is still there.
        address: "tcp:HOST:PORT" or "unix:PATH".
        leave: closes it.
        timeout_ns: how long an answer may take; None = the usual time.

    Raises:
        ControlError: nobody there, or not what the protocol says.
    """
    session = ControlSession(address, timeout_ns or TIMEOUT_NS, clock=stage.port.now)
    leave.callback(session.close)
    session.connect()
    stage.checks.append(session.fileno)
    return session


def patience(file: BenchFile) -> int | None:
    """How long the control server may take for an answer: the longest that a section grants."""
    sections = [getattr(file, name) for name in file.facilities]
    granted = [each.timeout_ns for each in sections if each.driver == "control"]
    return max((each for each in granted if each is not None), default=None)


def fit_control(
    stage: RealStage, session: ControlSession, facilities: Sequence[str], leds: Sequence[str]
) -> None:
    """Give the stage the facilities that a control server serves.

    Raises:
        ControlError: the server lacks one of them.
    """
    needs = {"bitrate": "bus"}
    session.require(*(needs.get(name, name) for name in facilities))
    makers: Mapping[str, Callable[[], object]] = {
        "power": lambda: ControlPower(session),
        "keys": lambda: ControlKeys(session),
        "leds": lambda: ControlLeds(session, leds),
        "faults": lambda: ControlFaults(session),
        "bitrate": lambda: ControlBitRate(session),
    }
    for name in facilities:
        setattr(stage, name, makers[name]())
    if "health" in session.can:
        stage.health = ControlHealth(session)
    elif "bus" in session.can:
        _look_on(stage, session)


def _look_on(stage: RealStage, session: ControlSession) -> None:
    """A simulated device that runs here: the kernel knows when its process had to wait."""
    if EXACT_TIME in os.environ:
        return
    with suppress(OSError):
        if pids := session.processes():
            health = NeighbourHealth(pids)
            stage.at_end(health.close)
            stage.health = health


def fit_from_file(
    stage: RealStage,
    file: BenchFile,
    profile: DeviceProfile,
    session: ControlSession | None,
    capture: Capture | None,
) -> None:
    """Give the stage the facilities that a bench file describes.

    Raises:
        BenchError: a driver cannot be had.
    """
    leds = list(profile.led_bits)
    controlled = [name for name in file.facilities if getattr(file, name).driver == "control"]
    if controlled:
        if session is None:
            raise BenchError(f"{file.path}: {', '.join(controlled)} need a [control] address")
        fit_control(stage, session, controlled, leds)
    if file.power and file.power.driver == "command":
        stage.power = CommandPower(
            file.power.on or (),
            file.power.off or (),
            stage.port.now,
            file.power.timeout_ns or COMMAND_NS,
        )
    asked: Mapping[str, Callable[[Terminal], object]] = {
        "power": OperatorPower,
        "keys": OperatorKeys,
        "leds": lambda terminal: OperatorLeds(terminal, leds),
        "faults": OperatorFaults,
        "bitrate": OperatorBitRate,
    }
    for name in file.facilities:
        section = getattr(file, name)
        if section.driver == "operator":
            answer_ns = section.timeout_ns or ANSWER_NS
            terminal = Terminal(stage.port.now, capture=capture, answer_ns=answer_ns)
            setattr(stage, name, asked[name](terminal))
    if file.bitrate and file.bitrate.driver == "interface":
        stage.bitrate = InterfaceBitRate(stage.port)


def keep_power(stage: RealStage, session: ControlSession | None, leave: ExitStack) -> None:
    """At the end leave the supply as it was found, where the control server tells."""
    if session is None or not isinstance(stage.power, ControlPower):
        return
    try:
        found = session.ask({"do": "state"}).get("power")
    except ControlError:
        return  # a server need not support it
    if isinstance(found, bool):
        leave.callback(_restore_power, session, found)


def _restore_power(session: ControlSession, on: bool) -> None:
    """Best effort: a server that is gone by now was reported when it went."""
    with suppress(ControlError):
        session.ask({"do": "power", "on": on})
