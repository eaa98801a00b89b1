"""A hand-made scene for the judge: frames and stimuli put down at stated instants."""

from __future__ import annotations

from collections.abc import Iterable

from hil_tests.clock import MS, S
from hil_tests.judge.causal import Lateness
from hil_tests.judge.cobs import nmt_frame
from hil_tests.judge.expected import Expected
from hil_tests.judge.timeline import ANY_STATE, States
from hil_tests.judge.verdict import Limits, Verdict
from hil_tests.judge.watch import Watch
from hil_tests.trace import BusEvent, EventKind, Moment, Sighting
from node_model.frame import Frame

NODE = 5
PERIOD = 100 * MS
BEAT = 0x700 + NODE


def device(
    *,
    node_id: int | None = NODE,
    heartbeat_ms: int | None = 100,
    bit_rate: int | None = 250_000,
    exclusive: bool = True,
    fade_ms: int = 0,
) -> Expected:
    """A node 5 with a heartbeat of 100 ms: each interval 95..105 ms, their mean 98..102 ms.

    Without a period there are no limits.
    """
    each = Limits(95 * MS, 105 * MS) if heartbeat_ms else Limits()
    return Expected(
        node_id=node_id,
        heartbeat_ns=None if heartbeat_ms is None else heartbeat_ms * MS,
        heartbeat_each=each,
        heartbeat_mean=Limits(98 * MS, 102 * MS) if heartbeat_ms else Limits(),
        heartbeat_first=Limits(at_most_ns=each.at_most_ns),
        bit_rate=bit_rate,
        command_ns=50 * MS,
        boot_up_ns=1 * S,
        emcy_ns=100 * MS,
        fade_ns=fade_ms * MS,
        exclusive=exclusive,
    )


class Scene:
    """A watch, and verbs that put something before it.

    Args:
        expected: the device.
        bit_ns: 0 = an untimed wire, where a frame was asked for at its stamp.
        states: possible at the start.
        rate: bit rate of the tester's end.
    """

    def __init__(
        self,
        expected: Expected | None = None,
        bit_ns: int = 0,
        states: States = ANY_STATE,
        rate: int | None = None,
    ) -> None:
        self.watch = Watch(expected or device(), bit_ns, states, rate)
        self.lateness = Lateness()
        self._index = 0

    def see(self, frame: Frame, at_ms: float, doubt_ms: float = 0, *, own: bool = False) -> None:
        """A frame ended at that instant."""
        sighting = Sighting(frame, round(at_ms * MS), round(doubt_ms * MS), own)
        self.watch.see(sighting, self._index)
        self._index += 1

    def beat(self, at_ms: float, state: int = 0x7F, doubt_ms: float = 0) -> None:
        """A heartbeat of the device."""
        self.see(Frame(BEAT, bytes((state,))), at_ms, doubt_ms)

    def beats(self, at_ms: Iterable[float], state: int = 0x7F) -> None:
        """Several heartbeats, the same frame object each time, as a model sends them."""
        frame = Frame(BEAT, bytes((state,)))
        for instant in at_ms:
            self.see(frame, instant)

    def boot(self, at_ms: float) -> None:
        """Boot-up of the device."""
        self.see(Frame(BEAT, b"\x00"), at_ms)

    def command(self, command: int, at_ms: float, to: int = NODE) -> None:
        """An NMT command of the tester's."""
        self.see(nmt_frame(command, to), at_ms, own=True)

    def power(self, at_ms: float, *, on: bool, mode: str = "regular") -> None:
        """The supply is switched."""
        detail: dict[str, object] = {"on": on, "mode": mode} if on else {"on": on}
        self.watch.did(Moment("power", round(at_ms * MS), round(at_ms * MS), detail))

    def rate(self, at_ms: float, bit_rate: int) -> None:
        """The tester's end changes its bit rate."""
        instant = round(at_ms * MS)
        self.watch.did(Moment("bitrate", instant, instant, {"bit_rate": bit_rate}))

    def event(self, at_ms: float, kind: EventKind = EventKind.GAP) -> None:
        """Something happened on the bus."""
        self.watch.happened(BusEvent(kind, round(at_ms * MS)))

    def started(self, at_ms: float = 0) -> Scene:
        """Power on and, 50 ms later, boot-up."""
        self.power(at_ms, on=True)
        self.boot(at_ms + 50)
        return self

    def verdicts(self, until_ms: float) -> list[Verdict]:
        """What the monitors found."""
        return list(self.watch.finish(round(until_ms * MS), self.lateness))

    def blamed(self, until_ms: float) -> list[str]:
        """The requirements that they blame."""
        return [verdict.requirement for verdict in self.verdicts(until_ms)]
