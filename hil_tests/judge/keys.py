"""The key oracle: edges in, key frames out, and what of it cannot be (KEY-01..07, KEY-20..23).

A pure function of the whole timeline, from the clause, without a debouncer of its own: it
asks which debounced states are possible when (`keys_levels`), that every frame shows one of
them, and that every change which must have counted was shown in time. A report already on
the wire when the next edge comes was not caused by it, so a frame may show any state of the
span in which it can have been asked for.

FAIL is said only of what no reading of the intervals allows. What is right in the reading
that is best for the device, yet wrong in one where every doubt goes against it, is
INCONCLUSIVE.
"""

from __future__ import annotations

from dataclasses import replace

from hil_tests.judge.keys_changes import Changes
from hil_tests.judge.keys_facts import Edge, KeyRules, KeyTimeline, Report, Turn
from hil_tests.judge.keys_frames import Frames
from hil_tests.judge.keys_reading import Reading, instant_of
from hil_tests.judge.verdict import Outcome, Verdict

__all__ = ["Edge", "KeyRules", "KeyTimeline", "Report", "Turn", "judge_keys"]


def judge_keys(timeline: KeyTimeline, rules: KeyRules, *, doubts: bool = True) -> list[Verdict]:
    """What is wrong with the key frames of a timeline; nothing = all is right.

    Args:
        timeline: see there.
        rules: see there.
        doubts: False = what is INCONCLUSIVE is not asked for.

    Returns:
        In order of time, FAIL where it is certain; only where nothing is, INCONCLUSIVE.
    """
    certain = Reading(timeline, rules)
    found = _wrong(certain)
    if found or not doubts:
        return found
    doubtful = [
        replace(verdict, outcome=Outcome.INCONCLUSIVE, text=f"perhaps: {verdict.text}")
        for late in (True, False)
        for verdict in _wrong(Reading(certain.sharpened(late=late), rules, certain))
    ]
    return sorted(doubtful, key=instant_of)


def _wrong(reading: Reading) -> list[Verdict]:
    """Everything that is wrong in one reading, in order of time."""
    found = [*Frames(reading).verdicts(), *Changes(reading).verdicts()]
    return sorted(found, key=instant_of)
