"""Steps that the tests of the keys share.

They judge from recorded instants only: a stimulus that came later than planned is judged as
it came.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from hil_tests.api import (
    MS,
    KeypadBench,
    KeypadProfile,
    Keys,
    Limits,
    Moment,
    NotApplicable,
    Parameters,
    Seen,
    matchers,
)

PREFERRED: Mapping[str, int] = {"node_id": 6, "debounce": 1}
"""Quick, and no node id that a node might assume; right with any parameters."""

MARGIN_NS = 2 * MS
"""How far on the other side of a limit a stimulus is put: small beside every limit."""

LINGER_NS = 100 * MS
"""How much longer than its limit a key frame is waited for, to tell late from missing."""


def known(bench: KeypadBench) -> Parameters:
    """What the device is commissioned to; stories and `bench.operational` see to it."""
    assert bench.parameters is not None
    return bench.parameters


def mask_of(profile: KeypadProfile, names: Iterable[str]) -> int:
    """The bits of some keys."""
    return sum(1 << profile.key_bits[name] for name in set(names))


def too_short_ns(bench: KeypadBench) -> int:
    """A press or release of this length must not be seen."""
    return known(bench).debounce_ns - bench.profile.limits.scan_ns - MARGIN_NS


def long_enough_ns(bench: KeypadBench) -> int:
    """A press or release of this length must be seen."""
    return known(bench).debounce_ns + bench.profile.limits.scan_ns + MARGIN_NS


def visible_ns(bench: KeypadBench) -> int:
    """A pause of this length cannot be missed between two readings of the keys."""
    return bench.profile.limits.scan_ns + MARGIN_NS


def report_limits(bench: KeypadBench) -> Limits:
    """From the last edge to the request of the key frame (KEY-05)."""
    limits, debounce_ns = bench.profile.limits, known(bench).debounce_ns
    return Limits(debounce_ns - limits.scan_ns, debounce_ns + limits.scan_ns + limits.key_frame_ns)


def settle(bench: KeypadBench) -> None:
    """Wait until what the keys are now must have been reported, and a while longer.

    So that what comes late is not taken for missing.
    """
    bench.wait(report_limits(bench).at_most_ns + LINGER_NS)


def expect_held_shown(bench: KeypadBench, keys: Keys, started: Seen) -> None:
    """The last key frame after a start shows exactly the keys that are held."""
    settle(bench)
    bench.wait(bench.profile.limits.command_ns)
    masks = key_masks(bench, started)
    text = f"{keys.mask:02X}h is shown after entry; the key frames were {masks}"
    bench.check(masks[-1:] == [keys.mask], text, since=started)


def expect_keys(
    bench: KeypadBench, names: Iterable[str], *, after: Moment | Seen, requirement: str = ""
) -> Seen:
    """A key frame with exactly these keys comes, and when the debounce time is over (KEY-05).

    Where one frame comes and shows something else, its content is wrong (KEY-03).

    Args:
        bench: the bench.
        names: of the keys held.
        after: what moved them.
        requirement: that a frame comes at all; left out, KEY-02, or KEY-20 with no key held.
    """
    profile, limits = bench.profile, report_limits(bench)
    mask = mask_of(profile, names)
    matcher = matchers.key_frame(bench.node_id, mask, profile.key_frame_bytes)
    within = limits.at_most_ns + LINGER_NS
    requirement = requirement or ("KEY-02" if mask else "KEY-20")
    if bench.first(matcher, after, after.when.latest + within + LINGER_NS) is None:
        told = key_masks(bench, after)
        if len(told) == 1:
            requirement = "KEY-03"
    seen = bench.expect(matcher, after=after, within=within, requirement=requirement)
    text = f"{matcher} after the edge"
    # What a debounce time of 0 means is a reading, and who filters all the same departs from that.
    timed = "KEY-05" if known(bench).debounce_ns else "COM-23"
    bench.measure_between(after, seen, limits, text, requirement=timed, since=after)
    return seen


def key_masks(bench: KeypadBench, after: Moment | Seen | int) -> list[int]:
    """What the key frames since something have shown, in order."""
    matcher = matchers.key_frame(bench.node_id)
    found = bench.collect(matcher, after=after, until=bench.now())
    return [int.from_bytes(seen.frame.data, "little") for seen in found]


def expect_masks(
    bench: KeypadBench, wanted: Sequence[int], *, after: Moment | Seen | int, requirement: str = ""
) -> None:
    """The key frames since something were these, no more and no fewer."""
    found = key_masks(bench, after)
    text = f"key frames {_show(wanted)}; they were {_show(found)}"
    bench.check(found == list(wanted), text, requirement=requirement, since=after)


def _show(masks: Sequence[int]) -> str:
    return " ".join(f"{mask:02X}h" for mask in masks) or "none"


def needs_releases(bench: KeypadBench) -> None:
    """Raise NotApplicable for a board that reports presses only."""
    if not bench.profile.releases_reported:
        raise NotApplicable("the profile says that the board does not report releases")


def missed(bench: KeypadBench, keys: Keys, requirement: str) -> str:
    """Which requirement a release that was not shown breaks.

    A board that shows presses and no release at all departs from KEY-20 and from nothing else,
    so one key is pressed and let go once more.
    """
    keys.release()
    settle(bench)
    pressed = keys.press(keys.names[-1])
    settle(bench)
    told = key_masks(bench, pressed)
    released = keys.release()
    settle(bench)
    return "KEY-20" if told and not key_masks(bench, released) else requirement


def pulse(keys: Keys, name: str, spans_ns: Sequence[int], *, held: bool = False) -> list[Moment]:
    """One key pressed and released in turn, each time after a span; the first one at once.

    Args:
        keys: the keys.
        name: of the key.
        spans_ns: how long it stays after each edge but the last.
        held: it is held now, so that it is released first.
    """
    others = keys.held - {name}
    steps: list[tuple[int, frozenset[str]]] = []
    at = 0
    for span_ns in (*spans_ns, 0):
        held = not held
        steps.append((at, others | {name} if held else others))
        at += span_ns
    return keys.sequence(steps)
