"""The SDO servers of a device as a communication service (CiA 301 4.2.0, 7.2.4 and 7.5.2.33).

The default server listens to 600h + node id and answers on 580h + node id; objects 1201h to
127Fh set up further ones. All are served in pre-operational and operational; in stopped they
are silent, and what stopped cut off is not taken up again.

How writes reach the other services: an observer in the object dictionary is told during
`receive` here. It returns no frames; what it causes becomes due in its own service at that
instant. So the device asks its other services for `advance` (or `deadline`) and for
`listens_to` after each `receive`, and sends what they return after the SDO's answer.
"""

from __future__ import annotations

from collections.abc import Container
from dataclasses import replace
from functools import partial

from node_model.cob_id import BIT_30, BIT_31, CAN_ID, check_cob_id, check_same_can_id
from node_model.frame import Frame
from node_model.nmt import NmtState
from node_model.node import NOTHING, Frames, earliest
from node_model.od import ObjectDictionary
from node_model.sdo.channel import Channel, Parts
from node_model.sdo.settings import SdoSettings

REQUESTS, ANSWERS = 0x600, 0x580
"""Identifiers of the default server less its node id (CiA 301 4.2.0, 7.3.5)."""
DEFAULT_SERVER = 0x1200
FURTHER = range(0x1201, 0x1280)
_EXTENDED = 1 << 29


LONGEST_FRAME_BITS = 138
"""A base frame of eight bytes with every stuff bit (135), and the intermission."""


class SdoServer:
    """All SDO servers of a device.

    Args:
        od: the dictionary that is served. Where it has 1200h, its COB-IDs are set.
        node_id: 1..127; may be changed before `start`.
        settings: the maker's choices.
        channel: class of a channel.
        parts: classes of the transfers.
    """

    alone = True
    set_up_by: Container[int] = FURTHER
    timed_by: Container[int] = FURTHER

    def __init__(
        self,
        od: ObjectDictionary,
        node_id: int,
        settings: SdoSettings | None = None,
        channel: type[Channel] = Channel,
        parts: Parts | None = None,
    ) -> None:
        self.od = od
        self.node_id = node_id
        self.settings = settings or SdoSettings()
        self.channel = channel
        self.parts = parts or Parts()
        self.serves = False
        self._channels: dict[int, Channel] = {}
        self._row: tuple[Channel, ...] = ()
        self._listens_to: frozenset[int] = frozenset()
        self._further = tuple(sorted(index for index in od.indices if index in FURTHER))
        for index in self._further:
            od.guard(index, partial(self._guard, index))
            od.observe(index, self._changed)

    # The verbs of a service.

    def listens_to(self) -> frozenset[int]:
        """The request identifiers of all servers that are set up."""
        return self._listens_to

    def start(self, now: int) -> Frames:  # noqa: ARG002  a verb of every service
        """Communication is initialised: default server and further ones as the objects say."""
        self._channels = {}
        self._set_default()
        self._set_up()
        self.serves = True
        return NOTHING

    def enter(self, state: NmtState, now: int) -> Frames:  # noqa: ARG002  a verb
        """Silent in stopped; a transfer under way ends without a word."""
        self.serves = state is not NmtState.STOPPED
        if not self.serves:
            self._forget()
        return NOTHING

    def receive(self, frame: Frame, now: int) -> Frames:
        """A request; returns the answer alone, not what it causes in other services."""
        channel = self._channels.get(frame.can_id)
        if channel is None or not self.serves:
            return NOTHING
        return channel.receive(frame, now)

    def advance(self, now: int) -> Frames:
        """Segments and time-outs that are due."""
        frames: list[Frame] = []
        for channel in self._row:
            frames += channel.advance(now)
        return frames

    def deadline(self) -> int | None:
        """The first deadline of all channels."""
        for channel in self._row:
            if channel.transfer is not None:
                return earliest(*(each.deadline() for each in self._row))
        return None

    def stop(self) -> None:
        """Supply or communication is gone."""
        self.serves = False
        self._forget()

    # How it is set up.

    def pace(self, bit_rate: int) -> None:
        """Uploaded blocks leave room on the wire for what the device sends beside them.

        Their segments keep the distance of the longest frame and a tenth more, from the next
        `start` on: so at most one of them waits in the controller before a heartbeat or PDO.

        Args:
            bit_rate: of the wire in bit/s.
        """
        gap_ns = LONGEST_FRAME_BITS * 1_100_000_000 // bit_rate
        if gap_ns != self.settings.segment_gap_ns:
            self.settings = replace(self.settings, segment_gap_ns=gap_ns)

    def _set_default(self) -> None:
        """1200h shows the identifiers that follow from the node id."""
        for sub, base in ((1, REQUESTS), (2, ANSWERS)):
            if self.od.has(DEFAULT_SERVER, sub):
                self.od.put_number(DEFAULT_SERVER, sub, base + self.node_id)

    def _set_up(self) -> None:
        """Make the channels that are valid now; one that stays as it was keeps its transfer."""
        wanted = {REQUESTS + self.node_id: ANSWERS + self.node_id}
        for index in self._further:
            request, answer = self.od.number(index, 1), self.od.number(index, 2)
            if not (request | answer) & (BIT_31 | _EXTENDED):
                wanted.setdefault(request & CAN_ID, answer & CAN_ID)
        old, self._channels = self._channels, {}
        for request, answer in wanted.items():
            known = old.get(request)
            if known is None or known.answer_id != answer:
                known = self.channel(self.od, request, answer, self.settings, self.parts)
            self._channels[request] = known
        self._row = tuple(self._channels.values())
        self._listens_to = frozenset(self._channels)

    def _changed(self, sub: int, now: int) -> None:  # noqa: ARG002  an observer
        self._set_up()

    def _guard(self, index: int, sub: int, data: bytes) -> None:
        """Refuse identifiers that are restricted, and changes of a valid one."""
        if sub not in {1, 2}:
            return
        old, new = self.od.number(index, sub), int.from_bytes(data, "little")
        if not old & BIT_31:
            check_same_can_id(old, new)
        if not new & BIT_31:
            check_cob_id(new, BIT_30)

    def _forget(self) -> None:
        for channel in self._row:
            channel.forget()
