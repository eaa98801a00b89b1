"""Commissioning: powered up with two keys held, the node waits for one frame and echoes it.

Source: keypad specification, "Inizializzazione". Each test leaves the device commissioned
to something else; the bench puts the old parameters back before they matter again.
"""

from __future__ import annotations

import attrs
import pytest

from hil_tests.acceptance.commissioning_steps import (
    EXAMPLE,
    OTHER,
    anew,
    answer,
    boots_as,
    expect_echoes,
    waiting,
)
from hil_tests.acceptance.led_steps import led_data, settle
from hil_tests.api import (
    ECHO_PERIOD_NS,
    MS,
    BitRate,
    Chance,
    Frame,
    KeypadBench,
    Keys,
    Leds,
    Nmt,
    NotRun,
    Power,
    S,
    Seen,
    around,
    cobs,
    matchers,
    nmt_frame,
    payload,
)

AT_125_KBIT = 3
"""Stored where silence is to be heard: a node that started regularly would speak there."""

LED_BASES = (cobs.LED_STEADY, cobs.LED_BLINK)

NAMED_RATES = {1: 500_000, 2: 250_000, 3: 125_000, 4: 100_000, 5: 50_000, 6: 20_000}


@pytest.mark.requirement("COM-02")
def test_takes_parameters_at_125_kbit(
    bench: KeypadBench, power: Power, keys: Keys, bitrate: BitRate
) -> None:
    """As it came to the bench, the node is commissioned at 125 kbit/s.

    The first of all: where it does not even do this, no other test gets as far as its question.
    """
    bench.fresh()
    bench.enter_commissioning()

    request = bench.request(EXAMPLE)

    answer(bench, request, payload(EXAMPLE), "COM-02")


@pytest.mark.requirement("COM-01")
def test_waits_in_silence(bench: KeypadBench, power: Power, keys: Keys, bitrate: BitRate) -> None:
    """Powered up with the two keys held, the node sends nothing at all."""
    bench.fresh(bit_rate_code=AT_125_KBIT)

    on = bench.enter_commissioning()

    bench.never(matchers.anything(), after=on, for_ns=4 * S)


@pytest.mark.requirement("COM-02", "COM-07")
@pytest.mark.parametrize("code", NAMED_RATES)
def test_listens_and_answers_at_125_kbit(
    bench: KeypadBench, power: Power, keys: Keys, bitrate: BitRate, code: int
) -> None:
    """Whatever bit rate is stored or told, commissioning runs at 125 kbit/s both ways."""
    bench.fresh(bit_rate_code=code)
    bench.enter_commissioning()
    told = payload(attrs.evolve(EXAMPLE, bit_rate_code=code))

    request = bench.request(told)

    answer(bench, request, told, "COM-02")


@pytest.mark.requirement("COM-03")
def test_wait_detects_no_keys(
    bench: KeypadBench, power: Power, keys: Keys, bitrate: BitRate
) -> None:
    """While it waits, keys that are pressed and released are not reported."""
    bench.fresh(bit_rate_code=AT_125_KBIT)
    waiting(bench)

    released = keys.release()
    for name in keys.names:
        keys.press(name)
        bench.wait(300 * MS)
        keys.release()

    bench.never(matchers.anything(), after=released, for_ns=4 * S)
    bench.expect_echo(bench.request(EXAMPLE), payload(EXAMPLE))


@pytest.mark.requirement("COM-03")
def test_wait_ignores_other_pdos_and_sdos(
    bench: KeypadBench, power: Power, keys: Keys, bitrate: BitRate
) -> None:
    """While it waits, it heeds no other PDO and no SDO; 4F8h still ends the wait."""
    bench.fresh(bit_rate_code=AT_125_KBIT)
    node_id = bench.node_id
    waiting(bench)
    began = bench.now()
    data = payload(OTHER)

    pdos = (0x180, 0x200, 0x280, 0x300, 0x380, 0x400, 0x480, 0x500)
    for base in pdos:
        bench.offer(Frame(base + node_id, data))
    for can_id in (0x4F7, 0x4F9, 0x3F8, 0x2F8, 0x5F8):
        bench.offer(Frame(can_id, data))
    for each in (node_id, OTHER.node_id, 0x7F):
        bench.offer(Frame(0x600 + each, bytes.fromhex("4000100000000000")))
        bench.offer(Frame(0x600 + each, b"\x23\x00\x20\x01" + data[:4]))
        bench.offer(Frame(0x600 + each, data + bytes(2)))

    bench.never(matchers.anything(), after=began, for_ns=4 * S)
    bench.expect_echo(bench.request(EXAMPLE), payload(EXAMPLE))


