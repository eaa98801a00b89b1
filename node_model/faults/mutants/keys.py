"""Faults of the key frames: when, what, in which state (requirements KEY)."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence

from node_model.debounce import Debouncer
from node_model.faults.link import Drop, Duplicate, Reorder, base_of
from node_model.faults.parts import Fault
from node_model.frame import Frame
from node_model.keypad.operation import KEY_BASE, Operation
from node_model.nmt import NmtCommand, NmtState
from node_model.node import MS, NOTHING, Frames


def is_key_frame(frame: Frame) -> bool:
    """First TPDO of any node."""
    return base_of(frame) == KEY_BASE


# The entry into operational.


class EntryFrameMissing(Operation, Fault):
    """No key frame is sent on entering operational."""

    violates = ("KEY-01", "KEY-22")

    def entry_frames(self, now: int) -> Frames:  # noqa: ARG002  the seam's arguments
        """Nothing until a key moves."""
        return NOTHING


class EntryFrameTwice(Operation, Fault):
    """The key frame on entering operational is sent twice."""

    violates = ("KEY-01", "KEY-06", "KEY-07")

    def entry_frames(self, now: int) -> Frames:
        """Once more."""
        return (*super().entry_frames(now), *super().entry_frames(now))


class EntryFrameEmpty(Operation, Fault):
    """The key frame on entering operational shows no key, whatever is held."""

    violates = ("KEY-01", "KEY-06", "KEY-22", "KEY-07")

    def entry_frames(self, now: int) -> Frames:  # noqa: ARG002  the seam's arguments
        """All released."""
        return (self.key_frame(0),)


class EntryOnlyFirstTime(Operation, Fault):
    """Only the first entry into operational is followed by a key frame."""

    violates = ("KEY-01", "KEY-07", "KEY-22")
    entered = False

    def entry_frames(self, now: int) -> Frames:
        """Once in a life."""
        first, self.entered = not self.entered, True
        return super().entry_frames(now) if first else NOTHING


class HeldAtStartNeverSeen(Operation, Fault):
    """Keys held at power-up are not seen until they move."""

    violates = ("KEY-22", "KEY-01", "KEY-06")

    def fresh_keys(self, mask: int) -> Debouncer:
        """What is held counts as released."""
        keys = super().fresh_keys(0)
        keys.raw = mask
        return keys


class EntryFrameLate(Operation, Fault):
    """The key frame on entering operational comes after 51 ms."""

    violates = ("KEY-01", "KEY-07")
    entry_at: int | None = None

    def entry_frames(self, now: int) -> Frames:
        """Not yet."""
        self.entry_at = now + 51 * MS
        return NOTHING

    def deadline(self) -> int | None:
        """That frame too."""
        due = super().deadline()
        return self.entry_at if self.entry_at and (due is None or self.entry_at < due) else due

    def fire(self, now: int) -> Frames:
        """That frame, if it is still wanted, and what else is due."""
        if self.entry_at != now:
            return super().fire(now)
        self.entry_at = None
        operational = self.state is NmtState.OPERATIONAL
        late = super().entry_frames(now) if operational else NOTHING
        return (*late, *super().fire(now)) if super().deadline() == now else late


# The payload.


class _OtherPayload(Operation):
    """Key frames show something else."""

    @abstractmethod
    def shown(self, mask: int) -> int:
        """Bits of the key frame."""

    def key_frame(self, mask: int) -> Frame:
        """A key frame with those bits."""
        return super().key_frame(self.shown(mask))


class KeyBitsSwapped(_OtherPayload, Fault):
    """The bits of the first two keys are swapped."""

    violates = ("KEY-03", "KEY-01", "KEY-06", "KEY-07", "KEY-22", "KEY-02")

    def shown(self, mask: int) -> int:
        """Bit 0 for bit 1."""
        return mask & ~3 | (mask & 1) << 1 | mask >> 1 & 1


class KeyBitsReversed(_OtherPayload, Fault):
    """The bits of the keys are counted from the other end."""

    violates = ("KEY-03", "KEY-01", "KEY-06", "KEY-07", "KEY-22", "KEY-02")

    def shown(self, mask: int) -> int:
        """Bit 7 for bit 0."""
        bits = 8 * self.profile.key_bytes
        return int(f"{mask:0{bits}b}"[::-1], 2)


class KeyBitsInverted(_OtherPayload, Fault):
    """A key bit is 0 while the key is held."""

    violates = ("KEY-03", "KEY-01", "KEY-06", "KEY-07", "KEY-22", "KEY-23", "KEY-02")

    def shown(self, mask: int) -> int:
        """Every bit."""
        return mask ^ ((1 << 8 * self.profile.key_bytes) - 1)


class LastKeyDead(_OtherPayload, Fault):
    """The key of the highest bit is never shown."""

    violates = ("KEY-03", "KEY-02", "KEY-06", "KEY-01", "KEY-22", "KEY-23")

    def shown(self, mask: int) -> int:
        """All but that one."""
        return mask & ~(1 << max(self.profile.keys.values()))


class KeyFrameShowsChange(Operation, Fault):
    """A key frame shows the keys that changed instead of those that are held."""

    violates = ("KEY-02", "KEY-03", "KEY-06", "KEY-20", "KEY-23")

    def settle(self, now: int) -> Frames:
        """The difference."""
        changed = self.keys.advance(now)
        return (self.key_frame(changed),) if changed and self.reports(changed) else NOTHING


class KeyFrameOfTwoBytes(Operation, Fault):
    """Key frames have one byte too many."""

    violates = ("ROB-02", "KEY-03")

    def key_frame(self, mask: int) -> Frame:
        """A zero behind."""
        frame = super().key_frame(mask)
        return Frame(frame.can_id, frame.data + b"\0")


class KeyFrameOfNodeOne(Operation, Fault):
    """Key frames have the COB-ID of node 1, whatever the node id is."""

    violates = ("KEY-01", "KEY-02", "ROB-02", "KEY-22")

    def key_frame(self, mask: int) -> Frame:
        """Forgotten to add the id."""
        return Frame(KEY_BASE + 1, super().key_frame(mask).data)


# What is reported.


class OnlyFirstKeyReported(Operation, Fault):
    """A key pressed while another one is held is not reported."""

    violates = ("KEY-02", "KEY-06", "KEY-22", "KEY-20", "KEY-03", "KEY-23", "ROB-03")

    def reports(self, changed: int) -> bool:
        """Only the first press and the last release."""
        alone = self.keys.settled in {0, changed}
        return alone and super().reports(changed)


class ReleasesNotReported(Operation, Fault):
    """Releases are not reported."""

    violates = ("KEY-20", "KEY-06", "KEY-02", "KEY-03", "KEY-23")

    def reports(self, changed: int) -> bool:
        """Presses only."""
        return bool(changed & self.keys.settled) and super().reports(changed)


class TogetherOnlyOneReported(Operation, Fault):
    """Of changes that mature together only the one with the lowest bit is ever shown."""

    violates = ("KEY-23", "KEY-06", "KEY-02", "KEY-20", "KEY-03", "KEY-05", "KEY-22")

    def settle(self, now: int) -> Frames:
        """The others wait for the next frame."""
        changed = self.keys.advance(now)
        if not changed or not self.reports(changed):
            return NOTHING
        others = changed & (changed - 1)
        return (self.key_frame(self.keys.settled ^ others),)


class KeyFrameDoubled(Duplicate, Fault):
    """Every key frame is sent twice."""

    violates = ("KEY-06", "KEY-01", "KEY-02", "KEY-07")

    def picks(self, frame: Frame) -> bool:
        """Key frames only."""
        return is_key_frame(frame)


class KeyFrameLostEveryFifth(Drop, Fault):
    """Every fifth key frame is missing."""

    violates = ("KEY-06", "KEY-02", "KEY-01", "KEY-20", "KEY-03", "KEY-23", "ROB-03", "KEY-05")
    every = 5

    def picks(self, frame: Frame) -> bool:
        """Key frames only."""
        return is_key_frame(frame)


class KeyFramesReordered(Reorder, Fault):
    """Key frames leave in pairs, the later one first."""

    violates = ("KEY-06", "KEY-01", "KEY-05", "KEY-22", "KEY-20")

    def picks(self, frame: Frame) -> bool:
        """Key frames only."""
        return is_key_frame(frame)


# Where it is reported.


class _ReportsIn(Operation):
    """Reports keys in another state too."""

    state_too: NmtState

    def reports(self, changed: int) -> bool:
        """There, or where it should."""
        return self.state is self.state_too or super().reports(changed)


class ReportsInPreOperational(_ReportsIn, Fault):
    """Key changes are reported in pre-operational too."""

    violates = ("KEY-07", "ROB-02")
    state_too = NmtState.PRE_OPERATIONAL


class ReportsInStopped(_ReportsIn, Fault):
    """Key changes are reported in stopped too."""

    violates = ("KEY-07", "ROB-02")
    state_too = NmtState.STOPPED


class EntryFrameInPreOperational(Operation, Fault):
    """Entering pre-operational is followed by a key frame too."""

    violates = ("KEY-07", "ROB-02", "NMT-07")

    def obey(self, command: NmtCommand, now: int) -> Frames:
        """The entry frame in the wrong place."""
        frames = super().obey(command, now)
        pre = self.state is NmtState.PRE_OPERATIONAL
        return (*frames, *super().entry_frames(now)) if pre else frames


class MissedChangesMadeUpFor(Operation, Fault):
    """Changes outside operational are reported one by one after the entry frame."""

    violates = ("KEY-07", "KEY-01", "KEY-06")
    missed: Sequence[int] = ()

    def settle(self, now: int) -> Frames:
        """Keep what nobody may hear."""
        before = self.keys.settled
        frames = super().settle(now)
        if self.keys.settled != before and self.state is not NmtState.OPERATIONAL:
            self.missed = (*self.missed[-7:], self.keys.settled)
        return frames

    def entry_frames(self, now: int) -> Frames:
        """The state, then the past."""
        past, self.missed = self.missed, ()
        return (*super().entry_frames(now), *(self.key_frame(mask) for mask in past))


FAULTS: tuple[type[Fault], ...] = (
    EntryFrameMissing,
    EntryFrameTwice,
    EntryFrameEmpty,
    EntryOnlyFirstTime,
    HeldAtStartNeverSeen,
    EntryFrameLate,
    KeyBitsSwapped,
    KeyBitsReversed,
    KeyBitsInverted,
    LastKeyDead,
    KeyFrameShowsChange,
    KeyFrameOfTwoBytes,
    KeyFrameOfNodeOne,
    OnlyFirstKeyReported,
    ReleasesNotReported,
    TogetherOnlyOneReported,
    KeyFrameDoubled,
    KeyFrameLostEveryFifth,
    KeyFramesReordered,
    ReportsInPreOperational,
    ReportsInStopped,
    EntryFrameInPreOperational,
    MissedChangesMadeUpFor,
)
