"""What is stored, what is refused, and what a power cut leaves behind.

Source: keypad specification, "Inizializzazione", and readings of ours where it is silent.
"""

from __future__ import annotations

import attrs
import pytest

from hil_tests.acceptance.commissioning_steps import (
    EXAMPLE,
    OTHER,
    answer,
    boots_as,
    expect_period,
    expect_report,
    waiting,
)
from hil_tests.api import (
    ECHO_PERIOD_NS,
    MS,
    BitRate,
    Frame,
    KeypadBench,
    Keys,
    Nmt,
    Parameters,
    Power,
    Seen,
    cobs,
    matchers,
    payload,
)


@pytest.mark.requirement("COM-21")
def test_only_the_first_message_counts(
    bench: KeypadBench, power: Power, keys: Keys, bitrate: BitRate
) -> None:
    """A second 4F8h changes neither the echo nor the memory."""
    bench.fresh()
    bench.enter_commissioning()
    echo = bench.expect_echo(bench.request(EXAMPLE), payload(EXAMPLE))
    bench.wait(250 * MS)

    second = bench.request(OTHER)
    for node_id in (10, 11, 12):  # and a third, and more
        bench.request(attrs.evolve(OTHER, node_id=node_id))

    after = bench.collect(matchers.echo(), after=echo, until=second.at)[-1]
    later = bench.beats(matchers.echo(), 5, after=second, patience_ns=3 * ECHO_PERIOD_NS)
    same = bool(later) and all(seen.frame == after.frame for seen in later)
    bench.check(same, "the echo stays what it was", since=second)
    bench.wait(bench.profile.limits.store_ns)
    bench.leave_commissioning(EXAMPLE)
    others = (OTHER.node_id, 10, 11, 12)
    boot = boots_as(bench, EXAMPLE, "COM-06", others, "COM-21")
    expect_period(bench, boot, EXAMPLE, "COM-06")


@pytest.mark.requirement("COM-22")
@pytest.mark.parametrize("node_id", [0, 16, 17, 31, 127, 128, 255])
def test_impossible_node_ids_are_ignored(
    bench: KeypadBench, power: Power, keys: Keys, bitrate: BitRate, node_id: int
) -> None:
    """A 4F8h with a node id outside 1..15 gets no echo; the node goes on waiting."""
    bench.fresh()
    waiting(bench)

    request = bench.request(attrs.evolve(OTHER, node_id=node_id))

    bench.never(matchers.anything(), after=request, for_ns=500 * MS)
    bench.expect_echo(bench.request(EXAMPLE), payload(EXAMPLE))


@pytest.mark.requirement("COM-22", "COM-29")
def test_impossible_node_id_is_not_stored(
    bench: KeypadBench, power: Power, keys: Keys, bitrate: BitRate
) -> None:
    """After a refused 4F8h the old parameters are used at the next start."""
    before = bench.fresh(prefer={"heartbeat_ms": 100})
    expect_period(bench, bench.boot(), before, "HB-01")
    bench.enter_commissioning()
    for node_id in (0, 16, 255):
        bench.request(attrs.evolve(OTHER, node_id=node_id))
    bench.wait(bench.profile.limits.store_ns)

    bench.leave_unknown(before.bit_rate)  # what it keeps is the question

    boot = boots_as(bench, before, "COM-22", sure=False)
    expect_period(bench, boot, before, "COM-22")


WRONG_FRAMES = {
    **{f"{size}-bytes": Frame(cobs.COMMISSION, payload(OTHER)[:size]) for size in range(6)},
    "remote-6": Frame(cobs.COMMISSION, remote=True, dlc=6),
    "remote-8": Frame(cobs.COMMISSION, remote=True, dlc=8),
    "extended": Frame(cobs.COMMISSION, payload(OTHER), extended=True),
    "extended-base-part": Frame(cobs.COMMISSION << 18, payload(OTHER), extended=True),
}


@pytest.mark.requirement("COM-24")
@pytest.mark.parametrize("frame", WRONG_FRAMES.values(), ids=WRONG_FRAMES.keys())
def test_malformed_messages_are_ignored(
    bench: KeypadBench, power: Power, keys: Keys, bitrate: BitRate, frame: Frame
) -> None:
    """A short, remote or extended 4F8h is ignored; the right one is still waited for."""
    bench.fresh()
    waiting(bench)
    bench.tolerate_missing_boot_up()  # an echo would be held against COM-01, a must

    sent = bench.offer(frame)

    bench.never(matchers.anything(), after=sent, for_ns=500 * MS)
    bench.expect_echo(bench.request(EXAMPLE), payload(EXAMPLE))


