"""In which states can the device be? A pure function of the stimuli and the boot-ups seen.

A command acts at some instant between the end of its frame and the limit "command to
effect"; until then the old and the new state are both possible.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Mapping

from hil_tests.clock import FOREVER, Interval
from hil_tests.judge.cobs import LEADS_TO, Nmt, State

States = frozenset[State]
ANY_STATE: States = frozenset(State)
_COMMISSIONING, _PRE_OPERATIONAL = State.COMMISSIONING, State.PRE_OPERATIONAL
_BOOTING: States = frozenset((State.STARTING, State.PRE_OPERATIONAL))


def commissions(possible: States) -> bool:
    """Whether a device of these possible states was powered up to be commissioned."""
    return _COMMISSIONING in possible and _PRE_OPERATIONAL not in possible


class StateTimeline:
    """Possible states over time, as steps.

    Args:
        command_ns: limit "command to effect".
        states: what is possible before the first stimulus.
    """

    def __init__(self, command_ns: int, states: States = ANY_STATE) -> None:
        self._command_ns = command_ns
        self._from: list[int] = [-FOREVER]
        self._states: list[States] = [states]
        self._asked: Interval | None = None
        self._answer = states
        """What was possible in the interval that was asked for last: several look at a frame."""

    def _cut(self, instant: int) -> States:
        """Forget the steps planned for later than `instant`; what is possible at it."""
        self._asked = None
        while self._from[-1] > instant:
            self._from.pop()
            self._states.pop()
        return self._states[-1]

    def _step(self, instant: int, states: States) -> None:
        if states == self._states[-1]:
            return
        self._asked = None
        if self._from[-1] >= instant:
            self._states[-1] = states
        else:
            self._from.append(instant)
            self._states.append(states)

    def command(self, when: Interval, command: Nmt, *, certain: bool = True) -> None:
        """An NMT command for the device ended on the wire in `when`.

        Args:
            when: its end.
            command: what was commanded.
            certain: False = the device may obey this frame or ignore it.
        """
        target = LEADS_TO[command]
        pending = self._states[-1]
        before = self._cut(when.earliest) | pending
        if not before - {State.OFF, State.COMMISSIONING}:
            return
        reached = _BOOTING if target is State.STARTING else frozenset((target,))
        self._step(when.earliest, before | reached)
        if not certain or before & {State.STARTING, State.OFF, State.COMMISSIONING}:
            # In the latter case it may be too early for the device to hear it.
            return
        self._step(when.latest + self._command_ns, reached)

    def power_off(self, when: Interval) -> None:
        """Supply was cut in `when`."""
        before = self._cut(when.earliest)
        self._step(when.earliest, before | {State.OFF})
        self._step(when.latest, frozenset((State.OFF,)))

    def power_on(self, when: Interval, commissioning: bool | None) -> None:
        """Supply came in `when`; `commissioning` None = either mode is possible."""
        self._cut(when.earliest)
        waiting: States = frozenset((State.STARTING, State.COMMISSIONING))
        modes = {True: waiting, False: _BOOTING, None: waiting | _BOOTING}
        self._step(when.earliest, modes[commissioning] | {State.OFF})
        self._step(when.latest, modes[commissioning])

    def booted(self, when: Interval) -> None:
        """A boot-up was asked for in `when`: initialisation is over."""
        now = self._cut(when.latest)
        settled = now - {State.STARTING, State.OFF, State.COMMISSIONING}
        self._step(when.latest, settled | {State.PRE_OPERATIONAL})

    def reacted(self, when: Interval, leads: Mapping[State, States]) -> States:
        """By itself the device may have changed its state at some instant of `when`.

        Args:
            when: not before the last thing that was known to act.
            leads: from a state to those that it may have gone to.

        Returns:
            What was possible before.
        """
        pending = self._states[-1]
        since = max(when.earliest, min(self._from[-1], when.latest))
        before = self._cut(since) | pending
        self._step(since, before.union(*(leads.get(state, ()) for state in before)))
        return before

    def possible(self, when: Interval) -> States:
        """Every state in which the device can have been at some instant of `when`."""
        if when is self._asked:
            return self._answer
        self._asked = when
        earliest, latest = when
        if self._from[-1] <= earliest <= latest:
            self._answer = self._states[-1]
        else:
            first = max(bisect_right(self._from, earliest) - 1, 0)
            last = bisect_right(self._from, latest)
            self._answer = frozenset().union(*self._states[first:last])
        return self._answer

    def commissions(self, when: Interval) -> bool:
        """Whether it was powered up to be commissioned, and is there or on the way there."""
        return commissions(self.possible(when))

    def sure(self, when: Interval) -> State | None:
        """The one state that it must have been in all through `when`; None = not known."""
        states = self.possible(when)
        return next(iter(states)) if len(states) == 1 else None
