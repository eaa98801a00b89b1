"""Plays scenarios on a bench, and judges each life of the device by every oracle there is.

Steps count from the one before as it was done. What a real board takes its own time for (to
start, to initialise after a reset) is waited for, so that a scenario means the same on each.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

from hil_tests.api import (
    COMMISSIONING_RATE,
    MS,
    Frame,
    FrameNotCarried,
    KeypadBench,
    NotRun,
    Parameters,
    Seen,
    Verdict,
    cobs,
    matchers,
    nmt_frame,
)
from hil_tests.scenarios import words
from hil_tests.scenarios.contacts import held_by, order_of
from hil_tests.scenarios.lives import (
    failures,
    in_order,
    judge_commissioning,
    judge_operation,
)
from hil_tests.scenarios.memory import stored
from hil_tests.scenarios.origins import Origin
from hil_tests.scenarios.record import Life
from hil_tests.scenarios.scenario import Scenario, Step
from hil_tests.scenarios.seeking import is_silent, seek, seek_after_pause
from hil_tests.scenarios.story import debounce_times, when_all_is_told

LINGER_NS = 5 * MS
"""How much longer than its limit the effect of an LED frame is waited for."""

LATE_NS = 3_000 * MS
"""How long a change of keys that was not shown is waited for: late is not lost."""

MOST_BEATS_NS = 3_000 * MS
"""A scenario waits for two beats at its end, but no longer than this."""


class LeftOpen(Exception):
    """From here on nobody can say what the device must do: what was played so far is judged."""


class Player:
    """One scenario on one bench.

    Args:
        bench: its test or example has begun.
        doubts: ask also what is wrong only if every doubt goes against the device.

    Raises:
        NotRun: (each method) the bench cannot do this; the text says why.
        LeftOpen: (`do`) the requirements do not say what follows.
    """

    def __init__(self, bench: KeypadBench, *, doubts: bool = True) -> None:
        self.bench = bench
        self.found: list[Verdict] = []
        self.limits = bench.profile.limits
        self._doubts = doubts
        self._batch: list[tuple[int, frozenset[str]]] = []
        self._order = order_of(bench)
        self._own: Parameters | None = None
        self._candidates: tuple[Parameters, ...] = ()
        self._origin = Origin()
        self._since = (0, 0)
        self._held = 0
        self._mode = ""
        self._ready_at = 0
        self._judged_until: int | None = None
        self._read: tuple[tuple[int, int], Life] | None = None
        """The life under way, as far as the record went when it was read."""

    # From beginning to end.

    def begin(self, scenario: Scenario) -> None:
        """Bring the device to where the scenario begins."""
        bench = self.bench
        bench.needs_facilities(sorted(scenario.needs))
        if not bench.stage.exclusive and scenario.disturbs:
            bench.needs_exclusive()
        if not bench.stage.writes_allowed and scenario.writes:
            bench.needs_writes("the scenario may change what the device has stored")
        self._candidates = (bench.fresh(None, **scenario.parameters),)
        if scenario.begin == "off":
            return
        self._operate()
        if scenario.begin == "operational":
            self._enter_operational()

    def _enter_operational(self) -> None:
        bench = self.bench
        bench.wait(self.limits.emcy_ns)
        bench.enter_operational()

    def do(self, step: Step) -> None:
        """Let the step's time pass, and do it.

        Steps of keys that follow each other are handed to the bench together, because some
        benches can time them better than we can from afar.
        """
        if step.verb == "keys":
            last = self._batch[-1][0] if self._batch else self.bench.now()
            self._batch.append((last + step.after_ns, held_by(self._order, words.mask(step.what))))
            return
        self._flush()
        self.bench.wait(step.after_ns)
        self.VERBS[step.verb](self, step.what)

    def finish(self) -> list[Verdict]:
        """Let everything show that still must; everything that was wrong, the first first."""
        self._flush()
        if self._mode == "operation":
            self.bench.wait(self._tail_ns())
        self._end_life(self.bench.now(), LATE_NS)
        self.found += self._origin.told(self.bench.monitored())
        return in_order(self.found)

    def _tail_ns(self) -> int:
        assert self._own is not None
        limits = self.limits
        keys_ns = self._own.debounce_ns + limits.scan_ns + limits.key_frame_ns + limits.command_ns
        each = self.bench.watch.expected.heartbeat_each.at_most_ns
        return max(keys_ns, min(2 * each, MOST_BEATS_NS))

    def _flush(self) -> None:
        """Play the steps of keys that were gathered."""
        batch, self._batch = self._batch, []
        if batch:
            assert self.bench.keys is not None
            start = batch[0][0]
            self.bench.wait_until(start)
            self.bench.keys.sequence([(at - start, held) for at, held in batch])

    # Lives.

    def _begin_life(self, mode: str) -> None:
        self._mode = mode
        self._since = self.bench.trace.mark()
        self._held = self.bench.keys.mask if self.bench.keys else 0
        self._judged_until = None
        self._read = None

    def _end_life(self, until: int, patience_ns: int = 0) -> None:
        """Judge what has just ended, up to an instant; nothing, where the device was off.

        Args:
            until: the instant.
            patience_ns: how long what seems to be missing may be waited for.
        """
        mode, self._mode = self._mode, ""
        if not mode:
            return
        bench = self.bench
        bench.settle()
        quiet = bench.watch.quiet_from(until)
        if self._judged_until is not None:
            quiet = min(quiet, self._judged_until)
        self.found += when_all_is_told(
            bench, lambda: self._judge(mode, self._life(), quiet), patience_ns
        )

    def _life(self) -> Life:
        """What was recorded since it was switched on."""
        told = self.bench.trace.mark()
        if self._read is None or self._read[0] != told:
            self._read = told, Life(self.bench, self.node_id, self._since, self._held)
        return self._read[1]

    def _judge(self, mode: str, life: Life, until: int) -> list[Verdict]:
        if mode == "commissioning":
            return judge_commissioning(self.bench, life, self._ready_at, until)
        found = judge_operation(self.bench, life, until, doubts=self._doubts)
        if self._own is not None and any(failures(found)):
            steps = debounce_times(self.bench, life, until)
            found = self._origin.debounced(found, steps, self._own)
        return self._origin.told(found)

    # Power.

    def _power(self, what: str) -> None:
        bench = self.bench
        assert bench.power is not None
        if what == "off":
            if bench.power.is_on:
                self._switch_off()
        elif not bench.power.is_on:
            modes = {"regular": self._operate, "commissioning": self._commission}
            mode = bench.start_mode()
            if mode not in modes:
                raise LeftOpen("which mode these keys lead to is left to the maker (COM-28)")
            modes[mode]()

    def _switch_off(self) -> None:
        bench, mode = self.bench, self._mode
        assert bench.power is not None
        off = bench.power.off()
        self._end_life(off.began_at)
        if mode == "commissioning":
            if any(failures(self.found)):
                raise LeftOpen("what it took for its parameters is not known any more")
            life = self._life()
            (before,) = self._candidates
            store_ns = self.limits.store_ns
            self._candidates = stored(before, life.requests, life.echoes, off.when, store_ns)
            self._origin.stayed(before, self._candidates, life.requests)
            if self._candidates != (before,):
                bench.forget()

    def _operate(self) -> None:
        """Power on, and the boot-up of regular operation."""
        bench = self.bench
        if len(self._candidates) > 1:
            self._identify()
        (own,) = self._candidates
        bench.tune(own.bit_rate)
        if own != bench.parameters:
            bench.renewed(own, off=True)
        self._own = own
        self._begin_life("operation")
        if bench.power is None:
            bench.boot()
            return
        on = bench.power.on()
        requirement = self._origin.starts(on.began_at, held=bool(bench.held))
        limit_ns = self.limits.boot_up_ns
        if bench.first(matchers.of_a_start(own.node_id), on, on.ended_at + 2 * limit_ns):
            # It starts as the one it should be: how it announces itself is another matter.
            self._origin.started(own)
            requirement = "NMT-02"
        elif is_silent(bench, on):
            self._end_life(bench.now())
            seek(bench, own, on, self._origin)
            requirement = self._origin.blames
        boot_up = matchers.boot_up(own.node_id)
        bench.expect(boot_up, after=on, within=limit_ns, requirement=requirement)
        self._origin.started(own)

    def _identify(self) -> None:
        """Power was cut while it stored: which of the two sets did it keep (COM-26)?"""
        bench = self.bench
        assert bench.power is not None
        held = bench.held
        rates = {each.bit_rate for each in self._candidates}
        boots = {cobs.ERROR_CONTROL + each.node_id: each for each in self._candidates}
        if len(rates) > 1 or len(boots) < len(self._candidates):
            raise LeftOpen("the old set and the new one start alike")
        bench.leave_unknown(rates.pop())
        on = bench.power.on()
        either = matchers.any_of(frozenset(boots), "boot-up of the old or the new node id")
        limit_ns = 2 * self.limits.boot_up_ns  # how soon is NMT-02
        if bench.first(either, on, on.ended_at + limit_ns) is None:
            seek_after_pause(bench, either, on)
        boot = bench.expect(either, after=on, within=limit_ns, requirement="COM-26")
        bench.power.off()
        if bench.keys is not None and held:
            bench.keys.hold(*held)
        self._origin.identified()
        self._candidates = (boots[boot.frame.can_id],)

    def _commission(self) -> None:
        """Power on with the commissioning keys held, and the time to initialise."""
        bench = self.bench
        assert bench.power is not None
        if why := bench.why_not_commission():
            raise NotRun(why)
        if len(self._candidates) > 1:
            self._identify()
        bench.tune(COMMISSIONING_RATE)
        self._begin_life("commissioning")
        on = bench.power.on()
        self._ready_at = on.ended_at + self.limits.boot_up_ns
        bench.wait(self.limits.boot_up_ns)

    # The bus.

    def _rate(self, what: str) -> None:
        """The tester at another rate: nobody hears anybody; keys are not judged across that."""
        rate = words.rate(what) or self._device_rate()
        if rate == self.bench.stage.bit_rate:
            return
        if self._judged_until is None:
            self._judged_until = self.bench.now()
        self.bench.tune(rate)

    def _device_rate(self) -> int:
        if self._mode == "commissioning" or self._own is None:
            return COMMISSIONING_RATE if self._mode else self.bench.stage.bit_rate
        return self._own.bit_rate

    def _load(self, what: str) -> None:
        """The bus is loaded to that share from now on, whatever it was loaded to before."""
        share_ppm, frames = words.loading(what)
        self.bench.end_load()
        if share_ppm:
            self.bench.needs_load(frames, share_ppm)

    def _post(self, frame: Frame) -> bool:
        """Queue a frame; False where there is nobody who would acknowledge it.

        Raises:
            LeftOpen: where a reset with these keys held leads to is left to the maker.
        """
        if not self._mode or self.bench.stage.bit_rate != self._device_rate():
            return False
        commands = not frame.can_id and self._mode == "operation"
        if commands and self.bench.start_mode() != "regular":
            own = self.node_id
            if (cobs.nmt_for(frame, own) or cobs.long_nmt_for(frame, own)) in cobs.RESETS:
                raise LeftOpen("both commissioning keys are held at a reset (COM-28)")
        try:
            self.bench.post(frame)
        except FrameNotCarried as error:
            raise NotRun(str(error)) from None
        return True

    @property
    def begun(self) -> bool:
        """The device was brought to where the scenario begins, or was about to start there."""
        return bool(self._candidates)

    @property
    def node_id(self) -> int:
        """Of the device; in commissioning the one that it had."""
        return (self._own or self._candidates[0]).node_id

    def _nmt(self, what: str) -> None:
        command, to = words.command(what)
        own = self.node_id
        ids = {"own": own, "all": 0, "other": own % 15 + 1, "alike": own + 16}
        frame = nmt_frame(command, ids[to])
        sent_from = len(self.bench.trace)
        heard = self._post(frame)
        if command in cobs.RESETS and to in {"own", "all"} and heard and self._mode == "operation":
            self._await_boot_up(self.bench.await_own(frame, sent_from))

    def _await_boot_up(self, sent: Seen) -> None:
        self.bench.expect(
            matchers.boot_up(self.node_id),
            after=sent,
            within=self.limits.boot_up_ns,
            requirement="NMT-06",
        )

    def _led(self, what: str) -> None:
        self._post(words.map_to("led", what, self.node_id))

    def _blink(self, what: str) -> None:
        self._post(words.map_to("blink", what, self.node_id))

    def _raw(self, what: str) -> None:
        if self._post(words.sent_to(what, self.node_id)):
            self._origin.littered()

    def _request(self, what: str) -> None:
        if self._mode == "commissioning" and self.bench.stage.bit_rate == COMMISSIONING_RATE:
            self.bench.request(words.payload(what))  # and somebody must be there to hear it
        else:
            self._post(Frame(cobs.COMMISSION, words.payload(what)))

    # LEDs.

    def _look(self, _: str) -> None:
        if self._mode and self.bench.leds is not None:
            self.bench.wait(self.limits.led_ns + LINGER_NS)
            self.bench.leds.read()

    def _watch(self, what: str) -> None:
        leds = self.bench.leds
        if self._mode != "operation" or leds is None:
            return
        if not leds.sees_edges:
            raise NotRun(f"bench {self.bench.stage.name!r} cannot tell when an LED changes")
        leds.watch(words.watched(what))

    VERBS: Mapping[str, Callable[[Player, str], None]] = {
        "nmt": _nmt,
        "led": _led,
        "blink": _blink,
        "send": _raw,
        "request": _request,
        "power": _power,
        "rate": _rate,
        "load": _load,
        "look": _look,
        "watch": _watch,
        "wait": lambda *_: None,
    }
    """What is done for each verb but "keys"."""
