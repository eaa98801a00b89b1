"""What a recording without stimuli says of each requirement: a verdict, or why there is none."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

from hil_tests.clock import show_interval
from hil_tests.judge.cobs import Nmt
from hil_tests.judge.expected import Expected
from hil_tests.judge.frames import ILL_FORMED
from hil_tests.judge.periodic import judge_periodic, mean_interval
from hil_tests.judge.verdict import Outcome, Verdict
from hil_tests.replay.onlooker import Findings
from hil_tests.requirements import Requirement

PDO = "C-TP-01"
KEY_FRAME = "KEY-07"
_MOST = 20
"""So many findings on one requirement are told; the others are counted."""


@dataclass(frozen=True, slots=True)
class Shown:
    """What came of one requirement.

    Args:
        requirement: its id.
        outcome: the worst of the verdicts; or that it was not run.
        text: why it was not run; "" = it was.
        verdicts: on it.
    """

    requirement: str
    outcome: Outcome
    text: str = ""
    verdicts: tuple[Verdict, ...] = ()


def shown(
    requirements: Mapping[str, Requirement], expected: Expected, found: Findings
) -> Iterator[Shown]:
    """Each requirement, in the order of the catalogue.

    Args:
        requirements: of the kind of device.
        expected: the device as it should be.
        found: in the recording.
    """
    wrong: dict[str, list[Verdict]] = {}
    for verdict in [*found.verdicts, *_doubtful(expected, found)]:
        wrong.setdefault(verdict.requirement, []).append(verdict)
    rights = _rights(expected)
    for name, requirement in requirements.items():
        bad = wrong.get(name, [])
        if bad:
            yield _bad(name, bad)
            continue
        right = rights.get(name)
        told = right(found) if right else _why_not(requirement)
        if isinstance(told, Verdict):
            yield Shown(name, told.outcome, "", (told,))
        else:
            yield Shown(name, Outcome.NOT_RUN, told)


def _bad(name: str, verdicts: list[Verdict]) -> Shown:
    """What is wrong, the worst first."""
    verdicts.sort(key=lambda each: each.outcome is not Outcome.FAIL)
    more = len(verdicts) - _MOST
    text = f"and {more} more of the kind" if more > 0 else ""
    return Shown(name, verdicts[0].outcome, text, tuple(verdicts[:_MOST]))


def _doubtful(expected: Expected, found: Findings) -> Iterator[Verdict]:
    """What may be wrong, and a recording cannot tell."""
    count = found.counts["unexplained"]
    if count:
        text = (
            f"{count} boot-ups follow no command: power was switched, or the device reset itself;"
            " a recording without stimuli cannot tell"
        )
        yield Verdict(expected.ids.boot_again, Outcome.INCONCLUSIVE, text)


Right = Callable[[Findings], Verdict | str]
"""The verdict where nothing is wrong, or why there is none."""


def _rights(expected: Expected) -> Mapping[str, Right]:
    ids, node = expected.ids, expected.node_id

    def counted(requirement: str, name: str, text: str, lacks: str) -> Right:
        def right(found: Findings) -> Verdict | str:
            count = found.counts[name]
            if not count:
                return f"the recording holds {lacks} of node {node}"
            return Verdict(requirement, Outcome.PASS, text.format(count))

        return right

    return {
        ids.beat: lambda found: _cadence(expected, found),
        ids.beat_form: counted(
            ids.beat_form, "beats", "{} heartbeats, each shows an NMT state", "no heartbeat"
        ),
        ids.beat_first: lambda found: _first_beats(expected, found),
        ids.reset_first: counted(
            ids.reset_first, "answered", "nothing before {} boot-ups", "no commanded reset"
        ),
        ids.reset: lambda found: _resets(expected, found),
        ids.self_start: counted(
            ids.self_start, "first beats", "{} starts, none led to operational", "no start"
        ),
        ids.state: lambda found: _states(expected, found),
        ILL_FORMED: counted(
            ILL_FORMED, "device", "{} frames under its identifiers, all well formed", "no frame"
        ),
        PDO: counted(PDO, "pdos", "{} PDOs, none outside operational", "no PDO in a known state"),
        KEY_FRAME: counted(
            KEY_FRAME, "pdos", "{} key frames, none outside operational", "no key frame"
        ),
    }


def _cadence(expected: Expected, found: Findings) -> Verdict | str:
    """The longest undisturbed stretch of beats, against the period."""
    longest = max(found.beats, key=len, default=[])
    name = f"heartbeat of node {expected.node_id}"
    if len(longest) < 2:
        return f"the recording holds no two undisturbed heartbeats of node {expected.node_id}"
    if not expected.heartbeat_ns:
        mean = show_interval(mean_interval(longest))
        count = len(longest) - 1
        return f"{name}: {count} intervals, mean {mean}; say what it should be with --heartbeat"
    each, mean_limits = expected.heartbeat_each, expected.heartbeat_mean
    return judge_periodic(name, longest, each, mean_limits, expected.ids.beat)


def _first_beats(expected: Expected, found: Findings) -> Verdict | str:
    count = found.counts["first beats"]
    if not expected.heartbeat_ns:
        return "the period of its heartbeat is not known; say it with --heartbeat"
    if not count:
        return f"the recording holds no start of node {expected.node_id}"
    text = f"{count} starts, the first heartbeat in time"
    return Verdict(expected.ids.beat_first, Outcome.PASS, text)


def _resets(expected: Expected, found: Findings) -> Verdict | str:
    """A device that was not heard any more may have lost its supply just then."""
    resets, answered = found.counts["resets"], found.counts["answered"]
    if not resets:
        return f"the recording holds no commanded reset of node {expected.node_id}"
    text = f"{resets} commanded resets, {answered} boot-ups that follow one"
    outcome = Outcome.PASS if answered >= resets else Outcome.INCONCLUSIVE
    return Verdict(expected.ids.reset, outcome, text)


def _states(expected: Expected, found: Findings) -> Verdict | str:
    """All five commands must have been seen: one that was not given was not obeyed either."""
    missing = [
        str(each.name).lower().replace("_", " ") for each in Nmt if each not in found.commands
    ]
    if missing or not found.counts["beats"]:
        what = f"no command {', '.join(missing)}" if missing else "no heartbeat"
        return f"the recording holds {what} for node {expected.node_id}"
    text = f"{found.counts['beats']} heartbeats show where the commands led"
    return Verdict(expected.ids.state, Outcome.PASS, text)


def _why_not(requirement: Requirement) -> str:
    needs = ", ".join(requirement.needs)
    if needs:
        return f"it takes stimuli ({needs}); a recording does not say when they were given"
    return "it takes questions of a test; a recording that was made without it does not hold them"
