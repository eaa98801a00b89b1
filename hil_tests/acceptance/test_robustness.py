"""Robustness: what is not meant for the node changes nothing, and it sends only its own.

The monitors watch every test; these put the node under what a hostile bus can bring.
"""

from __future__ import annotations

from contextlib import suppress
from itertools import groupby

import pytest

from hil_tests.acceptance.cadence import judge_row, next_beat, some_row
from hil_tests.acceptance.commissioning_steps import (
    expect_period,
    press_and_release,
)
from hil_tests.acceptance.nmt_steps import QUICK
from hil_tests.acceptance.robustness_steps import (
    expect_beats_only,
    expect_obeys,
    garbage,
    obeying,
    services,
    settled,
)
from hil_tests.api import (
    MS,
    BitRate,
    Frame,
    FrameNotCarried,
    KeypadBench,
    Keys,
    Leds,
    Limits,
    Nmt,
    NotRun,
    Power,
    S,
    Seen,
    cobs,
    exactly,
    judge_periodic,
    matchers,
)


def litter(bench: KeypadBench, count: int) -> None:
    """Send garbage, as far as the adapter has a way to send it."""
    for frame in garbage(bench.node_id, count):
        with suppress(FrameNotCarried):
            bench.send(frame)


@pytest.mark.requirement("ROB-01", "ROB-02")
@pytest.mark.parametrize("state", [Nmt.PRE_OPERATIONAL, Nmt.START, Nmt.STOP], ids=lambda c: c.name)
def test_garbage_changes_nothing(bench: KeypadBench, state: Nmt) -> None:
    """Frames of every kind that are not meant for the node leave state, cadence and obedience.

    None of them is answered.
    """
    bench.needs_exclusive()
    bench.start(prefer=QUICK)
    usual = obeying(bench, state)
    began = bench.now()
    quiet = settled(bench, state)
    litter(bench, 2500 if bench.stage.virtual else 150)
    expect_beats_only(bench, quiet)

    expect_obeys(bench, "ROB-01")

    resets = bench.collect(matchers.boot_up(bench.node_id), after=began, until=bench.now())
    bench.check(len(resets) == usual, "it restarted only when it was told to", since=began)


@pytest.mark.requirement("ROB-01", "ROB-02")
def test_every_identifier_changes_nothing(bench: KeypadBench) -> None:
    """A frame of each identifier but those of its services changes nothing and gets no answer."""
    bench.needs_exclusive()
    bench.start(prefer=QUICK)
    obeying(bench)
    quiet = settled(bench, Nmt.START)
    node_id = bench.node_id
    spared = services(node_id) | cobs.device_ids(node_id)
    data = bytes((node_id, 1, 2, 3, 4, 5, 6, 7))
    for can_id in range(1, 0x800):
        if can_id not in spared:
            bench.send(Frame(can_id, data))
        if can_id % 32 == 0:
            bench.wait(MS)  # a wire without bit times would carry them all at once

    expect_beats_only(bench, quiet)
    expect_obeys(bench, "ROB-01")


@pytest.mark.requirement("ROB-01")
def test_parameters_outlast_garbage(bench: KeypadBench, power: Power) -> None:
    """Stored parameters survive garbage, the commissioning message in operation included."""
    bench.needs_exclusive()
    bench.needs_writes("a faulty device may store a 4F8h that it gets in operation")
    bench.start(prefer=QUICK)
    power.off()
    began = bench.boot()
    known = bench.parameters
    if known is None:
        raise NotRun("what the device is commissioned to is not known")
    if known.heartbeat_ns:
        expect_period(bench, began, known, "HB-01")
    stranger = 15 if known.node_id != 15 else 1
    for command in (Nmt.PRE_OPERATIONAL, Nmt.START, Nmt.STOP):
        bench.nmt(command)
        bench.send(Frame(cobs.COMMISSION, bytes((stranger, 3, 1, 0, 0, 9))))
        litter(bench, 100 if bench.stage.virtual else 20)
    bench.wait(bench.profile.limits.store_ns)

    power.off()
    on = power.on()

    within = 2 * bench.profile.limits.boot_up_ns  # how soon is NMT-02
    boot = bench.expect(matchers.of_a_start(known.node_id), after=on, within=within)
    if bench.watch.expected.heartbeat_ns:
        expect_period(bench, boot, known, "ROB-01")


