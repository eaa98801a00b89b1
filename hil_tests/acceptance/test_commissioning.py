"""Commissioning: powered up with two keys held, the node takes its parameters from one frame.

Source: keypad specification, "Inizializzazione". Each test leaves the device commissioned
to something else; the bench puts the old parameters back before they matter again.
"""

from __future__ import annotations

import attrs
import pytest

from hil_tests.api import (
    ECHO_PERIOD_NS,
    MS,
    Bench,
    BitRate,
    Frame,
    Keys,
    Limits,
    Nmt,
    Parameters,
    Power,
    S,
    Seen,
    around,
    cobs,
    judge_periodic,
    matchers,
    nmt_frame,
    payload,
)

EXAMPLE = Parameters(5, 3, 100, 0, 1)
"""Node 5, 125 kbit/s, heartbeat 100 ms, debounce 100 ms."""

OTHER = Parameters(9, 3, 250, 7, 2)
"""Differs from the example in everything but the bit rate."""

AT_125_KBIT = 3
"""Stored where silence is to be heard: a node that started regularly would speak there."""

NAMED_RATES = {1: 500_000, 2: 250_000, 3: 125_000, 4: 100_000, 5: 50_000, 6: 20_000}
SOME_OTHER_CODES = (0, 7, 8, 128, 255)


def first_echo(bench: Bench, request: Seen, parameters: bytes) -> Seen:
    """The first echo, in time."""
    return bench.expect(
        matchers.echo(parameters),
        after=request,
        within=ECHO_PERIOD_NS + bench.profile.limits.echo_each_ns,
        requirement="COM-05",
    )


def expect_echoes(bench: Bench, since: Seen, parameters: bytes, count: int) -> list[Seen]:
    """The next echoes, all with these parameters and in their rhythm."""
    limits = bench.profile.limits
    echoes = bench.beats(
        matchers.echo(parameters), count, after=since, patience_ns=3 * ECHO_PERIOD_NS
    )
    bench.check(len(echoes) == count, f"{count} more echoes come", requirement="COM-05", since=since)
    verdict = judge_periodic(
        "echo 3F8h",
        [bench.when(echo) for echo in (since, *echoes)],
        Limits(*limits.echo_each()),
        Limits(*limits.echo_mean()),
        "COM-05",
    )
    if count > 20:  # noqa: PLR2004  fewer allow no verdict on the mean
        bench.conclude(verdict, since)
    return echoes


def boots_as(bench: Bench, parameters: Parameters, requirement: str) -> Seen:
    """A regular start shows the node id and, being heard at all, the bit rate."""
    if bench.power is None:  # pragma: no cover - commissioning was possible
        pytest.fail("commissioning without Power")
    on = bench.power.on()
    return bench.expect(
        matchers.boot_up(parameters.node_id),
        after=on,
        within=bench.profile.limits.boot_up_ns,
        requirement=requirement,
    )


def expect_period(bench: Bench, boot: Seen, parameters: Parameters, requirement: str) -> None:
    """Two heartbeats follow boot-up, the period apart."""
    limits = bench.watch.expected.heartbeat_each
    beat = matchers.heartbeat(parameters.node_id)
    first = bench.expect(beat, after=boot, within=limits.at_most_ns, requirement=requirement)
    bench.expect(beat, after=first, within=limits, requirement=requirement)


@pytest.mark.requirement("COM-01")
def test_waits_in_silence(bench: Bench, power: Power, keys: Keys, bitrate: BitRate) -> None:
    """Powered up with the two keys held, the node sends nothing at all."""
    bench.fresh(bit_rate_code=AT_125_KBIT)

    on = bench.enter_commissioning()

    bench.never(matchers.anything(), after=on, for_ns=4 * S)


@pytest.mark.requirement("COM-02", "COM-07")
@pytest.mark.parametrize("code", NAMED_RATES)
def test_listens_and_answers_at_125_kbit(
    bench: Bench, power: Power, keys: Keys, bitrate: BitRate, code: int
) -> None:
    """Whatever bit rate is stored, commissioning runs at 125 kbit/s in both directions."""
    bench.fresh(bit_rate_code=code)
    bench.enter_commissioning()

    request = bench.request(EXAMPLE)

    bench.expect(
        matchers.echo(payload(EXAMPLE)),
        after=request,
        within=ECHO_PERIOD_NS + bench.profile.limits.echo_each_ns,
    )


