"""When a press or a release counts: the debounce time from both sides (KEY-04..06).

A pulse that came out longer or shorter than planned, because a host was busy, is judged as
it came out: by the recorded edges.
"""

from __future__ import annotations

from functools import partial

import pytest

from hil_tests.acceptance.cadence import next_beat, period_ns
from hil_tests.acceptance.key_steps import (
    MARGIN_NS,
    PREFERRED,
    expect_keys,
    expect_masks,
    key_masks,
    known,
    long_enough_ns,
    mask_of,
    missed,
    needs_releases,
    pulse,
    report_limits,
    settle,
    too_short_ns,
    visible_ns,
)
from hil_tests.api import (
    MS,
    Frame,
    KeypadBench,
    Keys,
    Nmt,
    NotApplicable,
    State,
    cobs,
    exactly,
    matchers,
)
from hil_tests.scenarios.story import KeyStory

NEAR_MS = (0, -1, 1, 0)
"""How far from a heartbeat a key counts, in turn."""

DEBOUNCES = (1, 5, 255)
"""x 100 ms: the shortest, a usual one, the longest."""

LEVELS = ("press", "release")

LEFT_FOR = {Nmt.STOP: State.STOPPED, Nmt.PRE_OPERATIONAL: State.PRE_OPERATIONAL}
"""Where the commands lead that reset nothing."""

AGAIN = 8
"""Short pulses in a row: together they last much longer than the debounce time."""


def ready(bench: KeypadBench, keys: Keys, level: str, **needed: int) -> KeyStory:
    """The node operational; its second key held and reported, where it is to be released."""
    story = KeyStory.operational(bench, PREFERRED, **needed)
    if level == "release":
        needs_releases(bench)
        name = keys.names[1]
        expect_keys(bench, [name], after=keys.press(name), requirement="KEY-02")
    settle(bench)  # what the keys did around the entry itself is KEY-22
    return story


@pytest.mark.requirement("KEY-04")
@pytest.mark.parametrize("level", LEVELS)
@pytest.mark.parametrize("debounce", DEBOUNCES)
def test_short_pulse_is_never_seen(
    bench: KeypadBench, keys: Keys, debounce: int, level: str
) -> None:
    """A press or release just shorter than the debounce time less a scan brings no frame."""
    story = ready(bench, keys, level, debounce=debounce)
    pulse(keys, keys.names[1], [too_short_ns(bench)], held=level == "release")
    story.judge("KEY-04")


@pytest.mark.requirement("KEY-04")
@pytest.mark.parametrize("level", LEVELS)
@pytest.mark.parametrize("debounce", [1, 5])
def test_short_pulses_do_not_add_up(
    bench: KeypadBench, keys: Keys, debounce: int, level: str
) -> None:
    """Short pulses of one key, however often repeated, bring no frame."""
    story = ready(bench, keys, level, debounce=debounce)
    spans = [too_short_ns(bench), visible_ns(bench)] * AGAIN
    pulse(keys, keys.names[1], spans[:-1], held=level == "release")
    story.judge("KEY-04")


@pytest.mark.requirement("KEY-04", "KEY-06")
def test_short_pulses_of_all_keys_do_not_add_up(bench: KeypadBench, keys: Keys) -> None:
    """Short pulses of one key after the other bring no frame, however they overlap."""
    story = KeyStory.operational(bench, {"node_id": 6}, debounce=1)
    steps = [(n * 40 * MS, frozenset((name,))) for n, name in enumerate(keys.names * 3)]
    keys.sequence([*steps, (len(steps) * 40 * MS, frozenset())])
    story.judge("KEY-04", "KEY-06")


@pytest.mark.requirement("KEY-05", "KEY-06")
@pytest.mark.parametrize("level", LEVELS)
@pytest.mark.parametrize("debounce", [0, *DEBOUNCES])
def test_pulse_long_enough_is_seen(
    bench: KeypadBench, keys: Keys, debounce: int, level: str
) -> None:
    """A press or release just longer than the debounce time and a scan brings its frame."""
    story = ready(bench, keys, level, debounce=debounce)
    pulse(keys, keys.names[1], [long_enough_ns(bench)], held=level == "release")
    story.judge("KEY-05", "KEY-06")


@pytest.mark.requirement("KEY-05")
@pytest.mark.parametrize("debounce", [0, *DEBOUNCES])
def test_frame_comes_neither_early_nor_late(bench: KeypadBench, keys: Keys, debounce: int) -> None:
    """The frame is asked for the debounce time after the edge, for press and for release."""
    story = KeyStory.operational(bench, PREFERRED, debounce=debounce)
    for name in (keys.names[0], keys.names[-1]):
        expect_keys(bench, [name], after=keys.press(name))
        released = keys.release()
        if bench.profile.releases_reported:
            expect_keys(bench, [], after=released)
        settle(bench)
    story.judge("KEY-05")