@pytest.mark.requirement("COM-04", "COM-05")
def test_literal_example(bench: KeypadBench, power: Power, keys: Keys, bitrate: BitRate) -> None:
    """4F8h 05 03 00 64 00 01 is answered by 3F8h 05 03 00 64 00 01, again and again."""
    bench.fresh()
    bench.enter_commissioning()

    request = bench.request(bytes.fromhex("050300640001"))

    echo = answer(bench, request, bytes.fromhex("050300640001"), "COM-04")
    expect_echoes(bench, echo, bytes.fromhex("050300640001"), 5)


@pytest.mark.requirement("COM-05")
def test_echo_keeps_its_rhythm(
    bench: KeypadBench, power: Power, keys: Keys, bitrate: BitRate
) -> None:
    """The echo comes every 100 ms, each interval and the mean within their limits."""
    bench.fresh()
    bench.enter_commissioning()
    request = bench.request(OTHER)

    echo = bench.expect_echo(request, payload(OTHER))

    expect_echoes(bench, echo, payload(OTHER), 30)


@pytest.mark.requirement("COM-05", "COM-11")
@pytest.mark.parametrize(
    "data",
    ["010100000000", "0fff ffffffff", "0a0701000100", "0300 00ff ff00", "0805fffe0aff"],
    ids=["lowest", "highest", "heartbeat-256", "default-rate", "mixed"],
)
def test_echo_repeats_every_byte(
    bench: KeypadBench, power: Power, keys: Keys, bitrate: BitRate, data: str
) -> None:
    """Whatever was received comes back in bytes 0 to 5."""
    bench.fresh()
    bench.enter_commissioning()
    sent = bytes.fromhex(data)

    echo = bench.expect_echo(bench.request(sent), sent)

    expect_echoes(bench, echo, sent, 2)


@pytest.mark.requirement("COM-05", "COM-11")
def test_echo_repeats_what_the_seed_draws(
    bench: KeypadBench, power: Power, keys: Keys, bitrate: BitRate, chance: Chance
) -> None:
    """Each byte comes back with each value in virtual time, elsewhere with one that is drawn."""
    row = chance.row("echo")
    first, *shift = (row.randrange(256) for _ in range(6))
    for turn in range(first, first + (256 if bench.stage.virtual else 1)):
        anew(bench)
        bench.enter_commissioning()
        sent = bytes((turn % 15 + 1, *((turn + each) & 0xFF for each in shift)))

        bench.expect_echo(bench.request(sent), sent)


