"""Which LEDs shine or blink after which frames (LED-01..04, LED-06, LED-20..22)."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from hil_tests.acceptance.led_steps import (
    PREFERRED,
    blink_id,
    expect_lights,
    flicker,
    led_data,
    led_mask,
    no_led_bits,
    set_blinking,
    set_steady,
    settle,
    show_both,
    start_dark,
    steady_id,
)
from hil_tests.acceptance.nmt_steps import RESETS, enter, name_of, repeat
from hil_tests.api import Frame, KeypadBench, Leds, Nmt, NotApplicable, Power, cobs, matchers

LEAVING = (Nmt.STOP, Nmt.PRE_OPERATIONAL)
MAPS = ("steady", "blink")

Lights = Callable[[KeypadBench, list[str]], object]


def leave(bench: KeypadBench, way_out: Nmt) -> None:
    """Out of operational, and long enough for that to have taken effect."""
    enter(bench, cobs.LEADS_TO[way_out])


@pytest.mark.requirement("LED-01", "LED-03")
def test_every_led_alone_is_steady(bench: KeypadBench, leds: Leds) -> None:
    """Each bit of 200h + id by itself lights its LED and no other."""
    start_dark(bench)
    for name in leds.names:
        sent = set_steady(bench, [name])
        expect_lights(bench, leds, on=[name], after=sent)


@pytest.mark.requirement("LED-02", "LED-03")
def test_every_led_alone_blinks(bench: KeypadBench, leds: Leds) -> None:
    """Each bit of 300h + id by itself makes its LED blink and no other."""
    start_dark(bench)
    for name in leds.names:
        sent = set_blinking(bench, [name])
        expect_lights(bench, leds, blink=[name], after=sent)


@pytest.mark.requirement("LED-01")
def test_steady_map_replaces_the_one_before(bench: KeypadBench, leds: Leds) -> None:
    """All on, every other one, the others, none: each frame is the whole map."""
    start_dark(bench)
    for names in (leds.names, leds.names[::2], leds.names[1::2], leds.names, ()):
        sent = set_steady(bench, names)
        expect_lights(bench, leds, on=names, after=sent)


@pytest.mark.requirement("LED-02")
def test_blink_map_replaces_the_one_before(bench: KeypadBench, leds: Leds) -> None:
    """All blinking, every other one, the others, none: each frame is the whole map."""
    start_dark(bench)
    for names in (leds.names, leds.names[::2], leds.names[1::2], leds.names, ()):
        sent = set_blinking(bench, names)
        expect_lights(bench, leds, blink=names, after=sent)


@pytest.mark.requirement("LED-01", "LED-02")
def test_bytes_of_the_source(bench: KeypadBench, leds: Leds) -> None:
    """Node id 10 takes 20Ah#01 and 30Ah#02: the first LED on, the second one blinking."""
    profile = bench.profile
    bits = {bit: name for name, bit in profile.led_bits.items()}
    if profile.led_frame_bytes != 1 or not {0, 1} <= set(bits):
        raise NotApplicable("the profile has other LED maps than the source's keypad")
    start_dark(bench, {"node_id": 10})
    sent = bench.send(Frame(0x200 + bench.node_id, b"\x01"))
    settle(bench)
    expect_lights(bench, leds, on=[bits[0]], after=sent)
    sent = bench.send(Frame(0x300 + bench.node_id, b"\x02"))
    settle(bench)
    expect_lights(
        bench, leds, on=[bits[0]], blink=[bits[1]], after=sent, moved=([bits[1]], "LED-02")
    )


