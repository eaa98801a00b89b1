"""Faults of the echo 3F8h and of what else goes on then (requirements COM-05, COM-12)."""

from __future__ import annotations

from abc import abstractmethod

from node_model.faults.parts import Fault
from node_model.frame import Frame
from node_model.heartbeat import heartbeat_frame
from node_model.keypad import Keypad, Parameters
from node_model.keypad.commissioning import ECHO_ID, ECHO_PERIOD_NS, Commissioning
from node_model.keypad.operation import KEY_BASE, STEADY_BASE
from node_model.nmt import NmtState
from node_model.node import MS, NOTHING, Frames


class EchoTooFast(Commissioning, Fault):
    """The echo period is 89 ms."""

    violates = ("COM-05",)

    def echo_period_ns(self) -> int:
        """Just past the limit of an interval."""
        return 89 * MS


class EchoTooSlow(Commissioning, Fault):
    """The echo period is 111 ms."""

    violates = ("COM-05",)

    def echo_period_ns(self) -> int:
        """Just past the limit of an interval."""
        return 111 * MS


class EchoMeanTooFast(Commissioning, Fault):
    """Each echo interval is within its limit, but the mean is 97.9 ms."""

    violates = ("COM-05",)

    def echo_period_ns(self) -> int:
        """Just past the limit of the mean."""
        return ECHO_PERIOD_NS * 979 // 1000


class EchoMeanTooSlow(Commissioning, Fault):
    """Each echo interval is within its limit, but the mean is 102.1 ms."""

    violates = ("COM-05",)

    def echo_period_ns(self) -> int:
        """Just past the limit of the mean."""
        return ECHO_PERIOD_NS * 1021 // 1000


class FirstEchoLate(Commissioning, Fault):
    """The first echo comes 111 ms after reception."""

    violates = ("COM-05",)

    def first_echo_ns(self) -> int:
        """More than a period."""
        return 111 * MS


class EchoStops(Commissioning, Fault):
    """There are ten echoes, then silence."""

    violates = ("COM-05",)
    sent = 0

    def advance(self, now: int) -> Frames:
        """Count, and stop at ten."""
        frames = super().advance(now)[: 10 - self.sent]
        self.sent += len(frames)
        if self.sent == 10:
            self.echo_at = None
        return frames


class OtherEcho(Commissioning):
    """The echo differs from what was received."""

    @abstractmethod
    def told(self, received: bytes) -> bytes:
        """Bytes of the echo."""

    def echo_frame(self, parameters: Parameters) -> Frame:
        """3F8h with those bytes."""
        return Frame(ECHO_ID, self.told(parameters.encode()))


class EchoWithoutSyncTime(OtherEcho, Fault):
    """The sync time in the echo is always 0."""

    violates = ("COM-05", "COM-11")

    def told(self, received: bytes) -> bytes:
        """Byte 4 is dropped because nothing uses it."""
        return received[:4] + b"\0" + received[5:]


class EchoWithoutDebounce(OtherEcho, Fault):
    """The echo ends before the debounce time."""

    violates = ("COM-05", "ROB-02")

    def told(self, received: bytes) -> bytes:
        """Five bytes."""
        return received[:5]


class EchoSwapsHeartbeat(OtherEcho, Fault):
    """The two bytes of the heartbeat time are swapped in the echo."""

    violates = ("COM-05", "COM-09")

    def told(self, received: bytes) -> bytes:
        """Little-endian out, big-endian in."""
        return received[:2] + received[3:1:-1] + received[4:]


class EchoTellsMeaningOfCode(OtherEcho, Fault):
    """The echo shows code 2 for every bit-rate code that means the default."""

    violates = ("COM-05",)

    def told(self, received: bytes) -> bytes:
        """Normalised."""
        code = received[1] if received[1] in range(1, 7) else 2
        return received[:1] + bytes((code,)) + received[2:]


class HeartbeatsWhileEchoing(Commissioning, Fault):
    """Each echo is followed by a heartbeat."""

    violates = ("COM-12",)

    def advance(self, now: int) -> Frames:
        """In pairs."""
        beat = heartbeat_frame(1, NmtState.PRE_OPERATIONAL)
        return [frame for echo in super().advance(now) for frame in (echo, beat)]


class ReportsKeysWhileEchoing(Commissioning, Fault):
    """Keys are reported while the echo runs."""

    violates = ("COM-12",)

    def hold(self, mask: int, now: int) -> Frames:  # noqa: ARG002  the seam's arguments
        """A key frame of the new node id."""
        if self.echo is None:
            return NOTHING
        return (Frame(KEY_BASE + self.echo.data[0], bytes((mask & 0xFF,))),)


class BootsWithEcho(Commissioning, Fault):
    """Boot-up of the new node id is sent when the parameters are taken."""

    violates = ("COM-12",)

    def receive(self, frame: Frame, now: int) -> Frames:
        """Echo and boot-up."""
        waiting = self.echo is None
        frames = super().receive(frame, now)
        if waiting and self.echo is not None:
            return (*frames, heartbeat_frame(self.echo.data[0], NmtState.INITIALISING))
        return frames


class LedFrameLightsWhileEchoing(Keypad, Fault):
    """While the node echoes, a frame 200h+X lights its LEDs."""

    violates = ("COM-12",)
    shown = 0

    def receive(self, frame: Frame, now: int) -> Frames:
        """The map is shown, whoever it is for."""
        if isinstance(self._mode, Commissioning):
            steady = frame.can_id & 0x780 == STEADY_BASE and self._mode.echo is not None
            self.shown = frame.data[0] if steady and frame.data else self.shown
            self.listens_to = None
        return super().receive(frame, now)

    def lit(self, led: str, now: int) -> bool:
        """Also where it should be dark."""
        shown = self.shown >> self.profile.leds[led] & isinstance(self._mode, Commissioning)
        return bool(shown) or super().lit(led, now)


FAULTS: tuple[type[Fault], ...] = (
    EchoTooFast,
    EchoTooSlow,
    EchoMeanTooFast,
    EchoMeanTooSlow,
    FirstEchoLate,
    EchoStops,
    EchoWithoutSyncTime,
    EchoWithoutDebounce,
    EchoSwapsHeartbeat,
    EchoTellsMeaningOfCode,
    HeartbeatsWhileEchoing,
    ReportsKeysWhileEchoing,
    BootsWithEcho,
    LedFrameLightsWhileEchoing,
)