@pytest.mark.requirement("COM-05", "COM-06")
def test_echo_limits_are_those_of_the_source(
    bench: KeypadBench, power: Power, keys: Keys, bitrate: BitRate
) -> None:
    """A long echo neither stops nor drifts, and the parameters are safe afterwards."""
    bench.fresh()
    bench.enter_commissioning()
    echo = bench.expect_echo(bench.request(EXAMPLE), payload(EXAMPLE))

    echoes = expect_echoes(bench, echo, payload(EXAMPLE), 100)

    limits = bench.profile.limits
    drift = around(100 * ECHO_PERIOD_NS, 100 * ECHO_PERIOD_NS * limits.echo_mean_ppm // 1_000_000)
    bench.measure_between(echo, echoes[-1], drift, "a hundred echoes", since=echo)
    bench.leave_commissioning(EXAMPLE)
    boots_as(bench, EXAMPLE, "COM-06")


@pytest.mark.requirement("COM-12")
def test_does_nothing_but_echo(
    bench: KeypadBench, power: Power, keys: Keys, bitrate: BitRate
) -> None:
    """Once it echoes, keys, LED frames, SDO requests and NMT get no answer of any kind."""
    bench.fresh(bit_rate_code=AT_125_KBIT)
    old_id = bench.node_id
    bench.enter_commissioning()
    request = bench.request(EXAMPLE)
    echo = bench.expect_echo(request, payload(EXAMPLE))

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


@pytest.mark.requirement("COM-12")
def test_led_frames_light_nothing_while_it_echoes(
    bench: KeypadBench, power: Power, keys: Keys, leds: Leds, bitrate: BitRate
) -> None:
    """Once it echoes, LED frames with its old or new node id change no light."""
    old_id = bench.fresh().node_id
    bench.enter_commissioning()
    bench.expect_echo(bench.request(EXAMPLE), payload(EXAMPLE))
    before = dict(leds.read())
    if dict(leds.read()) != before:
        raise NotRun("the LEDs change by themselves while the node echoes")
    data = led_data(bench, (name for name, light in before.items() if light == "off"))

    sent = bench.send(Frame(cobs.LED_STEADY + old_id, data))
    for can_id in (cobs.LED_BLINK + old_id, *(base + EXAMPLE.node_id for base in LED_BASES)):
        bench.send(Frame(can_id, data))
    settle(bench)

    found = dict(leds.read())
    bench.check(found == before, f"lights stay {before}; they are {found}", since=sent)


def expect_only_echoes(bench: KeypadBench, echo: Seen, requirement: str) -> None:
    """Since an echo the node has sent nothing but echoes of the example."""
    found = bench.collect(matchers.anything(), after=echo, until=bench.now())
    others = [seen.frame for seen in found if seen.frame.data[:6] != payload(EXAMPLE)]
    text = "nothing but the echo is sent" + "".join(f"; {frame} came" for frame in others[:1])
    bench.check(not others, text, requirement=requirement, since=echo)


FOREIGN = {
    "start": nmt_frame(Nmt.START, 0),
    "stop": nmt_frame(Nmt.STOP, 0),
    "reset-node": nmt_frame(Nmt.RESET_NODE, 0),
    "reset-communication": nmt_frame(Nmt.RESET_COMMUNICATION, 0),
    "sync": Frame(0x080),
    "remote-4F8": Frame(cobs.COMMISSION, remote=True, dlc=6),
    "remote-3F8": Frame(cobs.ECHO, remote=True, dlc=6),
    "lss-configure": Frame(0x7E5, bytes.fromhex("0401000000000000")),
    "lss-inquire": Frame(0x7E5, bytes.fromhex("5e00000000000000")),
    "lss-identify": Frame(0x7E5, bytes.fromhex("4c00000000000000")),
    "lss-fastscan": Frame(0x7E5, bytes.fromhex("5100000000800000")),
}


@pytest.mark.requirement("COM-20")
def test_commissioning_ignores_everything_else(
    bench: KeypadBench, power: Power, keys: Keys, bitrate: BitRate
) -> None:
    """NMT, SYNC, remote and LSS frames change nothing, neither in the wait nor in the echo."""
    bench.fresh(bit_rate_code=AT_125_KBIT)
    waiting(bench)
    bench.tolerate_missing_boot_up()  # one that leaves the wait would be held against COM-12
    began = bench.now()
    bench.wait(1 * MS)  # so that nothing that they lead to can have been due before

    for frame in FOREIGN.values():
        bench.offer(frame)
    bench.never(matchers.anything(), after=began, for_ns=4 * S)
    if bench.collect(matchers.anything(), after=began, until=bench.now()):
        return  # it left the wait, which was observed: what it does now is a consequence
    request = bench.request(EXAMPLE)
    echo = bench.expect_echo(request, payload(EXAMPLE))
    bench.wait(500 * MS)
    expect_only_echoes(bench, echo, "COM-12")  # before anything was done to it
    begin = expect_echoes(bench, echo, payload(EXAMPLE), 1)[-1]
    for frame in FOREIGN.values():
        bench.send(frame)
        bench.wait(130 * MS)

    expect_echoes(bench, begin, payload(EXAMPLE), 12)
    expect_only_echoes(bench, begin, "COM-20")


@pytest.mark.requirement("COM-25")
def test_length_of_the_echo(
    bench: KeypadBench, power: Power, keys: Keys, bitrate: BitRate
) -> None:
    """How long the echo is, and what stands past the sixth byte, is written down."""
    bench.fresh()
    bench.enter_commissioning()

    echo = bench.expect_echo(bench.request(EXAMPLE), payload(EXAMPLE)).frame

    rest = echo.data[6:].hex(" ") or "nothing"
    text = f"the echo has {len(echo.data)} bytes; past the sixth stands {rest}"
    bench.characteristic("COM-25", text)


@pytest.mark.requirement("COM-27")
def test_fewer_or_other_keys_start_regularly(
    bench: KeypadBench, power: Power, keys: Keys, bitrate: BitRate
) -> None:
    """One of the two keys alone, or any other keys, lead to a regular start."""
    bench.fresh()
    pair = sorted(bench.profile.commissioning_keys)
    others = [name for name in keys.names if name not in pair]
    chosen: list[tuple[str, ...]] = [(name,) for name in keys.names]
    chosen += [(pair[0], others[0]), (others[0], others[1])] if len(others) > 1 else []
    for held in chosen:
        power.off()
        keys.hold(*held)
        boots_as(bench, bench.parameters or EXAMPLE, "COM-27")
    power.off()
    keys.release()


@pytest.mark.requirement("COM-28")
def test_more_keys_at_power_on(
    bench: KeypadBench, power: Power, keys: Keys, bitrate: BitRate
) -> None:
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
    bench: KeypadBench, power: Power, keys: Keys, bitrate: BitRate, command: Nmt
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
