"""The NMT slave and its boot-up (CiA 301 4.2.0, 7.2.8.3 and 7.3.2)."""

from __future__ import annotations

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from hil_tests.acceptance.cia301.steps import (
    DEVICE_TYPE,
    IDENTITY,
    PRODUCER,
    beats,
    changeable_setting,
    enter,
    go,
    needs_writable,
    quick,
    reset,
)
from hil_tests.acceptance.nmt_steps import COMMAND_TO, RUNNING_STATES, name_of
from hil_tests.api import (
    MS,
    Cia301Bench,
    Frame,
    Nmt,
    Power,
    S,
    Sdo,
    Sheet,
    State,
    cobs,
    matchers,
    nmt_frame,
    number,
    sdo_frames,
)

LINGER_NS = 1 * S
"""How long after a start a second boot-up is looked for."""

EARLY_NS = 10 * MS
"""So long before a boot-up a device is still starting for sure."""

UNDEFINED = (0x00, 0x03, 0x7F, 0x83, 0xFF)
COMMANDS = tuple(COMMAND_TO.values())


@pytest.mark.requirement("C-NMT-01", "C-NMT-13", "C-NMT-02", "C-NMT-20")
def test_power_on_brings_one_boot_up_first_of_all(bench: Cia301Bench, power: Power) -> None:
    """One byte 00h, no second one, and nothing before it."""
    bench.fresh()
    on = power.on()
    boot = bench.expect_boot_up(on)
    bench.wait(LINGER_NS)
    frames = bench.collect(matchers.anything(), after=on, until=bench.now())
    own = [seen for seen in frames if seen.frame.can_id & 0x7F == bench.node_id]
    text = f"boot-up is the first frame; {own[0].frame} was"
    bench.check(own[0].index == boot.index, text, requirement="C-NMT-02")
    count = sum(seen.frame == boot.frame for seen in own)
    bench.check(count == 1, f"one boot-up; there were {count}", requirement="C-NMT-13")


@pytest.mark.requirement("C-NMT-01")
def test_it_is_pre_operational_after_its_boot_up(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet
) -> None:
    """As the heartbeat shows."""
    boot = quick(bench, sdo, sheet)
    bench.expect_state(State.PRE_OPERATIONAL, after=boot)


@pytest.mark.requirement("C-NMT-03", "C-NMT-02")
def test_what_comes_before_the_boot_up_has_no_effect(
    bench: Cia301Bench, sdo: Sdo, power: Power, sheet: Sheet
) -> None:
    """Commands and requests while it starts: no answer, and it is pre-operational then.

    A command that nobody acknowledges goes on trying, and comes once the device is there.
    """
    needs_writable(sheet, (PRODUCER, 0))
    bench.fresh()
    on = power.on()
    if bench.first(matchers.boot_up(bench.node_id), on, bench.now() + 1 * MS):
        return  # a device that starts at once leaves no time for it
    start = nmt_frame(Nmt.START, bench.node_id)
    bench.post(start)
    bench.post(Frame(0x600 + bench.node_id, sdo_frames.read(DEVICE_TYPE, 0)))
    boot = bench.expect_boot_up(on)
    early = bench.collect(matchers.cob(0x580 + bench.node_id), after=on, until=bench.now())
    before = [seen for seen in early if seen.index < boot.index]
    bench.check(not before, "no SDO answer comes before the boot-up", requirement="C-NMT-02")
    own = (seen for seen in bench.frames_seen() if seen.own and seen.frame == start)
    if any(seen.at + EARLY_NS < boot.wanted.earliest for seen in own):
        beats(sdo)
        now = bench.now()
        bench.expect_state(State.PRE_OPERATIONAL, after=now, requirement="C-NMT-03")


@pytest.mark.requirement("C-NMT-04", "C-NMT-05", "C-NMT-21")
@pytest.mark.parametrize("start", RUNNING_STATES, ids=name_of)
@pytest.mark.parametrize("target", RUNNING_STATES, ids=name_of)
def test_every_command_leads_from_every_state(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, start: State, target: State
) -> None:
    """All nine pairs, a state to itself included."""
    quick(bench, sdo, sheet)
    enter(bench, start)
    command = bench.nmt(COMMAND_TO[target])
    bench.expect_state(target, after=command, requirement="C-NMT-05")


