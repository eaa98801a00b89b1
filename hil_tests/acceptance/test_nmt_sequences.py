"""Any sequence of NMT frames, good and bad, leads where the commands in it lead."""

from __future__ import annotations

from collections.abc import Sequence

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from hil_tests.api import MS, Frame, KeypadBench, Nmt, Seen, nmt_frame
from hil_tests.judge.nmt_oracle import Limits, Story, breaches

KINDS = (*Nmt, 0x00, 0x03, 0x83, "short", "remote", "extended")
ADDRESSEES = ("own", "all", "other")
GAPS_MS = (0, 1, 15, 45, 55, 110)
"""Back to back, within the limit of a command, about it, and past the next beat."""

CODES = len(KINDS) * len(ADDRESSEES) * len(GAPS_MS)
"""A step is one number, so that examples are small and shrink well."""


def step(gap_ms: int, kind: object, addressee: str = "own") -> int:
    """The number of a step."""
    place = KINDS.index(kind) * len(ADDRESSEES) + ADDRESSEES.index(addressee)
    return place * len(GAPS_MS) + GAPS_MS.index(gap_ms)


def frame_of(kind: int | str, to: int) -> Frame:
    """An NMT frame, or one that is none."""
    data = bytes((Nmt.START, to))
    if kind == "short":
        return Frame(0, data[:1])
    if kind == "remote":
        return Frame(0, remote=True, dlc=2)
    if kind == "extended":
        return Frame(0, data, extended=True)
    return nmt_frame(int(kind), to)


def play(bench: KeypadBench, steps: Sequence[int]) -> None:
    """Send the frames at their distances, and look on until everything must have shown."""
    to = {"own": bench.node_id, "all": 0, "other": bench.node_id + 1}
    for code in steps:
        place, gap = divmod(code, len(GAPS_MS))
        kind, addressee = divmod(place, len(ADDRESSEES))
        if GAPS_MS[gap]:
            bench.wait(GAPS_MS[gap] * MS)
        bench.post(frame_of(KINDS[kind], to[ADDRESSEES[addressee]]))
    limits = bench.profile.limits
    resets = any(KINDS[code // len(GAPS_MS) // len(ADDRESSEES)] in {0x81, 0x82} for code in steps)
    bench.wait(limits.command_ns + (limits.boot_up_ns if resets else 0))
    bench.wait(2 * bench.watch.expected.heartbeat_each.at_most_ns)


def recorded(bench: KeypadBench, boot: Seen) -> Story:
    """Everything since the boot-up, with what is known of a late host."""
    bench.settle()
    frames = [seen._replace(wanted=bench.when(seen)) for seen in bench.frames_seen(boot.index + 1)]
    return Story(bench.node_id, frames, bench.now())


@pytest.mark.requirement("NMT-07", "NMT-04", "NMT-05", "NMT-06", "HB-03")
@settings(max_examples=600)
@given(st.lists(st.integers(0, CODES - 1), max_size=8))
@example([step(45, 0x01), step(45, 0x02), step(45, 0x80)])
@example([step(0, 0x01), step(0, 0x02), step(0, 0x01, "all"), step(0, 0x02), step(0, 0x80)])
@example([step(110, 0x01), step(0, 0x81), step(1, 0x01), step(110, 0x02, "all")])
@example([step(110, 0x02), step(55, 0x82, "all"), step(15, 0x82), step(110, 0x01)])
@example([step(0, "short"), step(0, "remote"), step(0, "extended"), step(110, 0x01, "other")])
@example([step(110, 0x01), step(15, 0x03), step(15, 0x83), step(15, 0x00), step(0, 0x81, "other")])
def test_any_sequence(bench: KeypadBench, steps: list[int]) -> None:
    """Each frame of the node is explained by the commands before it, and nothing is missing."""
    bench.needs_exclusive()
    bench.begin_example()
    boot = bench.start({"heartbeat_ms": 50})
    play(bench, steps)
    limits = bench.profile.limits
    found = breaches(recorded(bench, boot), Limits(limits.command_ns, limits.boot_up_ns))
    for breach in found:
        bench.fail(breach.text, requirement=breach.requirement, since=boot)
    bench.check_monitors()