@pytest.mark.requirement("KEY-05", "KEY-04")
@pytest.mark.parametrize("level", LEVELS)
@pytest.mark.parametrize("gap_ms", [1, 4, 15, 40])
def test_bounces_start_the_time_anew(
    bench: KeypadBench, keys: Keys, gap_ms: int, level: str
) -> None:
    """After a train of bounces the time counts from the last edge; the train brings no frame."""
    story = ready(bench, keys, level, debounce=1)
    spans = [gap_ms * MS] * 10  # an even number: in the end it has moved
    pulse(keys, keys.names[1], spans, held=level == "release")
    settle(bench)
    story.judge("KEY-05", "KEY-04")


@pytest.mark.requirement("KEY-05", "KEY-06")
@pytest.mark.parametrize("level", LEVELS)
def test_bounce_late_in_the_time_starts_it_anew(
    bench: KeypadBench, keys: Keys, level: str
) -> None:
    """A bounce just before the debounce time is over puts the frame off by all of that time."""
    story = ready(bench, keys, level, debounce=5)
    spans = [too_short_ns(bench), visible_ns(bench)] * 2
    begin = bench.now()
    pulse(keys, keys.names[1], spans, held=level == "release")
    settle(bench)
    name = keys.names[1]
    wanted = 0 if level == "release" else mask_of(bench.profile, [name])
    masks = key_masks(bench, begin)
    right = masks[-1:] == [wanted]
    by = "KEY-06" if right or wanted else missed(bench, keys, "KEY-06")
    bench.check(right, f"{wanted:02X}h in the end; {masks}", requirement=by)
    story.judge("KEY-05", "KEY-06")


@pytest.mark.requirement("KEY-06", "KEY-05")
@pytest.mark.parametrize("shift_ms", [30, 60, 90])
def test_keys_are_timed_one_by_one(bench: KeypadBench, keys: Keys, shift_ms: int) -> None:
    """A key that moves while another one settles neither delays nor hastens it."""
    story = KeyStory.operational(bench, {"node_id": 6}, debounce=1)
    first, second = frozenset(keys.names[:1]), frozenset(keys.names[-1:])
    shift_ns, long_ns = shift_ms * MS, long_enough_ns(bench) + 200 * MS
    steps = [
        (0, first),
        (shift_ns, first | second),
        (long_ns, second),
        (long_ns + shift_ns, frozenset[str]()),
    ]
    keys.sequence(steps)
    story.judge("KEY-06", "KEY-05")


@pytest.mark.requirement("KEY-06", "KEY-05")
def test_bouncing_neighbour_does_not_delay_a_key(bench: KeypadBench, keys: Keys) -> None:
    """While one key bounces all the time another one is reported when it should."""
    story = KeyStory.operational(bench, {"node_id": 6}, debounce=1)
    noisy, quiet = keys.names[0], keys.names[-1]
    steps: list[tuple[int, frozenset[str]]] = []
    for n in range(24):
        names = {noisy} if n % 2 else set()
        steps.append((n * 25 * MS, frozenset(names | ({quiet} if 4 <= n < 14 else set()))))
    keys.sequence(steps)
    keys.release()
    story.judge("KEY-06", "KEY-05")


@pytest.mark.requirement("KEY-06")
def test_changes_are_reported_in_order(bench: KeypadBench, keys: Keys) -> None:
    """Keys pressed one after the other, each before the first is reported, come in that order."""
    needs_releases(bench)
    story = KeyStory.operational(bench, {"node_id": 6}, debounce=5)
    apart_ns = bench.profile.limits.scan_ns * 2 + bench.profile.limits.key_frame_ns + MARGIN_NS
    held = [frozenset(keys.names[: n + 1]) for n in range(len(keys.names))]
    sets = [*held, *(frozenset(keys.names) - names for names in held)]
    keys.sequence([(n * apart_ns, names) for n, names in enumerate(sets)])
    story.judge("KEY-06")


