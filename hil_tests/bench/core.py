"""The engine of a bench: time, trace, sending; the same on every stage.

A tester blocks only here, in `Port.next`. Every frame and stimulus goes into the trace and
through the watch, once, in order; verdicts are made from those.
"""

from __future__ import annotations

from array import array
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from heapq import heappop, heappush
from typing import TYPE_CHECKING, TypeVar

from hil_tests.bench import chronicle
from hil_tests.bench.action import Action
from hil_tests.bench.bulk import Bulk
from hil_tests.bench.census import Census
from hil_tests.bench.facilities import BitRate, Faults, Keys, Leds, Power
from hil_tests.bench.rates import Rates
from hil_tests.bench.reading import ReadClock
from hil_tests.bench.stage import Stage
from hil_tests.bench.terms import When, interval_of
from hil_tests.clock import FOREVER, MS, Interval, show_span
from hil_tests.errors import BenchError, FrameNotCarried
from hil_tests.judge.causal import Lateness, Seen, seen_between
from hil_tests.judge.cobs import State
from hil_tests.judge.expected import Expected
from hil_tests.judge.timeline import ANY_STATE
from hil_tests.judge.verdict import Verdict
from hil_tests.judge.watch import Watch
from hil_tests.trace import Burst, BusEvent, Columns, EventKind, Moment, Sighting, Sink, Trace
from node_model.frame import Frame

if TYPE_CHECKING:
    from hil_tests.config import DeviceProfile, Setup

T = TypeVar("T")

_ASKED_AGAIN = 3
"""How often the host of a model is asked, while frames come that its answer may not cover."""

STALL_NS = 25 * MS
"""A wait that ends this much too late, or more, is told as a stall of the host."""


