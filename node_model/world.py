"""Virtual time: several nodes and a tester on one bit-timed, arbitrated wire.

Laws: time is integer nanoseconds and never goes back; the same calls give the same frames
at the same instants, whatever interpreter or hash seed runs them. A frame occupies the
wire for its exact length (stuff bits included) plus the intermission; of the frames that
wait when the wire falls idle the lowest identifier wins. At one instant devices act before
stimuli, stimuli before the end of a frame, the end of a frame before the next start.

What the wire does not do: bit errors by itself, CAN FD. A controller at another bit
rate than the wire is deaf and mute and loses what it wanted to send (bus-off); a
controller that is alone keeps its frames until there is somebody to acknowledge them. A node
may take back what still waits.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Sequence
from heapq import heappop, heappush, heapreplace

from node_model.controller import Controller, Gathered, Waiting
from node_model.frame import Frame
from node_model.wire import Delivery, Event, Wire

FOREVER = 1 << 62

_CROWD = 6
"""From so many on it is worth while to look whether they can be served all at once: devices
that are due at one instant, frames that wait."""


class World(Wire):
    """One wire and everything on it.

    Args:
        bit_rate: of the wire in bit/s; a divisor of 1 000 000 000.
        now: the instant at which it begins.
    """

    # How time passes.

    def run(self, until: int) -> None:
        """Let time pass; the frames are seen by the nodes alone."""
        next_frame = self.next_frame
        while next_frame(until) is not None:
            pass

    def next_frame(self, until: int) -> Delivery | None:
        """Let time pass until a frame has ended, or until `until`.

        Returns:
            The frame, or None when `until` has come; then the world's time is `until`, or
            what it was if that is later.
        """
        events = self._events
        while True:
            flying = self._flying
            at = events[0][0] if events else FOREVER
            if flying is None and self._contest and self._audience > 1:
                wire_at = self._idle_from if self._idle_from > self.now else self.now
                if wire_at < at:
                    if wire_at > until:
                        break
                    flying = self._start(wire_at)
                    if flying is None:
                        continue
            if flying is not None and self._ends_at < at:
                if self._ends_at > until:
                    break
                return self._finish(flying)
            if at > until:
                break
            if (found := self._event(at, until, flying)) is not None:
                return found
        if until > self.now:
            self.now = until
        return None

    def gather(self, until: int, most: int, heard: Gathered, own: Controller) -> bool:
        """What `next_frame` would hand out, again and again.

        Args:
            until: no frame may end later.
            most: how many frames, at most.
            heard: they are added to it.
            own: a tester; its frames are told apart.

        Returns:
            Whether `until` has come; else there were enough, or an error frame before the last.
        """
        frames, instants = heard.frames, heard.instants
        next_frame = self.next_frame
        while (found := next_frame(until)) is not None:
            frame, at, sender, _ = found
            frames.append(frame)
            instants.append(at)
            if sender is own:
                heard.own.append(len(frames) - 1)
            if self.errors:
                return False
            if sender.repeats is not None and frame is sender.usual:
                ends = self._repeated(sender, frame, until, most - len(frames))
                frames += [frame] * len(ends)
                instants += ends
            elif len(self._contest) > _CROWD:
                self._drain(until, most - len(frames), heard, own)
            if len(frames) >= most:
                return False
        return True

    # The parts of it.

    def _event(self, at: int, until: int, flying: Waiting | None) -> Delivery | None:
        """Whatever stands at the top of the calendar.

        Returns:
            A frame that has ended by that, if it went out and came to its end at once.
        """
        events = self._events
        _, _, _, target, action = events[0]
        node = target.node if target is not None and target.due_at == at else None
        if target is None or node is None:
            heappop(events)
            if action is not None:
                self.now = at
                action(at)
            return None
        frames = node.advance(at)
        due = target.due_at = node.deadline()
        if due is None:
            heappop(events)
        else:
            self._order += 1
            heapreplace(events, (due, 0, self._order, target, None))
        if node.bit_rate != target.rate or node.listens_to is not target.listens_to:
            self.now = at
            self._queue(target, frames)
            self._retune(target, node)
        elif frames:
            if (
                flying is None
                and not self._contest
                and self._idle_from <= at
                and len(frames) == 1
                and (frames[0] is target.usual or self._gets_used_to(target, frames[0]))
            ):
                # Alone on an idle wire, and nobody listens. If nothing happens before it ends,
                # this is the same in effect as queueing it.
                ends_at = at + target.usual_ns
                if ends_at <= until and (not events or ends_at < events[0][0]):
                    self.now = ends_at
                    self._idle_from = ends_at + self._pause_ns
                    return frames[0], ends_at, target, at
            self.now = at
            self._queue(target, frames)
            if len(events) > _CROWD and events[_CROWD][0] == at:
                self._crowd(at)
        return None

    def _crowd(self, at: int) -> None:
        """As `_event` for all devices that are due now, after one that has a frame waiting.

        Nothing can happen between them: no frame starts or ends, and stimuli come later.
        """
        events, contest, rate, order = self._events, self._contest, self.bit_rate, self._order
        events.sort()
        count = bisect_left(events, (at, 1, 0, None, None))
        planned: list[Event] = []
        for _, _, _, target, _ in events[:count]:
            node = target.node if target is not None and target.due_at == at else None
            if target is None or node is None:
                continue
            frames = node.advance(at)
            due = target.due_at = node.deadline()
            order += 1
            if due is not None:
                planned.append((due, 0, order, target, None))
            same = node.bit_rate == target.rate and node.listens_to is target.listens_to
            waiting, alone = target.waiting, same and len(frames) == 1
            if alone and target.rate == rate and 0 == len(waiting) < target.depth:
                order += 1
                entry = (frames[0].order, order, frames[0], at, target)
                heappush(contest, entry)
                waiting.append(entry)
            elif frames or not same:
                self._order = order
                self._queue(target, frames)
                if not same:
                    self._retune(target, node)
                contest, order = self._contest, self._order
        self._order = order
        events[:count] = planned
        events.sort()

    def _drain(self, until: int, most: int, heard: Gathered, own: Controller) -> None:
        """Add the frames that go out one after the other, before anything else happens.

        Whoever sends them stands by what was asked for, and no node hears them.
        """
        contest, routes = self._contest, self._routes
        bit_ns, pause_ns = self.bit_ns, self._pause_ns
        limit = min(self._events[0][0] - 1, until) if self._events else until
        frames, instants, start = heard.frames, heard.instants, self._idle_from
        while contest and most > 0:
            best = contest[0]
            _, _, frame, _, sender = best
            ends_at = start + (frame.known_bits or frame.bits) * bit_ns
            if ends_at > limit or sender.withdraws is not None:
                break
            # A route that is known has been gone since somebody acknowledges.
            if routes.get(-1 if frame.extended else frame.can_id) != ():
                break
            most -= 1
            heappop(contest)
            waiting = sender.waiting
            if waiting[0] is best:
                waiting.popleft()
            else:
                waiting.remove(best)
            if waiting and not sender.by_identifier:
                heappush(contest, waiting[0])
            if sender is own:
                heard.own.append(len(frames))
            frames.append(frame)
            instants.append(ends_at)
            self.now, start = ends_at, ends_at + pause_ns
        self._idle_from = start

    def _repeated(self, sender: Controller, frame: Frame, until: int, most: int) -> Sequence[int]:
        """When the same frame ends that the sender repeats, alone on an idle wire.

        As in `_event` it is heard by no node, and nothing else happens meanwhile.
        """
        due, events = sender.due_at, self._events
        if due is None or due < self._idle_from or self._flying is not None or self._contest:
            return ()
        others = events[1:3] if events[0][3] is sender else events[:1]
        until = min(until, *[event[0] - 1 for event in others], FOREVER)
        last = until - sender.usual_ns
        if due > last or sender.repeats is None:
            return ()
        asked = sender.repeats(frame, last, sender.usual_ns + self._pause_ns, most)
        if not asked:
            return ()
        self.now = asked[-1] + sender.usual_ns
        self._idle_from = self.now + self._pause_ns
        self._settle(sender)
        return [at + sender.usual_ns for at in asked]
