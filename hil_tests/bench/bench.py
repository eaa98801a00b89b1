"""The bench as tests of every kind of device see it: bringing it to where a test starts.

On a virtual stage that is a new world; on a real one it is power, bit rate and whatever the
kind of device offers, within what the user allows. Each kind has a bench of its own.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from hil_tests.bench import chronicle
from hil_tests.bench.judging import LOOK_ON_NS, JudgingBench
from hil_tests.bench.terms import interval_of, lacking
from hil_tests.config import Setup
from hil_tests.judge import matchers
from hil_tests.judge.causal import Seen
from hil_tests.judge.cobs import Nmt
from hil_tests.judge.monitors import LATE_FACTOR
from hil_tests.judge.verdict import NotRun
from hil_tests.judge.watch import Watch
from hil_tests.trace import Moment
from node_model.frame import Frame


class Bench(JudgingBench):
    """Everything that a test can do and see, whatever the device is."""

    set_to = "set to"
    """How a device of this kind gets its parameters, in two words for the header."""

    seed = 0
    """Of everything that a test draws."""

    _loaded = False

    def _new_watch(self, *, off: bool, since: int | None = None) -> Watch:
        """A device that goes on beats as it did."""
        watch = super()._new_watch(off=off, since=since)
        before = getattr(self, "watch", None)
        if before is not None and not off and self.parameters is not None:
            watch.goes_on_from(before)
        return watch

    # Where tests start from.

    def fresh(self, prefer: Mapping[str, int] | None = None, **needed: int) -> Setup:
        """The device without power (where the bench has Power), as it was set up, untouched.

        Args:
            prefer: parameters that make the test quicker; used where they cost nothing.
            needed: parameters without which the test makes no sense.

        Returns:
            What the device is set to now.

        Raises:
            NotRun: the bench cannot bring the device there; the text says why.
        """
        raise NotImplementedError

    def go_home(self) -> None:
        """Give the device back what it had when the run began."""
        raise NotImplementedError

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
        return self.expect_boot_up(self.switch_on())

    def expect_boot_up(
        self, after: Moment | Seen, missing: str = "", node_id: int | None = None
    ) -> Seen:
        """The boot-up that a start leads to, in time; one that comes late is late, not missing.

        Args:
            after: what switched the device on, or reset it.
            missing: the requirement that there is one; left out, the monitor's.
            node_id: that it has now, where that is another one.
        """
        ids, limit_ns = self.watch.expected.ids, self.profile.limits.boot_up_ns
        commanded = isinstance(after, Seen)
        boot_up = matchers.boot_up(self.node_id if node_id is None else node_id)
        patience_at = interval_of(after).latest + LATE_FACTOR * limit_ns + LOOK_ON_NS
        rule = ids.reset_late if commanded else ids.boot_late
        if self.first(boot_up, after, patience_at) is None:
            rule = missing or (ids.reset if commanded else ids.boot_up)
        return self.expect(boot_up, after=after, within=limit_ns, requirement=rule)

    def switch_on(self) -> Moment | Seen:
        """Power on, or reset where the bench has no Power."""
        return self.power.on() if self.power else self.nmt(Nmt.RESET_NODE)

    def operational(self, prefer: Mapping[str, int] | None = None, **needed: int) -> Seen:
        """A regular start and the NMT command "start".

        Returns:
            What told that operational was entered, see `entered`.
        """
        self.start(prefer, **needed)
        return self.enter_operational()

    def enter_operational(self) -> Seen:
        """The NMT command "start", and what tells that it was obeyed."""
        return self.entered(self.nmt(Nmt.START))

    def entered(self, command: Seen) -> Seen:
        """What tells that the command "start" was obeyed."""
        raise NotImplementedError

    @property
    def device_proven(self) -> bool:
        """The device was heard in this run (or is virtual): its cable and supply are right."""
        return self.stage.virtual or self.heard_at_all or self.was_heard()

    def renewed(self, parameters: Setup, *, off: bool, until: int | None = None) -> None:
        """The device is now set to `parameters`: a new watch begins.

        Args:
            parameters: its new ones.
            off: it has no power.
            until: when the one before was last there; None = now.
        """
        self.parameters = parameters
        now = self.now()
        began_at = now if until is None else until
        fresh = until is not None
        self.trace.note(chronicle.renewal(began_at, now, parameters, off=off, fresh=fresh))
        self._close_watch(off=off, until=until)

    def forget(self) -> None:
        """What the device is set to is no longer known."""
        self.parameters = None

    def tolerate_missing_boot_up(self) -> None:
        """From here on the device may do what the source leaves open: no monitor judges it."""
        known, self.parameters = self.parameters, None
        self._close_watch(off=False)
        self.parameters = known

    def suppose(self, parameters: Setup) -> None:
        """The device is addressed as if it had these; no monitor judges it by them."""
        self.tolerate_missing_boot_up()
        self.parameters = parameters

    def recognised(self, on: Moment, parameters: Setup) -> None:
        """The device that was switched on by `on` has these: the monitors judge since then."""
        self.parameters = parameters
        self.watch = self._new_watch(off=True, since=on.began_at)
        self.watch.did(on)
        for index in range(self.trace.index_at(on.began_at), len(self.trace)):
            self.watch.see(self.trace.frame(index), index)

    # For people.

    def description(self) -> Mapping[str, str]:
        """For the header of a run."""
        port = self.stage.port
        wire = "timed" if port.timed else "untimed"
        return {
            "bench": self.stage.name,
            "bus": f"{port.name}, {self.stage.bit_rate} bit/s, {wire} wire",
            "clock": port.clock,
            "lateness": self.stage.health.about if self.stage.health else "",
        }

    # Load.

    def load(self, frames: Sequence[Frame], share_ppm: int) -> bool:
        """Load the bus from another station; False where this bench cannot."""
        if not self.stage.load(frames, share_ppm):
            return False
        self._loaded = True
        self.trace.note(chronicle.loading(self.now(), frames, share_ppm))
        self.watch.admit(frozenset(frame.can_id for frame in frames))
        return True

    def end_load(self) -> None:
        """Every loading station falls silent; nothing is done where there is none."""
        if self._loaded:
            self._loaded = False
            self.stage.end_load()
            self.trace.note(Moment("unload", self.now(), self.now()))

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
        self.trace.note(Moment("disturb", self.now(), self.now()))

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
