"""What key frames show, and when there is one (KEY-01..03, KEY-06, KEY-07, KEY-20, KEY-23)."""

from __future__ import annotations

import pytest

from hil_tests.acceptance.key_steps import (
    MARGIN_NS,
    PREFERRED,
    expect_held_shown,
    expect_keys,
    expect_masks,
    key_masks,
    mask_of,
    missed,
    needs_releases,
    report_limits,
    settle,
)
from hil_tests.acceptance.nmt_steps import RESETS, enter, name_of
from hil_tests.api import MS, Frame, KeypadBench, Keys, Nmt, NotApplicable, Power, cobs, matchers
from hil_tests.scenarios.story import KeyStory

LEADS_TO = cobs.LEADS_TO
LEAVING = (Nmt.STOP, Nmt.PRE_OPERATIONAL)


@pytest.mark.requirement("KEY-01")
@pytest.mark.parametrize("addressee", ["own id", "all nodes"])
def test_entry_brings_one_key_frame(bench: KeypadBench, keys: Keys, addressee: str) -> None:
    """On the command "start" the node sends its key frame, once, and then nothing more."""
    if addressee == "all nodes":
        bench.needs_exclusive()
    story = KeyStory.begin(bench, PREFERRED)
    command = bench.nmt(Nmt.START, bench.node_id if addressee == "own id" else 0)
    bench.entered(command)
    settle(bench)
    expect_masks(bench, [keys.mask], after=command)
    story.judge("KEY-01")


@pytest.mark.requirement("KEY-01", "KEY-07")
@pytest.mark.parametrize("way_out", LEAVING, ids=name_of)
def test_each_entry_shows_the_keys_held(bench: KeypadBench, keys: Keys, way_out: Nmt) -> None:
    """Each of three entries brings one key frame that shows what has been held all along."""
    story = KeyStory.operational(bench, PREFERRED)
    for name in keys.names[-3:]:
        pressed = keys.press(name)
        expect_keys(bench, keys.held, after=pressed, requirement="KEY-02")
        enter(bench, LEADS_TO[way_out])
        command = bench.nmt(Nmt.START)
        bench.entered(command)
        settle(bench)
        expect_masks(bench, [keys.mask], after=command)
    story.judge("KEY-01", "KEY-07")


@pytest.mark.requirement("KEY-01", "KEY-06")
def test_entry_shows_the_state_of_that_moment(bench: KeypadBench, keys: Keys) -> None:
    """What was pressed and released long before the next entry is shown by it as it is then."""
    story = KeyStory.operational(bench, PREFERRED)
    first, last = keys.names[0], keys.names[-1]
    bench.nmt(Nmt.STOP)
    bench.wait(bench.profile.limits.command_ns + MARGIN_NS)
    for held in ((first,), (last,), ()):
        keys.hold(*held)
        settle(bench)
        command = bench.nmt(Nmt.START)
        settle(bench)
        masks = key_masks(bench, command)
        text = f"after entry the last key frame shows {keys.mask:02X}h of {masks}"
        bench.check(masks[-1:] == [keys.mask], text, since=command)
        bench.nmt(Nmt.STOP)
        bench.wait(bench.profile.limits.command_ns + MARGIN_NS)
    story.judge("KEY-01", "KEY-06", "KEY-07")


@pytest.mark.requirement("KEY-02", "KEY-20")
def test_every_key_is_reported_alone(bench: KeypadBench, keys: Keys) -> None:
    """Each key pressed by itself brings a key frame, and so does its release."""
    story = KeyStory.operational(bench, PREFERRED)
    for name in keys.names:
        pressed = keys.press(name)
        expect_keys(bench, [name], after=pressed)
        released = keys.release()
        if bench.profile.releases_reported:
            expect_keys(bench, [], after=released, requirement="KEY-20")
        settle(bench)
    story.judge("KEY-02", "KEY-06")


@pytest.mark.requirement("KEY-02", "KEY-06", "KEY-20")
def test_keys_pressed_on_top_of_each_other(bench: KeypadBench, keys: Keys) -> None:
    """Keys added one by one until all are held, then let go one by one, are all reported."""
    story = KeyStory.operational(bench, PREFERRED)
    for name in keys.names:
        pressed = keys.press(name)
        expect_keys(bench, keys.held, after=pressed)
    for name in keys.names:
        released = keys.release(name)
        if bench.profile.releases_reported:
            expect_keys(bench, keys.held, after=released, requirement="KEY-20")
        settle(bench)
    story.judge("KEY-02", "KEY-06")


