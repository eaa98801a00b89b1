"""The watch: every frame and stimulus of a test goes through it, once, in order.

It knows when each frame was asked for (causal clock) and in which states the device can
be (timeline), and feeds the monitors.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence

from hil_tests.clock import FOREVER, MS, Interval, S
from hil_tests.judge.causal import CausalClock, Lateness, Seen
from hil_tests.judge.cobs import (
    COMMISSION,
    EMCY,
    ERROR_CONTROL,
    RESETS,
    Nmt,
    State,
    long_nmt_for,
    nmt_for,
)
from hil_tests.judge.expected import Expected, Family
from hil_tests.judge.frames import DeviceFrames
from hil_tests.judge.heartbeats import Heartbeats
from hil_tests.judge.monitors import AllowedFrames, BootUp, Monitor
from hil_tests.judge.reaction import Reaction
from hil_tests.judge.settings import HeartbeatSet, IdentifierSet, Role, SdoListener, Setting
from hil_tests.judge.speakers import Speakers
from hil_tests.judge.timeline import ANY_STATE, States, StateTimeline, commissions
from hil_tests.judge.verdict import Verdict
from hil_tests.trace import Burst, BusEvent, Moment, Sighting
from node_model.frame import Frame

ANSWERED_NS = 250 * MS
"""A guarding answer belongs to a poll of at most this long ago; limits are much shorter."""

_FRAMES: Mapping[Family, Callable[[Expected, StateTimeline], AllowedFrames | DeviceFrames]] = {
    Family.KEYPAD: AllowedFrames,
    Family.CIA301: DeviceFrames,
}
"""Who knows which frames a device may send."""

_MODES = {"commissioning": True, "regular": False}


class Watch:
    """Judges everything that must hold at all times.

    Args:
        expected: the device as it should be.
        bit_ns: duration of a bit; 0 on an untimed wire.
        states: in which states the device can be at the start.
        rate: bit rate of the tester's end at the start; None = the device's.
        since: instant from which the wire is watched; left out, it was idle before.
    """

    def __init__(
        self,
        expected: Expected,
        bit_ns: int = 0,
        states: States = ANY_STATE,
        rate: int | None = None,
        since: int = -FOREVER,
    ) -> None:
        self.expected = expected
        self._home = expected
        """As it is after each start."""
        self.timeline = StateTimeline(expected.command_ns, states)
        self.speakers = Speakers(expected)
        self._is_device = self.speakers.are_device
        self._sdo = None if expected.node_id is None else SdoListener(expected.node_id)
        """Hears what the tester sets in the device; None = its node id is not known."""
        self._held: Expected | None = None
        """What counts again if the write of 1017h that is under way is refused."""
        self._admitted: dict[int, Role] = {}
        """Identifiers that the device was given."""
        self._reaction = Reaction()
        """What 1029h says; it is forgotten with a start, which may bring a stored setting."""
        self._polls: deque[int] = deque()
        """Ends of guarding requests that were not answered yet."""
        self.clock = CausalClock(bit_ns, self._is_device, since)
        self._allowed = _FRAMES[expected.family](expected, self.timeline)
        if State.COMMISSIONING in states:
            self._allowed.requested()  # perhaps, before the watch began
        self._boot = BootUp(expected)
        self._heartbeats = Heartbeats(expected, self.timeline)
        self._monitors: tuple[Monitor, ...] = (self._allowed, self._boot, self._heartbeats)
        self._beat_id = -1 if expected.node_id is None else ERROR_CONTROL + expected.node_id
        self._beat: Frame | None = None
        self._deaf = rate is not None and expected.bit_rate not in {None, rate}
        self._fades_until = -1
        """Its supply was cut, and its capacitors may keep it alive until then."""
        for can_id, role in expected.speaks:
            self._admit(can_id, role)

    @property
    def owes_boot_up(self) -> bool:
        """The device was switched on or reset, and has not announced itself since."""
        return self._boot.owed

    def see(self, sighting: Sighting, index: int) -> Seen:
        """A frame was seen on the bus; `index` is its place in the trace."""
        seen = self.clock.see(sighting, index)
        if sighting.own:
            self._own(seen)
        elif seen.frame is self._beat:  # that was last found right in the present state
            self._heartbeats.see(seen)
        elif self._is_device(seen.frame):
            self._device(seen)
        return seen

    def see_all(self, burst: Burst, index: int) -> list[int]:
        """As `see` for one frame after the other, from the place `index` in the trace.

        Returns:
            After which instant each of them was asked for.
        """
        requests: list[int] = []
        frames, instants = burst.frames, burst.instants
        owns = iter((*burst.own, len(frames)))
        place, end, next_own = 0, len(frames), next(owns)
        while place < end:
            frame, first = frames[place], place
            place += 1
            if first == next_own:
                next_own = next(owns)
                requests.append(self.clock.request(frame, instants[first], 0, own=True))
                self._own(self._seen(burst, requests, first, index, own=True))
            elif frame is self._beat:
                while place < next_own and frames[place] is frame:
                    place += 1
                requests += self.clock.requests(frame, instants[first:place])
                self._beats(burst, requests, range(first, place), index)
            elif self._is_device(frame):
                requests.append(self.clock.request(frame, instants[first], 0, own=False))
                self._device(self._seen(burst, requests, first, index))
            else:
                place = self.speakers.back_at(frames, place, next_own, self._beat)
                requests += self.clock.others(frames[first:place], instants[first:place])
        return requests

    def _seen(
        self, burst: Burst, requests: Sequence[int], place: int, index: int, *, own: bool = False
    ) -> Seen:
        """One frame of a burst that begins at `index`."""
        frame, at = burst.frames[place], burst.instants[place]
        return self.clock.seen(frame, at, requests[place], own, index + place)

    def _beats(self, burst: Burst, requests: Sequence[int], places: range, index: int) -> None:
        """The very beat that was last found right in the present state, at these places."""
        beat, stretch = burst.frames[places[0]], slice(places.start, places.stop)
        frame_ns = beat.bits * self.clock.bit_ns
        starts = [at - frame_ns for at in burst.instants[stretch]]
        if self._heartbeats.in_time(beat, requests[stretch], starts):
            self._heartbeats.go_on(self._seen(burst, requests, places[-1], index), len(places))
            return
        for place in places:
            self._heartbeats.see(self._seen(burst, requests, place, index))

    def _device(self, seen: Seen) -> None:
        frame, _, wanted, _, _ = seen
        self._allowed.see(seen)
        dying = self._fades_until >= 0 and wanted.earliest <= self._fades_until
        if self._sdo is None or dying:
            return  # whose it is nobody can say, or it is dying, and owes nothing any more
        if commissions(self.timeline.possible(wanted)):
            return  # there every frame but the echo is wrong, and none is a start or a beat
        is_beat, asked_for = frame.can_id == self._beat_id, self._boot.owed
        if is_beat or asked_for:
            self._boot.see(seen)
        if self._sdo.waits or self._held is not None:
            self._learn(self._sdo, seen)
        if self._is_emcy(frame):
            self._react(seen)
        if is_beat and not frame.extended and not frame.remote:
            if self._answers_poll(seen):
                return
            self._heartbeats.see(seen)
            if frame.data == b"\x00":
                if not asked_for:
                    self._forget_settings(wanted, Nmt.RESET_COMMUNICATION)
                self._booted(seen)
            elif not self._boot.owed and self.timeline.sure(wanted):
                self._beat = frame

    def _await_period(self, request: Seen) -> None:
        """From a write of 1017h to its answer either period may count."""
        if self._sdo is not None and self._sdo.beat_asked and self._held is None:
            self._held = self.expected
            self.retime(self.expected.of_unknown_beat(), Interval(request.at, request.at))

    def _learn(self, listener: SdoListener, seen: Seen) -> None:
        """The device may have confirmed what the tester has written, or refused it."""
        setting = listener.answered(seen)
        if self._held is not None and not listener.beat_asked:
            held, self._held = self._held, None
            self.retime(held, seen.wanted)
        if setting is not None:
            self._set(setting)

    def _set(self, setting: Setting) -> None:
        """The tester has set something in the device."""
        if isinstance(setting, HeartbeatSet):
            period_ms = setting.period_ms
            known = self.expected.of_unknown_beat()
            if period_ms is not None:
                known = self.expected.beating(period_ms * MS)
            self.retime(known, setting.when)
        elif isinstance(setting, IdentifierSet):
            self._admit(setting.can_id, setting.role)
        else:
            self._reaction.set(setting)
            self._heartbeats.excused = self._reaction.unseen

    def _is_emcy(self, frame: Frame) -> bool:
        """An emergency message of a device that has 1029h."""
        node_id = self.expected.node_id
        if len(frame.data) != 8 or not self.expected.ids.reaction or node_id is None:
            return False
        role = self._admitted.get(frame.can_id)
        return role is Role.EMCY or (frame.can_id == EMCY + node_id and role is None)

    def _react(self, emcy: Seen) -> None:
        """A communication error may have changed its state."""
        error = self._reaction.told(emcy, self.expected.command_ns)
        if error is not None:
            self._beat = None
            self._heartbeats.reacted(error, self.timeline.reacted(error.when, error.leads))

    def retime(self, expected: Expected, when: Interval) -> None:
        """The device beats otherwise from some instant of `when` on."""
        self.expected = expected
        self._beat = None
        self._heartbeats.retimed(expected, self._calm(when))

    def rule_after(self, last: Sighting | None) -> str:
        """The requirement on when the next beat comes, after this beat or boot-up.

        That on the first beat speaks of the period of the start, not of one that was set since.
        """
        ids = self.expected.ids
        if last is None or last.frame.data != b"\x00":
            return ids.beat
        return ids.beat_first if last.at >= self._heartbeats.begun else ids.beat

    def goes_on_from(self, before: Watch) -> None:
        """The same device, watched anew: what was set in it since its start still holds."""
        if before.expected.heartbeat_ns != before._home.heartbeat_ns:
            self.retime(before.expected, Interval(-1, -1))
        for can_id, role in before._admitted.items():
            self._admit(can_id, role)
        self._reaction = before._reaction
        self._heartbeats.excused = self._reaction.unseen

    def _admit(self, can_id: int, role: Role) -> None:
        self._admitted[can_id] = role
        self.speakers.give(can_id)
        self._allowed.admit(can_id, role)

    def _answers_poll(self, seen: Seen) -> bool:
        """Whether it is a guarding answer; where the heartbeat runs there is none."""
        polls = self._polls
        if seen.frame.data == b"\x00" or self.expected.heartbeat_ns:
            polls.clear()
            return False
        while polls and polls[0] < seen.wanted.earliest - ANSWERED_NS:
            polls.popleft()
        if not polls or polls[0] > seen.wanted.latest:
            return False
        polls.popleft()
        return True

    def _booted(self, seen: Seen) -> None:
        """It is pre-operational now, unless it must not boot at all: that is its fault then."""
        if State.PRE_OPERATIONAL in self.timeline.possible(seen.wanted):
            self.timeline.booted(seen.wanted)

    def _own(self, seen: Seen) -> None:
        frame = seen.frame
        if frame.can_id == COMMISSION and not frame.extended:
            self._allowed.requested()
        node_id = self.expected.node_id
        if self._sdo is not None:
            self._sdo.asked(seen)
            self._await_period(seen)
        if frame.remote and frame.can_id == self._beat_id and not frame.extended:
            self._polls.append(seen.at)
        if node_id is None or frame.can_id or self._deaf:
            return
        when = Interval(seen.at, seen.at)
        command = nmt_for(frame, node_id)
        if command is not None and self.timeline.commissions(when):
            return  # there it obeys no command, and owes nothing for one
        if command is not None:
            self._beat = None
            self.timeline.command(when, command)
            self._tell(self._calm(when), command)
            return
        perhaps = long_nmt_for(frame, node_id)
        if perhaps is not None:
            self._beat = None
            self.timeline.command(when, perhaps, certain=False)
            self._heartbeats.commanded(when)
            if perhaps in RESETS:
                self._boot.excuse()
                self._heartbeats.silenced(self._calm(when))

    def _forget_settings(self, when: Interval, command: Nmt | None) -> None:
        """A start brings back what the device starts with (CiA 301 4.2.0, 7.3.2.2).

        Many stacks keep 1017h over a reset of the communication: there nobody can say.
        The same holds for a start that nobody asked for.
        """
        self._held = None
        self._reaction = Reaction()
        self._heartbeats.excused = frozenset()
        if self.expected.heartbeat_ns == self._home.heartbeat_ns:
            return
        known = self._home
        if command is Nmt.RESET_COMMUNICATION:
            known = self.expected.of_unknown_beat()
        self.retime(known, when)

    def _tell(self, when: Interval, command: Nmt) -> None:
        if command in RESETS:
            self._forget_settings(when, command)
        for monitor in self._monitors:
            if command in RESETS:
                monitor.restarted(when, command)
            else:
                monitor.commanded(when)

    def did(self, moment: Moment) -> None:
        """The bench did something to the device."""
        self._beat = None
        if moment.what == "power":
            self._power(moment)
        elif moment.what == "bitrate":
            rate = moment.detail.get("bit_rate")
            self._deaf = self.expected.bit_rate not in {None, rate}
            self._silence(moment.when)
            if isinstance(rate, int) and self.clock.bit_ns:
                self.clock.retune(S // rate, moment.ended_at)

    def _power(self, moment: Moment) -> None:
        if not moment.detail.get("on"):
            when = moment.when
            faded_at = when.latest + self.expected.fade_ns
            self._fades_until = faded_at if self.expected.fade_ns else -1
            self.timeline.power_off(Interval(when.earliest, faded_at))
            self._silence(when)
            return
        self._fades_until = -1
        mode = _MODES.get(str(moment.detail.get("mode")))
        self._allowed.powered()
        self.timeline.power_on(moment.when, mode)
        when = self._calm(moment.when)
        self._forget_settings(when, None)
        for monitor in self._monitors:
            if mode is False and not self._deaf and self.expected.node_id is not None:
                monitor.restarted(when, None)
            else:
                monitor.silenced(when)
        if mode is None:
            self._boot.tolerate()
        elif moment.detail.get("held"):
            self._boot.keys_held()

    def _silence(self, when: Interval) -> None:
        when = self._calm(when)
        for monitor in self._monitors:
            monitor.silenced(when)

    def _calm(self, when: Interval) -> Interval:
        """From where on a frame of the device may still have waited for the bus."""
        return Interval(min(when.earliest, self.quiet_from(when.earliest)), when.latest)

    def happened(self, event: BusEvent) -> None:
        """A bus event: what was lost may have been anything, so the cadence starts anew."""
        self._beat = None
        self.clock.disturb(event.at)
        self._boot.doubt()
        # Nothing can be overdue: what is missing may be among what was lost.
        self._silence(Interval(-1, -1))

    def admit(self, neighbours: frozenset[int]) -> None:
        """The bench puts a station on the bus that sends with these identifiers."""
        self.speakers.admit(neighbours)

    def quiet_from(self, until: int) -> int:
        """A frame asked for before this instant would have ended by `until`."""
        return self.clock.idle_before(until)

    def finish(self, until: int, lateness: Lateness) -> Iterator[Verdict]:
        """Everything that was wrong, up to `until`."""
        quiet_from = self.quiet_from(until)
        for monitor in self._monitors:
            yield from monitor.finish(until, quiet_from, lateness)
