"""Which requirement a verdict belongs to, where what was done just before tells it better.

A wrong state is blamed on the transition (NMT-07), a boot-up that nobody asked for on NMT-02.
If the device was right until a frame came that looks like an NMT command for it and is none,
it should have ignored that frame (NMT-05); if it restarts after any other frame, it is the
traffic that it did not stand (ROB-01), but a frame for its LEDs is no such traffic. A key change
that is missing is no state at all where a heartbeat after that frame shows operational; and no key
frame is to come from a device that did not enter operational (KEY-01), as its next heartbeat says.
"""

from __future__ import annotations

from dataclasses import replace

from hil_tests.api import Frame, KeypadBench, Verdict, cobs

_BY_STATE = frozenset(("NMT-02", "NMT-03", "NMT-07", "KEY-01", "KEY-06", "KEY-07"))
"""Verdicts that a wrong NMT state leads to."""

_LED_FRAMES = frozenset((cobs.LED_STEADY, cobs.LED_BLINK))

BOOT_UP = b"\x00"
OPERATIONAL = b"\x05"

_LOOK_BACK = 400
"""Frames."""


def better(bench: KeypadBench, node_id: int, verdict: Verdict) -> Verdict:
    """The verdict, with the requirement that says most about its cause."""
    if verdict.requirement not in _BY_STATE or verdict.at is None:
        return verdict
    if verdict.requirement == "KEY-01" and _elsewhere(bench, node_id, verdict.at):
        text = f"{verdict.text}; the heartbeat after that does not show operational"
        return replace(verdict, requirement="NMT-07", text=text)
    lure = _lure(bench, node_id, verdict.at, of_keys=verdict.requirement.startswith("KEY"))
    if lure is None:
        return verdict
    restarted = verdict.requirement == "NMT-02" and _restarted(bench, node_id, verdict.at)
    if not lure.can_id and (restarted or verdict.requirement != "NMT-02"):
        name = "NMT-05"
    elif restarted:
        name = "ROB-01"
    else:
        return verdict
    return replace(verdict, requirement=name, text=f"{verdict.text}, after {lure}")


def _lure(bench: KeypadBench, node_id: int, at: int, *, of_keys: bool) -> Frame | None:
    """The last frame that the device should have ignored, if it was right before it."""
    trace, beat = bench.trace, cobs.ERROR_CONTROL + node_id
    index = min(trace.index_at(at), len(trace) - 1)
    wrong = trace.frame(index).frame if index >= 0 else None
    lure: Frame | None = None
    for place in range(index, max(index - _LOOK_BACK, -1), -1):
        sighting = trace.frame(place)
        frame = sighting.frame
        if sighting.own:
            if cobs.nmt_for(frame, node_id) is not None:
                return None
            lure = lure or (None if _for_leds(frame, node_id) else frame)
        elif frame.can_id == beat and lure is None:
            if of_keys and frame.data == OPERATIONAL:
                return None
        elif frame.can_id == beat:
            # What it showed before, too, no lure has led to.
            return None if frame.data != BOOT_UP and frame == wrong else lure
    return None


def _for_leds(frame: Frame, node_id: int) -> bool:
    """Whether that is a regular frame for the LEDs."""
    known = frame.can_id - node_id in _LED_FRAMES and len(frame.data) == 1
    return known and not frame.extended and not frame.remote


def _elsewhere(bench: KeypadBench, node_id: int, at: int) -> bool:
    """Whether the next heartbeat, no command in between, shows another state than operational."""
    trace, beat = bench.trace, cobs.ERROR_CONTROL + node_id
    for place in range(trace.index_at(at), len(trace)):
        frame, _, _, own = trace.frame(place)
        if own and cobs.nmt_for(frame, node_id) is not None:
            break
        if not own and frame.can_id == beat:
            return frame.data not in {BOOT_UP, OPERATIONAL}
    return False


def _restarted(bench: KeypadBench, node_id: int, at: int) -> bool:
    """Whether the verdict is about a boot-up that came."""
    trace = bench.trace
    index = min(trace.index_at(at), len(trace) - 1)
    frame = trace.frame(index).frame
    return frame.can_id == cobs.ERROR_CONTROL + node_id and frame.data == BOOT_UP