@pytest.mark.requirement("KEY-06")
@pytest.mark.parametrize("debounce", [0, 1])
def test_last_frame_shows_the_final_state(bench: KeypadBench, keys: Keys, debounce: int) -> None:
    """After much chatter of many keys the last key frame shows what is held then."""
    story = KeyStory.operational(bench, {"node_id": 6}, debounce=debounce)
    names = keys.names
    steps: list[tuple[int, frozenset[str]]] = []
    at = 0
    for n in range(60):
        held = frozenset(name for bit, name in enumerate(names) if (n * 37 + n // 3) >> bit & 1)
        steps.append((at, held))
        at += (7, 31, 108, 3, 131, 62)[n % 6] * MS
    keys.sequence(steps)
    settle(bench)
    masks = key_masks(bench, bench.now() - at)
    text = f"{keys.mask:02X}h in the end; the last key frames were {masks[-3:]}"
    bench.check(masks[-1:] == [keys.mask] or not bench.profile.releases_reported, text)
    story.judge("KEY-06", "KEY-04")


@pytest.mark.requirement("KEY-06", "KEY-05")
@pytest.mark.parametrize("level", LEVELS)
def test_led_frames_do_not_delay_a_key(bench: KeypadBench, keys: Keys, level: str) -> None:
    """LED frames that come between the edge and the report neither delay nor lose it."""
    story = ready(bench, keys, level, debounce=1)
    settle(bench)
    moved = bench.now() + 20 * MS
    name = keys.names[1]
    for after_ms in (5, 45, 85):
        for base in (cobs.LED_STEADY, cobs.LED_BLINK):
            frame = Frame(base + bench.node_id, bytes(bench.profile.led_frame_bytes))
            bench.at(moved + after_ms * MS, partial(bench.post, frame))
    held = frozenset[str]() if level == "release" else frozenset((name,))
    keys.sequence([(20 * MS, held)])
    settle(bench)
    story.judge("KEY-06", "KEY-05")


@pytest.mark.requirement("KEY-06", "KEY-02")
def test_hundreds_of_changes_are_reported(bench: KeypadBench, keys: Keys) -> None:
    """Of many presses and releases of one key each is shown once (in virtual time 300)."""
    needs_releases(bench)
    story = KeyStory.operational(bench, {"node_id": 6}, debounce=1)
    settle(bench)
    name, begin = frozenset(keys.names[-1:]), bench.now()
    count, apart_ns = (300 if bench.stage.virtual else 20), 2 * report_limits(bench).at_most_ns
    keys.sequence([(n * apart_ns, frozenset() if n % 2 else name) for n in range(count)])
    settle(bench)
    changes = len(key_masks(bench, begin))
    by = "" if changes == count else missed(bench, keys, "KEY-06")
    text = f"{count} changes bring {count} frames; {changes} came"
    bench.check(changes == count, text, requirement=by)
    story.judge("KEY-06", "KEY-02")


@pytest.mark.requirement("KEY-05", "KEY-01")
def test_reentry_does_not_change_the_time(bench: KeypadBench, keys: Keys) -> None:
    """After stop and start, and after a reset, the debounce time is what it was."""
    story = KeyStory.operational(bench, PREFERRED)
    name = keys.names[1]
    for command in (Nmt.STOP, Nmt.PRE_OPERATIONAL, Nmt.RESET_NODE, Nmt.RESET_COMMUNICATION):
        sent = bench.nmt(command)
        if command in LEFT_FOR:
            bench.expect_state(LEFT_FOR[command], after=sent, requirement="NMT-04")
        else:
            boot_up, within = matchers.boot_up(bench.node_id), bench.profile.limits.boot_up_ns
            bench.expect(boot_up, after=sent, within=within, requirement="NMT-06")
        bench.enter_operational()
        settle(bench)
        expect_keys(bench, [name], after=keys.press(name))
        keys.release()
        settle(bench)
    story.judge("KEY-05", "KEY-01")


@pytest.mark.requirement("KEY-06", "HB-04")
def test_key_that_counts_at_a_heartbeat_is_told(bench: KeypadBench, keys: Keys) -> None:
    """A press whose debounce time ends as a heartbeat is due costs neither frame."""
    story = KeyStory.operational(bench, {"node_id": 6}, heartbeat_ms=250, debounce=1)
    name, period = keys.names[0], period_ns(bench)
    lead = period - known(bench).debounce_ns
    for off_ms in NEAR_MS:
        beat = next_beat(bench, exactly(bench.now()))
        bench.wait_until(bench.when(beat).latest + period + lead + off_ms * MS)
        expect_keys(bench, [name], after=keys.press(name))
        beat = next_beat(bench, exactly(bench.now()))
        bench.wait_until(bench.when(beat).latest + period + lead + off_ms * MS)
        released = keys.release()
        if bench.profile.releases_reported:
            expect_keys(bench, [], after=released, requirement="KEY-20")
        settle(bench)
    story.judge("KEY-06")


@pytest.mark.requirement("KEY-02", "HB-05")
def test_keys_are_told_without_heartbeat(bench: KeypadBench, keys: Keys) -> None:
    """With heartbeat time 0 a press and a release are reported as with any other."""
    story = KeyStory.operational(bench, PREFERRED, heartbeat_ms=0)
    name = keys.names[0]
    expect_keys(bench, [name], after=keys.press(name))
    released = keys.release()
    if bench.profile.releases_reported:
        expect_keys(bench, [], after=released, requirement="KEY-20")
    settle(bench)
    story.judge("KEY-02")


@pytest.mark.requirement("KEY-20")
def test_releases_are_silent_where_the_profile_says_so(bench: KeypadBench, keys: Keys) -> None:
    """On a board that reports presses only, letting go of one key and of all brings no frame."""
    if bench.profile.releases_reported:
        raise NotApplicable("the profile says that the board reports releases")
    KeyStory.operational(bench, PREFERRED)
    pressed = keys.hold(*keys.names[:2])
    expect_keys(bench, keys.names[:2], after=pressed, requirement="KEY-02")
    for name in keys.names[:2]:
        released = keys.release(name)
        settle(bench)
        expect_masks(bench, [], after=released)
