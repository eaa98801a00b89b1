"""The verbs of scenarios: what each can act on, and what not."""

from __future__ import annotations

import pytest

from hil_tests.clock import S
from hil_tests.judge.cobs import Nmt
from hil_tests.scenarios import words
from hil_tests.scenarios.scenario import scenario
from hil_tests.scenarios.words import OWN_RATE, WORDS, Command, Loading, Sent
from node_model.frame import Frame


def refused(verb: str, text: str) -> None:
    """A step with that argument is explained, with the form of its verb."""
    with pytest.raises(ValueError, match=f"^step '0ms {verb}\\b") as caught:
        scenario(f"off: 0ms {verb} {text}")
    assert WORDS[verb].form in str(caught.value)


@pytest.mark.parametrize("verb", sorted(WORDS))
def test_every_verb_says_how_it_is_written(verb: str) -> None:
    """Its form begins with it, and an argument that it cannot have is answered with the form."""
    assert WORDS[verb].form.startswith(verb)
    refused(verb, "?!")


@pytest.mark.parametrize(
    ("text", "meant"),
    [
        ("start", Command(Nmt.START, "own")),
        ("reset-node all", Command(Nmt.RESET_NODE, "all")),
        ("pre-operational other", Command(Nmt.PRE_OPERATIONAL, "other")),
        ("81 alike", Command(0x81, "alike")),
        ("00", Command(0, "own")),
        ("FF", Command(0xFF, "own")),
    ],
)
def test_commands_are_named_or_bytes(text: str, meant: Command) -> None:
    """To the device itself where nobody else is named."""
    assert words.command(text) == meant


@pytest.mark.parametrize("text", ["", "100", "-1", "start nobody", "start own all", "own", "xy"])
def test_commands_that_are_none(text: str) -> None:
    """More than a byte, another addressee, one word too many."""
    refused("nmt", text)


@pytest.mark.parametrize(
    ("text", "meant"),
    [
        ("123#", Frame(0x123)),
        ("123#1122", Frame(0x123, b"\x11\x22")),
        ("7ff#aA", Frame(0x7FF, b"\xaa")),
        ("000#R", Frame(0, remote=True)),
        ("123#R8", Frame(0x123, remote=True, dlc=8)),
        ("00000123#", Frame(0x123, extended=True)),
        ("1FFFFFFF#R2", Frame(0x1FFFFFFF, remote=True, extended=True, dlc=2)),
        ("123#1122334455667788_F", Frame(0x123, bytes.fromhex("1122334455667788"), dlc=15)),
    ],
)
def test_frames_are_written_as_candump_writes_them(text: str, meant: Frame) -> None:
    """Three digits for 11 bits, eight for 29; R and a length for a remote frame; _ for a DLC."""
    assert words.sent(text) == Sent(meant, relative=False)


@pytest.mark.parametrize(
    ("most", "beyond"), [("+780#11", "+781#11"), ("+1FFFFF80#", "+1FFFFF81#"), ("+000#R", "+7FF#")]
)
def test_a_node_id_is_added_where_it_fits(most: str, beyond: str) -> None:
    """With every node id, up to 127, the identifier is one."""
    assert words.sent(most) == Sent(words.frame_of(most[1:]), relative=True)
    refused("send", beyond)


@pytest.mark.parametrize(
    "text",
    ["", "123", "12#", "1234#", "800#", "20000000#", "123#1", "123#RG", "123#RF5",
     "123#112233445566778899", "123#11_8", "123#11_9", "123#_9", "++123#", "123#11 22"],
)  # fmt: skip
def test_frames_that_are_none(text: str) -> None:
    """Identifiers beyond their bits, half bytes, more than eight, lengths that cannot be."""
    refused("send", text)


def test_keys_are_binary_digits() -> None:
    """The first key stands on the right; 64 are the most."""
    assert words.mask("101") == 5
    assert words.mask(64 * "1") == (1 << 64) - 1
    for wrong in ("", "2", "-1", "0b1", "1_1", "١", 65 * "0"):
        refused("keys", wrong)


def test_payloads_are_at_most_eight_bytes() -> None:
    """In hex, - for none."""
    assert words.payload("-") == b""
    assert words.payload("0f AA") == b"\x0f\xaa"
    assert len(words.payload(16 * "1")) == 8
    for wrong in ("", "1", "xx", 18 * "1"):
        refused("led", wrong)


def test_power_is_on_or_off() -> None:
    """Nothing in between."""
    assert words.power("on")
    assert not words.power("off")
    refused("power", "cycle")


def test_rates_are_bits_a_second() -> None:
    """From one thousand to one million, or the device's own."""
    assert words.rate("own") == OWN_RATE
    assert words.rate("1000") == 1000
    assert words.rate("1000000") == 1_000_000
    for wrong in ("999", "1000001", "-1", "fast", ""):
        refused("rate", wrong)


@pytest.mark.parametrize("text", ["0ms", "61s", "", "soon"])
def test_leds_are_watched_for_a_minute_at_most(text: str) -> None:
    """And for some time at all."""
    assert WORDS["watch"].read("60s") == 60 * S
    refused("watch", text)


def test_loads_are_shares_of_the_bus_time() -> None:
    """High priority or low, 1 to 100 per cent, or off."""
    assert words.loading("off") == Loading(0, ())
    high, low = words.loading("1% high"), words.loading("100% low")
    assert (high.share_ppm, low.share_ppm) == (10_000, 1_000_000)
    assert {frame.can_id for frame in high.frames} == {0x080}
    assert {frame.can_id for frame in low.frames} == {0x7FF}
    for wrong in ("", "0% high", "101% low", "50 low", "50%", "x% high"):
        refused("load", wrong)
    refused("load", "50% middle")
