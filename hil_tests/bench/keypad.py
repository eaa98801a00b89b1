"""The bench of a keypad: a device that is commissioned by its keys, over the bus."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial

import attrs

from hil_tests.bench.bench import Bench
from hil_tests.bench.facilities import Keys, Leds
from hil_tests.bench.judging import LOOK_ON_NS
from hil_tests.bench.stage import Stage
from hil_tests.bench.terms import expected_of, interval_of, lacking
from hil_tests.clock import exactly
from hil_tests.config import ECHO_PERIOD_NS, KeypadProfile, Parameters, Setup
from hil_tests.config.parameters import BIT_RATE_CODES, OTHER_BIT_RATE
from hil_tests.errors import NotAcknowledged
from hil_tests.judge import matchers
from hil_tests.judge.causal import Seen
from hil_tests.judge.cobs import COMMISSION, State, parameter_bytes
from hil_tests.judge.expected import Expected
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


class KeypadBench(Bench):
    """Everything that a test of a keypad can do and see."""

    set_to = "commissioned to"
    profile: KeypadProfile
    home: Parameters | None
    parameters: Parameters | None

    def __init__(
        self, stage: Stage, profile: KeypadProfile, parameters: Parameters | None
    ) -> None:
        super().__init__(stage, profile, parameters)
        self.keys = Keys(self, stage.keys, profile.key_bits) if stage.keys else None
        self.leds = Leds(self, stage.leds, profile.led_bits) if stage.leds else None
        self._stored = parameters
        """What the device was last known to be commissioned to."""

    def start_mode(self) -> str:
        """How the device will start with the keys that are held now."""
        held = self.held
        if not held:
            return "regular"
        if held == self.profile.commissioning_keys:
            return "commissioning"
        return "either" if held > self.profile.commissioning_keys else "regular"

    def expected(self, parameters: Setup | None) -> Expected:
        """See `BenchCore`."""
        return expected_of(
            self.profile,
            parameters,
            exclusive=self.stage.exclusive,
            fades=self.stage.fades,
            key_bytes=self.profile.key_frame_bytes,
            emcy_ns=self.profile.limits.emcy_ns,
        )

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
            target = attrs.evolve(target, **{**wish.preferred, **wish.needed})
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

    def boot(self) -> Seen:
        """Power on, or reset where the bench has no Power, and the boot-up that follows."""
        on = self.switch_on()
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
        self._stored = self.parameters or self._stored
        self.forget()
        return self.offer(Frame(COMMISSION, data))

    def expect_echo(self, request: Seen, data: bytes) -> Seen:
        """The first echo of these six bytes, in time."""
        self.seek_answer(request, data, "COM-05")
        return self.expect(
            matchers.echo(data), after=request, within=self._echo_within(), requirement="COM-05"
        )

    def _echo_within(self) -> int:
        return ECHO_PERIOD_NS + self.profile.limits.echo_each_ns

    def seek_answer(self, request: Seen, data: bytes, silent: str) -> None:
        """Listen at other bit rates where the node is silent after 4F8h at 125 kbit/s.

        Args:
            request: the 4F8h.
            data: its six bytes.
            silent: the requirement that a node breaks which answers nowhere.

        Raises:
            DeviceFailure: it answers at another bit rate (COM-02), or nowhere.
        """
        if self.first(matchers.anything(), request, request.at + 3 * ECHO_PERIOD_NS) is not None:
            return
        self.settle()
        known = self.watch.quiet_from(self.known_until) > request.at + self._echo_within()
        tried = []
        for rate, listen in self._other_rates(data):
            listen(rate)
            end = self.now() + 3 * ECHO_PERIOD_NS
            if self.first(matchers.echo(), exactly(self.now()), end) is not None:
                text = f"commissioning runs at 125 kbit/s; an echo came at {rate} bit/s"
                self.fail(text, requirement="COM-02", since=request)
            tried.append(f", nor at {rate} bit/s")
        if known:  # else whoever expects the echo says what can be said
            text = f"an answer to {request.frame} at 125 kbit/s; none came{''.join(tried)}"
            self.fail(text, requirement=silent, since=request)

    def _other_rates(self, data: bytes) -> Iterator[tuple[int, Callable[[int], None]]]:
        """Bit rates that a node may wrongly be at, and what brings it to speak there."""
        if self.bitrate is None:
            return
        told = BIT_RATE_CODES.get(data[1], OTHER_BIT_RATE)
        if told != COMMISSIONING_RATE:
            yield told, self.tune
        if self._stored is not None and self._stored.bit_rate != COMMISSIONING_RATE:
            yield self._stored.bit_rate, partial(self._offer_at, data)

    def _offer_at(self, data: bytes, rate: int) -> None:
        """Power up for commissioning once more, and send 4F8h at another bit rate."""
        if self.power:
            self.power.off()
        self.tune(rate)
        self.switch_on()
        self.wait(self.profile.limits.boot_up_ns)
        self.post(Frame(COMMISSION, data))

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
        first = self.expect_echo(request, payload(parameters))
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

    def _recommission(self, target: Parameters) -> None:
        try:
            self.commission(target)
        except DeviceFailure:
            self.forget()
            raise

    def go_home(self) -> None:
        """Give the device back the parameters that it had when the run began."""
        if self.home is None or self.stage.virtual:
            return
        if self.parameters != self.home:
            self._recommission(self.home)
            self.boot()
        elif self.profile.eds:
            self.start()  # what was changed over SDO is gone then
