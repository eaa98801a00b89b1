"""Faults of the heartbeat (requirements HB)."""

from __future__ import annotations

from node_model.emcy import EMCY_BASE
from node_model.faults.link import Drop, Duplicate, base_of
from node_model.faults.parts import Fault
from node_model.frame import Frame
from node_model.heartbeat import HEARTBEAT_BASE, HeartbeatProducer
from node_model.keypad.operation import Operation
from node_model.nmt import NmtCommand, NmtState
from node_model.node import MS, NOTHING, Frames

_LIMIT_PERCENT = 5
_LIMIT_NS = 5 * MS
"""The limit of an interval is 5 % or 5 ms, whichever is more (profile)."""


def just_outside(period_ns: int) -> int:
    """By how much an interval must be off to be judged wrong."""
    return max(period_ns * _LIMIT_PERCENT // 100, _LIMIT_NS) + 1 * MS


def is_beat(frame: Frame) -> bool:
    """A heartbeat, not a boot-up."""
    return base_of(frame) == HEARTBEAT_BASE and frame.data != b"\0"


class HeartbeatTooSlow(Operation, Fault):
    """The heartbeat period is 1 ms longer than the limit of an interval allows."""

    violates = ("HB-01", "HB-06", "HB-04")

    def heartbeat_ns(self) -> int:
        """Just past the limit of an interval."""
        period = super().heartbeat_ns()
        return period + just_outside(period) if period else 0


class HeartbeatTooFast(Operation, Fault):
    """The heartbeat period is 1 ms shorter than the limit of an interval allows."""

    violates = ("HB-01", "HB-04")

    def heartbeat_ns(self) -> int:
        """Just past the limit of an interval; periods of a few ms are halved."""
        period = super().heartbeat_ns()
        return max(period - just_outside(period), period // 2)


class HeartbeatMeanTooSlow(Operation, Fault):
    """Each interval is within its limit, but the mean period is 2.1 % too long."""

    violates = ("HB-01", "HB-04")

    def heartbeat_ns(self) -> int:
        """Just past the limit of the mean."""
        return super().heartbeat_ns() * 1021 // 1000


class HeartbeatMeanTooFast(Operation, Fault):
    """Each interval is within its limit, but the mean period is 2.1 % too short."""

    violates = ("HB-01", "HB-04")

    def heartbeat_ns(self) -> int:
        """Just past the limit of the mean."""
        return super().heartbeat_ns() * 979 // 1000


class _Uneven(HeartbeatProducer):
    """Every seventh beat comes late; the next one is in time again."""

    __slots__ = ("count",)

    def start(self, now: int) -> None:
        self.count = 0
        super().start(now)

    def beat(self) -> None:
        super().beat()
        self.count += 1
        late = min(just_outside(self.period_ns), self.period_ns // 2)
        if self.due_at is not None and self.count % 7 in {0, 6}:
            self.due_at += -late if self.count % 7 == 0 else late


class HeartbeatUneven(Operation, Fault):
    """Every seventh heartbeat is 1 ms later than its limit allows; the mean is right."""

    violates = ("HB-01", "HB-04")
    heartbeat_type = _Uneven


class _Drifting(HeartbeatProducer):
    """Each interval is a thousandth longer than the last."""

    __slots__ = ()

    def beat(self) -> None:
        super().beat()
        self.period_ns += self.period_ns // 1000


class HeartbeatDrifts(Operation, Fault):
    """Each heartbeat interval is 0.1 % longer than the one before."""

    violates = ("HB-04", "HB-01", "ROB-03")
    heartbeat_type = _Drifting


class HeartbeatLostEverySeventh(Drop, Fault):
    """Every seventh heartbeat is missing."""

    violates = ("HB-01", "HB-04", "HB-06")

    def picks(self, frame: Frame) -> bool:
        """Heartbeats only."""
        return is_beat(frame)


class HeartbeatDoubled(Duplicate, Fault):
    """Every heartbeat is sent twice."""

    violates = ("HB-01", "HB-04")

    def picks(self, frame: Frame) -> bool:
        """Heartbeats only."""
        return is_beat(frame)


class HeartbeatNoFasterThanFiftyMs(Operation, Fault):
    """Periods below 50 ms are taken as 50 ms."""

    violates = ("HB-01", "COM-09", "HB-06")

    def heartbeat_ns(self) -> int:
        """Zero still means none."""
        period = super().heartbeat_ns()
        return max(period, 50 * MS) if period else 0


class _Mute(Operation):
    """No heartbeat in one state."""

    mute_in: NmtState

    def beat_frames(self) -> Frames:
        """Nothing in that state."""
        return NOTHING if self.state is self.mute_in else super().beat_frames()


class HeartbeatStopsWhenStopped(_Mute, Fault):
    """There is no heartbeat in stopped."""

    violates = ("HB-01", "HB-02", "NMT-07", "HB-06")
    mute_in = NmtState.STOPPED


class HeartbeatStopsWhenOperational(_Mute, Fault):
    """There is no heartbeat in operational."""

    violates = ("HB-01", "HB-02", "NMT-07", "HB-06")
    mute_in = NmtState.OPERATIONAL


class HeartbeatStopsWhenPreOperational(_Mute, Fault):
    """There is no heartbeat in pre-operational."""

    violates = ("HB-01", "HB-06", "HB-02", "NMT-07")
    mute_in = NmtState.PRE_OPERATIONAL


class HeartbeatWithToggleBit(Operation, Fault):
    """Bit 7 of the heartbeat toggles, as in node guarding."""

    violates = ("HB-02",)
    toggle = 0

    def beat_frames(self) -> Frames:
        """The state with a toggle bit."""
        self.toggle ^= 0x80
        return (Frame(HEARTBEAT_BASE + self.node_id, bytes((self.state | self.toggle,))),)


class HeartbeatOfTwoBytes(Operation, Fault):
    """The heartbeat has a second byte."""

    violates = ("HB-02", "ROB-02")

    def beat_frames(self) -> Frames:
        """State and a zero."""
        return (Frame(HEARTBEAT_BASE + self.node_id, bytes((self.state, 0))),)


class _ShowsInstead(Operation):
    """Shows another byte in one state."""

    wrong_in: NmtState
    shows: int

    def beat_frames(self) -> Frames:
        """The wrong byte in that state."""
        if self.state is not self.wrong_in:
            return super().beat_frames()
        return (Frame(HEARTBEAT_BASE + self.node_id, bytes((self.shows,))),)


class StoppedShownAsPreOperational(_ShowsInstead, Fault):
    """The heartbeat shows 7Fh in stopped."""

    violates = ("HB-02", "HB-03", "NMT-04", "NMT-07")
    wrong_in = NmtState.STOPPED
    shows = 0x7F


class OperationalShownAsPreOperational(_ShowsInstead, Fault):
    """The heartbeat goes on to show 7Fh in operational."""

    violates = ("HB-02", "HB-03", "NMT-04", "NMT-07")
    wrong_in = NmtState.OPERATIONAL
    shows = 0x7F


class PreOperationalShownAsZero(_ShowsInstead, Fault):
    """The heartbeat shows 00h in pre-operational, as if it booted for ever."""

    violates = ("HB-02", "NMT-01", "NMT-02", "NMT-07", "HB-01", "HB-06", "NMT-06")
    wrong_in = NmtState.PRE_OPERATIONAL
    shows = 0


class HeartbeatShowsOldState(Operation, Fault):
    """The first heartbeat after a command still shows the state before it."""

    violates = ("HB-03", "HB-02", "NMT-07")
    shown = NmtState.PRE_OPERATIONAL

    def beat_frames(self) -> Frames:
        """What was true at the last beat."""
        before, self.shown = self.shown, self.state
        return self.beats[before.value]


class HeartbeatRestartedByCommand(Operation, Fault):
    """Every NMT command to another node restarts the heartbeat timer."""

    violates = ("HB-04", "HB-01", "ROB-01", "HB-06")

    def receive(self, frame: Frame, now: int) -> Frames:
        """Whatever is for others."""
        if self.boot_at is None and frame.can_id == 0 and self.command(frame) is None:
            self.beat.start(now)
        return super().receive(frame, now)


class HeartbeatRestartedByKeyFrame(Operation, Fault):
    """Every key frame restarts the heartbeat timer."""

    violates = ("HB-04", "HB-01", "HB-06")

    def settle(self, now: int) -> Frames:
        """A key frame starts the period anew."""
        frames = super().settle(now)
        if frames:
            self.beat.start(now)
        return frames


class HeartbeatDoubledByKeyFrame(Operation, Fault):
    """Every key frame is followed by an extra heartbeat."""

    violates = ("HB-04", "HB-01", "ROB-03", "HB-05")

    def settle(self, now: int) -> Frames:
        """Key frame and heartbeat."""
        frames = super().settle(now)
        return (*frames, *self.beat_frames()) if frames else frames


class HeartbeatSkippedByKeyFrame(Operation, Fault):
    """The heartbeat that follows a key frame is left out."""

    violates = ("HB-04", "HB-01", "HB-06")

    def settle(self, now: int) -> Frames:
        """A key frame counts as a sign of life."""
        frames = super().settle(now)
        if frames:
            self.beat.beat()
        return frames


class HeartbeatRestartedByLedFrame(Operation, Fault):
    """Every LED frame restarts the heartbeat timer."""

    violates = ("HB-04", "HB-01", "HB-06")

    def receive(self, frame: Frame, now: int) -> Frames:
        """An LED frame starts the period anew."""
        if self.boot_at is None and frame.can_id:
            self.beat.start(now)
        return super().receive(frame, now)


class ZeroPeriodBeats(Operation, Fault):
    """Heartbeat time 0 is taken as 1000 ms."""

    violates = ("HB-05", "COM-09")

    def heartbeat_ns(self) -> int:
        """A default where there should be silence."""
        return super().heartbeat_ns() or 1000 * MS


class ZeroPeriodBootsSilently(Operation, Fault):
    """With heartbeat time 0 there is no boot-up either."""

    violates = ("HB-05", "NMT-02")

    def boot_frames(self, cause: NmtCommand) -> Frames:
        """Only what is not error control."""
        frames = super().boot_frames(cause)
        silent = not self.parameters.heartbeat_ms
        return tuple(f for f in frames if not silent or f.can_id == EMCY_BASE + self.node_id)


class _StartsLate(HeartbeatProducer):
    """The first beat takes longer than the others."""

    __slots__ = ()

    def start(self, now: int) -> None:
        super().start(now + just_outside(self.period_ns))


class FirstHeartbeatLate(Operation, Fault):
    """The first heartbeat comes 1 ms later after boot-up than a period and its limit allow."""

    violates = ("HB-06",)
    heartbeat_type = _StartsLate


FAULTS: tuple[type[Fault], ...] = (
    HeartbeatTooSlow,
    HeartbeatTooFast,
    HeartbeatMeanTooSlow,
    HeartbeatMeanTooFast,
    HeartbeatUneven,
    HeartbeatDrifts,
    HeartbeatLostEverySeventh,
    HeartbeatDoubled,
    HeartbeatNoFasterThanFiftyMs,
    HeartbeatStopsWhenStopped,
    HeartbeatStopsWhenOperational,
    HeartbeatStopsWhenPreOperational,
    HeartbeatWithToggleBit,
    HeartbeatOfTwoBytes,
    StoppedShownAsPreOperational,
    OperationalShownAsPreOperational,
    PreOperationalShownAsZero,
    HeartbeatShowsOldState,
    HeartbeatRestartedByCommand,
    HeartbeatRestartedByKeyFrame,
    HeartbeatDoubledByKeyFrame,
    HeartbeatSkippedByKeyFrame,
    HeartbeatRestartedByLedFrame,
    ZeroPeriodBeats,
    ZeroPeriodBootsSilently,
    FirstHeartbeatLate,
)