class BenchCore:
    """What every verb of a bench is made of.

    Args:
        stage: the world or the real bus behind it.
        profile: of the device.
        parameters: what the device is set to; None = not known.
    """

    def __init__(self, stage: Stage, profile: DeviceProfile, parameters: Setup | None) -> None:
        self.stage = stage
        self._clock = stage.port.now
        self.now: Callable[[], int] = self._clock if stage.virtual else ReadClock(self)
        """The present instant on the clock of the bus, ns, for whoever goes by it."""
        self.profile = profile
        self.home: Setup | None = parameters
        self.parameters: Setup | None = parameters
        self.trace = Trace()
        self.lateness = Lateness()
        self.stalls = 0
        self.verdicts: list[Verdict] = []
        self._found: list[Verdict] = []
        self.frames = 0
        self.bus_ns = 0
        self.census = Census()
        self.heard_at_all = False
        self._earliest = array("q")
        self._expected: dict[tuple[Setup | None, bool, bool], Expected] = {}
        """What the judge was told before: a bench begins anew many times with few devices."""
        self._newest: Seen | None = None  # who waits for a frame looks at the last one at once
        self._calendar: list[tuple[int, int, Callable[[], object]]] = []
        self._order = 0
        self._later: deque[Sighting | BusEvent] = deque()
        """Read, but not yet taken into the trace."""
        self._bulk = Bulk(self, stage.port)
        self._told_at = stage.port.now()
        """The host of a model has told its lateness with frames of before this."""
        self.known_until = self._told_at
        """Whatever was asked for on the bus before this instant is in the trace."""
        self._began_at = stage.port.now()
        self.watch = self._new_watch(off=False)
        self.rates = Rates(self.watch.clock.bit_ns)
        self.power = Power(self, stage.power) if stage.power else None
        self.keys: Keys | None = None
        self.leds: Leds | None = None
        self.faults: Faults | None = None
        self.bitrate = BitRate(self, stage.bitrate) if stage.bitrate else None
        self.opening = chronicle.opening(self)
        """How the bench stood when what is written to a sink now began: a test, or an example."""

    # What it knows.

    @property
    def node_id(self) -> int:
        """Node id that the device has now.

        Raises:
            BenchError: nobody told; the test should have asked for parameters.
        """
        if self.parameters is None:
            raise BenchError("the node id of the device is not known; state it in [device]")
        return self.parameters.node_id

    @property
    def held(self) -> frozenset[str]:
        """The keys held now."""
        return self.keys.held if self.keys else frozenset()

    def start_mode(self) -> str:
        """How the device will start when it is switched on now."""
        return "regular"

    def expected(self, parameters: Setup | None) -> Expected:
        """What the judge is told about the device."""
        raise NotImplementedError

    def _new_watch(self, *, off: bool, since: int | None = None) -> Watch:
        port = self.stage.port
        rate = self.stage.bit_rate
        key = self.parameters, self.stage.exclusive, self.stage.fades
        if key not in self._expected:
            self._expected[key] = self.expected(self.parameters)
        return Watch(
            self._expected[key],
            1_000_000_000 // rate if port.timed else 0,
            frozenset((State.OFF,)) if off else ANY_STATE,
            rate,
            self._clock() if since is None else since,
        )

    # The trace.

    def begin(self, *sinks: Sink) -> None:
        """A test begins: a new trace, which is written to the sinks as it comes."""
        self.trace = Trace(*sinks)
        self._earliest = array("q")
        self._newest = None
        self._calendar.clear()
        self.verdicts, self._found = [], []
        self._began_at = self._clock()
        if sinks:
            self.opening = chronicle.opening(self)
        self.watch = self._new_watch(off=False)
        self.rates = Rates(self.watch.clock.bit_ns)

    def resume(self, parameters: Setup | None, home: Setup | None, *, heard: bool) -> None:
        """A recording begins: the device is set as it was then; nothing of before counts."""
        self.parameters, self.home, self.heard_at_all = parameters, home, heard
        self._later.clear()
        self._told_at = self.known_until = self._clock()

    def begin_example(self) -> None:
        """An example of a property begins: the one before is counted, and its record let go."""
        self._count()
        sinks = self.trace.sinks
        self.begin(*sinks)
        for sink in sinks:
            sink.write(self.opening)

    def end(self) -> list[Verdict]:
        """A test ends: what the monitors found in it."""
        self._close_watch(off=False)
        self._count()
        return self._found

    def _count(self) -> None:
        """Frames and bus time of what has ended go to the totals of the run."""
        self.heard_at_all = self.heard_at_all or self.trace.hears_others()
        self.frames += len(self.trace)
        self.census.add(self.trace)
        self.bus_ns += max(self._clock() - self._began_at, 0)

    def _close_watch(self, *, off: bool, until: int | None = None) -> None:
        """What one watch found up to `until` (None = now) is kept; another begins."""
        self.settle()
        end = self.known_until if until is None else until
        self._found.extend(self.watch.finish(end, self.lateness))
        self.watch = self._new_watch(off=off)
        self.rates.keep(len(self.trace), self.watch.clock.bit_ns)

    def note(self, moment: Moment) -> Moment:
        """Put a stimulus into the trace, in its place among the frames.

        What the bus had to say until then may still wait to be read: it goes first. Only a
        device that is being switched on had nothing to say before.
        """
        later = []
        first = moment.began_at if moment.detail.get("on") else moment.ended_at + 1
        for item in self._waiting():
            if item.at < first:
                self.take(item)
            else:
                later.append(item)
        self.trace.note(moment)
        self.watch.did(moment)
        self.rates.keep(len(self.trace), self.watch.clock.bit_ns)
        for item in later:
            self.take(item)
        return moment

    def _waiting(self) -> Iterator[Sighting | BusEvent]:
        """Everything that has happened on the bus by now and was not yet read."""
        while self._later:
            yield self._later.popleft()
        port = self.stage.port
        while (item := port.next(port.now())) is not None:
            yield item

    def drain(self) -> None:
        """Read everything that has happened on the bus by now."""
        for item in self._waiting():
            self.take(item)

    def take(self, item: Sighting | BusEvent) -> None:
        """Put what a port handed out into the trace."""
        if isinstance(item, Sighting):
            seen = self._newest = self.watch.see(item, self.trace.see(item))
            self._earliest.append(seen.wanted[0])
        else:
            self.trace.note(item)
            if item.kind is not EventKind.STALL:
                self.watch.happened(item)

    def seen(self, index: int) -> Seen:
        """The frame with that index in the trace, with its causal interval."""
        newest = self._newest
        if newest is not None and newest.index == index and newest.wanted[0] <= newest.wanted[1]:
            return newest
        frame, at, _, own = self.trace.frame(index)
        bit_ns = self.rates.of(index)
        latest = at - (frame.known_bits or frame.bits) * bit_ns if bit_ns else at
        return seen_between(frame, at, min(self._earliest[index], latest), latest, own, index)

    def frames_seen(self, start: int = 0) -> Iterator[Seen]:
        """The frames of the trace from index `start`."""
        yield from map(self.seen, range(start, len(self.trace)))

    # Time.

    @property
    def planned(self) -> bool:
        """Something is on the calendar."""
        return bool(self._calendar)

    def wait(self, span_ns: int) -> None:
        """Let time pass; everything that happens on the bus is recorded."""
        self.wait_until(self.now() + span_ns)

    def wait_until(self, instant: int) -> None:
        """Let time pass until `instant`."""
        if self.stage.virtual and not self._later and self._bulk.glide(instant):
            return
        while self.pump(instant):
            if not self._later:
                self._bulk.catch_up()

    def take_burst(self, burst: Burst) -> None:
        """Put the frames of a burst into the trace."""
        self._earliest.extend(self.watch.see_all(burst, self.trace.see_all(burst)))

    def take_columns(self, columns: Columns) -> None:
        """Put the frames of columns into the trace."""
        see = self.watch.see
        for index, sighting in enumerate(columns.sightings(), self.trace.extend(columns)):
            self._earliest.append(see(sighting, index).wanted[0])

    def at(self, instant: int, action: Callable[[], object]) -> None:
        """Put an action on the calendar: carried out at `instant`, whatever is waited for."""
        self._order += 1
        heappush(self._calendar, (instant, self._order, action))

    def pump(self, until: int, also: Sequence[int] = (), *, keep: bool = False) -> bool:
        """Let time pass until something happens or `until` comes.

        Args:
            until: the instant.
            also: descriptors to wait for besides.
            keep: what the bus says is not taken yet.

        Returns:
            True when something happened on the bus or on the calendar, False when `until`
            has come or a descriptor in `also` is readable.
        """
        calendar = self._calendar
        planned = calendar[0][0] if calendar else FOREVER
        began_at = self._clock()
        later = self._later
        item = later.popleft() if later else self.stage.port.next(min(until, planned), also)
        if item is not None:
            if keep:
                later.append(item)
            else:
                self.take(item)
            return True
        now = self._clock()
        if planned <= until and now >= planned:
            heappop(calendar)[2]()
            return True
        # A wait for an instant that was past already is no stall.
        late_ns = now - max(until, began_at)
        if late_ns > 0 and until > began_at and not also:
            self.trace.note(Moment("wait", until, now))
        if late_ns > STALL_NS and not also:
            # The host did not let us run: say so, it is never the device's fault.
            self.stalls += 1
            text = f"the host stopped the suite for {show_span(late_ns)}"
            self.take(BusEvent(EventKind.STALL, now, text))
        return False

    def carry_out(self, action: Action[T], *, withhold: bool = False) -> T:
        """Start an action and wait for it in the loop that also reads the bus.

        Where the answer and a frame wait together, because the suite was stopped, the answer
        is read first and the frame left for `note`: it may be what the action led to.

        Args:
            action: what to do.
            withhold: every frame that comes meanwhile is left for `note`.
        """
        withheld: list[Sighting | BusEvent] = []
        action.start(self._clock())
        try:
            while not action.poll(self._clock()):
                while self._later:
                    item = self._later.popleft()
                    if withhold:
                        withheld.append(item)
                    else:
                        self.take(item)
                self.pump(action.wake_at, action.descriptors, keep=True)
            return action.result()
        finally:
            self._later.extendleft(reversed(withheld))

    def settle(self) -> None:
        """Read what has happened, and ask the host of a model how late it was with it.

        A stop between reading and judging must not look like silence of the device: known is
        the bus up to the instant at which this began.
        """
        known_until = self.now()
        health = self.stage.health
        for _ in range(_ASKED_AGAIN if health is not None else 0):
            count, told_at = len(self.trace), self.now()
            assert health is not None
            pairs = self.carry_out(health.late())
            now = self.now()
            for due, sent in pairs:
                self.lateness.add(due, sent)
            if pairs:
                self.trace.note(chronicle.lateness(told_at, now, pairs))
            self._told_at = told_at
            self.drain()
            if len(self.trace) == count:
                break  # no frame came since the host told its lateness
        self.drain()
        self.known_until = known_until

    # Doing and measuring.

    def post(self, frame: Frame) -> None:
        """Queue a frame without waiting for the bus."""
        try:
            self.stage.port.send(frame)
        except FrameNotCarried:
            self.trace.note(Moment("refused", (now := self._clock()), now, {"frame": str(frame)}))
            raise

    def record(self, verdict: Verdict) -> Verdict:
        """Keep a verdict for the results."""
        self.verdicts.append(verdict)
        if self.trace.sinks:
            self.trace.remark(chronicle.mark_of(verdict, self._clock()))
        return verdict

    def when(self, thing: When) -> Interval:
        """The interval of something, widened by the lateness of the device's host.

        A host that has not yet told of the time of that frame is asked first.
        """
        if isinstance(thing, Seen) and not thing.own:
            if thing.at >= self._told_at and self.stage.health is not None:
                self.settle()
            return self.lateness.widen(thing)
        return interval_of(thing)

    def close(self) -> None:
        """Leave the bus and the bench as they were found."""
        self.stage.close()