@pytest.mark.requirement("COM-03")
def test_wait_detects_no_keys(bench: Bench, power: Power, keys: Keys, bitrate: BitRate) -> None:
    """While it waits, keys that are pressed and released are not reported."""
    bench.fresh(bit_rate_code=AT_125_KBIT)
    bench.enter_commissioning()

    released = keys.release()
    for name in keys.names:
        keys.press(name)
        bench.wait(300 * MS)
        keys.release()

    bench.never(matchers.anything(), after=released, for_ns=4 * S)
    first_echo(bench, bench.request(EXAMPLE), payload(EXAMPLE))


@pytest.mark.requirement("COM-03")
def test_wait_ignores_other_pdos_and_sdos(
    bench: Bench, power: Power, keys: Keys, bitrate: BitRate
) -> None:
    """While it waits, it heeds no other PDO and no SDO; 4F8h still ends the wait."""
    bench.fresh(bit_rate_code=AT_125_KBIT)
    node_id = bench.node_id
    on = bench.enter_commissioning()
    data = payload(OTHER)

    pdos = (0x180, 0x200, 0x280, 0x300, 0x380, 0x400, 0x480, 0x500)
    for base in pdos:
        bench.send(Frame(base + node_id, data))
    for can_id in (0x4F7, 0x4F9, 0x3F8, 0x2F8, 0x5F8):
        bench.send(Frame(can_id, data))
    for each in (node_id, OTHER.node_id, 0x7F):
        bench.send(Frame(0x600 + each, bytes.fromhex("4000100000000000")))
        bench.send(Frame(0x600 + each, b"\x23\x00\x20\x01" + data[:4]))
        bench.send(Frame(0x600 + each, data + bytes(2)))

    bench.never(matchers.anything(), after=on, for_ns=4 * S)
    first_echo(bench, bench.request(EXAMPLE), payload(EXAMPLE))


@pytest.mark.requirement("COM-04", "COM-05")
def test_literal_example(bench: Bench, power: Power, keys: Keys, bitrate: BitRate) -> None:
    """4F8h 05 03 00 64 00 01 is answered by 3F8h 05 03 00 64 00 01, again and again."""
    bench.fresh()
    bench.enter_commissioning()

    request = bench.request(bytes.fromhex("050300640001"))

    echo = bench.expect(
        matchers.echo(bytes.fromhex("050300640001")),
        after=request,
        within=ECHO_PERIOD_NS + bench.profile.limits.echo_each_ns,
    )
    expect_echoes(bench, echo, bytes.fromhex("050300640001"), 5)


@pytest.mark.requirement("COM-05")
def test_echo_keeps_its_rhythm(bench: Bench, power: Power, keys: Keys, bitrate: BitRate) -> None:
    """The echo comes every 100 ms, each interval and the mean within their limits."""
    bench.fresh()
    bench.enter_commissioning()
    request = bench.request(OTHER)

    echo = first_echo(bench, request, payload(OTHER))

    expect_echoes(bench, echo, payload(OTHER), 30)


@pytest.mark.requirement("COM-05", "COM-11")
@pytest.mark.parametrize(
    "data",
    ["010100000000", "0fff ffffffff", "0a0701000100", "0300 00ff ff00", "0805fffe0aff"],
    ids=["lowest", "highest", "heartbeat-256", "default-rate", "mixed"],
)
def test_echo_repeats_every_byte(
    bench: Bench, power: Power, keys: Keys, bitrate: BitRate, data: str
) -> None:
    """Whatever was received comes back in bytes 0 to 5."""
    bench.fresh()
    bench.enter_commissioning()
    sent = bytes.fromhex(data)

    echo = first_echo(bench, bench.request(sent), sent)

    expect_echoes(bench, echo, sent, 2)


