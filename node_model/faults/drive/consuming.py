"""Drives that watch the heartbeats of others wrongly (EC-04, C-HBC)."""

from __future__ import annotations

from dataclasses import replace

from node_model.faults.parts import Fault
from node_model.frame import Frame
from node_model.heartbeat_consumer import HeartbeatConsumer, Watch
from node_model.node import Frames
from node_model.service import Fault as Error


class ConsumerDoesNotWait(Fault, HeartbeatConsumer):
    """A node is watched from the instant at which 1016h was written."""

    violates = ("EC-04", "C-HBC-02")

    def _written(self, sub: int, now: int) -> None:
        super()._written(sub, now)
        watch = self._watches.get(sub)
        if watch is not None and watch.active:
            watch.lapse_at = now + watch.time_ns
            self._plan()


class ConsumerBeginsWithBootUp(Fault, HeartbeatConsumer):
    """A boot-up begins the watching as a heartbeat does."""

    violates = ("C-HBC-02",)

    def begins(self, data: int) -> bool:
        return True


class ConsumerIsBlind(Fault, HeartbeatConsumer):
    """Heartbeats that do not come have no consequence."""

    violates = ("EC-04", "C-HBC-03")

    def receive(self, frame: Frame, now: int) -> Frames:
        return ()


class ConsumerTooPatient(Fault, HeartbeatConsumer):
    """The consumer time is half as long again as it should be."""

    violates = ("C-HBC-06", "EC-04")

    def _watch(self, sub: int) -> Watch:
        watch = super()._watch(sub)
        watch.time_ns = watch.time_ns * 3 // 2
        return watch


class ConsumerTooStrict(Fault, HeartbeatConsumer):
    """The consumer time is 10 % too short."""

    violates = ("C-HBC-06", "EC-04")

    def _watch(self, sub: int) -> Watch:
        watch = super()._watch(sub)
        watch.time_ns = watch.time_ns * 9 // 10
        return watch


class ConsumerReadsNodeIdElsewhere(Fault, HeartbeatConsumer):
    """The node id is looked for in the highest byte of an entry of 1016h."""

    violates = ("C-HBC-01", "C-HBC-03", "EC-04")

    def _watch(self, sub: int) -> Watch:
        watch = super()._watch(sub)
        watch.node_id = self._od.number(0x1016, sub) >> 24
        return watch


class ConsumerWatchesOneTwice(Fault, HeartbeatConsumer):
    """Two entries of 1016h can name the same node."""

    violates = ("C-HBC-04",)

    def is_watched(self, wanted: Watch) -> bool:
        return False


class ConsumerRefusesItsOwnNode(Fault, HeartbeatConsumer):
    """An entry of 1016h cannot be written again with the node that it has."""

    violates = ("C-HBC-05",)

    def is_watched(self, wanted: Watch) -> bool:
        own = self._watch(wanted.sub)
        return super().is_watched(wanted) or (own.active and own.node_id == wanted.node_id)


class ConsumerHasOneEntry(Fault, HeartbeatConsumer):
    """Only the first entry of 1016h is watched."""

    violates = ("C-HBC-09",)

    def _watch(self, sub: int) -> Watch:
        return super()._watch(sub) if sub == 1 else Watch(sub, 0)


class ConsumerGoesOnAfterZero(Fault, HeartbeatConsumer):
    """An entry of 1016h that was set to 0 is watched on."""

    violates = ("C-HBC-09",)

    def _written(self, sub: int, now: int) -> None:
        if self._watch(sub).active:
            super()._written(sub, now)


class ConsumerNeverForgives(Fault, HeartbeatConsumer):
    """After a heartbeat event heartbeats do not end the error."""

    violates = ("C-HBC-08",)

    def ends_event(self, data: int) -> bool:
        return False


class ConsumerTellsAnotherCode(Fault, HeartbeatConsumer):
    """A missing heartbeat is told with the code 8140h."""

    violates = ("EC-04", "C-HBC-03")

    def event(self, watch: Watch) -> Error:
        return replace(super().event(watch), code=0x8140)


class ConsumerSetsNoBit(Fault, HeartbeatConsumer):
    """A missing heartbeat does not set bit 4 of the error register."""

    violates = ("C-HBC-03", "C-EM-21", "EM-03")

    def event(self, watch: Watch) -> Error:
        return replace(super().event(watch), register=0)


class ConsumerHasNoReaction(Fault, HeartbeatConsumer):
    """A missing heartbeat does not cause the reaction of 1029h."""

    violates = ("EC-04", "C-HBC-03", "C-EM-22")

    def event(self, watch: Watch) -> Error:
        return replace(super().event(watch), communication=False)


class ConsumerTimeZeroIsASecond(Fault, HeartbeatConsumer):
    """An entry of 1016h with a node and the time 0 is watched for a second."""

    violates = ("C-HBC-01", "EC-04")

    def _watch(self, sub: int) -> Watch:
        value = self._od.number(0x1016, sub)
        return Watch(sub, value if value & 0xFFFF or not value else value | 1000)


FAULTS: tuple[type[Fault], ...] = (
    ConsumerDoesNotWait,
    ConsumerBeginsWithBootUp,
    ConsumerIsBlind,
    ConsumerTooPatient,
    ConsumerTooStrict,
    ConsumerReadsNodeIdElsewhere,
    ConsumerWatchesOneTwice,
    ConsumerRefusesItsOwnNode,
    ConsumerHasOneEntry,
    ConsumerGoesOnAfterZero,
    ConsumerNeverForgives,
    ConsumerTellsAnotherCode,
    ConsumerSetsNoBit,
    ConsumerHasNoReaction,
    ConsumerTimeZeroIsASecond,
)