@pytest.mark.requirement("KEY-02", "KEY-06")
def test_twentieth_press_is_like_the_first(bench: KeypadBench, keys: Keys) -> None:
    """Twenty presses and releases of one key bring one frame each, none lost, none twice."""
    needs_releases(bench)
    story = KeyStory.operational(bench, PREFERRED)
    name = keys.names[1]
    settle(bench)
    begin = keys.release()
    for _ in range(20):
        keys.press(name)
        settle(bench)
        keys.release()
        settle(bench)
    wanted = [mask_of(bench.profile, [name]), 0] * 20
    by = "" if key_masks(bench, begin) == wanted else missed(bench, keys, "KEY-02")
    expect_masks(bench, wanted, after=begin, requirement=by)
    story.judge("KEY-02", "KEY-06")


@pytest.mark.requirement("KEY-03")
def test_every_key_has_its_bit(bench: KeypadBench, keys: Keys) -> None:
    """A key alone sets exactly its own bit of the profile; all others held, exactly theirs."""
    story = KeyStory.operational(bench, PREFERRED)
    for name in keys.names:
        for held in ([name], [other for other in keys.names if other != name]):
            if not bench.profile.releases_reported:
                keys.release()  # nothing is told where keys are only let go
                settle(bench)
            moved = keys.hold(*held)
            settle(bench)
            masks = key_masks(bench, moved)
            wanted = mask_of(bench.profile, held)
            text = f"the key frame shows {wanted:02X}h while {', '.join(held)} are held"
            right = masks[-1:] == [wanted]
            by = "" if right or masks else missed(bench, keys, "KEY-03")
            bench.check(right, f"{text}; {masks}", requirement=by, since=moved)
    story.judge("KEY-03")


@pytest.mark.requirement("KEY-03")
def test_key_frame_has_the_length_of_the_map(bench: KeypadBench, keys: Keys) -> None:
    """A key frame has as many bytes as the profile says, whatever is held."""
    bench.operational(PREFERRED)
    begin = bench.now()
    keys.hold(*keys.names)
    settle(bench)
    keys.release()
    settle(bench)
    frames = bench.collect(matchers.key_frame(bench.node_id), after=begin, until=bench.now())
    size = bench.profile.key_frame_bytes
    for seen in frames:
        bench.check(len(seen.frame.data) == size, f"{size} bytes in {seen.frame}", since=begin)
    bench.check(bool(frames), "a key frame with all keys held", since=begin)


@pytest.mark.requirement("KEY-03", "KEY-01")
def test_bytes_of_the_source(bench: KeypadBench, keys: Keys) -> None:
    """The keypad of the source with node id 10 sends 18Ah: 01h for on_off, 02h for aut."""
    profile = bench.profile
    bits = dict(profile.key_bits)
    if profile.key_frame_bytes != 1 or (bits.get("on_off"), bits.get("aut")) != (0, 1):
        raise NotApplicable("the profile has another hardware map than the source's keypad")
    entry = bench.operational({**PREFERRED, "node_id": 10})
    wanted = f"18{bench.node_id:X}"
    bench.check(str(entry.frame) == f"{wanted}#00", f"{wanted}#00; it was {entry.frame}")
    for name, data in (("on_off", "01"), ("aut", "02")):
        moved = keys.hold(name)
        settle(bench)
        found = bench.collect(matchers.key_frame(bench.node_id), after=moved, until=bench.now())
        text = f"{wanted}#{data} for {name}; it was {found[-1].frame if found else 'nothing'}"
        bench.check(bool(found) and str(found[-1].frame) == f"{wanted}#{data}", text, since=moved)


@pytest.mark.requirement("KEY-07")
@pytest.mark.parametrize("state", ["pre-operational", "stopped"])
def test_outside_operational_keys_are_silent(bench: KeypadBench, keys: Keys, state: str) -> None:
    """In pre-operational and in stopped neither presses nor releases bring a key frame."""
    story = KeyStory.begin(bench, PREFERRED)
    if state == "stopped":
        bench.nmt(Nmt.STOP)
        bench.wait(bench.profile.limits.command_ns)
    began = bench.now()
    for names in (*((name,) for name in keys.names), keys.names):
        keys.hold(*names)
        settle(bench)
        keys.release()
        settle(bench)
    key_frame = matchers.key_frame(bench.node_id)
    bench.never(key_frame, after=began, for_ns=bench.now() - began)
    story.judge("KEY-07")