def strange_frames(bench: KeypadBench) -> list[Frame]:
    """Frames that look like LED frames of this node and are none."""
    all_on = led_data(bench, bench.profile.led_bits)
    size = len(all_on)
    other = bench.node_id % 15 + 1
    frames = [Frame(cobs.NMT, bytes((Nmt.START, other)))]
    for base in (cobs.LED_STEADY, cobs.LED_BLINK):
        frames += [
            Frame(base + bench.node_id, remote=True, dlc=size),
            Frame(base + bench.node_id, remote=True, dlc=0),
            Frame(base + bench.node_id, all_on, extended=True),
            Frame((base + bench.node_id) << 18, all_on, extended=True),
            Frame(base + other, all_on),
            Frame(base, all_on),
            Frame(base + 0x080 + bench.node_id, all_on),
        ]
    return frames


@pytest.mark.requirement("LED-01", "LED-02")
def test_frames_that_are_not_for_it_light_nothing(bench: KeypadBench, leds: Leds) -> None:
    """Remote, extended and NMT frames, and LED frames of other nodes, change no LED."""
    bench.needs_exclusive()
    start_dark(bench)
    half, rest = leds.names[::2], leds.names[1::2]
    sent = show_both(bench, leds, half, rest)
    for frame in strange_frames(bench):
        sent = bench.send(frame)
    settle(bench)
    expect_lights(bench, leds, on=half, blink=rest, after=sent)


@pytest.mark.requirement("LED-03")
def test_maps_do_not_touch_each_other(bench: KeypadBench, leds: Leds) -> None:
    """Writing either map leaves the LEDs of the other as they were."""
    start_dark(bench)
    half, rest = leds.names[::2], leds.names[1::2]
    show_both(bench, leds, half, rest)
    sent = set_steady(bench, half[:1])
    expect_lights(bench, leds, on=half[:1], blink=rest, after=sent, moved=(half, "LED-01"))
    sent = set_blinking(bench, rest[:1])
    expect_lights(bench, leds, on=half[:1], blink=rest[:1], after=sent, moved=(rest, "LED-02"))
    sent = set_steady(bench, ())
    expect_lights(bench, leds, blink=rest[:1], after=sent, moved=(half, "LED-01"))
    set_steady(bench, half)
    sent = set_blinking(bench, ())
    expect_lights(bench, leds, on=half, after=sent, moved=(rest, "LED-02"))


@pytest.mark.requirement("LED-03")
def test_each_map_is_kept_beneath_the_other(bench: KeypadBench, leds: Leds) -> None:
    """An LED in both maps goes on with the one that is left when it leaves the other."""
    start_dark(bench)
    name = leds.names[-1]
    sent = set_blinking(bench, [name])
    expect_lights(bench, leds, blink=[name], after=sent, requirement="LED-02")
    set_steady(bench, [name])
    sent = set_steady(bench, ())
    expect_lights(bench, leds, blink=[name], after=sent)
    set_steady(bench, [name])
    sent = set_blinking(bench, ())
    expect_lights(bench, leds, on=[name], after=sent)
    set_blinking(bench, [name])
    sent = set_blinking(bench, ())
    expect_lights(bench, leds, on=[name], after=sent)


@pytest.mark.requirement("LED-01", "LED-02")
def test_hundreds_of_frames_wear_nothing_out(bench: KeypadBench, leds: Leds) -> None:
    """After hundreds of LED frames in one life the next ones light as before."""
    start_dark(bench)

    repeat(bench, flicker(bench))
    last_at = bench.now()
    settle(bench)
    blinks = "blink" in leds.read().values()
    expect_lights(bench, leds, after=last_at, requirement="LED-02" if blinks else "LED-01")

    show_both(bench, leds, leds.names[::2], leds.names[1::2])


@pytest.mark.requirement("LED-04")
@pytest.mark.parametrize("way_out", LEAVING, ids=name_of)
def test_frames_outside_operational_light_nothing(
    bench: KeypadBench, leds: Leds, way_out: Nmt
) -> None:
    """LED frames in pre-operational or stopped do nothing, then or on the next entry."""
    start_dark(bench)
    leave(bench, way_out)
    set_steady(bench, leds.names[::2])
    sent = set_blinking(bench, leds.names[1::2])
    expect_lights(bench, leds, after=sent)
    entered = bench.enter_operational()
    settle(bench)
    expect_lights(bench, leds, after=entered)


