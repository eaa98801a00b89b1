"""What must be said: the state on entry into operational, and every change in time."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

from hil_tests.clock import show_span
from hil_tests.judge.keys_facts import Report
from hil_tests.judge.keys_levels import Change, KeyLevels
from hil_tests.judge.keys_reading import Reading, fail
from hil_tests.judge.verdict import Limits, Verdict


class Changes:
    """Looks for the frames that a reading asks for."""

    def __init__(self, reading: Reading) -> None:
        self._reading = reading
        self._rules = reading.rules
        self._reports = reading.reports

    def verdicts(self) -> Iterator[Verdict]:
        """Frames that are missing or late."""
        yield from self._entries()
        yield from self._unshown()

    def _entries(self) -> Iterator[Verdict]:
        """Windows without their first frame."""
        for opens, closes in self._reading.windows:
            bound = opens.latest + self._rules.command_ns
            if bound > min(closes.earliest, self._reading.until):
                continue
            later = [r for r in self._reports if r.wanted.latest >= opens.earliest]
            if later and later[0].wanted.earliest <= bound:
                continue
            limits = Limits(at_most_ns=self._rules.command_ns)
            in_time = later and later[0].wanted.earliest <= closes.latest
            timed = (opens, later[0].wanted) if in_time else None
            how = "late" if timed else "missing"
            text = f"the key frame on entering operational is {how}"
            yield fail("KEY-01", text, bound, timed, limits)

    def _unshown(self) -> Iterator[Verdict]:
        """Changes that were not shown, or too late."""
        silent = self._releases_are_silent()
        for name, key in self._reading.keys.items():
            for change in key.changes:
                if not change.level and not self._rules.releases_reported:
                    continue
                judged_by = min(change.closes_at, self._reading.until)
                if self._bound(change) <= judged_by and self._is_lost(key, change):
                    yield self._lost(name, key, change, silent=silent)

    def _releases_are_silent(self) -> bool:
        """Whether no frame, but for those on entry, has shown nothing but keys let go."""
        return not any(
            before.mask & ~report.mask
            and not report.mask & ~before.mask
            and not self._entered_between(before, report)
            for before, report in pairwise(self._reports)
        )

    def _entered_between(self, before: Report, report: Report) -> bool:
        """Whether the later frame may be one on entry."""
        return any(
            before.wanted.earliest <= opens.latest and opens.earliest <= report.wanted.latest
            for opens, _ in self._reading.windows
        )

    def _bound(self, change: Change) -> int:
        return change.must_be_at + self._rules.key_frame_ns

    def _shows(self, change: Change, bound: int) -> Report | None:
        """The first frame that shows a change, perhaps too early, asked for by `bound`."""
        earliest = min(change.can_be_at, change.began.earliest)
        return next(
            (
                report
                for report in self._reports
                if report.wanted.latest >= earliest
                and report.wanted.earliest <= bound
                and report.mask >> change.bit & 1 == change.level
            ),
            None,
        )

    def _is_lost(self, key: KeyLevels, change: Change) -> bool:
        """Whether no frame shows a sure change, or the last one by then shows another state."""
        bound = self._bound(change)
        if change.sure and self._shows(change, bound) is None:
            return True
        if key.steady_until(change) <= bound:
            return False
        last = self._last_by(bound)
        return not any(report.mask >> change.bit & 1 == change.level for report in last)

    def _last_by(self, instant: int) -> Iterator[Report]:
        """The frames which can have been the last that was asked for by an instant."""
        for report in reversed(self._reports):
            if report.wanted.earliest <= instant:
                yield report
                if report.wanted.latest <= instant:
                    return

    def _lost(self, name: str, key: KeyLevels, change: Change, *, silent: bool) -> Verdict:
        """A change that was not shown in time."""
        what = f"{name} {'pressed' if change.level else 'released'}"
        bound = self._bound(change)
        if silent and not change.level:
            return fail("KEY-20", f"{what}: no release was ever shown", bound)
        limits = Limits(at_most_ns=self._rules.surely_ns + self._rules.key_frame_ns)
        late = None
        if change.sure or change.outside:
            late = self._shows(change, min(change.closes_at, key.steady_until(change)))
        if late is not None and late.wanted.earliest > bound:
            text = f"{what}: the key frame came {show_span(late.wanted.earliest - bound)} too late"
            return fail("KEY-05", text, bound, (change.began, late.wanted), limits)
        if change.outside and change.level and late is None:
            return fail("KEY-22", f"{what} before operational was never shown", bound)
        return fail("KEY-06", f"{what}: the change was never shown", bound)