@pytest.mark.requirement("COM-06", "COM-08", "COM-09")
@pytest.mark.parametrize("parameters", [EXAMPLE, OTHER], ids=["example", "other"])
def test_next_start_uses_the_parameters(
    bench: Bench, power: Power, keys: Keys, bitrate: BitRate, parameters: Parameters
) -> None:
    """At the next regular power-up node id, bit rate and heartbeat are the new ones."""
    bench.fresh()
    bench.commission(parameters)

    boot = boots_as(bench, parameters, "COM-06")

    expect_period(bench, boot, parameters, "COM-06")


@pytest.mark.requirement("COM-06")
def test_commissions_again_and_again(
    bench: Bench, power: Power, keys: Keys, bitrate: BitRate
) -> None:
    """The last of several commissionings counts, and it outlasts several power-ups."""
    bench.fresh()
    for parameters in (EXAMPLE, OTHER, EXAMPLE, OTHER):
        bench.commission(parameters)
        boots_as(bench, parameters, "COM-06")
    for _ in range(3):
        power.off()
        boots_as(bench, OTHER, "COM-06")


@pytest.mark.requirement("COM-07")
@pytest.mark.parametrize("code", NAMED_RATES)
def test_each_named_bit_rate(
    bench: Bench, power: Power, keys: Keys, bitrate: BitRate, code: int
) -> None:
    """Codes 1 to 6 mean 500, 250, 125, 100, 50 and 20 kbit/s."""
    bench.fresh()
    parameters = attrs.evolve(EXAMPLE, bit_rate_code=code)
    bench.commission(parameters)
    bench.check(bench.stage.bit_rate == NAMED_RATES[code], f"the tester runs at code {code}")

    boots_as(bench, parameters, "COM-07")


@pytest.mark.requirement("COM-07")
def test_every_other_code_means_250_kbit(
    bench: Bench, power: Power, keys: Keys, bitrate: BitRate
) -> None:
    """Code 0 and codes 7 to 255 mean 250 kbit/s (all in virtual time, some elsewhere)."""
    bench.fresh()
    every = [code for code in range(256) if code not in NAMED_RATES]
    for code in every if bench.stage.virtual else SOME_OTHER_CODES:
        parameters = attrs.evolve(EXAMPLE, bit_rate_code=code)
        bench.commission(parameters)
        bench.check(bench.stage.bit_rate == 250_000, f"the tester runs at 250 kbit/s for {code}")  # noqa: PLR2004
        boots_as(bench, parameters, "COM-07")


@pytest.mark.requirement("COM-08")
@pytest.mark.parametrize("node_id", range(1, 16))
def test_each_node_id(
    bench: Bench, power: Power, keys: Keys, bitrate: BitRate, node_id: int
) -> None:
    """Every node id from 1 to 15 is taken, announced, and listened to."""
    bench.fresh()
    parameters = attrs.evolve(EXAMPLE, node_id=node_id)
    bench.commission(parameters)

    boots_as(bench, parameters, "COM-08")

    command = bench.nmt(Nmt.START)
    bench.expect(
        matchers.key_frame(node_id), after=command, within=bench.profile.limits.command_ns
    )


@pytest.mark.requirement("COM-09")
@pytest.mark.parametrize(
    "heartbeat_ms",
    [
        pytest.param(1, marks=pytest.mark.virtual("1 ms is faster than a hosted model can be")),
        10,
        255,
        256,
        1000,
        0x1234,
        65535,
    ],
)
def test_heartbeat_time_is_big_endian_milliseconds(
    bench: Bench, power: Power, keys: Keys, bitrate: BitRate, heartbeat_ms: int
) -> None:
    """Bytes 2 and 3 are the heartbeat time in milliseconds, high byte first."""
    bench.fresh()
    parameters = attrs.evolve(EXAMPLE, heartbeat_ms=heartbeat_ms)
    bench.commission(parameters)

    boot = boots_as(bench, parameters, "COM-06")

    expect_period(bench, boot, parameters, "COM-09")


@pytest.mark.requirement("COM-09", "HB-05")
def test_heartbeat_time_zero_is_none(
    bench: Bench, power: Power, keys: Keys, bitrate: BitRate
) -> None:
    """Heartbeat time 0 means no heartbeat."""
    bench.fresh()
    parameters = attrs.evolve(EXAMPLE, heartbeat_ms=0)
    bench.commission(parameters)

    boot = boots_as(bench, parameters, "COM-06")

    bench.never(matchers.heartbeat(parameters.node_id), after=boot, for_ns=10 * S)


