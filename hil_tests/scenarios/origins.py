"""What a start rests on: so that a device which starts wrongly is blamed for the cause.

After a stay in commissioning it is the requirement on what is kept (COM-06, COM-07, COM-26,
COM-29; several of these are our own readings); with keys held, that it starts regularly at
all (COM-27); after garbage, that nothing was changed by it (ROB-01).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from hil_tests.api import Parameters, Verdict, cobs
from hil_tests.judge.echoes import Request

_ORIGINS = {
    "changed": "COM-06",
    "retuned": "COM-07",
    "asked twice": "COM-21",
    "kept": "COM-29",
    "cut": "COM-26",
}

_TIMES = frozenset(("KEY-04", "KEY-05", "HB-01", "HB-05", "HB-06"))
"""Requirements that tell with which parameters a device works."""


class Origin:
    """Follows what is done to the memory of a device between its starts."""

    def __init__(self) -> None:
        self._from = ""
        self._littered = False
        self._mixed = False
        self._unborn: tuple[str, int] | None = None

    def stayed(
        self, before: Parameters, after: Sequence[Parameters], requests: Sequence[Request]
    ) -> None:
        """It was in commissioning, had one set of parameters, and can have these now."""
        if sum(each.frame.can_id == cobs.COMMISSION for each in requests) > 1:
            self._from = "asked twice"
        elif any(each.bit_rate_code != before.bit_rate_code for each in after):
            self._from = "retuned"
        elif tuple(after) != (before,):
            self._from = "changed"
        else:
            self._from = self._from or "kept"

    def identified(self) -> None:
        """Power was cut while it stored; its node id has told which set it kept."""
        self._from = "cut"

    def littered(self) -> None:
        """It was sent a frame that must change nothing."""
        self._littered = True

    def starts(self, at: int, *, held: bool) -> str:
        """It is switched on: the requirement which says that it boots as it should."""
        usual = "ROB-01" if self._littered else "NMT-02"
        requirement = "COM-27" if held else _ORIGINS.get(self._from, usual)
        self._mixed = self._from == "cut"
        self._unborn = (requirement, at)
        return requirement

    def started(self) -> None:
        """It has booted as it should."""
        self._unborn, self._from, self._littered = None, "", False

    def told(self, found: Sequence[Verdict]) -> list[Verdict]:
        """Verdicts on what follows from a wrong start, on the requirement behind that start.

        Times of another set than that of its node id are a mixture of both (COM-26).
        """
        times = _TIMES if self._mixed else frozenset()
        verdicts = [
            replace(each, requirement="COM-26") if each.requirement in times else each
            for each in found
        ]
        if self._unborn is None:
            return verdicts
        requirement, since = self._unborn
        return [
            replace(each, requirement=requirement) if (each.at or 0) >= since else each
            for each in verdicts
        ]
