"""What a node does when it starts, and what makes it operational (NMT-01..03, NMT-20)."""

from __future__ import annotations

import pytest

from hil_tests.acceptance.nmt_steps import QUICK, RESETS, enter, expect_unmoved, name_of
from hil_tests.api import (
    Frame,
    KeypadBench,
    Keys,
    Moment,
    Nmt,
    Power,
    S,
    Seen,
    State,
    cobs,
    matchers,
)

LINGER_NS = 1 * S
"""How long after a start a second boot-up is looked for."""

NOT_STARTED = (State.PRE_OPERATIONAL, State.STOPPED)


def expect_announcement(bench: KeypadBench, start: Moment | Seen) -> Seen:
    """Boot-up, first of all frames of the node, then the EMCY "hardware".

    Returns:
        The boot-up.
    """
    limits, node_id = bench.profile.limits, bench.node_id
    boot = bench.expect(matchers.boot_up(node_id), after=start, within=limits.boot_up_ns)
    bench.expect(matchers.emcy(node_id, code_class=0x50), after=boot, within=limits.emcy_ns)
    return boot


def count_boot_ups(bench: KeypadBench, after: Moment | Seen) -> int:
    """How many boot-ups there were since `after`, a while later."""
    bench.wait(LINGER_NS)
    return len(bench.collect(matchers.boot_up(bench.node_id), after=after, until=bench.now()))


@pytest.mark.requirement("NMT-01")
def test_node_is_pre_operational_after_start(bench: KeypadBench) -> None:
    """After a start without the commissioning keys the heartbeat shows pre-operational."""
    boot = bench.start(QUICK)
    bench.expect_state(State.PRE_OPERATIONAL, after=boot)


@pytest.mark.requirement("NMT-02")
def test_boot_up_comes_first_then_emcy(bench: KeypadBench, power: Power) -> None:
    """After power-on the first frame of the node is boot-up; the EMCY "hardware" follows."""
    bench.fresh(QUICK)
    on = power.on()
    boot = expect_announcement(bench, on)
    own = matchers.any_of(cobs.device_ids(bench.node_id), "frame of the node")
    first = bench.collect(own, after=on, until=bench.now())[0]
    bench.check(
        first.index == boot.index,
        f"the first frame after power-on is boot-up; it was {first.frame}",
        since=on,
    )


@pytest.mark.requirement("NMT-02")
def test_boot_up_comes_once(bench: KeypadBench, power: Power) -> None:
    """There is one boot-up for each power-on, not two."""
    bench.fresh(QUICK)
    on = power.on()
    expect_announcement(bench, on)
    count = count_boot_ups(bench, on)
    bench.check(count == 1, f"one boot-up after power-on; there were {count}", since=on)


@pytest.mark.requirement("NMT-02")
def test_boot_up_is_one_zero_byte(bench: KeypadBench, power: Power) -> None:
    """Boot-up is 0x70X with one byte 00h, X being the node id, as the source writes it."""
    bench.fresh({**QUICK, "node_id": 10})
    on = power.on()
    error_control = matchers.any_of(frozenset((0x700 + bench.node_id,)), "frame 70Xh")
    within = bench.profile.limits.boot_up_ns
    boot = bench.expect(error_control, after=on, within=within)
    wanted = f"70{bench.node_id:X}#00"
    bench.check(str(boot.frame) == wanted, f"boot-up {wanted}; it was {boot.frame}", since=on)


@pytest.mark.requirement("NMT-02")
def test_third_power_on_is_like_the_first(bench: KeypadBench, power: Power) -> None:
    """Each of three power cycles brings one boot-up, then the EMCY."""
    bench.fresh(QUICK)
    for turn in (1, 2, 3):
        on = power.cycle()
        boot = expect_announcement(bench, on)
        bench.expect_state(State.PRE_OPERATIONAL, after=boot, requirement="NMT-01")
        found = bench.collect(matchers.boot_up(bench.node_id), after=on, until=bench.now())
        bench.check(len(found) == 1, f"one boot-up after power-on {turn}; {len(found)}", since=on)


@pytest.mark.requirement("NMT-02", "NMT-06")
def test_third_reset_node_is_like_the_first(bench: KeypadBench) -> None:
    """Each of three commands "reset node" brings one boot-up, then the EMCY."""
    bench.start(QUICK)
    for turn in (1, 2, 3):
        sent = bench.nmt(Nmt.RESET_NODE)
        within = bench.profile.limits.boot_up_ns
        boot_up = matchers.boot_up(bench.node_id)
        bench.expect(boot_up, after=sent, within=within, requirement="NMT-06")
        boot = expect_announcement(bench, sent)
        bench.expect_state(State.PRE_OPERATIONAL, after=boot, requirement="NMT-06")
        found = bench.collect(matchers.boot_up(bench.node_id), after=sent, until=bench.now())
        bench.check(len(found) == 1, f"one boot-up after reset {turn}; {len(found)}", since=sent)


