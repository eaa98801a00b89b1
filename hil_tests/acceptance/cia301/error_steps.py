"""An error that any device can be given over the bus: a heartbeat or a poll that stays away."""

from __future__ import annotations

from dataclasses import dataclass

from hil_tests.acceptance.cia301.guarding_steps import poll
from hil_tests.acceptance.cia301.steps import (
    BEHAVIOUR,
    CONSUMER,
    GUARD_TIME,
    LIFE_FACTOR,
    LIFE_GUARD_CODE,
    expect_emcy,
    guarded,
)
from hil_tests.api import (
    MS,
    Cia301Bench,
    Frame,
    NotApplicable,
    Sdo,
    Seen,
    Sheet,
    cobs,
    u8,
    u32,
)

SPAN_MS = 100
SPAN_NS = SPAN_MS * MS


@dataclass(frozen=True, slots=True)
class Trouble:
    """A communication error 8130h, made and healed at will.

    Args:
        bench: the bench.
        other: node whose heartbeat is awaited; None = guarding polls are.
    """

    bench: Cia301Bench
    other: int | None

    def heal(self) -> Seen:
        """A heartbeat, or a poll: the error is gone, and its span begins anew."""
        if self.other is None:
            return poll(self.bench)
        return self.bench.send(Frame(cobs.ERROR_CONTROL + self.other, b"\x05"))

    def keep_away(self, span_ns: int) -> None:
        """Let time pass without the error."""
        until = self.bench.now() + span_ns
        while self.bench.now() < until:
            self.heal()
            self.bench.wait(SPAN_NS // 2)

    def arise(self) -> Seen:
        """Begin the span, and wait until the error is there; returns what began it."""
        began = self.heal()
        limits = self.bench.profile.limits
        self.bench.wait(SPAN_NS + limits.life_ns + limits.emcy_ns)
        return began

    @property
    def rule(self) -> str:
        """The requirement that says that there is this error."""
        return "C-NG-06" if self.other is None else "C-HBC-03"

    def told(self, began: Seen, requirement: str) -> Seen:
        """The EMCY that tells of it, since what began it."""
        limits = self.bench.profile.limits
        within = SPAN_NS + limits.life_ns + limits.emcy_ns
        return expect_emcy(
            self.bench, LIFE_GUARD_CODE, after=began, within=within, requirement=requirement
        )


def trouble(bench: Cia301Bench, sdo: Sdo, sheet: Sheet) -> Trouble:
    """A regular start; the device can be given an error that changes no state.

    Raises:
        NotApplicable: it has neither a heartbeat consumer nor life guarding.
    """
    bench.needs_exclusive()
    bench.start()
    behaviour = sheet.get(BEHAVIOUR, 1)
    if behaviour is not None and behaviour.writable:
        sdo.write(BEHAVIOUR, 1, u8(1), requirement="C-EM-22")
    consumer = sheet.get(CONSUMER, 1)
    if consumer is not None and consumer.writable:
        other = (bench.node_id + 20) % 127 + 1
        sdo.write(CONSUMER, 1, u32(other << 16 | SPAN_MS), requirement="C-HBC-01")
        return shown_once(Trouble(bench, other))
    if sheet.get(GUARD_TIME) is None or sheet.get(LIFE_FACTOR) is None:
        raise NotApplicable("the device has neither 1016h nor 100Ch: no error can be made")
    guarded(sdo, sheet, SPAN_MS, 1)
    return shown_once(Trouble(bench, None))


def shown_once(error: Trouble) -> Trouble:
    """Before anything else is asked of it, the error comes and goes."""
    error.told(error.arise(), error.rule)
    error.heal()
    limits = error.bench.profile.limits
    error.bench.wait(limits.emcy_ns + limits.life_ns)
    return error