@pytest.mark.requirement("C-NMT-06")
def test_node_id_0_is_for_every_node(bench: Cia301Bench, sdo: Sdo, sheet: Sheet) -> None:
    """Start, stop and pre-operational to all."""
    bench.needs_exclusive()
    quick(bench, sdo, sheet)
    for state in (State.OPERATIONAL, State.STOPPED, State.PRE_OPERATIONAL):
        command = bench.nmt(COMMAND_TO[state], 0)
        bench.expect_state(state, after=command)


def other_ids(node_id: int) -> list[int]:
    """Node ids that the device has not, some of them a single bit away."""
    near = {node_id ^ 1 << bit for bit in range(8)} | {0x7F, 0xFF}
    return sorted(near - {0, node_id})


@pytest.mark.requirement("C-NMT-07")
def test_a_command_for_another_node_changes_nothing(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet
) -> None:
    """Every command, with node ids a bit away from its own."""
    bench.needs_exclusive()
    quick(bench, sdo, sheet)
    enter(bench, State.STOPPED)
    since = bench.now()
    for other in other_ids(bench.node_id):
        for command in Nmt:
            bench.send(Frame(0, bytes((command, other))))
    unmoved(bench, State.STOPPED, since=since)


def unmoved(bench: Cia301Bench, state: State, *, since: int, requirement: str = "") -> None:
    """Since then every heartbeat shows a state, one more does, and nothing rebooted."""
    bench.wait(3 * (bench.watch.expected.heartbeat_ns or 0))
    error_control = matchers.cob(cobs.ERROR_CONTROL + bench.node_id)
    frames = bench.collect(error_control, after=since, until=bench.now())
    told = {seen.frame.data for seen in frames if seen.at > since}
    wrong = [data.hex() for data in told if data != bytes((state.value,))]
    text = f"the state is still {state}; the error control shows {wrong}"
    strange = told - {bytes((one.value,)) for one in RUNNING_STATES} - {b"\x00"}
    requirement = "C-HB-02" if strange else requirement
    bench.check(bool(told) and not wrong, text, requirement=requirement)


@pytest.mark.requirement("C-NMT-08")
@pytest.mark.parametrize("state", RUNNING_STATES, ids=name_of)
def test_an_undefined_command_changes_nothing(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, state: State
) -> None:
    """00h, 03h, 7Fh, 83h and FFh."""
    quick(bench, sdo, sheet)
    enter(bench, state)
    since = bench.now()
    for command in UNDEFINED:
        bench.send(Frame(0, bytes((command, bench.node_id))))
    unmoved(bench, state, since=since)


@pytest.mark.requirement("C-NMT-09")
def test_what_it_makes_of_other_lengths_is_written_down(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet
) -> None:
    """NMT frames of three and eight bytes."""
    bench.needs_exclusive()
    quick(bench, sdo, sheet)
    enter(bench, State.PRE_OPERATIONAL)
    for rest in (bytes(1), bytes(6)):
        bench.send(Frame(0, bytes((Nmt.STOP, bench.node_id)) + rest))
        obeys = bench.shown_state(bench.now()) is State.STOPPED
        told = "is obeyed" if obeys else "is ignored"
        bench.characteristic("C-NMT-09", f"a command of {2 + len(rest)} bytes {told}")
        go(bench, State.PRE_OPERATIONAL)


@pytest.mark.requirement("C-NMT-10")
def test_remote_and_29_bit_frames_command_nothing(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet
) -> None:
    """Identifier 0 in a remote frame and in a 29-bit frame with a command."""
    bench.needs_exclusive()
    quick(bench, sdo, sheet)
    enter(bench, State.PRE_OPERATIONAL)
    since = bench.now()
    bench.send(Frame(0, remote=True, dlc=2))
    bench.send(Frame(0, bytes((Nmt.STOP, bench.node_id)), extended=True))
    unmoved(bench, State.PRE_OPERATIONAL, since=since)