@pytest.mark.requirement("NMT-02", "NMT-06")
@pytest.mark.parametrize("command", RESETS, ids=name_of)
def test_reset_brings_one_boot_up(bench: KeypadBench, command: Nmt) -> None:
    """There is one boot-up for each reset by command, not two."""
    bench.start(QUICK)
    sent = bench.nmt(command)
    within = bench.profile.limits.boot_up_ns
    bench.expect(matchers.boot_up(bench.node_id), after=sent, within=within, requirement="NMT-06")
    count = count_boot_ups(bench, sent)
    bench.check(
        count == 1, f"one boot-up after {name_of(command)}; there were {count}", since=sent
    )


@pytest.mark.requirement("NMT-20", "NMT-02")
def test_emcy_has_the_generic_hardware_code(bench: KeypadBench) -> None:
    """The EMCY of a start is 0050h, generic error set, and five zeros: 50h is the high byte."""
    boot = bench.start({**QUICK, "node_id": 1})
    emcy = bench.expect(
        matchers.emcy(bench.node_id),
        after=boot,
        within=bench.profile.limits.emcy_ns,
        requirement="NMT-02",
    )
    code, register, rest = emcy.frame.data[:2], emcy.frame.data[2], emcy.frame.data[3:]
    bench.check(code == b"\x00\x50", f"error code 5000h; the EMCY is {emcy.frame}", since=boot)
    bench.check(bool(register & 1), f"error register bit 0 is set in {emcy.frame}", since=boot)
    bench.check(rest == bytes(5), f"manufacturer bytes are zero in {emcy.frame}", since=boot)


@pytest.mark.requirement("NMT-03")
@pytest.mark.parametrize("state", NOT_STARTED, ids=name_of)
def test_left_alone_it_does_not_start(bench: KeypadBench, state: State) -> None:
    """Without a command the node stays where it is."""
    bench.start(QUICK)
    sent = enter(bench, state)
    bench.wait(60 * S if bench.stage.virtual else 2 * S)
    expect_unmoved(bench, state, after=sent, by="waiting")


@pytest.mark.requirement("NMT-03")
@pytest.mark.parametrize("state", NOT_STARTED, ids=name_of)
def test_keys_do_not_start_it(bench: KeypadBench, keys: Keys, state: State) -> None:
    """Pressing and releasing keys, one by one and all together, starts nothing."""
    parameters = bench.fresh({**QUICK, "debounce": 1})
    bench.boot()
    sent = enter(bench, state)
    held_ns = parameters.debounce_ns + 2 * bench.profile.limits.scan_ns
    for names in (*([name] for name in keys.names), keys.names):
        keys.hold(*names)
        bench.wait(held_ns)
        keys.release()
        bench.wait(held_ns)
    expect_unmoved(bench, state, after=sent, by="a key")


def traffic_that_starts_nothing(node_id: int) -> tuple[Frame, ...]:
    """Frames to this node and to others that are no NMT frames, however alike."""
    start = bytes((Nmt.START, node_id))
    return (
        Frame(0x200 + node_id, b"\xff"),
        Frame(0x300 + node_id, b"\xff"),
        Frame(0x200 + node_id, start),
        Frame(0x300 + node_id, start),
        Frame(0x001, start),
        Frame(0x080),
        Frame(0x080, b"\x01"),
        Frame(0x100, bytes(6)),
        Frame(0x180 + node_id, dlc=1, remote=True),
        Frame(0x700 + node_id, dlc=1, remote=True),
        Frame(0x77F, b"\x00"),
        Frame(0x77F, b"\x05"),
        Frame(0x4F8, bytes((node_id, Nmt.START, 0, 100, 0, 1))),
        Frame(0x7E5, b"\x04\x00" + bytes(6)),
    )


@pytest.mark.requirement("NMT-03")
@pytest.mark.parametrize("state", NOT_STARTED, ids=name_of)
def test_other_traffic_does_not_start_it(bench: KeypadBench, state: State) -> None:
    """LED frames, SYNC, TIME, requests, heartbeats of others and 4F8h start nothing."""
    bench.needs_exclusive()
    bench.start(QUICK)
    sent = enter(bench, state)
    for frame in traffic_that_starts_nothing(bench.node_id):
        bench.send(frame)
    expect_unmoved(bench, state, after=sent, by="traffic of others")
