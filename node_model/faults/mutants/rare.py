"""Faults that show rarely: the third time, the thousandth, at a wrap, between two edges."""

from __future__ import annotations

from node_model.debounce import Debouncer
from node_model.faults.link import Drop
from node_model.faults.mutants.heartbeat import is_beat, just_outside
from node_model.faults.mutants.keys import is_key_frame
from node_model.faults.parts import Fault
from node_model.frame import Frame
from node_model.heartbeat import HeartbeatProducer
from node_model.keypad.commissioning import ECHO_ID, Commissioning
from node_model.keypad.operation import Operation
from node_model.nmt import NmtCommand, NmtState
from node_model.node import MS, NOTHING, Frames

_TICKS_NS = 65_536 * MS
"""Where a counter of ms in 16 bits wraps."""


# The third time, and later.


class ThirdResetIgnored(Operation, Fault):
    """The third NMT reset since power-on is ignored."""

    violates = ("NMT-06", "NMT-04", "NMT-07")
    resets = 0

    def reset(self, command: NmtCommand, now: int) -> Frames:
        """Two are remembered."""
        self.resets += 1
        return super().reset(command, now) if self.resets != 3 else NOTHING


class ThirdRequestChangesMemory(Commissioning, Fault):
    """A third 4F8h is stored, though the echo shows the first."""

    violates = ("COM-21", "COM-06")
    requests = 0

    def receive(self, frame: Frame, now: int) -> Frames:
        """Two are counted."""
        parameters = self.decode(frame.data) if self.accepts(frame) else None
        self.requests += parameters is not None
        if parameters is not None and self.requests == 3:
            self.store.save(parameters.encode(), now)
        return super().receive(frame, now)


class EchoLostEveryFiftieth(Drop, Fault):
    """Every fiftieth echo is missing."""

    violates = ("COM-05",)
    every = 50

    def picks(self, frame: Frame) -> bool:
        """Echoes only."""
        return frame.can_id == ECHO_ID


class HeartbeatLostEveryThousandth(Drop, Fault):
    """Every thousandth heartbeat is missing."""

    violates = ("HB-01", "HB-04")
    every = 1000

    def picks(self, frame: Frame) -> bool:
        """Heartbeats only."""
        return is_beat(frame)


class KeyFrameLostEveryHundredth(Drop, Fault):
    """Every hundredth key frame is missing."""

    violates = ("KEY-06", "KEY-02", "KEY-01")
    every = 100

    def picks(self, frame: Frame) -> bool:
        """Key frames only."""
        return is_key_frame(frame)


class KeyFramesEndWithCounter(Operation, Fault):
    """A counter of eight bits runs full: after 255 reports of keys there is no more."""

    violates = ("KEY-06", "KEY-02")
    reported = 0

    def settle(self, now: int) -> Frames:
        """Count, and stop at 255."""
        frames = super().settle(now)
        self.reported += bool(frames)
        return frames if self.reported <= 255 else NOTHING


class _Wrapping(HeartbeatProducer):
    """Counts ms in 16 bits since boot-up."""

    __slots__ = ("wraps_at",)

    def start(self, now: int) -> None:
        self.wraps_at = now + _TICKS_NS
        super().start(now)

    def beat(self) -> None:
        super().beat()
        if self.due_at is not None and self.due_at >= self.wraps_at:
            self.wraps_at += _TICKS_NS
            self.due_at += just_outside(self.period_ns)


class HeartbeatLateAtWrap(Operation, Fault):
    """Each time 65.536 s have passed since boot-up one heartbeat is 1 ms too late."""

    violates = ("HB-01", "HB-04")
    heartbeat_type = _Wrapping


class DeafAfterTwoHundredCommands(Operation, Fault):
    """After two hundred NMT commands since power-on the node obeys no more."""

    violates = ("NMT-04", "NMT-07")
    heard = 0

    def command(self, frame: Frame) -> NmtCommand | None:
        """A queue is full for good."""
        found = super().command(frame)
        self.heard += found is not None
        return found if self.heard <= 200 else None


class LedsFreezeAfterTwoHundredFrames(Operation, Fault):
    """After two hundred LED frames since power-on no LED changes any more."""

    violates = ("LED-01", "LED-02")
    taken = 0

    def takes_leds(self) -> bool:
        """A counter ends at its limit."""
        taken = super().takes_leds()
        self.taken += taken
        return taken and self.taken <= 200


# Between two edges, across a state.


class StopForgetsHeldKeys(Operation, Fault):
    """A key that is held when operational is left counts as released until it moves."""

    violates = ("KEY-01", "KEY-06", "KEY-22", "KEY-07")

    def obey(self, command: NmtCommand, now: int) -> Frames:
        """The debouncer starts anew."""
        was = self.state
        frames = super().obey(command, now)
        if was is NmtState.OPERATIONAL and self.state is not was:
            self.keys = self.debouncer_type(self.debounce_ns(), 0)
            self.keys.raw = self.raw
        return frames


class LedFrameRestartsDebounce(Operation, Fault):
    """An LED frame restarts the debounce time of every pending key."""

    violates = ("KEY-05",)

    def receive(self, frame: Frame, now: int) -> Frames:
        """Between two edges."""
        if frame.can_id and self.boot_at is None:
            self.keys = self._again(now)
        return super().receive(frame, now)

    def _again(self, now: int) -> Debouncer:
        keys = self.debouncer_type(self.debounce_ns(), self.keys.settled)
        keys.edge(self.raw, now)
        return keys


class LedFrameDropsPendingKey(Operation, Fault):
    """A key that is being debounced when an LED frame comes is not reported."""

    violates = ("KEY-06", "KEY-02", "KEY-20")

    def receive(self, frame: Frame, now: int) -> Frames:
        """What is pending is forgotten."""
        if frame.can_id and self.boot_at is None:
            settled, self.keys = self.keys.settled, self.fresh_keys(self.raw)
            self.keys.settled = settled
        return super().receive(frame, now)


class BeatRestartsDebounce(Operation, Fault):
    """A key that is being debounced when a heartbeat is sent starts its debounce time anew."""

    violates = ("KEY-05", "KEY-02", "KEY-06", "COM-10", "KEY-22", "KEY-20")

    def beat_frames(self) -> Frames:
        """The timer is shared."""
        assert self.beat.due_at is not None
        keys = self.debouncer_type(self.debounce_ns(), self.keys.settled)
        keys.edge(self.raw, self.beat.due_at - self.beat.period_ns)
        self.keys = keys
        return super().beat_frames()


FAULTS: tuple[type[Fault], ...] = (
    ThirdResetIgnored,
    ThirdRequestChangesMemory,
    EchoLostEveryFiftieth,
    HeartbeatLostEveryThousandth,
    KeyFrameLostEveryHundredth,
    KeyFramesEndWithCounter,
    HeartbeatLateAtWrap,
    DeafAfterTwoHundredCommands,
    LedsFreezeAfterTwoHundredFrames,
    StopForgetsHeldKeys,
    LedFrameRestartsDebounce,
    LedFrameDropsPendingKey,
    BeatRestartsDebounce,
)
