"""What `results.json` says of one test, as values and as plain data (docs/results.md)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from hil_tests.reporting.margins import Ends, Margin, margin_of

OUTCOMES = (
    "passed",
    "failed",
    "observation",
    "characteristic",
    "inconclusive",
    "not run",
    "not applicable",
    "error",
)
"""Of a test and of a verdict, in the words of every report."""

PASSING = frozenset(("passed", "characteristic"))
"""Those that hold nothing against the device."""


def known(outcome: str) -> str:
    """The outcome itself.

    Raises:
        ValueError: no report knows it.
    """
    if outcome not in OUTCOMES:
        raise ValueError(f"outcome {outcome!r} is none of {', '.join(OUTCOMES)}")
    return outcome


class VerdictRow(NamedTuple):
    """What one test found out about one requirement.

    Args:
        requirement: its id.
        outcome: one of `OUTCOMES`.
        what: what was judged, e.g. "interval of the heartbeat".
        measured_ns: interval in which the measured value lies; None = not a time.
        limits_ns: at least, at most; None = no limit on that side.
        text: the sentence for people.
        at: the instant to look at in the trace, ns; None = none in particular.
        cause_at: from when the measured span counts: the interval in which that was, ns.
        effect_at: the same of its end; None = it never came, or nothing was timed.
    """

    requirement: str
    outcome: str
    what: str = ""
    measured_ns: tuple[int, int] | None = None
    limits_ns: Ends | None = None
    text: str = ""
    at: int | None = None
    cause_at: tuple[int, int] | None = None
    effect_at: tuple[int, int] | None = None

    @property
    def margin(self) -> Margin | None:
        """The room that the measurement left."""
        return margin_of(self.measured_ns, self.limits_ns)

    def to_json(self) -> dict[str, object]:
        """As plain data; unit, doubt and margin are worked out."""
        measured, margin = self.measured_ns, self.margin
        return {
            "requirement": self.requirement,
            "outcome": known(self.outcome),
            "what": self.what,
            "unit": "ns" if measured else None,
            "measured_ns": list(measured) if measured else None,
            "doubt_ns": measured[1] - measured[0] if measured else None,
            "limits_ns": list(self.limits_ns) if self.limits_ns else None,
            "margin": margin._asdict() if margin else None,
            "at": self.at,
            "cause_at": list(self.cause_at) if self.cause_at else None,
            "effect_at": list(self.effect_at) if self.effect_at else None,
            "text": self.text,
        }


@dataclass(frozen=True, slots=True)
class TraceFile:
    """A recording: its path relative to the run's folder, its sum, how many frames it holds."""

    path: str
    sha256: str = ""
    frames: int = 0


@dataclass(frozen=True, slots=True)
class TestResult:
    """What came of one test.

    Args:
        test: its node id.
        outcome: one of `OUTCOMES`; the worst of its verdicts, or an error of the bench.
        title: the fact that it states, in a sentence.
        seconds: wall-clock time it took.
        bus_ns: time that passed on the bus.
        frames: how many frames it saw.
        error_frames: error frames on the bus.
        losses: how often frames were lost on the way to the tester.
        lost: how many frames that were, as far as it is known.
        busy_ns: how long the wire was taken by frames; None = no bit times on that wire, or
            no record was kept.
        requirements: ids it claims.
        verdicts: what it found; also on requirements of monitors, which it does not claim.
        trace: its recording.
        reproduce: a command line that repeats it.
        text: why, where the verdicts do not say: reason of a skip, error of the bench.
    """

    __test__ = False  # pytest would take it for a test class

    test: str
    outcome: str
    title: str = ""
    seconds: float = 0.0
    bus_ns: int = 0
    frames: int = 0
    error_frames: int = 0
    losses: int = 0
    lost: int = 0
    busy_ns: int | None = None
    requirements: Sequence[str] = ()
    verdicts: Sequence[VerdictRow] = ()
    trace: TraceFile | None = None
    reproduce: str | None = None
    text: str = ""

    def to_json(self) -> dict[str, object]:
        """As plain data."""
        trace = self.trace
        return {
            "test": self.test,
            "outcome": known(self.outcome),
            "title": self.title,
            "seconds": round(self.seconds, 6),
            "bus_ns": self.bus_ns,
            "frames": self.frames,
            "error_frames": self.error_frames,
            "losses": self.losses,
            "lost": self.lost,
            "busy_ns": self.busy_ns,
            "requirements": list(self.requirements),
            "verdicts": [row.to_json() for row in self.verdicts],
            "trace": trace.path if trace else None,
            "trace_sha256": trace.sha256 if trace else None,
            "trace_frames": trace.frames if trace else None,
            "reproduce": self.reproduce,
            "text": self.text,
        }
