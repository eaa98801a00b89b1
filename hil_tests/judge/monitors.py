"""The monitors that watch every test: one for each thing that must hold at all times.

Each gets the frames that concern it and every stimulus, keeps what looks wrong as a
suspicion, and gives its verdicts in `finish`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cache
from typing import Protocol

from hil_tests.clock import Interval, show_span
from hil_tests.judge.causal import Lateness, Seen
from hil_tests.judge.cobs import (
    ECHO,
    EMCY,
    ERROR_CONTROL,
    HARDWARE,
    KEYS,
    SDO_ANSWER,
    Nmt,
    State,
)
from hil_tests.judge.expected import Expected
from hil_tests.judge.settings import Role
from hil_tests.judge.suspicion import Silence, Suspicion, always_wrong, confirmed
from hil_tests.judge.timeline import States, StateTimeline, commissions
from hil_tests.judge.verdict import Outcome, Verdict


class Monitor(Protocol):
    """Something that must hold at all times."""

    def see(self, seen: Seen) -> None:
        """A frame of the device."""

    def restarted(self, when: Interval, by: Nmt | None) -> None:
        """The device was powered (None) or commanded to reset, and will boot."""

    def commanded(self, when: Interval) -> None:
        """An NMT command for the device that resets nothing."""

    def silenced(self, when: Interval) -> None:
        """The device lost its power, or the tester can no longer hear it."""

    def finish(self, until: int, quiet_from: int, lateness: Lateness) -> Iterator[Verdict]:
        """What is wrong.

        Args:
            until: everything up to this instant was seen.
            quiet_from: a frame asked for before this would have been seen by now.
            lateness: what is known of the host.
        """


_SPEAKING: States = frozenset((State.PRE_OPERATIONAL, State.OPERATIONAL))
_BEATING: States = _SPEAKING | {State.STOPPED}


@cache  # a watch begins several times in each scenario
def _rules(node_id: int | None, key_bytes: int) -> Mapping[int, tuple[range, States, str]]:
    """What may be sent under an identifier: lengths, states, and who forbids it elsewhere."""
    rules = {ECHO: (range(6, 9), frozenset((State.COMMISSIONING,)), "ROB-02")}
    if node_id is not None:
        rules |= {
            ERROR_CONTROL + node_id: (range(1, 2), _BEATING, "ROB-02"),
            EMCY + node_id: (range(8, 9), _SPEAKING, "ROB-02"),
            KEYS + node_id: (
                range(key_bytes, key_bytes + 1),
                frozenset((State.OPERATIONAL,)),
                "KEY-07",
            ),
            SDO_ANSWER + node_id: (range(8, 9), _SPEAKING, "ROB-02"),
        }
    return rules


class AllowedFrames:
    """Only the listed frames, with their lengths, in the states that allow them.

    ROB-02, and KEY-07, COM-01 and COM-12 where the state is what forbids the frame.
    """

    def __init__(self, expected: Expected, timeline: StateTimeline) -> None:
        node_id = expected.node_id
        self._timeline = timeline
        self._suspicions: list[Suspicion] = []
        self._requested = False
        self._identified = node_id is not None
        self._emcy_id = EMCY + (node_id or 0)
        self._emcy_until = -1
        self._emcy_ns = expected.emcy_ns
        self._rules = _rules(node_id, expected.key_bytes)

    def requested(self) -> None:
        """The tester sent 4F8h: an echo may follow."""
        self._requested = True

    def powered(self) -> None:
        """A new start, in whatever mode, needs a new 4F8h."""
        self._requested = False

    def admit(self, can_id: int, role: Role) -> None:
        """The identifiers of a keypad are fixed."""

    def see(self, seen: Seen) -> None:
        """Note what is wrong with a frame."""
        frame = seen.frame
        rule = self._rules.get(frame.can_id)
        possible = self._timeline.possible(seen.wanted)
        if frame.can_id != ECHO and commissions(possible):
            self._forbidden(seen, frozenset(), possible, "ROB-02")
            return
        if rule is None and not self._identified:
            return  # without a node id nobody can say whose frame it is
        if rule is None or frame.extended or frame.remote:
            requirement = self._silence_rule(seen) or "ROB-02"
            text = f"the device sent {frame}, which is none of its frames"
            self._suspect(requirement, text, seen)
            return
        lengths, states, requirement = rule
        if len(frame.data) not in lengths:
            text = f"the device sent {frame} with {len(frame.data)} bytes"
            self._suspect("ROB-02", f"{text}; {lengths[0]} are right", seen)
            return
        late = seen.wanted.earliest > self._emcy_until
        if frame.can_id == self._emcy_id and frame.data[1] != HARDWARE and late:
            # (the one after a start is NMT-02's business)
            text = f"the device sent {frame}: an EMCY with another code than 50xxh is not listed"
            self._suspect("ROB-02", text, seen)
        if frame.data == b"\x00" and states is _BEATING:
            self._emcy_until = seen.wanted.latest + self._emcy_ns
        if not possible & states:
            if frame.can_id == self._emcy_id and seen.wanted.earliest <= self._emcy_until:
                return  # the EMCY of this start, queued before a command stopped the node
            self._forbidden(seen, states, possible, requirement)
        elif frame.can_id == ECHO and not self._requested:
            self._suspect("COM-01", f"echo {frame} before any 4F8h was sent", seen)

    def _suspect(self, requirement: str, text: str, seen: Seen) -> None:
        self._suspicions.append(Suspicion(requirement, text, seen, always_wrong))

    def _forbidden(self, seen: Seen, states: States, possible: States, requirement: str) -> None:
        requirement = self._silence_rule(seen) or requirement
        now = " or ".join(sorted(str(state) for state in possible))
        text = f"the device sent {seen.frame} while it was {now}"
        self._suspicions.append(
            Suspicion(requirement, text, seen, lambda when: self._state_check(when, states))
        )

    def _silence_rule(self, seen: Seen) -> str:
        """What forbids every frame but the echo, where the device is being commissioned."""
        if State.COMMISSIONING not in self._timeline.possible(seen.wanted):
            return ""
        return "COM-12" if self._requested else "COM-01"

    def _state_check(self, when: Interval, states: States) -> Outcome:
        """FAIL where no possible state allows the frame at any instant of `when`."""
        return Outcome.INCONCLUSIVE if self._timeline.possible(when) & states else Outcome.FAIL

    def restarted(self, when: Interval, by: Nmt | None) -> None:
        """The timeline knows."""

    def commanded(self, when: Interval) -> None:
        """The timeline knows."""

    def silenced(self, when: Interval) -> None:
        """The timeline knows."""

    def finish(self, until: int, quiet_from: int, lateness: Lateness) -> Iterator[Verdict]:  # noqa: ARG002
        """See `Monitor`."""
        return confirmed(self._suspicions, lateness)


LATE_FACTOR = 2
"""A boot-up that has not come after so many times its limit is missing; before, it is late."""


class BootUp:
    """Boot-up comes once after each reset, in time, first of all, and never else."""

    def __init__(self, expected: Expected) -> None:
        self._expected = expected
        self._ids = expected.ids
        self._can_id = ERROR_CONTROL + (expected.node_id or 0)
        self._owed = 0
        self._excused = 0
        self._since = Interval(0, 0)
        self._grace_ns = 0
        self._commanded = False
        self._name = self._ids.boot_up
        self._suspicions: list[Suspicion] = []
        self._early: list[Suspicion] = []
        """Frames before the boot-up that is owed: where none comes, they are not the fault."""
        self._missing: list[Silence] = []

    def see(self, seen: Seen) -> None:
        """Note what is wrong with a frame."""
        frame = seen.frame
        if frame.can_id == self._can_id and frame.data == b"\x00":
            if self._owed:
                self._owed -= 1
                self._check_late(seen)
                self._keep_early()
            elif self._excused:
                self._excused -= 1
            else:
                self._suspect("boot-up without a reset", seen)
            self._since = Interval(-1, -1)
        elif self._owed and self._since.latest >= 0:
            if self._name == "COM-27":
                self._name = self._ids.boot_up  # a regular start it is, whatever it lacks
            bound = self._since.latest + self._grace_ns
            if seen.wanted.latest > bound:
                self._early.append(
                    Suspicion(
                        self._ids.reset_first if self._commanded else self._ids.boot_first,
                        f"{frame} came before the boot-up",
                        seen,
                        lambda when: Outcome.FAIL if when.earliest > bound else Outcome.PASS,
                    )
                )

    @property
    def owed(self) -> bool:
        """A boot-up is still to come."""
        return self._owed > 0

    def excuse(self) -> None:
        """The device got a frame that it may take for a reset: one boot-up may follow."""
        self._excused += 1

    def doubt(self) -> None:
        """Frames may have been lost: a boot-up that is owed may be among them, or may come."""
        self._excused += self._owed
        self._owed = 0

    def tolerate(self) -> None:
        """The device may boot, or may not: both are left to it."""
        self._owed = 1
        self._since = Interval(-1, -1)

    def _suspect(self, text: str, seen: Seen) -> None:
        self._suspicions.append(Suspicion(self._ids.boot_again, text, seen, always_wrong))

    @property
    def _late(self) -> str:
        """The requirement that it comes in time."""
        return self._ids.reset_late if self._commanded else self._ids.boot_late

    def _check_late(self, seen: Seen) -> None:
        """Note a boot-up that came, and too late."""
        limit = self._expected.boot_up_ns
        limit_at = self._since.latest + limit
        if self._since.latest < 0 or seen.wanted.latest <= limit_at:
            return
        text = f"the boot-up came later than {show_span(limit)} after the reset"
        self._suspicions.append(
            Suspicion(
                self._late,
                text,
                seen,
                lambda when: Outcome.FAIL if when.earliest > limit_at else Outcome.PASS,
            )
        )

    def _keep_early(self) -> None:
        """What came first came before a boot-up that was there, or may still come in time."""
        self._suspicions += self._early
        self._early.clear()

    def _overdue(self, until: int) -> None:
        """Note a boot-up that should have come by `until`; it may still come."""
        limit = self._expected.boot_up_ns
        limit_at = self._since.latest + limit
        if self._owed and self._since.latest >= 0 and until > limit_at:
            text = f"no boot-up within {show_span(limit)} after the reset"
            missing = until > self._since.latest + LATE_FACTOR * limit
            name = self._name if missing or self._name == "COM-27" else self._late
            verdict = Verdict(name, Outcome.FAIL, text, at=until)
            self._missing.append(Silence(verdict, limit_at, until))
            self._excused += self._owed
            self._owed = 0
            self._early.clear()

    def restarted(self, when: Interval, by: Nmt | None) -> None:
        """A new start."""
        self._overdue(when.earliest)
        self._keep_early()
        self._owed = 1 if by is None else self._owed + 1
        self._excused = 0 if by is None else self._excused
        self._commanded = by is not None
        self._name = self._ids.reset if self._commanded else self._ids.boot_up
        self._since = when
        self._grace_ns = 0 if by is None else self._expected.command_ns

    def keys_held(self) -> None:
        """Keys are held at this start: that it is a regular one is our own reading (COM-27)."""
        self._name = "COM-27"

    def commanded(self, when: Interval) -> None:
        """Nothing that concerns a boot-up."""

    def silenced(self, when: Interval) -> None:
        """Nothing is due any more."""
        self._overdue(when.earliest)
        self._owed = 0

    def finish(self, until: int, quiet_from: int, lateness: Lateness) -> Iterator[Verdict]:  # noqa: ARG002
        """See `Monitor`."""
        self._overdue(quiet_from)
        self._keep_early()
        yield from confirmed(self._missing, lateness)
        yield from confirmed(self._suspicions, lateness)
