"""Keypads that differ and conform: a test that fails one of them is too strict."""

from __future__ import annotations

from node_model.debounce import Debouncer
from node_model.emcy import EMCY_BASE, GENERIC_ERROR, HARDWARE_ERROR, emcy_frame
from node_model.faults.link import Delay, Slow, base_of
from node_model.faults.parts import Deviation
from node_model.faults.pausing import PausingKeys
from node_model.frame import Frame
from node_model.heartbeat import HeartbeatProducer
from node_model.keypad import Keypad, Parameters
from node_model.keypad.commissioning import ECHO_ID, ECHO_PERIOD_NS, Commissioning
from node_model.keypad.operation import BLINK_BASE, STEADY_BASE, Operation
from node_model.nmt import NmtCommand, NmtState
from node_model.node import MS, NOTHING, US, Frames, earliest

_SCAN_NS = 10 * MS
"""How often a keypad may read its keys at the least (profile)."""


class FirstHeartbeatAtOnce(Operation, Deviation):
    """The first heartbeat follows boot-up at once."""

    allowed_by = "HB-06"

    def boot_frames(self, cause: NmtCommand) -> Frames:
        """Boot-up, EMCY, heartbeat."""
        frames = super().boot_frames(cause)
        return (*frames, *self.beat_frames()) if self.beat.period_ns else frames


class HeartbeatAtStateChange(Operation, Deviation):
    """A state change is shown by a heartbeat at once, which starts a new phase."""

    allowed_by = "HB-04"

    def obey(self, command: NmtCommand, now: int) -> Frames:
        """Whatever the command brings, then the heartbeat."""
        before = self.state
        frames = super().obey(command, now)
        if self.boot_at is not None or self.state is before or not self.beat.period_ns:
            return frames
        self.beat.start(now)
        return (*frames, *self.beat_frames())


class ClockSlow(Operation, Deviation):
    """The clock is 100 ppm slow."""

    allowed_by = "HB-01"

    def heartbeat_ns(self) -> int:
        """A little more than it should be."""
        return super().heartbeat_ns() * 10_001 // 10_000

    def debounce_ns(self) -> int:
        """The same clock."""
        return super().debounce_ns() * 10_001 // 10_000


class ClockFast(Operation, Deviation):
    """The clock is 100 ppm fast."""

    allowed_by = "HB-01"

    def heartbeat_ns(self) -> int:
        """A little less than it should be."""
        return super().heartbeat_ns() * 9_999 // 10_000

    def debounce_ns(self) -> int:
        """The same clock."""
        return super().debounce_ns() * 9_999 // 10_000


