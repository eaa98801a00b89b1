"""What a communication error does to the NMT state, as 1029h:01 says (CiA 301 4.2.0, 7.5.2.32).

The bus tells of such an error by its emergency message, and what the tester has written by
the answer. Where nobody can know the setting, or an emergency message may have been held
back, every state that the object can lead to is possible.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

from hil_tests.clock import FOREVER, US, Interval
from hil_tests.judge.causal import Seen
from hil_tests.judge.cobs import State
from hil_tests.judge.settings import BehaviourSet, EmergenciesHeld
from hil_tests.judge.timeline import States

ERRORS = frozenset((0x8130, 0x8140))
"""Life guarding or heartbeat event; recovered from bus-off (CiA 301 4.2.0, 7.2.7.1)."""

INHIBIT_NS = 0xFFFF * 100 * US
"""The longest inhibit time 1015h: so long an emergency message can wait after another one."""

Leads = Mapping[State, States]
"""From a state to those that an error can lead to; a state that is not named stays."""

_OPERATIONAL, _PRE, _STOPPED = State.OPERATIONAL, State.PRE_OPERATIONAL, State.STOPPED
_LEADS: Mapping[int, Leads] = MappingProxyType(
    {
        0: {_OPERATIONAL: frozenset((_PRE,))},
        1: {},
        2: {_OPERATIONAL: frozenset((_STOPPED,)), _PRE: frozenset((_STOPPED,))},
    }
)
_ANYWHERE: Leads = MappingProxyType(
    {
        _OPERATIONAL: frozenset((_OPERATIONAL, _PRE, _STOPPED)),
        _PRE: frozenset((_PRE, _STOPPED)),
    }
)
"""The setting is not known, or the maker's own."""


class Reacted(NamedTuple):
    """A communication error, and what it can have done.

    Args:
        when: it happened at some instant of this.
        leads: where from each state.
        prompt: no inhibit time can have kept the message back.
    """

    when: Interval
    leads: Leads
    prompt: bool


class Reaction:
    """The setting of 1029h:01, and the errors that were told."""

    def __init__(self) -> None:
        self._leads = _ANYWHERE
        self._held = False
        self._told_at = -FOREVER

    def set(self, setting: BehaviourSet | EmergenciesHeld) -> None:
        """The tester has written 1029h:01, or something that keeps emergency messages back."""
        if isinstance(setting, BehaviourSet):
            value = setting.value
            self._leads = _ANYWHERE if value is None else _LEADS.get(value, _ANYWHERE)
        else:
            self._held = True

    @property
    def unseen(self) -> States:
        """States that an error can have led to of which no message tells."""
        if not self._held:
            return frozenset()
        return frozenset().union(*self._leads.values())

    def told(self, emcy: Seen, early_ns: int) -> Reacted | None:
        """An emergency message; the error, where it is one of communication.

        Args:
            emcy: the message.
            early_ns: so much earlier the state may have changed.
        """
        before, self._told_at = self._told_at, emcy.wanted.latest
        if int.from_bytes(emcy.frame.data[:2], "little") not in ERRORS:
            return None
        since = emcy.wanted.earliest - early_ns
        prompt = before <= since - INHIBIT_NS
        when = Interval(since if prompt else min(since, before), emcy.wanted.latest)
        return Reacted(when, self._leads, prompt)