def press_and_release(bench: Bench, keys: Keys, requirement: str) -> None:
    """One key pressed and released is reported after the debounce time, both ways."""
    limits = bench.profile.limits
    parameters = bench.parameters or EXAMPLE
    latest = parameters.debounce_ns + limits.scan_ns + limits.key_frame_ns
    early = parameters.debounce_ns - limits.scan_ns
    allowed = Limits(early, latest) if early > 0 else Limits(at_most_ns=latest)
    name = keys.names[-1]
    bench.wait(limits.command_ns)
    pressed = keys.press(name)
    bench.expect(
        matchers.key_frame(parameters.node_id, keys.mask),
        after=pressed,
        within=allowed,
        requirement=requirement,
    )
    if bench.profile.releases_reported:
        released = keys.release()
        bench.expect(
            matchers.key_frame(parameters.node_id, 0),
            after=released,
            within=allowed,
            requirement=requirement,
        )


@pytest.mark.requirement("COM-10")
@pytest.mark.parametrize("debounce", [1, 2, 5, 20, 255])
def test_debounce_time_is_tenths_of_a_second(
    bench: Bench, power: Power, keys: Keys, bitrate: BitRate, debounce: int
) -> None:
    """Byte 5 times 100 ms is how long a press or a release must last."""
    bench.fresh()
    parameters = attrs.evolve(EXAMPLE, debounce=debounce)
    bench.commission(parameters)
    boots_as(bench, parameters, "COM-06")
    bench.enter_operational()

    press_and_release(bench, keys, "COM-10")


@pytest.mark.requirement("COM-23")
def test_debounce_zero_filters_nothing(
    bench: Bench, power: Power, keys: Keys, bitrate: BitRate
) -> None:
    """With debounce time 0 every press and release is reported at once."""
    bench.fresh()
    parameters = attrs.evolve(EXAMPLE, debounce=0)
    bench.commission(parameters)
    boots_as(bench, parameters, "COM-06")
    bench.enter_operational()

    press_and_release(bench, keys, "COM-23")


@pytest.mark.requirement("COM-11")
@pytest.mark.parametrize("sync_time", [1, 10, 255])
def test_sync_time_has_no_effect(
    bench: Bench, power: Power, keys: Keys, bitrate: BitRate, sync_time: int
) -> None:
    """The sync time is echoed; heartbeat and debounce stay what they are, and nothing is added."""
    bench.fresh()
    parameters = attrs.evolve(EXAMPLE, sync_time=sync_time)
    bench.commission(parameters)

    boot = boots_as(bench, parameters, "COM-06")

    expect_period(bench, boot, parameters, "COM-11")
    bench.enter_operational()
    press_and_release(bench, keys, "COM-11")


@pytest.mark.requirement("COM-12")
def test_does_nothing_but_echo(bench: Bench, power: Power, keys: Keys, bitrate: BitRate) -> None:
    """Once it echoes, keys, LED frames, SDO requests and NMT get no answer of any kind."""
    bench.fresh(bit_rate_code=AT_125_KBIT)
    old_id = bench.node_id
    bench.enter_commissioning()
    request = bench.request(EXAMPLE)
    echo = first_echo(bench, request, payload(EXAMPLE))

    keys.release()
    keys.press(keys.names[-1])
    for node_id in (old_id, EXAMPLE.node_id):
        bench.send(Frame(0x600 + node_id, bytes.fromhex("4000100000000000")))
        bench.send(Frame(cobs.LED_STEADY + node_id, b"\xff"))
        bench.send(nmt_frame(Nmt.START, node_id))
        bench.send(nmt_frame(Nmt.RESET_NODE, node_id))
    bench.send(nmt_frame(Nmt.START, 0))

    expect_echoes(bench, echo, payload(EXAMPLE), 30)
    others = [
        seen
        for seen in bench.collect(matchers.anything(), after=request, until=bench.now())
        if seen.frame.can_id != cobs.ECHO
    ]
    text = "nothing but 3F8h is sent" + "".join(f"; {seen.frame} came" for seen in others[:3])
    bench.check(not others, text, since=request)


