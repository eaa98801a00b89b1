"""The monitor of a CiA 301 device's frames: only those that its state allows, well formed.

(CiA 301 4.2.0, 7.3.2.2: which services exist in which NMT state; 7.3.3: the identifiers of
the pre-defined connection set.)
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from hil_tests.clock import Interval
from hil_tests.judge.causal import Lateness, Seen
from hil_tests.judge.cobs import (
    EMCY,
    ERROR_CONTROL,
    LSS_ANSWER,
    SDO_ANSWER,
    SYNC,
    TIME,
    TPDOS,
    Nmt,
    State,
)
from hil_tests.judge.expected import Expected
from hil_tests.judge.settings import Role
from hil_tests.judge.suspicion import Suspicion, always_wrong, confirmed
from hil_tests.judge.timeline import States, StateTimeline
from hil_tests.judge.verdict import Outcome, Verdict

STRANGE = "C-RB-01"
ILL_FORMED = "C-RB-02"

_OPERATIONAL: States = frozenset((State.OPERATIONAL,))
_SPEAKING: States = _OPERATIONAL | {State.PRE_OPERATIONAL}
_RUNNING: States = _SPEAKING | {State.STOPPED}


class Rule(NamedTuple):
    """What may be sent under an identifier.

    Args:
        lengths: in bytes.
        states: in which it may be sent.
        requirement: that forbids it elsewhere.
    """

    lengths: range
    states: States
    requirement: str


_RULES = {
    Role.PDO: Rule(range(9), _OPERATIONAL, "C-TP-01"),
    Role.EMCY: Rule(range(8, 9), _SPEAKING, "C-EM-17"),
    Role.SYNC: Rule(range(2), _SPEAKING, "C-NMT-16"),
    Role.TIME: Rule(range(6, 7), _SPEAKING, "C-NMT-16"),
    Role.SDO: Rule(range(8, 9), _SPEAKING, "C-NMT-16"),
}
_ERROR_CONTROL = Rule(range(1, 2), _RUNNING, STRANGE)
_LSS = Rule(range(8, 9), _RUNNING | {State.STARTING}, STRANGE)


def identifiers(node_id: int) -> dict[int, Rule]:
    """The identifiers under which a device with that node id may speak, as it starts."""
    rules = {
        SYNC: _RULES[Role.SYNC],
        TIME: _RULES[Role.TIME],
        EMCY + node_id: _RULES[Role.EMCY],
        SDO_ANSWER + node_id: _RULES[Role.SDO],
        ERROR_CONTROL + node_id: _ERROR_CONTROL,
        LSS_ANSWER: _LSS,
    }
    return rules | {base + node_id: _RULES[Role.PDO] for base in TPDOS}


class DeviceFrames:
    """Only the frames of the pre-defined connection set, and those that were configured."""

    def __init__(self, expected: Expected, timeline: StateTimeline) -> None:
        self._timeline = timeline
        self._identified = expected.node_id is not None
        self._rules = identifiers(expected.node_id) if expected.node_id is not None else {}
        self._suspicions: list[Suspicion] = []

    def admit(self, can_id: int, role: Role) -> None:
        """The device was given another identifier to send under."""
        self._rules[can_id] = _RULES[role]

    def see(self, seen: Seen) -> None:
        """Note what is wrong with a frame."""
        if not self._identified:
            return  # without a node id nobody can say whose frame it is
        frame = seen.frame
        if frame.extended or frame.remote:
            kind = "remote frame" if frame.remote else "frame with a 29-bit identifier"
            self._suspect(ILL_FORMED, f"the device sent {frame}, a {kind}", seen)
            return
        rule = self._rules.get(frame.can_id)
        if rule is None:
            self._suspect(STRANGE, f"the device sent {frame}, which is none of its frames", seen)
            return
        if len(frame.data) not in rule.lengths:
            text = f"the device sent {frame} with {len(frame.data)} bytes"
            self._suspect(ILL_FORMED, f"{text}; {rule.lengths[-1]} are right", seen)
            return
        possible = self._timeline.possible(seen.wanted)
        if not possible & rule.states:
            self._forbidden(seen, rule, possible)

    def _suspect(self, requirement: str, text: str, seen: Seen) -> None:
        self._suspicions.append(Suspicion(requirement, text, seen, always_wrong))

    def _forbidden(self, seen: Seen, rule: Rule, possible: States) -> None:
        now = " or ".join(sorted(str(state) for state in possible))
        text = f"the device sent {seen.frame} while it was {now}"

        def check(when: Interval) -> Outcome:
            allowed = self._timeline.possible(when) & rule.states
            return Outcome.INCONCLUSIVE if allowed else Outcome.FAIL

        self._suspicions.append(Suspicion(rule.requirement, text, seen, check))

    def requested(self) -> None:
        """Nobody commissions such a device."""

    def powered(self) -> None:
        """The timeline knows."""

    def restarted(self, when: Interval, by: Nmt | None) -> None:
        """The timeline knows."""

    def commanded(self, when: Interval) -> None:
        """The timeline knows."""

    def silenced(self, when: Interval) -> None:
        """The timeline knows."""

    def finish(self, until: int, quiet_from: int, lateness: Lateness) -> Iterator[Verdict]:  # noqa: ARG002
        """See `Monitor`."""
        return confirmed(self._suspicions, lateness)