@pytest.mark.requirement("LED-04")
def test_frames_before_the_first_start_light_nothing(bench: KeypadBench, leds: Leds) -> None:
    """LED frames to a node that was never started do nothing, and nothing of them stays."""
    bench.start(PREFERRED)
    bench.wait(bench.profile.limits.emcy_ns)
    before = leds.read()
    set_steady(bench, leds.names)
    sent = set_blinking(bench, leds.names)
    lights = leds.read()
    text = f"lights stay {dict(before)}; they are {dict(lights)}"
    bench.check(dict(lights) == dict(before), text, since=sent)
    entered = bench.enter_operational()
    settle(bench)
    if set(before.values()) == {"off"}:  # else it departs from LED-21, and does it its own way
        expect_lights(bench, leds, after=entered)


@pytest.mark.requirement("LED-04")
@pytest.mark.parametrize("way_out", LEAVING, ids=name_of)
def test_frames_outside_operational_put_nothing_out(
    bench: KeypadBench, leds: Leds, way_out: Nmt
) -> None:
    """Empty maps sent in pre-operational or stopped do not change what shines."""
    start_dark(bench)
    half, rest = leds.names[::2], leds.names[1::2]
    set_steady(bench, half)
    set_blinking(bench, rest)
    leave(bench, way_out)
    before = leds.read()
    set_steady(bench, ())
    sent = set_blinking(bench, ())
    after = leds.read()
    text = f"lights stay {dict(before)}; they are {dict(after)}"
    bench.check(dict(before) == dict(after), text, since=sent)


@pytest.mark.requirement("LED-06")
@pytest.mark.parametrize("which", MAPS)
def test_short_frames_are_ignored(bench: KeypadBench, leds: Leds, which: str) -> None:
    """Frames with fewer bytes than the map, none included, change no LED."""
    start_dark(bench)
    on, blink = (leds.names, ()) if which == "steady" else ((), leds.names)
    before = set_steady(bench, on) if which == "steady" else set_blinking(bench, blink)
    requirement = "LED-01" if which == "steady" else "LED-02"
    expect_lights(bench, leds, on, blink, after=before, requirement=requirement)
    can_id = steady_id(bench) if which == "steady" else blink_id(bench)
    sent = bench.now()
    for size in range(bench.profile.led_frame_bytes):
        bench.send(Frame(can_id, bytes(size)))
    settle(bench)
    expect_lights(bench, leds, on, blink, after=sent)


@pytest.mark.requirement("LED-06")
@pytest.mark.parametrize("filling", [0x00, 0xFF], ids=["zeros", "ones"])
def test_extra_bytes_mean_nothing(bench: KeypadBench, leds: Leds, filling: int) -> None:
    """The map stands in the first bytes; what follows, up to eight bytes, is not looked at."""
    size = bench.profile.led_frame_bytes
    if size == 8:
        raise NotApplicable("the map takes all of the frame")
    start_dark(bench)
    half, rest = leds.names[::2], leds.names[1::2]
    show_both(bench, leds, rest, half)
    set_steady(bench, half)
    sent = set_blinking(bench, rest)
    expect_lights(bench, leds, on=half, blink=rest, after=sent, moved=(rest, "LED-02"))
    half, rest = rest, half
    for length in {size + 1, 8}:
        extra = bytes([filling]) * (length - size)
        bench.send(Frame(steady_id(bench), led_data(bench, half) + extra))
        sent = bench.send(Frame(blink_id(bench), led_data(bench, rest) + extra))
        settle(bench)
        expect_lights(bench, leds, on=half, blink=rest, after=sent)
        half, rest = rest, half


