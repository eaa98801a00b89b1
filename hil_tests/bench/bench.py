"""The bench as tests see it: bringing the device into the state that a test starts from.

On a virtual stage that is a new world; on a real one it is power, keys, bit rate and the
device's own commissioning, within what the user allows.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import attrs

from hil_tests.bench.judging import LOOK_ON_NS, JudgingBench
from hil_tests.bench.terms import interval_of, lacking
from hil_tests.config import ECHO_PERIOD_NS, Parameters
from hil_tests.errors import NotAcknowledged
from hil_tests.judge import matchers
from hil_tests.judge.causal import Seen
from hil_tests.judge.cobs import COMMISSION, Nmt, State, parameter_bytes
from hil_tests.judge.verdict import DeviceFailure, NotRun
from hil_tests.trace import Moment
from node_model.frame import Frame

COMMISSIONING_RATE = 125_000
"""Bit rate of commissioning, whatever is stored (keypad source)."""


def payload(parameters: Parameters) -> bytes:
    """The six bytes of 4F8h for these parameters."""
    return parameter_bytes(
        parameters.node_id,
        parameters.bit_rate_code,
        parameters.heartbeat_ms,
        parameters.sync_time,
        parameters.debounce,
    )


@dataclass(frozen=True, slots=True)
class Wish:
    """Parameters that a test would like the device to have.

    Args:
        needed: without these it cannot be run.
        preferred: it is quicker with these, but right with any.
    """

    needed: Mapping[str, int]
    preferred: Mapping[str, int]


class Bench(JudgingBench):
    """Everything that a test can do and see."""

    # Where tests start from.

    def fresh(self, prefer: Mapping[str, int] | None = None, **needed: int) -> Parameters:
        """The device without power (where the bench has Power), no key held, at its bit rate.

        Args:
            prefer: parameters that make the test quicker; used where they cost nothing.
            needed: parameters without which the test makes no sense, e.g. `debounce=5`.

        Returns:
            What the device is commissioned to now.

        Raises:
            NotRun: the bench cannot bring the device there; the text says why.
        """
        target = self._target(Wish(needed, prefer or {}))
        left_at = self.now()
        if self.stage.renew(target):
            self._reset_facilities()
            self.renewed(target, off=True, until=left_at)
            return target
        if self.keys and self.keys.held:
            self.keys.release()
        if target != self.parameters:
            self._recommission(target)
        if self.power:
            self.power.off()
        self.tune(target.bit_rate)
        self.renewed(target, off=self.power is not None)
        return target

    def _target(self, wish: Wish) -> Parameters:
        """Which parameters the test will run with."""
        base = self.home or self.parameters
        known = base or self.profile.factory
        if base is None:
            self._may_commission(
                "what the device is commissioned to is not known (state parameters in [device])"
            )
        target = attrs.evolve(known, **wish.needed)
        if target != base:
            wanted = ", ".join(f"{name} {value}" for name, value in wish.needed.items())
            self._may_commission(f"the test needs {wanted}")
        if wish.preferred and not self.why_not_commission():
            target = attrs.evolve(target, **wish.preferred)
        return target

    def why_not_commission(self) -> str:
        """Why this bench may not or cannot commission; "" = it may and can."""
        if self.stage.virtual:
            return ""
        lacks = [name for name in ("power", "keys") if getattr(self, name) is None]
        if lacks:
            missing, sections = lacking(lacks)
            return f"bench {self.stage.name!r} has {missing} to commission with; add {sections}"
        if not self.stage.writes_allowed:
            return "commissioning writes non-volatile memory; allow it with --can-allow-writes"
        return ""

    def _may_commission(self, reason: str) -> None:
        why = self.why_not_commission()
        if why:
            raise NotRun(f"{reason}: {why}")

    def _reset_facilities(self) -> None:
        """The stage gave us a new device: nothing is held, nothing is on."""
        if self.keys:
            self.keys.held = frozenset()
        if self.power:
            self.power.forget()

    def tune(self, bit_rate: int) -> None:
        """Bring the tester's end to the device's bit rate."""
        if bit_rate == self.stage.bit_rate:
            return
        if self.bitrate is None:
            raise NotRun(
                f"the device runs at {bit_rate} bit/s, the bus at {self.stage.bit_rate}; bench"
                f" {self.stage.name!r} has no [bitrate] to change it"
            )
        self.bitrate.set(bit_rate)

    def start(self, prefer: Mapping[str, int] | None = None, **needed: int) -> Seen:
        """A regular start: the device has just announced itself and is pre-operational.

        Returns:
            The boot-up.
        """
        self.fresh(prefer, **needed)
        return self.boot()

    def boot(self) -> Seen:
        """Power on, or reset where the bench has no Power, and the boot-up that follows."""
        on: Moment | Seen = self.power.on() if self.power else self.nmt(Nmt.RESET_NODE)
        until = interval_of(on).latest + 2 * self.profile.limits.boot_up_ns
        silent = self.held and not self.first(matchers.of_a_start(self.node_id), on, until)
        # That it starts regularly with keys held is our own reading of the source.
        requirement = "COM-27" if silent else "NMT-02"
        return self.expect(
            matchers.boot_up(self.node_id),
            after=on,
            within=self.profile.limits.boot_up_ns,
            requirement=requirement,
        )

    def operational(self, prefer: Mapping[str, int] | None = None, **needed: int) -> Seen:
        """A regular start and the NMT command "start".

        Returns:
            The key frame that tells that operational was entered (KEY-01).
        """
        self.start(prefer, **needed)
        return self.enter_operational()

    def enter_operational(self) -> Seen:
        """The NMT command "start" and the key frame that answers it."""
        return self.entered(self.nmt(Nmt.START))

    def entered(self, command: Seen) -> Seen:
        """The key frame that follows the command "start" (KEY-01).

        Where none comes, and the heartbeat says that the node is not operational, it is the
        command that was not obeyed (NMT-04).
        """
        key_frame, within = matchers.key_frame(self.node_id), self.profile.limits.command_ns
        told = self.first(key_frame, command, interval_of(command).latest + within + LOOK_ON_NS)
        if told is None and self.watch.expected.heartbeat_ns:
            self.expect_state(State.OPERATIONAL, after=command, requirement="NMT-04")
        return self.expect(key_frame, after=command, within=within, requirement="KEY-01")

    # Commissioning.

    @property
    def device_proven(self) -> bool:
        """The device was heard in this run (or is virtual): its cable and supply are right."""
        return self.stage.virtual or self.heard_at_all or self.was_heard()

    def enter_commissioning(self, *extra: str) -> Moment:
        """Power up with the commissioning keys (and `extra` ones) held, at 125 kbit/s.

        Returns:
            The power-on; by now the device has had the time to initialise.

        Raises:
            NotRun: the bench has no Power or no Keys, or may not write.
        """
        self._may_commission("commissioning")
        if self.power is None or self.keys is None:  # pragma: no cover - asked just before
            raise NotRun("commissioning needs Power and Keys")
        self.power.off()
        self.keys.hold(*self.profile.commissioning_keys, *extra)
        self.tune(COMMISSIONING_RATE)
        on = self.power.on()
        self.wait(self.profile.limits.boot_up_ns)
        return on

    def request(self, parameters: Parameters | bytes) -> Seen:
        """Send one 4F8h; from now on the device's parameters count as unknown."""
        data = parameters if isinstance(parameters, bytes) else payload(parameters)
        self.forget()
        return self.offer(Frame(COMMISSION, data))

    def offer(self, frame: Frame) -> Seen:
        """Send a frame to a node that waits to be commissioned, at 125 kbit/s (COM-02)."""
        try:
            return self.send(frame, "COM-02")
        except NotAcknowledged as error:
            if not self.device_proven:
                raise
            self.fail(f"nobody listens at 125 kbit/s: {error}", requirement="COM-02")

    def leave_commissioning(self, parameters: Parameters) -> None:
        """Power off, keys released, tester at the bit rate of `parameters`."""
        if self.power:
            self.power.off()
        if self.keys:
            self.keys.release()
        self.tune(parameters.bit_rate)
        self.renewed(parameters, off=True)

    def commission(self, parameters: Parameters) -> Seen:
        """The whole procedure, from power-up with the keys held to power off.

        Returns:
            The first echo.
        """
        self.enter_commissioning()
        request = self.request(parameters)
        first = self.expect(
            matchers.echo(payload(parameters)),
            after=request,
            within=ECHO_PERIOD_NS + self.profile.limits.echo_each_ns,
            requirement="COM-05",
        )
        self.wait(self.profile.limits.store_ns)
        self.leave_commissioning(parameters)
        return first

    def leave_unknown(self, bit_rate: int) -> None:
        """As `leave_commissioning`, where nobody can say what was stored."""
        if self.power:
            self.power.off()
        if self.keys:
            self.keys.release()
        self.tune(bit_rate)
        self.forget()
        self._close_watch(off=True)

    def tolerate_missing_boot_up(self) -> None:
        """From here on the device may do what the source leaves open: no monitor judges it."""
        known, self.parameters = self.parameters, None
        self._close_watch(off=False)
        self.parameters = known

    def suppose(self, parameters: Parameters) -> None:
        """The device is addressed as if it had these; no monitor judges it by them."""
        self.tolerate_missing_boot_up()
        self.parameters = parameters

    def recognised(self, on: Moment, parameters: Parameters) -> None:
        """The device that was switched on by `on` has these: the monitors judge since then."""
        self.parameters = parameters
        self.watch = self._new_watch(off=True, since=on.began_at)
        self.watch.did(on)
        for index in range(self.trace.index_at(on.began_at), len(self.trace)):
            self.watch.see(self.trace.frame(index), index)

    def _recommission(self, target: Parameters) -> None:
        try:
            self.commission(target)
        except DeviceFailure:
            self.forget()
            raise

    def go_home(self) -> None:
        """Give the device back the parameters that it had when the run began."""
        if self.home is not None and self.parameters != self.home and not self.stage.virtual:
            self._recommission(self.home)
            self.boot()

    # For people.

    def description(self) -> Mapping[str, str]:
        """For the header of a run."""
        port = self.stage.port
        wire = "timed" if port.timed else "untimed"
        return {
            "bench": self.stage.name,
            "bus": f"{port.name}, {self.stage.bit_rate} bit/s, {wire} wire",
            "clock": port.clock,
        }

    # Load.

    def needs_timed_wire(self, why: str) -> None:
        """Raise NotRun on a wire without arbitration and bit times."""
        if not self.stage.port.timed:
            raise NotRun(f"{self.stage.port.name} is an untimed wire: {why}")

    def needs_load(self, frames: Sequence[Frame], share_ppm: int) -> None:
        """Load the bus to a share from another station.

        Raises:
            NotRun: this bench cannot.
        """
        if not self.load(frames, share_ppm):
            raise NotRun(f"bench {self.stage.name!r} cannot load the bus to a known share")

    def needs_error_frames(self) -> None:
        """Put an error frame on the bus.

        Raises:
            NotRun: this bench cannot.
        """
        if not self.stage.disturb():
            raise NotRun(f"bench {self.stage.name!r} cannot put error frames on the bus")

    def needs_facilities(self, names: Sequence[str]) -> None:
        """Raise NotRun where the bench has not all of these."""
        lacks = [name for name in names if getattr(self, name) is None]
        if lacks:
            missing, sections = lacking(lacks)
            raise NotRun(f"bench {self.stage.name!r} has {missing}; add {sections} to its file")

    def needs_writes(self, why: str) -> None:
        """Raise NotRun where nothing may be done that could change stored parameters."""
        if not self.stage.writes_allowed:
            raise NotRun(f"{why}; allow it with --can-allow-writes")

    def needs_exclusive(self) -> None:
        """Raise NotRun where others on the bus would be disturbed."""
        if not self.stage.exclusive:
            raise NotRun(
                f"bench {self.stage.name!r} shares its bus; say exclusive = true in [bus]"
                " if nothing else lives on it"
            )