class _Jitters(HeartbeatProducer):
    """Beats around a grid, by a linear congruential sequence of its own (Knuth, MMIX)."""

    __slots__ = ("_state", "_target")

    def start(self, now: int) -> None:
        self._state = 1
        super().start(now)
        self._target = now + self.period_ns

    def beat(self) -> None:
        self._state = (self._state * 6364136223846793005 + 1442695040888963407) % (1 << 64)
        self._target += self.period_ns
        span = min(max(self.period_ns // 50, 2 * MS), self.period_ns // 4)
        self.due_at = self._target + span * (self._state >> 53) // (1 << 11)


class HeartbeatJitters(Operation, Deviation):
    """Each heartbeat comes up to 2 % (or 2 ms) after its due instant, never the same."""

    allowed_by = "HB-01"
    heartbeat_type = _Jitters


class SlowBoot(Keypad, Deviation):
    """Initialisation takes 999 ms."""

    allowed_by = "NMT-02"

    def start_ns(self) -> int:
        """Within the profile's 1 s."""
        return 999 * MS


class SlowReset(Operation, Deviation):
    """Initialisation after an NMT reset takes 999 ms."""

    allowed_by = "NMT-06"

    def reset_ns(self) -> int:
        """As long as after power-on."""
        return 999 * MS


class EmcyAfterPause(Delay, Deviation):
    """The EMCY comes 99 ms after boot-up."""

    allowed_by = "NMT-02"
    span_ns = 99 * MS

    def picks(self, frame: Frame) -> bool:
        """EMCY only."""
        return base_of(frame) == EMCY_BASE


class EmcyAfterResetCommunication(Operation, Deviation):
    """The EMCY follows boot-up after reset communication too."""

    allowed_by = "NMT-22"

    def boot_frames(self, cause: NmtCommand) -> Frames:  # noqa: ARG002  the seam's arguments
        """The same after every reset."""
        return super().boot_frames(NmtCommand.RESET_NODE)


class EmcyOfAnotherHardwareCode(Operation, Deviation):
    """The EMCY has code 5001h and bytes of the maker."""

    allowed_by = "NMT-02"
    departs = ("NMT-20",)

    def emcy(self) -> Frame:
        """Still hardware."""
        return emcy_frame(self.node_id, HARDWARE_ERROR + 1, GENERIC_ERROR, b"\1\2\3\4\5")


class LongCommandsRefused(Operation, Deviation):
    """NMT frames of more than two bytes are ignored."""

    allowed_by = "NMT-21"

    def command(self, frame: Frame) -> NmtCommand | None:
        """Exactly two bytes."""
        return super().command(frame) if len(frame.data) == 2 else None


class SlowToObey(Slow, Deviation):
    """NMT commands take effect after 49 ms."""

    allowed_by = "HB-03"
    span_ns = 49 * MS

    def picks(self, frame: Frame) -> bool:
        """NMT only."""
        return frame.can_id == 0


class _Scanning(Debouncer):
    """Sees the contacts only at every multiple of 10 ms."""

    def __init__(self, time_ns: int, raw: int = 0) -> None:
        super().__init__(time_ns, raw)
        self._contacts = raw
        self._scan_at: int | None = None

    def edge(self, raw: int, now: int) -> None:
        self._contacts = raw
        self._scan_at = (now // _SCAN_NS + 1) * _SCAN_NS
        self.due_at = earliest(self.due_at, self._scan_at)

    def advance(self, now: int) -> int:
        scan_at = self._scan_at
        if scan_at is not None and scan_at <= now:
            self._scan_at = None
            super().edge(self._contacts, scan_at)
        ripe = super().advance(now)
        self.due_at = earliest(min(self._mature_at.values(), default=None), self._scan_at)
        return ripe


class KeysScanned(Operation, Deviation):
    """Keys are read every 10 ms; what happens between two readings is not seen."""

    allowed_by = "KEY-05"
    debouncer_type = _Scanning


class KeyFrameAfterPause(PausingKeys, Deviation):
    """Key frames are sent 19 ms after the change was taken."""

    allowed_by = "KEY-05"


class KeyChangesInSeveralFrames(Operation, Deviation):
    """Changes that mature together travel in one frame a key, one right after the other."""

    allowed_by = "KEY-23"

    def settle(self, now: int) -> Frames:
        """The states on the way, lowest bit first."""
        changed = self.keys.advance(now)
        if not self.reports(changed):
            return NOTHING
        mask, frames = self.keys.settled ^ changed, []
        while changed:
            bit = changed & -changed
            changed ^= bit
            mask ^= bit
            frames.append(self.key_frame(mask))
        return frames


class EntryCountsAtOnce(Operation, Deviation):
    """What is held on entering operational counts at once."""

    allowed_by = "KEY-22"

    def entry_frames(self, now: int) -> Frames:
        """The contacts as they are, settled."""
        self.keys = self.fresh_keys(self.raw)
        return super().entry_frames(now)


class EntryStartsDebounce(Operation, Deviation):
    """Keys pressed outside operational count after the debounce time from entry."""

    allowed_by = "KEY-22"

    def fresh_keys(self, mask: int) -> Debouncer:  # noqa: ARG002  the seam's arguments
        """After a reset no key is known to be held."""
        return super().fresh_keys(0)

    def hold(self, mask: int, now: int) -> Frames:
        """Outside operational nobody looks."""
        if self.state is NmtState.OPERATIONAL:
            return super().hold(mask, now)
        self.raw = mask
        return NOTHING

    def entry_frames(self, now: int) -> Frames:
        """What was known; the contacts count from now."""
        self.keys.edge(self.raw, now)
        self.keys.advance(now)
        return super().entry_frames(now)


class StartAgainSendsState(Operation, Deviation):
    """A start command while operational sends the key frame again."""

    allowed_by = "KEY-21"

    def obey(self, command: NmtCommand, now: int) -> Frames:
        """As on entry."""
        again = command is NmtCommand.START and self.state is NmtState.OPERATIONAL
        return self.entry_frames(now) if again else super().obey(command, now)


class LedsOffOnLeaving(Operation, Deviation):
    """All LEDs go off when operational is left."""

    allowed_by = "LED-22"

    def obey(self, command: NmtCommand, now: int) -> Frames:
        """New lamps in every other state."""
        frames = super().obey(command, now)
        if self.state is not NmtState.OPERATIONAL:
            self.lamps = self.lamps_type(self.profile, now)
        return frames


class SlowLeds(Slow, Deviation):
    """LED frames take effect after 49 ms."""

    allowed_by = "LED-01"
    span_ns = 49 * MS

    def picks(self, frame: Frame) -> bool:
        """LED frames only."""
        return base_of(frame) in {STEADY_BASE, BLINK_BASE}


class BlinkRestartsWithMap(Operation, Deviation):
    """Each blink frame starts the waveform anew, for all LEDs together."""

    allowed_by = "LED-05"

    def receive(self, frame: Frame, now: int) -> Frames:
        """Another origin; the maps stay."""
        blinking = self.lamps.blinking
        frames = super().receive(frame, now)
        if self.lamps.blinking != blinking:
            old, self.lamps = self.lamps, self.lamps_type(self.profile, now)
            self.lamps.steady, self.lamps.blinking = old.steady, old.blinking
        return frames


class EchoOfEightBytes(Commissioning, Deviation):
    """The echo has eight bytes, the last two zero."""

    allowed_by = "COM-25"

    def echo_frame(self, parameters: Parameters) -> Frame:
        """Two more."""
        return Frame(ECHO_ID, parameters.encode() + bytes(2))


class FirstEchoAfterPeriod(Commissioning, Deviation):
    """The first echo comes one period after reception."""

    allowed_by = "COM-05"

    def first_echo_ns(self) -> int:
        """Not at once."""
        return ECHO_PERIOD_NS


class EchoSlightlySlow(Commissioning, Deviation):
    """The echo period is 101.9 ms."""

    allowed_by = "COM-05"

    def echo_period_ns(self) -> int:
        """Within the limits of interval and mean."""
        return ECHO_PERIOD_NS + 1900 * US


class CommissionsWithMoreKeys(Keypad, Deviation):
    """Both commissioning keys together with others start commissioning too."""

    allowed_by = "COM-28"

    def wants_commissioning(self) -> bool:
        """At least these."""
        return self._held >= self.profile.commissioning_keys


class CommissionsAfterReset(Keypad, Deviation):
    """Both commissioning keys held at an NMT reset start commissioning too."""

    allowed_by = "COM-28"

    def receive(self, frame: Frame, now: int) -> Frames:
        """A reset leads back to the choice of the mode."""
        frames = super().receive(frame, now)
        mode = self._mode
        if isinstance(mode, Operation) and mode.boot_at is not None and self.wants_commissioning():
            self._mode, self._decide_at = None, mode.boot_at
            self.listens_to = frozenset()
        return frames


DEVIATIONS: tuple[type[Deviation], ...] = (
    FirstHeartbeatAtOnce,
    HeartbeatAtStateChange,
    ClockSlow,
    ClockFast,
    HeartbeatJitters,
    SlowBoot,
    SlowReset,
    EmcyAfterPause,
    EmcyAfterResetCommunication,
    EmcyOfAnotherHardwareCode,
    LongCommandsRefused,
    SlowToObey,
    KeysScanned,
    KeyFrameAfterPause,
    KeyChangesInSeveralFrames,
    EntryCountsAtOnce,
    EntryStartsDebounce,
    StartAgainSendsState,
    LedsOffOnLeaving,
    SlowLeds,
    BlinkRestartsWithMap,
    EchoOfEightBytes,
    FirstEchoAfterPeriod,
    EchoSlightlySlow,
    CommissionsWithMoreKeys,
    CommissionsAfterReset,
)