SDO_REQUESTS = (
    "4000100000000000",  # upload of 1000h:00
    "4018100100000000",  # upload of 1018h:01
    "40ffff0000000000",  # upload of an object that nobody has
    "6000000000000000",  # a segment that was never begun
    "8000100000000005",  # abort
    "a000100000000000",  # block upload that was never begun
    "ffffffffffffffff",  # no command at all
    "40001000",  # too short
    "",
)


@pytest.mark.requirement("ROB-01", "ROB-02")
@pytest.mark.parametrize("state", [Nmt.PRE_OPERATIONAL, Nmt.START, Nmt.STOP], ids=lambda c: c.name)
def test_sdo_requests_do_no_harm(bench: KeypadBench, state: Nmt) -> None:
    """SDO requests, answered or not, neither restart the node nor disturb it."""
    bench.start(prefer=QUICK)
    obeying(bench, state)
    quiet = settled(bench, state)
    for request in SDO_REQUESTS:
        bench.send(Frame(0x600 + bench.node_id, bytes.fromhex(request)))
        bench.wait(20 * MS)

    expect_beats_only(bench, quiet, spared=0x580 + bench.node_id)
    expect_obeys(bench, "ROB-01")


@pytest.mark.requirement("ROB-02")
def test_a_whole_life_of_listed_frames(
    bench: KeypadBench, power: Power, keys: Keys, leds: Leds, bitrate: BitRate
) -> None:
    """Through starts, states, keys and LED frames the node sends its listed frames only."""
    bench.fresh(prefer=QUICK)
    for _ in range(2):
        power.off()
        bench.boot()
        bench.enter_operational()
        for name in keys.names[:3]:
            keys.press(name)
            bench.wait(bench.profile.limits.scan_ns + 250 * MS)
        bench.send(Frame(cobs.LED_STEADY + bench.node_id, b"\x05"))
        bench.send(Frame(cobs.LED_BLINK + bench.node_id, b"\x0a"))
        for command in (Nmt.STOP, Nmt.PRE_OPERATIONAL, Nmt.START, Nmt.RESET_COMMUNICATION):
            bench.nmt(command)
            bench.wait(1 * S)
        keys.release()
    # Every frame went through the monitor of listed frames; here is what it was made of.
    allowed = cobs.device_ids(bench.node_id)
    strangers = [
        seen
        for seen in bench.frames_seen()
        if not seen.own and seen.frame.can_id not in allowed and bench.stage.exclusive
    ]
    bench.check(not strangers, "every frame has an identifier of the node")


@pytest.mark.requirement("ROB-02")
@pytest.mark.parametrize("base", [0x080, 0x180, 0x200, 0x300, 0x580, 0x600, 0x700])
def test_remote_frames_are_not_answered(bench: KeypadBench, base: int) -> None:
    """A remote frame for any of the node's identifiers, node guarding included, gets no answer."""
    bench.needs_exclusive()
    bench.operational(prefer=QUICK)
    bench.wait(200 * MS)

    asked = bench.send(Frame(base + bench.node_id, remote=True, dlc=1 if base == 0x700 else 8))

    bench.wait(500 * MS)
    expect_beats_only(bench, asked)


LOADED_S = 20
LOW_PRIORITY = 0x7F0
HIGH_PRIORITY = 0x010


def filler(first: int) -> list[Frame]:
    """Eight-byte frames of eight neighbouring identifiers."""
    return [Frame(first + step, bytes((step * 37 & 0xFF,) * 8)) for step in range(8)]