@pytest.mark.requirement("LED-06")
def test_bits_without_an_led_mean_nothing(bench: KeypadBench, leds: Leds) -> None:
    """Bits of the maps that belong to no LED light none."""
    spare = no_led_bits(bench)
    if not spare:
        raise NotApplicable("the profile has an LED for every bit")
    start_dark(bench)
    size = bench.profile.led_frame_bytes
    bench.send(Frame(steady_id(bench), spare.to_bytes(size, "little")))
    sent = bench.send(Frame(blink_id(bench), spare.to_bytes(size, "little")))
    settle(bench)
    expect_lights(bench, leds, after=sent)
    both = spare | led_mask(bench, leds.names[:1])
    sent = bench.send(Frame(steady_id(bench), both.to_bytes(size, "little")))
    settle(bench)
    expect_lights(bench, leds, on=leds.names[:1], after=sent)


@pytest.mark.requirement("LED-20")
@pytest.mark.parametrize("first", MAPS)
def test_led_in_both_maps(bench: KeypadBench, leds: Leds, first: str) -> None:
    """An LED in both maps is as the profile says, whichever frame came first."""
    start_dark(bench)
    half = leds.names[::2]
    order = (set_steady, set_blinking) if first == "steady" else (set_blinking, set_steady)
    sent = order[0](bench, half)
    if first == "steady":
        expect_lights(bench, leds, on=half, after=sent, requirement="LED-01")
    else:
        expect_lights(bench, leds, blink=half, after=sent, requirement="LED-02")
    sent = order[1](bench, half)
    steady = bench.profile.both_set == "steady"
    expect_lights(bench, leds, half if steady else (), () if steady else half, after=sent)


@pytest.mark.requirement("LED-21")
@pytest.mark.parametrize("command", RESETS, ids=name_of)
def test_leds_are_off_after_a_reset(bench: KeypadBench, leds: Leds, command: Nmt) -> None:
    """After a reset by command every LED is off, and stays so when the node is started."""
    bench.operational(PREFERRED)
    set_steady(bench, leds.names[::2])
    set_blinking(bench, leds.names[1::2])
    sent = bench.nmt(command)
    boot = bench.expect(
        matchers.boot_up(bench.node_id),
        after=sent,
        within=bench.profile.limits.boot_up_ns,
        requirement="NMT-06",
    )
    bench.wait(bench.profile.limits.emcy_ns)
    expect_lights(bench, leds, after=boot)
    entered = bench.enter_operational()
    settle(bench)
    expect_lights(bench, leds, after=entered)


@pytest.mark.requirement("LED-21")
def test_leds_are_off_after_power_on(bench: KeypadBench, leds: Leds, power: Power) -> None:
    """After each power-on every LED is off, and stays so when the node is started."""
    bench.operational(PREFERRED)
    set_steady(bench, leds.names[::2])
    set_blinking(bench, leds.names[1::2])
    power.off()
    boot = bench.boot()
    bench.wait(bench.profile.limits.emcy_ns)
    expect_lights(bench, leds, after=boot)
    entered = bench.enter_operational()
    settle(bench)
    expect_lights(bench, leds, after=entered)


@pytest.mark.requirement("LED-22", "LED-04")
@pytest.mark.parametrize("way_out", LEAVING, ids=name_of)
def test_leds_on_leaving_are_recorded(bench: KeypadBench, leds: Leds, way_out: Nmt) -> None:
    """Whether the LEDs stay as they are when operational is left is written down."""
    start_dark(bench)
    half, rest = leds.names[::2], leds.names[1::2]
    set_steady(bench, half)
    set_blinking(bench, rest)
    leave(bench, way_out)
    found = dict(leds.read())
    kept = dict.fromkeys(half, "on") | dict.fromkeys(rest, "blink")
    off = dict.fromkeys(leds.names, "off")
    how = "stay as they are" if found == kept else "go off" if found == off else f"are {found}"
    bench.characteristic("LED-22", f"on the command {name_of(way_out)} the LEDs {how}")
    # Whatever they did: in operational a frame is the whole map again.
    bench.enter_operational()
    set_blinking(bench, ())
    show_both(bench, leds, rest, half)