FOREIGN = {
    "start": nmt_frame(Nmt.START, 0),
    "stop": nmt_frame(Nmt.STOP, 0),
    "reset-node": nmt_frame(Nmt.RESET_NODE, 0),
    "reset-communication": nmt_frame(Nmt.RESET_COMMUNICATION, 0),
    "sync": Frame(0x080),
    "remote-4F8": Frame(cobs.COMMISSION, remote=True, dlc=6),
    "remote-3F8": Frame(cobs.ECHO, remote=True, dlc=6),
    "lss-identify": Frame(0x7E5, bytes.fromhex("4c00000000000000")),
    "lss-fastscan": Frame(0x7E5, bytes.fromhex("5100000000800000")),
}


@pytest.mark.requirement("COM-20")
def test_commissioning_ignores_everything_else(
    bench: Bench, power: Power, keys: Keys, bitrate: BitRate
) -> None:
    """NMT, SYNC, remote and LSS frames change nothing, neither in the wait nor in the echo."""
    bench.fresh(bit_rate_code=AT_125_KBIT)
    on = bench.enter_commissioning()

    for frame in FOREIGN.values():
        bench.send(frame)
    bench.never(matchers.anything(), after=on, for_ns=4 * S)
    request = bench.request(EXAMPLE)
    echo = first_echo(bench, request, payload(EXAMPLE))
    for frame in FOREIGN.values():
        bench.send(frame)
        bench.wait(130 * MS)

    last = expect_echoes(bench, echo, payload(EXAMPLE), 12)[-1]
    others = bench.collect(matchers.anything(), after=echo, until=last.at)
    only = all(seen.frame.data[:6] == payload(EXAMPLE) for seen in others)
    bench.check(only, "nothing but the echo is sent", since=echo)


@pytest.mark.requirement("COM-21")
def test_only_the_first_message_counts(
    bench: Bench, power: Power, keys: Keys, bitrate: BitRate
) -> None:
    """A second 4F8h changes neither the echo nor the memory."""
    bench.fresh()
    bench.enter_commissioning()
    echo = first_echo(bench, bench.request(EXAMPLE), payload(EXAMPLE))
    bench.wait(250 * MS)

    second = bench.request(OTHER)

    after = bench.collect(matchers.echo(), after=echo, until=second.at)[-1]
    later = bench.beats(matchers.echo(), 5, after=second, patience_ns=3 * ECHO_PERIOD_NS)
    same = bool(later) and all(seen.frame == after.frame for seen in later)
    bench.check(same, "the echo stays what it was", since=second)
    bench.wait(bench.profile.limits.store_ns)
    bench.leave_commissioning(EXAMPLE)
    boot = boots_as(bench, EXAMPLE, "COM-21")
    expect_period(bench, boot, EXAMPLE, "COM-21")


@pytest.mark.requirement("COM-22")
@pytest.mark.parametrize("node_id", [0, 16, 17, 31, 127, 128, 255])
def test_impossible_node_ids_are_ignored(
    bench: Bench, power: Power, keys: Keys, bitrate: BitRate, node_id: int
) -> None:
    """A 4F8h with a node id outside 1..15 gets no echo; the node goes on waiting."""
    bench.fresh()
    bench.enter_commissioning()

    request = bench.request(attrs.evolve(OTHER, node_id=node_id))

    bench.never(matchers.anything(), after=request, for_ns=500 * MS)
    first_echo(bench, bench.request(EXAMPLE), payload(EXAMPLE))


@pytest.mark.requirement("COM-22", "COM-29")
def test_impossible_node_id_is_not_stored(
    bench: Bench, power: Power, keys: Keys, bitrate: BitRate
) -> None:
    """After a refused 4F8h the old parameters are used at the next start."""
    before = bench.fresh(prefer={"heartbeat_ms": 100})
    bench.enter_commissioning()
    for node_id in (0, 16, 255):
        bench.request(attrs.evolve(OTHER, node_id=node_id))
    bench.wait(bench.profile.limits.store_ns)

    bench.leave_commissioning(before)

    boot = boots_as(bench, before, "COM-22")
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
    bench: Bench, power: Power, keys: Keys, bitrate: BitRate, frame: Frame
) -> None:
    """A short, remote or extended 4F8h is ignored; the right one is still waited for."""
    bench.fresh()
    bench.enter_commissioning()

    sent = bench.send(frame)

    bench.never(matchers.anything(), after=sent, for_ns=500 * MS)
    first_echo(bench, bench.request(EXAMPLE), payload(EXAMPLE))


