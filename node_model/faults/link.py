"""What a bad cable, connector or transceiver does to a node: wrappers that keep its laws.

An effect says what becomes of each frame; a link applies it to every frame that a node
sends and hears, and keeps what travels. Effects count frames, they never throw dice.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from heapq import heappop, heappush

from node_model.frame import MAX_DATA_BYTES, Frame
from node_model.node import MS, NOTHING, Frames, Node, Panel, Withdrawing, earliest

Travel = Iterable[tuple[int, Frame]]
"""Frames and the instants at which each of them arrives."""


def base_of(frame: Frame) -> int:
    """COB-ID without the node id: the service of the predefined connection set."""
    return frame.can_id & 0x780


class Effect:
    """Changes nothing; its heirs change the frames that `picks` picks."""

    def picks(self, frame: Frame) -> bool:  # noqa: ARG002  heirs use it
        """Whether this frame is touched."""
        return True

    def outgoing(self, frame: Frame, now: int) -> Travel:
        """What becomes of a frame that the node wants to send at `now`."""
        return self.change(frame, now) if self.picks(frame) else ((now, frame),)

    def change(self, frame: Frame, now: int) -> Travel:
        """What becomes of a picked frame."""
        return ((now, frame),)

    def incoming(self, frame: Frame, now: int) -> Travel:
        """What becomes of a frame that ended on the wire at `now`."""
        return ((now, frame),)

    def line_rate(self, bit_rate: int) -> int:
        """Bit rate on the wire where the node wants `bit_rate`."""
        return bit_rate


class Drop(Effect):
    """Every nth frame is lost."""

    every = 7

    def __init__(self) -> None:
        self._count = 0

    def change(self, frame: Frame, now: int) -> Travel:
        """Count, and lose the last of each turn."""
        self._count = (self._count + 1) % self.every
        return ((now, frame),) if self._count else ()


class Delay(Effect):
    """Frames are sent late."""

    span_ns = 35 * MS

    def change(self, frame: Frame, now: int) -> Travel:
        """Not yet."""
        return ((now + self.span_ns, frame),)


class Slow(Effect):
    """Frames take effect late: the node is slow to read them."""

    span_ns = 60 * MS

    def incoming(self, frame: Frame, now: int) -> Travel:
        """Not yet."""
        return ((now + self.span_ns if self.picks(frame) else now, frame),)

    def outgoing(self, frame: Frame, now: int) -> Travel:
        """What it sends goes at once."""
        return ((now, frame),)


class Duplicate(Effect):
    """Every frame is sent twice."""

    def change(self, frame: Frame, now: int) -> Travel:
        """Once more."""
        return ((now, frame), (now, frame))


class Reorder(Effect):
    """Frames leave in pairs, the later one first."""

    def __init__(self) -> None:
        self._kept: Frame | None = None

    def change(self, frame: Frame, now: int) -> Travel:
        """Keep the first of a pair until the second has gone."""
        first, self._kept = self._kept, None
        if first is None:
            self._kept = frame
            return ()
        return ((now, frame), (now, first))


class Corrupt(Effect):
    """One bit of the first byte is inverted."""

    bit = 0x10

    def change(self, frame: Frame, now: int) -> Travel:
        """Invert it; a frame without data is spared."""
        data = frame.data
        if data:
            frame = replace(frame, data=bytes((data[0] ^ self.bit, *data[1:])))
        return ((now, frame),)


class WrongLength(Effect):
    """A zero byte too many; of eight bytes the last is cut off."""

    def change(self, frame: Frame, now: int) -> Travel:
        """Longer, or where that cannot be shorter; a remote frame is spared."""
        data = frame.data
        if not frame.remote:
            longer = data[:-1] if len(data) == MAX_DATA_BYTES else data + b"\0"
            frame = replace(frame, data=longer, dlc=-1)
        return ((now, frame),)


class AsRemote(Effect):
    """Sent as remote frames of the same length."""

    def change(self, frame: Frame, now: int) -> Travel:
        """The data is lost."""
        return ((now, replace(frame, data=b"", remote=True)),)


class AsExtended(Effect):
    """Sent with a 29-bit identifier of the same value."""

    def change(self, frame: Frame, now: int) -> Travel:
        """Same number, other format."""
        return ((now, replace(frame, extended=True)),)


class WrongRate(Effect):
    """The oscillator is of the wrong kind: the wire runs at twice the bit rate."""

    def line_rate(self, bit_rate: int) -> int:
        """Twice what was meant."""
        return 2 * bit_rate


class Link:
    """A node behind an effect.

    Args:
        node: any node; only this link may talk to it from now on.
        effect: what becomes of its frames; one of its own for each link.
    """

    def __init__(self, node: Node, effect: Effect) -> None:
        self.node = node
        self.effect = effect
        self.bit_rate = 0
        self.listens_to: frozenset[int] | None = frozenset()
        self._count = 0
        self._heard: list[tuple[int, int, Frame]] = []
        self._said: list[tuple[int, int, Frame]] = []
        self._tune()

    def _tune(self) -> None:
        self.bit_rate = self.effect.line_rate(self.node.bit_rate)
        self.listens_to = self.node.listens_to

    def _keep(self, queue: list[tuple[int, int, Frame]], at: int, frame: Frame) -> None:
        """Frames of one instant keep their order."""
        self._count += 1
        heappush(queue, (at, self._count, frame))

    def _say(self, frames: Frames, now: int) -> Frames:
        """What of these goes at once; the rest is kept until its time comes."""
        self._tune()
        ready = []
        for frame in frames:
            for at, changed in self.effect.outgoing(frame, now):
                if at <= now:
                    ready.append(changed)
                else:
                    self._keep(self._said, at, changed)
        return ready

    def power_on(self, now: int) -> Frames:
        """Supply is applied."""
        return self._say(self.node.power_on(now), now)

    def power_off(self, now: int) -> Frames:
        """Supply is cut; what was on its way is gone."""
        self.node.power_off(now)
        self._heard.clear()
        self._said.clear()
        self._tune()
        return NOTHING

    def receive(self, frame: Frame, now: int) -> Frames:
        """A frame from the bus, now or when its time has come."""
        frames: Frames = ()
        for at, changed in self.effect.incoming(frame, now):
            if at <= now:
                frames = (*frames, *self._say(self.node.receive(changed, now), now))
            else:
                self._keep(self._heard, at, changed)
        return frames

    def advance(self, now: int) -> Frames:
        """Everything that is due, oldest first."""
        frames: Frames = ()
        while (due := self.deadline()) is not None and due <= now:
            frames = (*frames, *self._step(due))
        return frames

    def _step(self, now: int) -> Frames:
        """What is due at this very instant: heard, done, said."""
        frames = list(self._say(self.node.advance(now), now))
        while self._heard and self._heard[0][0] <= now:
            frames += self._say(self.node.receive(heappop(self._heard)[2], now), now)
        while self._said and self._said[0][0] <= now:
            frames.append(heappop(self._said)[2])
        return frames

    def deadline(self) -> int | None:
        """The node's own, or the first arrival."""
        return earliest(
            self.node.deadline(),
            self._heard[0][0] if self._heard else None,
            self._said[0][0] if self._said else None,
        )


