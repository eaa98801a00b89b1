"""Steps that the tests of the LEDs share: frames in, light out."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from hil_tests.api import MS, Frame, KeypadBench, Leds, Seen, cobs

PREFERRED: Mapping[str, int] = {"node_id": 6}
"""No node id that a node might assume; right with any parameters."""

LINGER_NS = 100 * MS
"""How much longer than its limit an effect is waited for: late is judged by itself, where the
bench sees when an LED changes."""


def led_mask(bench: KeypadBench, names: Iterable[str]) -> int:
    """The bits of some LEDs."""
    return sum(1 << bench.profile.led_bits[name] for name in set(names))


def led_data(bench: KeypadBench, names: Iterable[str]) -> bytes:
    """The map of some LEDs, as long as the profile says, first byte lowest."""
    return led_mask(bench, names).to_bytes(bench.profile.led_frame_bytes, "little")


def settle(bench: KeypadBench) -> None:
    """Wait until an LED frame must have taken effect, and a while longer."""
    bench.wait(bench.profile.limits.led_ns + LINGER_NS)


def start_dark(bench: KeypadBench, prefer: Mapping[str, int] = PREFERRED) -> None:
    """Operational, both maps empty: what LEDs show after a start is our own reading (LED-21)."""
    bench.operational(prefer)
    bench.send(Frame(steady_id(bench), led_data(bench, ())))
    bench.send(Frame(blink_id(bench), led_data(bench, ())))
    settle(bench)


def steady_id(bench: KeypadBench) -> int:
    """COB-ID of the map of steady LEDs."""
    return cobs.LED_STEADY + bench.node_id


def blink_id(bench: KeypadBench) -> int:
    """COB-ID of the map of blinking LEDs."""
    return cobs.LED_BLINK + bench.node_id


def set_steady(bench: KeypadBench, names: Iterable[str]) -> Seen:
    """Exactly these LEDs are on, by 200h + id; waits for the effect."""
    sent = bench.send(Frame(steady_id(bench), led_data(bench, names)))
    settle(bench)
    return sent


def set_blinking(bench: KeypadBench, names: Iterable[str]) -> Seen:
    """Exactly these LEDs blink, by 300h + id; waits for the effect."""
    sent = bench.send(Frame(blink_id(bench), led_data(bench, names)))
    settle(bench)
    return sent


def show_both(bench: KeypadBench, leds: Leds, on: Sequence[str], blink: Sequence[str]) -> Seen:
    """Both maps in use, each seen to work before it is looked at with the other."""
    sent = set_steady(bench, on)
    expect_lights(bench, leds, on=on, after=sent, requirement="LED-01")
    sent = set_blinking(bench, blink)
    expect_lights(bench, leds, on=on, blink=blink, after=sent, moved=(blink, "LED-02"))
    return sent


def expect_lights(
    bench: KeypadBench,
    leds: Leds,
    on: Iterable[str] = (),
    blink: Iterable[str] = (),
    *,
    after: Seen | int,
    requirement: str = "",
    moved: tuple[Iterable[str], str] | None = None,
) -> None:
    """Exactly these LEDs shine, exactly these blink, all others are off.

    Args:
        bench: the bench.
        leds: its LEDs.
        on: that shine.
        blink: that blink.
        after: what led to that.
        requirement: that it is so.
        moved: the LEDs that the last map was about, and the requirement that it moves them;
            where others are wrong that is LED-03.
    """
    wanted = dict.fromkeys(leds.names, "off")
    wanted |= dict.fromkeys(on, "on") | dict.fromkeys(blink, "blink")
    found = leds.read()
    wrong = [
        f"{name} is {found.get(name, 'not there')}, not {light}"
        for name, light in wanted.items()
        if found.get(name) != light
    ]
    if moved is not None:
        names, requirement = moved
        others = set(wanted) - set(names)
        if any(found.get(name) != wanted[name] for name in others):
            requirement = "LED-03"
    text = f"lights: {_show(wanted)}" + (f"; {', '.join(wrong)}" if wrong else "")
    bench.check(not wrong, text, requirement=requirement, since=after)


def _show(lights: Mapping[str, str]) -> str:
    parts = [
        f"{light}: {', '.join(names)}"
        for light in ("on", "blink")
        if (names := [name for name, now in lights.items() if now == light])
    ]
    return "; ".join(parts) or "all off"


def flicker(bench: KeypadBench) -> list[Frame]:
    """Both maps full, then both empty."""
    maps = (led_data(bench, bench.profile.led_bits), led_data(bench, ()))
    return [Frame(base, data) for data in maps for base in (steady_id(bench), blink_id(bench))]


def no_led_bits(bench: KeypadBench) -> int:
    """The bits of the map that belong to no LED."""
    every = (1 << 8 * bench.profile.led_frame_bytes) - 1
    return every & ~led_mask(bench, bench.profile.led_bits)