@pytest.mark.requirement("COM-24")
@pytest.mark.parametrize("extra", ["00", "ffff"], ids=["7-bytes", "8-bytes"])
def test_bytes_past_the_sixth_mean_nothing(
    bench: Bench, power: Power, keys: Keys, bitrate: BitRate, extra: str
) -> None:
    """A longer 4F8h is taken; what stands past the sixth byte changes nothing."""
    bench.fresh()
    bench.enter_commissioning()

    request = bench.request(payload(EXAMPLE) + bytes.fromhex(extra))

    bench.expect(
        matchers.echo(payload(EXAMPLE)),
        after=request,
        within=ECHO_PERIOD_NS + bench.profile.limits.echo_each_ns,
    )
    bench.wait(bench.profile.limits.store_ns)
    bench.leave_commissioning(EXAMPLE)
    boots_as(bench, EXAMPLE, "COM-24")


@pytest.mark.requirement("COM-25")
def test_length_of_the_echo(bench: Bench, power: Power, keys: Keys, bitrate: BitRate) -> None:
    """How long the echo is, and what stands past the sixth byte, is written down."""
    bench.fresh()
    bench.enter_commissioning()

    echo = first_echo(bench, bench.request(EXAMPLE), payload(EXAMPLE)).frame

    rest = echo.data[6:].hex(" ") or "nothing"
    text = f"the echo has {len(echo.data)} bytes; past the sixth stands {rest}"
    bench.characteristic("COM-25", text)


FIRST = Parameters(3, 3, 100, 1, 1)
SECOND = Parameters(12, 3, 200, 2, 2)
"""Two sets that share the bit rate, so that either is heard, and nothing else."""

CUTS_REAL = (0, 5, 20, 60, 150, 500)
CUTS_VIRTUAL = range(0, 200, 1)


@pytest.mark.requirement("COM-26", "COM-06")
def test_power_cut_while_storing(bench: Bench, power: Power, keys: Keys, bitrate: BitRate) -> None:
    """Power cut at any instant of storing leaves the old set or the new set, never a mixture."""
    bench.fresh()
    for cut_ms in CUTS_VIRTUAL if bench.stage.virtual else CUTS_REAL:
        bench.commission(FIRST)
        bench.enter_commissioning()
        request = bench.request(SECOND)
        bench.wait_until(request.at + cut_ms * MS)
        bench.leave_unknown(FIRST.bit_rate)

        on = power.on()

        either = matchers.any_of(
            frozenset(cobs.ERROR_CONTROL + each.node_id for each in (FIRST, SECOND)),
            "boot-up of the old or the new node id",
        )
        boot = bench.expect(
            either, after=on, within=bench.profile.limits.boot_up_ns, requirement="COM-26"
        )
        found = FIRST if boot.frame.can_id == cobs.ERROR_CONTROL + FIRST.node_id else SECOND
        expect_whole_set(bench, keys, found, boot, cut_ms)


def expect_whole_set(
    bench: Bench, keys: Keys, found: Parameters, boot: Seen, cut_ms: int
) -> None:
    """Heartbeat and debounce time belong to the node id that booted."""
    each = Limits(*bench.profile.limits.heartbeat_each_ns(found.heartbeat_ns))
    beat = matchers.heartbeat(found.node_id)
    first = bench.expect(beat, after=boot, within=each.at_most_ns, requirement="COM-26")
    bench.expect(beat, after=first, within=each, requirement="COM-26")
    command = bench.nmt(Nmt.START, found.node_id)
    bench.expect(
        matchers.key_frame(found.node_id), after=command, within=bench.profile.limits.command_ns
    )
    limits = bench.profile.limits
    pressed = keys.press(keys.names[0])
    bench.expect(
        matchers.key_frame(found.node_id, keys.mask),
        after=pressed,
        within=Limits(
            found.debounce_ns - limits.scan_ns,
            found.debounce_ns + limits.scan_ns + limits.key_frame_ns,
        ),
        requirement="COM-26",
    )
    whole = f"cut {cut_ms} ms after 4F8h: node {found.node_id} with its own times"
    bench.check(fact=True, text=whole, requirement="COM-26")