class PanelLink(Link):
    """A panel behind an effect; hands and eyes reach it directly."""

    def __init__(self, panel: Panel, effect: Effect) -> None:
        self.panel = panel
        super().__init__(panel, effect)
        self.name = panel.name
        self.keys = panel.keys
        self.leds = panel.leds
        self.faults = panel.faults

    def _tune(self) -> None:
        super()._tune()
        self.powered = self.panel.powered

    def hold(self, held: frozenset[str], now: int) -> Frames:
        """Exactly these keys are held."""
        return self._say(self.panel.hold(held, now), now)

    def fail(self, active: frozenset[str], now: int) -> Frames:
        """Exactly these errors exist."""
        return self._say(self.panel.fail(active, now), now)

    def lit(self, led: str, now: int) -> bool:
        """Whether that LED shines."""
        return self.panel.lit(led, now)

    def lamp_change(self, now: int) -> int | None:
        """The panel's own, or the arrival of a frame that may change a lamp."""
        return earliest(self.panel.lamp_change(now), *(at for at, _, _ in self._heard[:1]))

    def image(self) -> bytes:
        """Content of the panel's memory."""
        return self.panel.image()


class DeviceLink(PanelLink):
    """A device behind an effect that takes back frames as the device would."""

    def withdraws(self, frame: Frame, asked_at: int, now: int) -> bool:
        """Whether it takes this frame back."""
        device = self.panel
        return isinstance(device, Withdrawing) and device.withdraws(frame, asked_at, now)