@pytest.mark.requirement("COM-24")
@pytest.mark.parametrize("extra", ["00", "ffff"], ids=["7-bytes", "8-bytes"])
def test_bytes_past_the_sixth_mean_nothing(
    bench: KeypadBench, power: Power, keys: Keys, bitrate: BitRate, extra: str
) -> None:
    """A longer 4F8h is taken; what stands past the sixth byte changes nothing."""
    bench.fresh()
    bench.enter_commissioning()

    request = bench.request(payload(EXAMPLE) + bytes.fromhex(extra))

    answer(bench, request, payload(EXAMPLE), "COM-24")
    bench.wait(bench.profile.limits.store_ns)
    bench.leave_commissioning(EXAMPLE)
    boots_as(bench, EXAMPLE, "COM-06")


FIRST = Parameters(3, 3, 100, 1, 1)
SECOND = Parameters(12, 3, 200, 2, 2)
"""Two sets that share the bit rate, so that either is heard, and nothing else."""

CUT_IN_THE_MIDST_NS = 20 * MS
"""After 4F8h; sooner than most memories hold six bytes."""

CUTS_REAL = (0, 5, 20, 60, 150, 500)
CUTS_VIRTUAL = range(0, 200, 1)


@pytest.mark.requirement("COM-26", "COM-06")
def test_power_cut_while_storing(
    bench: KeypadBench, power: Power, keys: Keys, bitrate: BitRate
) -> None:
    """Power cut at any instant of storing leaves the old set or the new set, never a mixture."""
    bench.fresh()
    for whole in (FIRST, SECOND):  # each by itself, as it must be found again
        bench.commission(whole)
        boot = boots_as(bench, whole, "COM-06")
        expect_period(bench, boot, whole, "COM-09")
        bench.enter_operational()
        bench.wait(bench.profile.limits.command_ns)
        expect_report(bench, keys, keys.press(keys.names[0]), "COM-10")
        keys.release()
    found = SECOND
    for cut_ms in CUTS_VIRTUAL if bench.stage.virtual else CUTS_REAL:
        keys.release()
        bench.enter_commissioning()
        request = bench.request(SECOND if found == FIRST else FIRST)
        bench.wait_until(request.at + cut_ms * MS)
        bench.leave_unknown(FIRST.bit_rate)
        found, boot = boots_as_either(bench, power)
        expect_whole_set(bench, keys, found, boot, cut_ms)


def boots_as_either(bench: KeypadBench, power: Power) -> tuple[Parameters, Seen]:
    """A regular start shows which of the two sets is stored: that set, and the boot-up."""
    on = power.on()
    either = matchers.any_of(
        frozenset(cobs.ERROR_CONTROL + each.node_id for each in (FIRST, SECOND)),
        "boot-up of the old or the new node id",
    )
    within = 2 * bench.profile.limits.boot_up_ns
    boot = bench.expect(either, after=on, within=within, requirement="COM-26")
    found = FIRST if boot.frame.can_id == cobs.ERROR_CONTROL + FIRST.node_id else SECOND
    bench.suppose(found)
    return found, boot


def expect_whole_set(
    bench: KeypadBench, keys: Keys, found: Parameters, boot: Seen, cut_ms: int
) -> None:
    """Heartbeat and debounce time belong to the node id that booted."""
    expect_period(bench, boot, found, "COM-26")
    bench.entered(bench.nmt(Nmt.START))
    bench.wait(bench.profile.limits.command_ns)
    expect_report(bench, keys, keys.press(keys.names[0]), "COM-26")
    whole = f"cut {cut_ms} ms after 4F8h: node {found.node_id} with its own times"
    bench.check(fact=True, text=whole, requirement="COM-26")


@pytest.mark.requirement("COM-29", "COM-26")
def test_storing_that_was_cut_is_not_resumed(
    bench: KeypadBench, power: Power, keys: Keys, bitrate: BitRate
) -> None:
    """What a power cut left of storing is not completed in a later wait without 4F8h."""
    bench.fresh()
    bench.commission(FIRST)
    boots_as(bench, FIRST, "COM-06")
    bench.enter_commissioning()
    request = bench.request(SECOND)
    bench.wait_until(request.at + CUT_IN_THE_MIDST_NS)
    bench.leave_unknown(FIRST.bit_rate)
    found, _ = boots_as_either(bench, power)

    bench.enter_commissioning()
    bench.wait(bench.profile.limits.store_ns)
    bench.leave_unknown(FIRST.bit_rate)

    again, boot = boots_as_either(bench, power)
    text = f"node {found.node_id} after the cut is node {found.node_id} after a wait"
    bench.check(again == found, f"{text}; it is {again.node_id}", since=boot)


@pytest.mark.requirement("COM-29")
def test_wait_without_message_changes_nothing(
    bench: KeypadBench, power: Power, keys: Keys, bitrate: BitRate
) -> None:
    """Power off in the wait, without a valid 4F8h, leaves the stored parameters as they were."""
    before = bench.fresh(prefer={"heartbeat_ms": 100})
    expect_period(bench, bench.boot(), before, "HB-01")
    bench.enter_commissioning()

    bench.leave_unknown(before.bit_rate)  # what it keeps is the question

    boot = boots_as(bench, before, "COM-29", sure=False)
    expect_period(bench, boot, before, "COM-29")