@pytest.mark.requirement("COM-27")
def test_fewer_or_other_keys_start_regularly(
    bench: Bench, power: Power, keys: Keys, bitrate: BitRate
) -> None:
    """One of the two keys alone, or any other keys, lead to a regular start."""
    bench.fresh()
    pair = sorted(bench.profile.commissioning_keys)
    others = [name for name in keys.names if name not in pair]
    chosen = [(name,) for name in keys.names]
    chosen += [(pair[0], others[0]), (others[0], others[1])] if len(others) > 1 else []
    for held in chosen:
        power.off()
        keys.hold(*held)
        boots_as(bench, bench.parameters or EXAMPLE, "COM-27")
    power.off()
    keys.release()


@pytest.mark.requirement("COM-28")
def test_more_keys_at_power_on(bench: Bench, power: Power, keys: Keys, bitrate: BitRate) -> None:
    """Both keys and a further one at power-on: what the node does is written down."""
    bench.fresh()
    others = [name for name in keys.names if name not in bench.profile.commissioning_keys]
    if not others:
        pytest.skip("this device has no further key")
    rate = (bench.parameters or EXAMPLE).bit_rate
    power.off()
    keys.hold(*bench.profile.commissioning_keys, others[0])
    bitrate.set(rate)

    on = power.on()

    limit = bench.profile.limits.boot_up_ns
    boot = bench.first(matchers.boot_up(bench.node_id), on, on.ended_at + limit)
    text = "a regular start" if boot else "no regular start (commissioning)"
    bench.characteristic("COM-28", f"both commissioning keys and {others[0]}: {text}")


@pytest.mark.requirement("COM-28")
@pytest.mark.parametrize("command", [Nmt.RESET_NODE, Nmt.RESET_COMMUNICATION], ids=["81h", "82h"])
def test_keys_held_at_a_reset(
    bench: Bench, power: Power, keys: Keys, bitrate: BitRate, command: Nmt
) -> None:
    """Both keys held at an NMT reset: what the node does is written down."""
    bench.start()
    keys.hold(*bench.profile.commissioning_keys)
    bench.wait(200 * MS)
    bench.tolerate_missing_boot_up()

    reset = bench.nmt(command)

    limit = bench.profile.limits.boot_up_ns
    boot = bench.first(matchers.boot_up(bench.node_id), reset, reset.at + limit)
    text = "a regular start" if boot else "no regular start (commissioning)"
    bench.characteristic("COM-28", f"both keys held at NMT {int(command):02X}h: {text}")


@pytest.mark.requirement("COM-29")
def test_wait_without_message_changes_nothing(
    bench: Bench, power: Power, keys: Keys, bitrate: BitRate
) -> None:
    """Power off in the wait, without a valid 4F8h, leaves the stored parameters as they were."""
    before = bench.fresh(prefer={"heartbeat_ms": 100})
    bench.enter_commissioning()

    bench.leave_commissioning(before)

    boot = boots_as(bench, before, "COM-29")
    expect_period(bench, boot, before, "COM-29")


@pytest.mark.requirement("COM-05", "COM-06")
def test_echo_limits_are_those_of_the_source(
    bench: Bench, power: Power, keys: Keys, bitrate: BitRate
) -> None:
    """A long echo neither stops nor drifts, and the parameters are safe afterwards."""
    bench.fresh()
    bench.enter_commissioning()
    echo = first_echo(bench, bench.request(EXAMPLE), payload(EXAMPLE))

    echoes = expect_echoes(bench, echo, payload(EXAMPLE), 100)

    limits = bench.profile.limits
    drift = around(100 * ECHO_PERIOD_NS, 100 * ECHO_PERIOD_NS * limits.echo_mean_ppm // 1_000_000)
    bench.measure(
        bench.when(echoes[-1]).since(bench.when(echo)), drift, "a hundred echoes", since=echo
    )
    bench.leave_commissioning(EXAMPLE)
    boots_as(bench, EXAMPLE, "COM-06")
