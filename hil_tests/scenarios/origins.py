"""What a start rests on: so that a device which starts wrongly is blamed for the cause.

After a stay in commissioning it is the requirement on what is kept (COM-06, COM-07, COM-26,
COM-29; several of these are our own readings); with keys held, that it starts regularly at
all (COM-27); after garbage, that nothing was changed by it (ROB-01).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from hil_tests.api import Interval, Parameters, Verdict, cobs
from hil_tests.clock import FOREVER
from hil_tests.judge.echoes import Request
from hil_tests.judge.keys_time import Steps

_ORIGINS = {
    "changed": "COM-06",
    "retuned": "COM-07",
    "asked twice": "COM-21",
    "kept": "COM-29",
    "cut": "COM-26",
}

_TIMES = frozenset(("KEY-04", "KEY-05", "HB-01", "HB-05", "HB-06"))
"""Requirements that tell with which parameters a device works."""

_DEBOUNCED = frozenset(("KEY-04", "KEY-05"))
"""Requirements that a device breaks which debounces with another time than it was given."""

_SYNC_TIMES = 10
"""So many steps of the sync time are one of the debounce time."""

_NEAR = 4
"""Steps of the sync time that a scan and a key frame may hide."""


class Origin:
    """Follows what is done to the memory of a device between its starts."""

    def __init__(self) -> None:
        self._from = ""
        self._littered = False
        self._mixed: list[Interval] = []
        """Lives that began with one set of two: from that start to the next."""
        self._unborn: tuple[str, int] | None = None
        self._keyless = ""
        """What its start would rest on without the keys that are held."""
        self._sure = True
        """Nothing was done that a faulty device may have changed its memory for."""
        self._older: set[Parameters] = set()
        """Everything that was stored before what is now."""
        self._started_with: set[int] = set()
        """Bit-rate codes with which it has started at the right bit rate."""

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
        self._sure = self._from in {"changed", "retuned"}
        self._older |= {before} - set(after)

    def identified(self) -> None:
        """Power was cut while it stored; its node id has told which set it kept."""
        self._from = "cut"
        self._sure = False

    def littered(self) -> None:
        """It was sent a frame that must change nothing."""
        self._littered = True
        self._sure = False

    def starts(self, at: int, *, held: bool) -> str:
        """It is switched on: the requirement which says that it boots as it should."""
        usual = "ROB-01" if self._littered else "NMT-02"
        self._keyless = _ORIGINS.get(self._from, usual)
        requirement = "COM-27" if held else self._keyless
        self._mixed = [Interval(since, min(until, at)) for since, until in self._mixed]
        if self._from == "cut":
            self._mixed.append(Interval(at, FOREVER))
        self._unborn = (requirement, at)
        return requirement

    def started(self, own: Parameters) -> None:
        """It has booted as it should, with these parameters."""
        self._unborn, self._from, self._littered = None, "", False
        self._started_with.add(own.bit_rate_code)

    def blamed(self, requirement: str) -> None:
        """Somebody has looked why it did not start, and knows better."""
        assert self._unborn is not None, "it was switched on"
        self._unborn = (requirement, self._unborn[1])

    def keys_tell_nothing(self) -> None:
        """It does not start without the keys that were held either."""
        self.blamed(self._keyless)

    @property
    def blames(self) -> str:
        """The requirement that a start which fails now is blamed on."""
        assert self._unborn is not None, "it was switched on"
        return self._unborn[0]

    def elsewhere(self, own: Parameters, rate: int) -> None:
        """It starts, but at another bit rate than that of its code.

        That code then means another one (COM-07). Where it has started well with it before,
        may have kept an older rate, or was sent what must change nothing, nobody can tell.
        """
        kept = any(each.bit_rate == rate for each in self._older)
        if self._sure and not kept and own.bit_rate_code not in self._started_with:
            self.blamed("COM-07")

    def debounced(self, found: Sequence[Verdict], steps: Steps, own: Parameters) -> list[Verdict]:
        """Verdicts on keys of a device that keeps to another debounce time than its own.

        It takes the byte for another number (COM-10). Where it may have kept an older time, or
        the sync time, which must not count (COM-11), makes up the difference, nobody can tell.

        Args:
            found: everything that is wrong in a life.
            steps: the debounce times that explain its changes.
            own: what it was commissioned to.
        """
        kept = any(each.debounce in steps for each in self._older)
        if not self._sure or not steps or own.debounce in steps or kept or _by_sync(steps, own):
            return list(found)
        with_ = f"it works with debounce time {min(steps)}, not {own.debounce}"
        return [
            replace(each, requirement="COM-10", text=f"{each.text}; {with_}")
            if each.requirement in _DEBOUNCED
            else each
            for each in found
        ]

    def told(self, found: Sequence[Verdict]) -> list[Verdict]:
        """Verdicts on what follows from a wrong start, on the requirement behind that start.

        Times of another set than that of its node id are a mixture of both (COM-26), unless
        they are as wrong in lives that can be no mixture.
        """
        plain = {each.requirement for each in found if not self._in_mixture(each)}
        verdicts = [
            replace(each, requirement="COM-26") if each.requirement in _TIMES - plain else each
            for each in found
        ]
        if self._unborn is None:
            return verdicts
        requirement, since = self._unborn
        return [
            replace(each, requirement=requirement) if (each.at or 0) >= since else each
            for each in verdicts
        ]

    def _in_mixture(self, verdict: Verdict) -> bool:
        """Whether it is about a life in which the parameters can be a mixture."""
        at = verdict.at
        return at is not None and any(since <= at < until for since, until in self._mixed)


def _by_sync(steps: Steps, own: Parameters) -> bool:
    """Whether the sync time, added or taken away, would lead to about the same times."""
    apart = {abs(each * _SYNC_TIMES - own.debounce * _SYNC_TIMES) for each in steps}
    return bool(own.sync_time) and any(abs(by - own.sync_time) <= _NEAR for by in apart)