@pytest.mark.requirement("KEY-07", "KEY-01")
@pytest.mark.parametrize("way_out", LEAVING, ids=name_of)
def test_changes_outside_are_not_made_up_for(bench: KeypadBench, keys: Keys, way_out: Nmt) -> None:
    """Presses that came and went outside operational leave no trace after the entry."""
    story = KeyStory.operational(bench, PREFERRED)
    enter(bench, LEADS_TO[way_out])
    for name in keys.names:
        keys.hold(name)
        settle(bench)
        keys.release()
        settle(bench)
    command = bench.nmt(Nmt.START)
    bench.entered(command)
    settle(bench)
    expect_masks(bench, [0], after=command)
    story.judge("KEY-07", "KEY-01")


@pytest.mark.requirement("KEY-07")
@pytest.mark.parametrize("way_out", LEAVING, ids=name_of)
def test_change_that_matures_outside_is_not_sent(
    bench: KeypadBench, keys: Keys, way_out: Nmt
) -> None:
    """A press whose debounce time ends after operational was left brings no key frame."""
    bench_ns = bench.profile.limits.command_ns + bench.profile.limits.scan_ns + MARGIN_NS
    story = KeyStory.operational(bench, debounce=max(2, -(-2 * bench_ns // (100 * MS))))
    keys.press(keys.names[0])
    left = bench.nmt(way_out)
    settle(bench)
    bench.expect_state(LEADS_TO[way_out], after=left, requirement="NMT-04")
    command = bench.nmt(Nmt.START)
    bench.entered(command)
    settle(bench)
    text = "the press is shown after the next entry"
    bench.check(key_masks(bench, command)[-1:] == [keys.mask], text, since=command)
    story.judge("KEY-07", "KEY-01")


@pytest.mark.requirement("KEY-07", "KEY-01")
@pytest.mark.parametrize("command", RESETS, ids=name_of)
def test_reset_silences_the_keys(bench: KeypadBench, keys: Keys, command: Nmt) -> None:
    """After a reset by command no key frame comes until the node is started again."""
    story = KeyStory.operational(bench, PREFERRED)
    name = keys.names[-1]
    expect_keys(bench, [name], after=keys.press(name), requirement="KEY-02")
    sent = bench.nmt(command)
    within = bench.profile.limits.boot_up_ns
    boot_up = matchers.boot_up(bench.node_id)
    boot = bench.expect(boot_up, after=sent, within=within, requirement="NMT-06")
    keys.release()
    settle(bench)
    keys.press(keys.names[0])
    key_frame = matchers.key_frame(bench.node_id)
    bench.never(key_frame, after=boot, for_ns=report_limits(bench).at_most_ns)
    bench.enter_operational()
    story.judge("KEY-07", "KEY-01", "KEY-22")


@pytest.mark.requirement("KEY-20")
def test_releases_are_reported(bench: KeypadBench, keys: Keys) -> None:
    """Letting go of one of two keys, then of the other, brings a key frame each."""
    needs_releases(bench)
    story = KeyStory.operational(bench, PREFERRED)
    first, last = keys.names[0], keys.names[-1]
    keys.hold(first, last)
    settle(bench)
    expect_keys(bench, [last], after=keys.release(first), requirement="KEY-20")
    expect_keys(bench, [], after=keys.release(last))
    story.judge("KEY-20")


@pytest.mark.requirement("KEY-21")
def test_second_start_is_recorded(bench: KeypadBench, keys: Keys) -> None:
    """Whether a start command while operational brings the key frame again is written down."""
    story = KeyStory.operational(bench, PREFERRED)
    name = keys.names[0]
    expect_keys(bench, [name], after=keys.press(name), requirement="KEY-02")
    command = bench.nmt(Nmt.START)
    settle(bench)
    again = bool(key_masks(bench, command))
    story.judge("KEY-06")
    what = "brings the key frame again" if again else "brings no key frame"
    bench.characteristic("KEY-21", f"a start command to an operational node {what}")


@pytest.mark.requirement("KEY-22", "KEY-01")
@pytest.mark.parametrize("which", ["each", "all but one"])
def test_keys_held_at_the_start_are_shown(bench: KeypadBench, keys: Keys, which: str) -> None:
    """Keys held since before the start are shown at the latest the debounce time after entry."""
    names = keys.names if which == "each" else keys.names[:2]
    for name in names:
        bench.fresh(PREFERRED)
        keys.hold(*([name] if which == "each" else set(keys.names) - {name}))
        story = KeyStory(bench)
        bench.boot()
        bench.wait(bench.profile.limits.emcy_ns)
        command = bench.nmt(Nmt.START)
        bench.entered(command)
        expect_held_shown(bench, keys, command)
        story.judge("KEY-22", "KEY-01")
        keys.release()


@pytest.mark.requirement("KEY-22", "KEY-01")
def test_key_pressed_right_after_power_on_is_shown(
    bench: KeypadBench, power: Power, keys: Keys
) -> None:
    """A key that is pressed while the node initialises disturbs no start, and is shown."""
    bench.fresh(PREFERRED)
    story = KeyStory(bench)
    on = power.on()
    keys.press(keys.names[-1])
    within = bench.profile.limits.boot_up_ns
    bench.expect(matchers.boot_up(bench.node_id), after=on, within=within, requirement="NMT-02")
    settle(bench)
    started = bench.nmt(Nmt.START)
    expect_held_shown(bench, keys, started)
    story.judge("KEY-22", "KEY-01")


@pytest.mark.requirement("KEY-22", "KEY-01")
@pytest.mark.parametrize("moved", ["nothing", "press", "release"])
@pytest.mark.parametrize("command", RESETS, ids=name_of)
def test_keys_are_known_after_a_reset(
    bench: KeypadBench, keys: Keys, command: Nmt, moved: str
) -> None:
    """What is held after a reset is shown, held through it, or moved while the node starts."""
    story = KeyStory.operational(bench, PREFERRED)
    special = bench.profile.commissioning_keys  # all of them at a reset: COM-28
    free = [key for key in keys.names if key not in special] or keys.names
    name, other = free[-1], free[0]
    expect_keys(bench, [name], after=keys.press(name), requirement="KEY-02")
    sent = bench.nmt(command)
    if moved == "press":
        keys.press(other)
    elif moved == "release":
        keys.release()
    within = bench.profile.limits.boot_up_ns
    bench.expect(matchers.boot_up(bench.node_id), after=sent, within=within, requirement="NMT-06")
    settle(bench)
    started = bench.nmt(Nmt.START)
    expect_held_shown(bench, keys, started)
    story.judge("KEY-22", "KEY-01")


@pytest.mark.requirement("KEY-22", "KEY-01", "KEY-07")
def test_key_pressed_just_before_entry_is_shown(bench: KeypadBench, keys: Keys) -> None:
    """A key that is pressed in pre-operational is shown; when it counts is written down."""
    story = KeyStory.begin(bench, {"node_id": 6}, debounce=3)
    keys.press(keys.names[1])
    bench.wait(100 * MS)
    command = bench.nmt(Nmt.START)
    bench.entered(command)
    expect_held_shown(bench, keys, command)
    story.judge("KEY-22", "KEY-01")
    at_once = key_masks(bench, command)[0] == keys.mask
    how = "at once on entry" if at_once else "after the debounce time"
    bench.characteristic("KEY-22", f"a key pressed in pre-operational counts {how}")


@pytest.mark.requirement("KEY-23", "KEY-06")
@pytest.mark.parametrize("apart_ms", [0, 3], ids=["at once", "within a scan"])
def test_keys_that_mature_together(bench: KeypadBench, keys: Keys, apart_ms: int) -> None:
    """All keys pressed together, then released together, are shown in one or several frames."""
    story = KeyStory.operational(bench, PREFERRED)
    count = 0
    for order in (keys.names, tuple(reversed(keys.names))):
        held: list[frozenset[str]] = [frozenset(order[: n + 1]) for n in range(len(order))]
        for sets in (held, [*reversed(held[:-1]), frozenset[str]()]):
            steps = [(n * apart_ms * MS, names) for n, names in enumerate(sets)]
            moments = keys.sequence(steps if apart_ms else [(0, sets[-1])])
            settle(bench)
            masks = key_masks(bench, moments[0])
            count = max(count, len(masks))
            if keys.held or bench.profile.releases_reported:
                text = f"{keys.mask:02X}h is shown in the end; the key frames were {masks}"
                right = masks[-1:] == [keys.mask]
                by = "" if right or keys.held else missed(bench, keys, "KEY-23")
                bench.check(right, text, requirement=by, since=moments[0])
    story.judge("KEY-23", "KEY-06", "KEY-02")
    how = "one frame" if count == 1 else f"up to {count} frames"
    text = f"{len(keys.names)} keys moved {apart_ms} ms apart travel in {how}"
    bench.characteristic("KEY-23", text)


@pytest.mark.requirement("KEY-06", "KEY-07")
def test_remote_request_changes_nothing(bench: KeypadBench, keys: Keys) -> None:
    """A remote frame with the identifier of the key frame is no change of a key."""
    story = KeyStory.operational(bench, PREFERRED)
    expect_keys(bench, keys.names[:1], after=keys.press(keys.names[0]), requirement="KEY-02")
    asked = bench.send(Frame(cobs.KEYS + bench.node_id, dlc=1, remote=True))
    settle(bench)
    expect_masks(bench, [], after=asked)
    story.judge("KEY-06")
