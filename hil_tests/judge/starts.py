"""What follows a boot-up: one EMCY "hardware" after a full start (NMT-02, NMT-20).

A pure function of what was seen and done. Where something came between that may have kept
the EMCY back (a command, the supply, lost frames), nothing is asked for.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

from hil_tests.clock import Interval, show_span
from hil_tests.judge.cobs import HARDWARE
from hil_tests.judge.verdict import Limits, Outcome, Verdict
from node_model.frame import Frame

GENERIC = 0x01
"""Bit 0 of the error register."""

_EXAMPLE = bytes((0x00, HARDWARE, GENERIC, 0, 0, 0, 0, 0))
"""Code 5000h, little-endian, generic error, nothing of the maker's (NMT-20)."""


class Start(NamedTuple):
    """A boot-up after power-on or reset node.

    Args:
        boot: when it was asked for.
        disturbed_at: the first thing after it that may have kept the EMCY back.
    """

    boot: Interval
    disturbed_at: int


class Emergency(NamedTuple):
    """An EMCY of the device, of eight bytes."""

    wanted: Interval
    frame: Frame


def judge_starts(
    starts: Sequence[Start], seen: Sequence[Emergency], emcy_ns: int, until: int
) -> Iterator[Verdict]:
    """What is wrong with the EMCYs after some starts.

    Args:
        starts: full starts, in order.
        seen: every EMCY, in order.
        emcy_ns: from the boot-up to its EMCY, at most.
        until: what was asked for before this was seen.
    """
    limits = Limits(at_most_ns=emcy_ns)
    for start in starts:
        bound = start.boot.latest + emcy_ns
        found = next((each for each in seen if each.wanted.latest >= start.boot.earliest), None)
        if found is not None and found.wanted.earliest <= min(bound, start.disturbed_at):
            yield from _content(found)
            continue
        if bound >= min(start.disturbed_at, until):
            continue
        text = f"no EMCY within {show_span(emcy_ns)} after the boot-up"
        yield Verdict("NMT-02", Outcome.FAIL, text, limits=limits, at=bound)


def _content(found: Emergency) -> Iterator[Verdict]:
    data = found.frame.data
    at = found.wanted.latest
    if data[1] != HARDWARE:
        text = f"the EMCY after the boot-up is {found.frame}; its code is not 50xxh"
        yield Verdict("NMT-02", Outcome.FAIL, text, at=at)
    elif data[0] or not data[2] & GENERIC or any(data[3:]):
        text = f"the EMCY after the boot-up is {found.frame}, not {_EXAMPLE.hex(' ').upper()}"
        yield Verdict("NMT-20", Outcome.FAIL, text, at=at)
