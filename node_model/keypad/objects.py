"""The keypad's object dictionary and its SDO server, made when somebody first asks for them.

Served in pre-operational and operational; commissioning knows no SDO. What clients write is
lost with a reset: the commissioned parameters alone survive (keypad specification). Nothing
here is ever due by itself.
"""

from __future__ import annotations

from typing import Protocol

from node_model.debounce import Debouncer
from node_model.emcy import ERROR_REGISTER, GENERIC_ERROR
from node_model.frame import Frame
from node_model.heartbeat import PRODUCER_TIME, HeartbeatProducer
from node_model.keypad.lamps import Lamps
from node_model.keypad.parameters import Parameters
from node_model.keypad.profile import Profile
from node_model.nmt import NmtState
from node_model.node import MS, Frames
from node_model.od import ObjectDictionary
from node_model.sdo import SdoServer, SdoSettings
from node_model.sheets import entries_of, shipped

KEYS, STEADY, BLINKING = 0x6000, 0x6200, 0x2200
"""Objects with a byte for eight keys or LEDs in sub-index 1."""

_BYTE = 0xFF
_WITHOUT_BLOCKS = SdoSettings(has_blocks=False)


class Owner(Protocol):
    """The part of a keypad whose state the objects show."""

    profile: Profile
    parameters: Parameters
    state: NmtState
    keys: Debouncer
    lamps: Lamps
    beat: HeartbeatProducer


class Objects:
    """What a client sees of a keypad.

    Args:
        owner: the keypad in operation.
        now: when somebody first asked.
    """

    def __init__(self, owner: Owner, now: int) -> None:
        node_id = owner.parameters.node_id
        self._owner = owner
        sheet = owner.profile.eds or shipped("keypad.eds")
        self.od = ObjectDictionary(entries_of(sheet, node_id))
        self._put(PRODUCER_TIME, 0, owner.parameters.heartbeat_ms)
        self._put(ERROR_REGISTER, 0, GENERIC_ERROR)
        self.od.observe(PRODUCER_TIME, self._new_period)
        self.od.observe(STEADY, self._new_light)
        self.od.observe(BLINKING, self._new_light)
        self._server = SdoServer(self.od, node_id, _WITHOUT_BLOCKS)
        self._server.start(now)
        self.enter(owner.state, now)

    def enter(self, state: NmtState, now: int) -> None:
        """The NMT state has changed: stopped ends a transfer, and is silent."""
        self._server.enter(state, now)

    def serve(self, frame: Frame, now: int) -> Frames:
        """A data frame with the identifier of requests; its answer."""
        self._show()
        return self._server.receive(frame, now)

    def _show(self) -> None:
        """The objects are as keys and LEDs are now."""
        lamps = self._owner.lamps
        self._put(KEYS, 1, self._owner.keys.settled & _BYTE)
        self._put(STEADY, 1, lamps.steady & _BYTE)
        self._put(BLINKING, 1, lamps.blinking & _BYTE)

    def _put(self, index: int, sub: int, value: int) -> None:
        """What the keypad knows better than its EDS file, where that lists it."""
        if self.od.has(index, sub):
            self.od.put_number(index, sub, value)

    def _new_period(self, sub: int, now: int) -> None:  # noqa: ARG002  a VAR
        """1017h acts at once (CiA 301 4.2.0, 7.2.8.2.2.1)."""
        beat = self._owner.beat
        beat.period_ns = self.od.number(PRODUCER_TIME) * MS
        beat.start(now)

    def _new_light(self, sub: int, now: int) -> None:  # noqa: ARG002  told of both maps
        """A client has written a map of LEDs."""
        lamps = self._owner.lamps
        steady = self.od.number(STEADY, 1, lamps.steady & _BYTE)
        blinking = self.od.number(BLINKING, 1, lamps.blinking & _BYTE)
        lamps.steady = lamps.steady & ~_BYTE | steady
        lamps.blinking = lamps.blinking & ~_BYTE | blinking