@pytest.mark.requirement("C-NMT-11", "C-NMT-12", "C-NMT-13")
@pytest.mark.parametrize("command", cobs.RESETS, ids=name_of)
def test_a_reset_brings_back_the_power_on_values(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, command: Nmt
) -> None:
    """What was written to objects of communication is gone; one that is kept is noted."""
    needs_writable(sheet, (PRODUCER, 0))
    bench.start()
    before = {place: sdo.read(*place) for place in changeable(sheet)}
    for (index, sub), data in before.items():
        changed = number(data) ^ 0x40
        sdo.write(index, sub, changed.to_bytes(len(data), "little"))
    reset(bench, command)
    for (index, sub), data in before.items():
        found = sdo.read(index, sub)
        text = f"{index:04X}h:{sub:02X} is {data.hex()} after {name_of(command)}; {found.hex()}"
        if command is Nmt.RESET_NODE:
            bench.check(found == data, text, requirement="C-NMT-11")
        elif found == data:
            bench.check(True, text, requirement="C-NMT-12")
        else:
            bench.characteristic("C-NMT-12", f"kept over reset communication: {text}")


def changeable(sheet: Sheet) -> list[tuple[int, int]]:
    """Objects of communication that can be written and do nothing meanwhile."""
    wanted = ((PRODUCER, 0), (0x100C, 0), (0x100D, 0), (0x1015, 0))
    objects = ((place, sheet.get(*place)) for place in wanted)
    return [place for place, one in objects if one is not None and one.writable]


@pytest.mark.requirement("C-NMT-11", "C-NMT-12")
@pytest.mark.parametrize("command", cobs.RESETS, ids=name_of)
def test_what_a_reset_does_to_the_application(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, command: Nmt
) -> None:
    """Reset node brings back its power-on values, reset communication leaves it alone."""
    bench.needs_writes("an application object is written")
    one, other = changeable_setting(sheet)
    place = (one.index, one.sub)
    bench.start()
    before = sdo.read(*place)
    with sdo.kept(place):
        sdo.write(*place, other)
        reset(bench, command)
        found = sdo.read(*place)
        wanted, rule = (before, "C-NMT-11") if command is Nmt.RESET_NODE else (other, "C-NMT-12")
        text = f"{one.place} is {wanted.hex()} after {name_of(command)}; it is {found.hex()}"
        bench.check(found == wanted, text, requirement=rule)


@pytest.mark.requirement("C-NMT-13", "C-NMT-20")
@pytest.mark.parametrize("command", cobs.RESETS, ids=name_of)
@pytest.mark.parametrize("state", RUNNING_STATES, ids=name_of)
def test_a_reset_brings_one_boot_up_in_time(
    bench: Cia301Bench, command: Nmt, state: State
) -> None:
    """From every state, and no second one."""
    bench.start()
    go(bench, state)
    since = bench.now()
    reset(bench, command)
    bench.wait(LINGER_NS)
    boot_up = matchers.boot_up(bench.node_id)
    count = len(bench.collect(boot_up, after=since, until=bench.now()))
    bench.check(count == 1, f"one boot-up; there were {count}", requirement="C-NMT-13")


@pytest.mark.requirement("C-NMT-14", "C-NMT-15")
@pytest.mark.parametrize("state", [State.PRE_OPERATIONAL, State.OPERATIONAL], ids=name_of)
def test_sdo_is_served_where_it_must_be(bench: Cia301Bench, sdo: Sdo, state: State) -> None:
    """In pre-operational and operational."""
    rule = "C-NMT-15" if state is State.OPERATIONAL else "C-NMT-14"
    bench.start()
    go(bench, state)
    sdo.read(DEVICE_TYPE, requirement=rule)
    sdo.read(IDENTITY, 1, requirement=rule)


@pytest.mark.requirement("C-NMT-14")
def test_pre_operational_knows_no_pdo(bench: Cia301Bench) -> None:
    """SYNC and remote requests lead to no PDO there."""
    bench.needs_exclusive()
    bench.start()
    node_id = bench.node_id
    first = bench.send(Frame(0x080))
    for base in (0x180, 0x280, 0x380, 0x480):
        bench.send(Frame(base + node_id, remote=True, dlc=8))
    bench.send(Frame(0x080))
    bench.wait(200 * MS)
    pdos = frozenset(base + node_id for base in (0x180, 0x280, 0x380, 0x480))
    bench.never(matchers.any_of(pdos, "a PDO"), after=first, for_ns=200 * MS)