@pytest.mark.requirement("ROB-03", "HB-04")
@pytest.mark.timed("a wire without arbitration cannot be loaded to a known share")
def test_keeps_its_periods_under_lower_priority_load(bench: KeypadBench, keys: Keys) -> None:
    """At full load by lower-priority frames heartbeat and key frames come as always."""
    bench.operational(bit_rate_code=5, heartbeat_ms=100, debounce=1)
    judge_row(bench, some_row(bench, next_beat(bench, exactly(bench.now()))), "HB-01")
    press_and_release(bench, keys, "KEY-05")  # before the load
    start = bench.now()
    bench.needs_load(filler(LOW_PRIORITY), 1_000_000)

    expect_key_frames(bench, keys)
    bench.wait_until(start + LOADED_S * S)

    beats = bench.collect(matchers.heartbeat(bench.node_id), after=start, until=bench.now())
    expected = bench.watch.expected
    bench.conclude(
        judge_periodic(
            "heartbeat under full load of lower priority",
            [bench.when(beat) for beat in beats],
            expected.heartbeat_each,
            expected.heartbeat_mean,
        )
    )


def expect_key_frames(bench: KeypadBench, keys: Keys) -> list[Seen]:
    """Each key pressed and released is reported, in time, whatever is on the bus."""
    found = []
    limits = bench.profile.limits
    debounce_ns = bench.parameters.debounce_ns if bench.parameters else 0
    latest = debounce_ns + limits.scan_ns + limits.key_frame_ns
    for name in keys.names[:4]:
        moved = keys.press(name)
        found.append(
            bench.expect(
                matchers.key_frame(bench.node_id),
                after=moved,
                within=Limits(at_most_ns=latest),
            )
        )
    keys.release()
    bench.wait(latest)
    return found


@pytest.mark.requirement("ROB-03", "KEY-06")
@pytest.mark.timed("a wire without arbitration cannot be loaded to a known share")
def test_loses_no_key_change_under_higher_priority_load(bench: KeypadBench, keys: Keys) -> None:
    """After full load by higher-priority frames every key change is told, in order."""
    bench.operational(bit_rate_code=3, heartbeat_ms=1000, debounce=1)
    press_and_release(bench, keys, "KEY-05")  # before the load
    bench.wait(400 * MS)
    masks = [0]
    began = bench.now()
    bench.needs_load(filler(HIGH_PRIORITY), 1_000_000)
    for name in keys.names[:4]:
        keys.press(name)
        masks.append(keys.mask)
        bench.wait(400 * MS)
    bench.end_load()

    bench.wait(2 * S)

    frames = bench.collect(matchers.key_frame(bench.node_id), after=began, until=bench.now())
    masks_told = (int.from_bytes(seen.frame.data, "little") for seen in frames)
    told = [mask for mask, _ in groupby(masks_told)]  # that none comes twice is KEY-06
    text = f"the changes {masks[1:]} are told in order; told were {told}"
    bench.check(told == masks[1:], text, since=began)


@pytest.mark.requirement("ROB-03", "HB-01")
@pytest.mark.timed("a wire without arbitration cannot be loaded to a known share")
def test_recovers_after_higher_priority_load(bench: KeypadBench) -> None:
    """When a load of higher priority ends, the node is back in its rhythm and obeys."""
    bench.start(bit_rate_code=3, heartbeat_ms=1000)
    obeying(bench)
    bench.needs_load(filler(HIGH_PRIORITY), 1_000_000)
    bench.wait(5 * S)
    bench.end_load()
    bench.wait(1 * S)

    expect_obeys(bench, "ROB-03")


@pytest.mark.requirement("ROB-04")
def test_error_frames_are_shrugged_off(bench: KeypadBench, keys: Keys) -> None:
    """Error frames at any instant: what the node makes of them is written down."""
    bench.operational(heartbeat_ms=100, debounce=1)
    start = bench.now()
    for step in range(200):
        bench.needs_error_frames()
        bench.wait(17 * MS + step * 13_000)
    alive = bench.first(matchers.heartbeat(bench.node_id), bench.now(), bench.now() + 150 * MS)
    beats = bench.collect(matchers.heartbeat(bench.node_id), after=start, until=bench.now())
    what = f"it went on, {len(beats)} heartbeats in between" if alive else "it fell silent"
    bench.characteristic("ROB-04", f"after 200 error frames {what}")
