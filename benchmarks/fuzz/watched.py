"""A device under watch: what must hold whatever it is told, at every call.

- It raises nothing, and time goes on: after each call its deadline lies ahead.
- A heartbeat comes exactly when it is due: one period after the boot-up, the write of 1017h
  or the heartbeat before, with the state in it, and at no other instant.
- An NMT command leads where CiA 301 says (7.3.2.2); nothing else does, but for an error.
- Every SDO and LSS answer has eight bytes.
- Its memory changes only after "save", "load" or LSS 17h were accepted.
"""

from __future__ import annotations

from functools import partial

from node_model.device import Cia301Device
from node_model.frame import Frame
from node_model.nmt import NmtState
from node_model.node import MS, Frames

PRODUCER_TIME, STORE, RESTORE = 0x1017, 0x1010, 0x1011
LSS_REQUEST, LSS_ANSWER, LSS_STORE = 0x7E5, 0x7E4, 0x17
TARGETS = {1: 0x05, 2: 0x04, 0x80: 0x7F, 0x81: 0x00, 0x82: 0x00}
REACTIONS = {0: NmtState.PRE_OPERATIONAL, 2: NmtState.STOPPED}
STATES = frozenset({b"\x04", b"\x05", b"\x7f"})
BYTE_NS = 50_000
"""What the memory needs for a byte."""


class Finding(Exception):
    """Something that must hold does not."""


class Watched:
    """A node for a world or a host of one's own.

    Args:
        device: switched off.
    """

    def __init__(self, device: Cia301Device) -> None:
        self.device = device
        self.bit_rate = device.bit_rate
        self.listens_to = device.listens_to
        self.now = 0
        self.calls = 0
        self.said: list[tuple[int, Frame]] = []
        self.beats = 0
        """Boot-ups, heartbeats and answers to polls that it sent."""
        self._beat_at: int | None = None
        self._image = device.image()
        self._asked_at: int | None = None
        self._written: bytes | None = None
        self._watch_objects()

    def _watch_objects(self) -> None:
        """The objects of the present node id."""
        self._od = od = self.device.od
        od.observe(PRODUCER_TIME, self._new_period)
        for index, word in ((STORE, b"save"), (RESTORE, b"load")):
            od.guard(index, partial(self._keep, word))
            od.observe(index, self._asked)

    def _period_ns(self) -> int:
        return self.device.od.number(PRODUCER_TIME) * MS

    def _new_period(self, sub: int, now: int) -> None:  # noqa: ARG002  an observer
        period = self._period_ns()
        self._beat_at = now + period if period else None

    def _keep(self, word: bytes, sub: int, data: bytes) -> None:
        if data != word:
            raise Finding(f"{data!r} was accepted where {word!r} is asked for, sub-index {sub}")

    def _asked(self, sub: int, now: int) -> None:  # noqa: ARG002  an observer
        self._asked_at = now

    # The verbs of a node.

    def power_on(self, now: int) -> Frames:
        """Supply."""
        return self._judged(self.device.power_on(now), now)

    def power_off(self, now: int) -> Frames:
        """No supply."""
        return self._judged(self.device.power_off(now), now)

    def receive(self, frame: Frame, now: int) -> Frames:
        """A frame."""
        before = self.device.state
        hears, node_id = bool(self.device.bit_rate), self.device.node_id
        frames = self._judged(self.device.receive(frame, now), now, frame)
        expected = before
        if hears and not frame.can_id:
            expected = _target(frame, node_id, before)
        if self.device.state is not expected and not self._may_change(frames, frame):
            raise Finding(f"{frame} led from {before.name} to {self.device.state.name}")
        return frames

    def _may_change(self, frames: Frames, frame: Frame) -> bool:
        """An error has its reaction (1029h), and LSS starts a device that gets its node id."""
        state = self.device.state
        if state is NmtState.INITIALISING:
            return frame.can_id == LSS_REQUEST
        told = any(len(each.data) == 8 and each.can_id < 0x100 for each in frames)
        return told or (self.is_quiet_about_errors() and state is self.reaction())

    def is_quiet_about_errors(self) -> bool:
        """There is no EMCY, or it may be held back for a time (1014h, 1015h)."""
        od = self.device.od
        return od.number(0x1014) >> 31 == 1 or od.number(0x1015) > 0

    def reaction(self) -> NmtState | None:
        """Where an error of communication leads from operational; None = nowhere (1029h)."""
        return REACTIONS.get(self.device.od.number(0x1029, 1))

    def advance(self, now: int) -> Frames:
        """Time."""
        return self._judged(self.device.advance(now), now)

    def deadline(self) -> int | None:
        """The device's."""
        return self.device.deadline()

    # What must hold.

    def _judged(self, frames: Frames, now: int, cause: Frame | None = None) -> Frames:
        device = self.device
        self.calls += 1
        self.now = now
        self.bit_rate, self.listens_to = device.bit_rate, device.listens_to
        if device.od is not self._od:
            self._watch_objects()
        for frame in frames:
            self.said.append((now, frame))
            if frame.can_id == 0x700 + device.node_id:
                self._beat(frame, now, cause)
            elif frame.can_id == 0x580 + device.node_id and len(frame.data) != 8:
                raise Finding(f"an SDO answer is {frame}")
            elif frame.can_id == LSS_ANSWER:
                self._lss(frame, now)
        self._none_is_late(now)
        due = device.deadline()
        if due is not None and due <= now:
            raise Finding(f"its deadline {due} is not later than {now}")
        self._memory(now)
        return frames

    def _beat(self, frame: Frame, now: int, cause: Frame | None) -> None:
        self.beats += 1
        period = self._period_ns()
        if frame.data == b"\0":
            self._beat_at = now + period if period else None
            return
        if cause is not None and cause.remote and not period:
            return  # the answer to a poll
        if frame.data not in STATES:
            raise Finding(f"a heartbeat is {frame}")
        if now != self._beat_at:
            raise Finding(f"{frame} at {now}; due was {self._beat_at}")
        self._beat_at = now + period

    def _none_is_late(self, now: int) -> None:
        if self.device.state is NmtState.INITIALISING:
            self._beat_at = None
            return
        while self._beat_at is not None and self._beat_at <= now:
            if self.device.bit_rate:
                raise Finding(f"the heartbeat of {self._beat_at} did not come by {now}")
            self._beat_at += self._period_ns()  # silent, as LSS 15h asks for

    def _lss(self, frame: Frame, now: int) -> None:
        if len(frame.data) != 8:
            raise Finding(f"an LSS answer is {frame}")
        if frame.data[0] == LSS_STORE:
            self._asked_at = now

    def _memory(self, now: int) -> None:
        image = self.device.image()
        if image == self._image:
            return
        if self._asked_at is None or now > self._asked_at + len(image) * BYTE_NS:
            raise Finding(f"its memory changed at {now}; it was last asked to at {self._asked_at}")
        self._image = image


def _target(frame: Frame, node_id: int, before: NmtState) -> NmtState:
    """Where a frame with identifier 0 leads."""
    data = frame.data
    if frame.extended or frame.remote or len(data) < 2 or data[1] not in {0, node_id}:
        return before
    if before is NmtState.INITIALISING:
        return before  # without a node id it is in LSS alone
    return NmtState(TARGETS.get(data[0], before))
