"""A keypad that takes its time to tell of its keys, inside the limit (KEY-05)."""

from __future__ import annotations

from node_model.frame import Frame
from node_model.keypad import Parameters, Profile
from node_model.keypad.operation import Operation
from node_model.nmt import NmtCommand
from node_model.node import MS, NOTHING, Frames, earliest


class PausingKeys(Operation):
    """Key frames wait a while; a reset forgets those that still do."""

    span_ns = 19 * MS

    def __init__(self, profile: Profile, parameters: Parameters, mask: int, now: int) -> None:
        self._pending: list[tuple[int, Frame]] = []
        super().__init__(profile, parameters, mask, now)

    def entry_frames(self, now: int) -> Frames:
        """Later."""
        return self._later(super().entry_frames(now), now)

    def settle(self, now: int) -> Frames:
        """Later."""
        return self._later(super().settle(now), now)

    def _later(self, frames: Frames, now: int) -> Frames:
        self._pending += ((now + self.span_ns, frame) for frame in frames)
        return NOTHING

    def reset(self, command: NmtCommand, now: int) -> Frames:
        """What was still to be sent is forgotten."""
        self._pending.clear()
        return super().reset(command, now)

    def fire(self, now: int) -> Frames:
        """The key frames whose time has come go first."""
        due = [frame for at, frame in self._pending if at <= now]
        del self._pending[: len(due)]
        return (*due, *super().fire(now))

    def deadline(self) -> int | None:
        """The next of them counts, too."""
        return earliest(super().deadline(), *(at for at, _ in self._pending[:1]))
