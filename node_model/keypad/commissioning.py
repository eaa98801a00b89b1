"""Commissioning of the keypad: wait for one 4F8h, store it, echo it as 3F8h for ever.

In this mode the bus runs at 125 kbit/s and nothing else is heard or said.
"""

from __future__ import annotations

from node_model.frame import Frame
from node_model.keypad.parameters import SIZE, Parameters
from node_model.node import MS, NOTHING, Frames, earliest
from node_model.storage import RecordStore

REQUEST_ID = 0x4F8
ECHO_ID = 0x3F8
BIT_RATE = 125_000
ECHO_PERIOD_NS = 100 * MS


class Commissioning:
    """From a power-up with the commissioning keys held until power is cut.

    Args:
        store: where the parameters go.
        now: the instant at which the node begins to wait.
    """

    bit_rate = BIT_RATE
    listens_to: frozenset[int] | None = frozenset((REQUEST_ID,))

    def __init__(self, store: RecordStore, now: int) -> None:
        self.store = store
        self.since = now
        self.echo: Frame | None = None
        self.echo_at: int | None = None

    def accepts(self, frame: Frame) -> bool:
        """Whether this is the one message that is waited for: base data, six bytes or more."""
        plain = not (frame.remote or frame.extended)
        return plain and frame.can_id == REQUEST_ID and len(frame.data) >= SIZE

    def receive(self, frame: Frame, now: int) -> Frames:
        """Take the first valid 4F8h; anything else, and a second one, changes nothing."""
        if self.echo is not None or not self.accepts(frame):
            return NOTHING
        parameters = self.decode(frame.data)
        if parameters is None:
            return NOTHING
        self.store.save(parameters.encode(), now)
        self.echo = self.echo_frame(parameters)
        self.echo_at = now + self.first_echo_ns()
        return self.advance(now)

    def decode(self, data: bytes) -> Parameters | None:
        """Parameters in the payload of a 4F8h; None = not to be taken."""
        return Parameters.decode(data)

    def echo_frame(self, parameters: Parameters) -> Frame:
        """3F8h with the parameters received."""
        return Frame(ECHO_ID, parameters.encode())

    def first_echo_ns(self) -> int:
        """From reception to the first echo; at most one period."""
        return 0

    def echo_period_ns(self) -> int:
        """From echo to echo."""
        return ECHO_PERIOD_NS

    def hold(self, mask: int, now: int) -> Frames:  # noqa: ARG002  the verb of both modes
        """Keys mean nothing here."""
        return NOTHING

    def advance(self, now: int) -> Frames:
        """Write to memory and echo, as far as time has come."""
        self.store.advance(now)
        frames = []
        while self.echo is not None and self.echo_at is not None and self.echo_at <= now:
            self.echo_at += self.echo_period_ns()
            frames.append(self.echo)
        return frames or NOTHING

    def deadline(self) -> int | None:
        """The next byte to store or echo to send."""
        return earliest(self.store.due_at, self.echo_at)
