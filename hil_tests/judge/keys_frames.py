"""What key frames say: where the node may speak, only what can be so, and nothing twice."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator
from itertools import pairwise

from hil_tests.clock import FOREVER
from hil_tests.judge.keys_facts import Report
from hil_tests.judge.keys_levels import KeyLevels
from hil_tests.judge.keys_reading import Reading, fail
from hil_tests.judge.verdict import Limits, Verdict


class Frames:
    """Judges each key frame of a reading."""

    def __init__(self, reading: Reading) -> None:
        self._reading = reading
        self._rules = reading.rules
        self._reports = reading.reports
        self._windows = reading.windows

    def verdicts(self) -> Iterator[Verdict]:
        """Frames that must not be there, or not say this."""
        yield from self._outside()
        yield from self._untrue()
        yield from self._repeated()

    def _outside(self) -> Iterator[Verdict]:
        """Frames that were asked for outside operational."""
        for report, window in zip(self._reports, self._reading.places, strict=True):
            if window is None:
                text = (
                    f"key frame {self._reading.shown(report)} while the node was not operational"
                )
                yield fail("KEY-07", text, report.wanted.latest)

    def _untrue(self) -> Iterator[Verdict]:
        """Frames that show a state which was not possible."""
        for index, report in enumerate(self._reports):
            window = self._reading.places[index]
            if window is None or self._reading.can_be(report):
                continue
            entry = self._reading.place_in(window, index)
            yield from self._blame(report, entry)

    def _blame(self, report: Report, entry: int | None) -> Iterator[Verdict]:
        """The keys that are wrong, and what is wrong with them."""
        if report.mask & ~self._reading.bits:
            text = f"key frame {report.mask:02X}h has bits that belong to no key"
            yield fail("KEY-03", text, report.wanted.latest)
        oldest = self._reading.asked_from(report)
        found = False
        for name, bit in self._rules.keys.items():
            level, key = report.mask >> bit & 1, self._reading.keys.get(name)
            if key is None and level:
                found = True
                yield self._never_was(name, report, level)
            elif key and not self._key_can_be(key, level, oldest, report.wanted.latest):
                found = True
                yield self._wrong_key(name, key, report, level, entry)
        if not found and not report.mask & ~self._reading.bits:
            text = f"{self._reading.shown(report)} is no state that the keys had at one time"
            yield fail("KEY-06", f"key frame {text}", report.wanted.latest)

    def _key_can_be(self, key: KeyLevels, level: int, earliest: int, latest: int) -> bool:
        """Whether a key can have had that level at some instant of a span."""
        first = bisect_right(key.steps, (earliest, 3)) - 1
        last = bisect_right(key.steps, (latest, 3))
        return any(levels >> level & 1 for _, levels in key.steps[first:last])

    def _never_was(self, name: str, report: Report, level: int) -> Verdict:
        """A key that a frame shows at a level that it had at no time by then."""
        shown = "pressed" if level else "released"
        return fail("KEY-03", f"{name} is shown {shown} but never was", report.wanted.latest)

    def _wrong_key(
        self, name: str, key: KeyLevels, report: Report, level: int, entry: int | None
    ) -> Verdict:
        """A key that a frame shows at a level at which it cannot be."""
        is_shown = f"{name} is shown {'pressed' if level else 'released'}"
        at = report.wanted.latest
        stays = [
            (index, stay)
            for index, stay in enumerate(key.stays)
            if stay.level == level and stay.start.earliest <= at
        ]
        if not stays:
            return self._never_was(name, report, level)
        index, stay = stays[-1]
        counts_at = key.may_count_at(index) if index else -FOREVER
        if counts_at is not None and at < counts_at:
            limits = Limits(at_least_ns=self._rules.soonest_ns)
            timed = (stay.start, report.wanted)
            return fail("KEY-05", f"{is_shown} too early", at, timed, limits)
        recent = stay.end.latest + self._rules.surely_ns + self._rules.key_frame_ns
        if counts_at is None and report.wanted.earliest <= recent:
            limits = Limits(at_least_ns=self._rules.soonest_ns)
            timed = (stay.start, stay.end)
            return fail("KEY-04", f"{is_shown} after too short a time", at, timed, limits)
        if entry == 0:
            return fail("KEY-01", f"{is_shown} on entering operational, which is wrong", at)
        if entry is not None:
            return fail("KEY-07", f"{is_shown} after entry: that is past", at)
        return fail("KEY-06", f"{is_shown} although it is not so any more", at)

    def _repeated(self) -> Iterator[Verdict]:
        """Frames that say the same as the one before."""
        if not self._rules.releases_reported:
            return
        for index in range(1, len(self._reports)):
            before, report = self._reports[index - 1], self._reports[index]
            window = self._reading.places[index]
            if before.mask != report.mask or window is None or self._may_repeat(before, report):
                continue
            leaving = report.wanted.latest >= window.closes.earliest
            entry = "KEY-01" if self._reading.place_in(window, index) == 1 else "KEY-06"
            requirement = "KEY-07" if leaving else entry
            text = f"key frame {self._reading.shown(report)} sent twice"
            yield fail(requirement, text, report.wanted.latest)

    def _may_repeat(self, before: Report, report: Report) -> bool:
        """Whether a start command may be why the same is said again (KEY-01, KEY-21)."""
        command_ns = self._rules.command_ns
        for earlier, window in pairwise(self._windows):
            left_by = earlier.closes.latest + command_ns
            if before.wanted.earliest <= left_by and window.opens.earliest <= report.wanted.latest:
                return True
        return any(
            start.earliest <= report.wanted.latest
            and report.wanted.earliest <= start.latest + command_ns
            for start in self._reading.again
        )