@pytest.mark.requirement("C-NMT-16")
def test_stopped_is_silent_but_for_error_control(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet
) -> None:
    """Requests and SYNC bring nothing, not even an abort; the heartbeat goes on."""
    bench.needs_exclusive()
    quick(bench, sdo, sheet)
    first = enter(bench, State.STOPPED)
    bench.wait(bench.profile.limits.command_ns)
    since = bench.now()
    sdo.silence(sdo_frames.read(DEVICE_TYPE, 0))
    sdo.silence(sdo_frames.read(0x5FFF, 0))
    bench.send(Frame(0x080))
    bench.wait(500 * MS)
    frames = bench.collect(matchers.anything(), after=since, until=bench.now())
    beat = cobs.ERROR_CONTROL + bench.node_id
    others = [str(seen.frame) for seen in frames if seen.frame.can_id != beat]
    told = f"in stopped nothing but the heartbeat is sent; there was {others[:3]}"
    bench.check(not others, told, since=first)


@pytest.mark.requirement("C-NMT-17")
def test_a_transfer_that_stop_cut_off_is_not_resumed(bench: Cia301Bench, sdo: Sdo) -> None:
    """Back in pre-operational the next segment belongs to no transfer, and a new one works."""
    bench.start()
    answer = sdo.ask(sdo_frames.read(0x1008, 0))
    go(bench, State.STOPPED)
    go(bench, State.PRE_OPERATIONAL)
    if answer[0] & 0xF2 == 0x40:
        segment = sdo.offer(sdo_frames.read_segment(0))
        text = f"no segment of the old transfer comes; {(segment or b'').hex(' ')} did"
        bench.check(segment is None or segment[0] == 0x80, text)
    sdo.read(DEVICE_TYPE)


@pytest.mark.requirement("C-NMT-19")
def test_it_does_not_start_by_itself(bench: Cia301Bench, sdo: Sdo, sheet: Sheet) -> None:
    """Left alone it stays pre-operational, unless 1F80h says otherwise."""
    quick(bench, sdo, sheet)
    since = bench.now()
    if sheet.get(0x1F80) is not None and not sdo.number(0x1F80) & 0x04:
        bench.characteristic("C-NMT-19", "1F80h allows the device to start by itself")
        return
    bench.wait(60 * S if bench.stage.virtual else 2 * S)
    unmoved(bench, State.PRE_OPERATIONAL, since=since)


@pytest.mark.requirement("C-NMT-21")
def test_a_command_acts_in_time(bench: Cia301Bench, sdo: Sdo) -> None:
    """After the limit SDO is alive again, each time that stopped is left."""
    bench.start()
    for _ in range(5):
        go(bench, State.STOPPED)
        bench.nmt(Nmt.PRE_OPERATIONAL)
        bench.wait(bench.profile.limits.command_ns)
        sdo.read(DEVICE_TYPE, requirement="C-NMT-21")


commands = st.lists(st.sampled_from(COMMANDS), min_size=1, max_size=12)


@pytest.mark.requirement("C-NMT-22")
@given(burst=commands)
@example(burst=[Nmt.START, Nmt.STOP, Nmt.PRE_OPERATIONAL])
@example(burst=[Nmt.STOP, Nmt.START])
def test_a_burst_ends_where_its_last_command_leads(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, burst: list[Nmt]
) -> None:
    """Commands back to back, the last one wins."""
    bench.begin_example()
    quick(bench, sdo, sheet)
    sent = [bench.nmt(command) for command in burst]
    bench.expect_state(cobs.LEADS_TO[burst[-1]], after=sent[-1])
    bench.check_monitors()


@pytest.mark.requirement("C-NMT-15")
def test_operational_serves_error_control_and_sdo_at_once(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet
) -> None:
    """The heartbeat shows 05h while SDO reads and writes."""
    quick(bench, sdo, sheet)
    enter(bench, State.OPERATIONAL)
    beats(sdo, 50)
    bench.expect_state(State.OPERATIONAL, after=bench.now())
