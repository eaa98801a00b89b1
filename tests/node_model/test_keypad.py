"""The keypad as a whole: power, choice of the mode, memory."""

from __future__ import annotations

import pytest

from node_model.frame import Frame
from node_model.keypad import Keypad, Parameters, Profile, load
from node_model.node import MS, Frames, earliest

PROFILE = load()
BOTH = frozenset({"on_off", "aut"})
BOOT = (Frame(0x701, b"\x00"), Frame(0x081, b"\x00\x50\x01\x00\x00\x00\x00\x00"))


def powered(held: frozenset[str] = frozenset(), image: bytes = b"") -> Keypad:
    """A keypad after its initialisation; supply came at 0."""
    pad = Keypad(PROFILE, image)
    pad.hold(held, 0)
    pad.power_on(0)
    pad.advance(50 * MS)
    return pad


def commissioned(parameters: Parameters) -> bytes:
    """The memory of a keypad that was commissioned to these parameters."""
    pad = powered(BOTH)
    pad.receive(Frame(0x4F8, parameters.encode()), 60 * MS)
    pad.advance(1000 * MS)
    pad.power_off(1000 * MS)
    return pad.image()


def test_it_announces_itself_50_ms_after_power_on() -> None:
    """Silent and off the bus until then; the factory's id 1 at 250 kbit/s."""
    pad = Keypad(PROFILE)
    assert pad.deadline() is None
    assert pad.power_on(0) == ()
    assert pad.powered
    assert pad.bit_rate == 0
    assert pad.deadline() == 50 * MS
    assert pad.advance(49 * MS) == ()
    assert pad.advance(50 * MS) == BOOT
    assert pad.bit_rate == 250_000


def test_power_on_twice_is_power_on_once() -> None:
    """A powered node does nothing more."""
    pad = Keypad(PROFILE)
    pad.power_on(0)
    assert pad.power_on(40 * MS) == ()
    assert pad.deadline() == 50 * MS


def test_power_off_silences_it() -> None:
    """Nothing is due, heard or lit; the next power-on starts anew."""
    pad = powered()
    assert pad.power_off(60 * MS) == ()
    assert not pad.powered
    assert pad.bit_rate == 0
    assert pad.deadline() is None
    assert pad.advance(10**12) == ()
    assert pad.receive(Frame(0, b"\x01\x00"), 10**12) == ()
    pad.power_on(10**12)
    assert pad.advance(10**12 + 50 * MS) == BOOT


def test_both_commissioning_keys_lead_to_the_wait() -> None:
    """Nothing is sent; the bus runs at 125 kbit/s."""
    pad = powered(BOTH)
    assert pad.bit_rate == 125_000
    assert pad.deadline() is None


@pytest.mark.parametrize(
    "held", [{"on_off"}, {"aut"}, {"k3", "k4"}, {"on_off", "k3"}, {"on_off", "aut", "k3"}, set()]
)
def test_any_other_keys_lead_to_a_regular_start(held: set[str]) -> None:
    """One of the two, others, or more than the two."""
    assert powered(frozenset(held)).bit_rate == 250_000


def test_the_keys_count_at_the_end_of_initialisation() -> None:
    """What was held at power-on and let go before does not matter."""
    pad = Keypad(PROFILE)
    pad.power_on(0)
    pad.hold(BOTH, 10 * MS)
    pad.advance(50 * MS)
    assert pad.bit_rate == 125_000


def test_commissioned_parameters_are_used_at_the_next_regular_start() -> None:
    """Id, bit rate and heartbeat of a 4F8h, through the memory alone."""
    image = commissioned(Parameters(15, 6, 250, 0, 2))
    pad = Keypad(PROFILE, image)
    pad.power_on(0)
    assert pad.advance(50 * MS)[0] == Frame(0x70F, b"\x00")
    assert pad.bit_rate == 20_000
    assert pad.deadline() == 300 * MS
    assert pad.stored() == Parameters(15, 6, 250, 0, 2)


def test_a_power_cut_while_storing_leaves_the_old_parameters() -> None:
    """Cut after 30 of 60 ms."""
    pad = powered(BOTH, commissioned(Parameters(15, 6, 250, 0, 2)))
    pad.receive(Frame(0x4F8, Parameters(3).encode()), 60 * MS)
    pad.advance(90 * MS)
    pad.power_off(90 * MS)
    assert Keypad(PROFILE, pad.image()).stored() == Parameters(15, 6, 250, 0, 2)


def test_a_keypad_without_memory_is_what_the_factory_made() -> None:
    """Blank memory: the profile's parameters."""
    assert Keypad(PROFILE).stored() == PROFILE.factory


def test_keys_and_leds_are_named_in_the_order_of_their_bits() -> None:
    """Not in that of the profile."""
    pad = Keypad(Profile(keys={"b": 1, "a": 0}, leds={"y": 9, "x": 3}))
    assert pad.keys == ("a", "b")
    assert pad.leds == ("x", "y")
    assert pad.mask(frozenset({"b"})) == 2


def test_an_unknown_key_is_named_with_the_known_ones() -> None:
    """And nothing is held then."""
    pad = powered()
    with pytest.raises(ValueError, match=r"no key aux, bux; this keypad has on_off, aut, k3"):
        pad.hold(frozenset({"bux", "on_off", "aux"}), 60 * MS)
    assert pad.deadline() == 1050 * MS


def test_keys_and_leds_work_in_operation() -> None:
    """A press becomes a frame, a frame becomes light."""
    pad = powered()
    assert pad.receive(Frame(0, b"\x01\x01"), 60 * MS) == (Frame(0x181, b"\x00"),)
    assert pad.hold(frozenset({"k3"}), 100 * MS) == ()
    assert pad.advance(200 * MS) == (Frame(0x181, b"\x04"),)
    pad.receive(Frame(0x301, b"\x04"), 300 * MS)
    assert pad.lit("k3", 300 * MS)
    assert not pad.lit("k3", 550 * MS)
    assert pad.lamp_change(300 * MS) == 550 * MS


def test_leds_are_dark_without_power_and_in_commissioning() -> None:
    """Nor do they ever change by themselves."""
    for pad in (Keypad(PROFILE), powered(BOTH)):
        assert not pad.lit("k3", 60 * MS)
        assert pad.lamp_change(60 * MS) is None


def test_the_earliest_of_deadlines_leaves_out_none() -> None:
    """The helper of every node that has several parts."""
    assert earliest() is None
    assert earliest(None, None) is None
    assert earliest(None, 3, 2, None, 5) == 2


def test_it_has_no_errors_to_raise() -> None:
    """A bench can raise none; a name is refused."""
    pad = Keypad(load())
    assert pad.faults == ()
    assert list(pad.fail(frozenset(), 0)) == []
    with pytest.raises(ValueError, match="no fault heat; this keypad has none"):
        pad.fail(frozenset(("heat",)), 0)


class Other(Keypad):
    """It may do something else at a deadline."""

    def advance(self, now: int) -> Frames:
        """As usual, so far."""
        return super().advance(now)


def test_heartbeats_are_repeated_in_regular_operation_alone() -> None:
    """Not without power, not in commissioning, and not by a keypad that is made differently."""
    far = 100_000 * MS
    pad, other = powered(), Other(PROFILE)
    other.power_on(0)
    other.advance(50 * MS)
    (beat,) = other.advance(1050 * MS)
    assert not other.repeats(beat, far, MS, 2)
    assert not Keypad(PROFILE).repeats(beat, far, MS, 2)
    assert not powered(BOTH).repeats(beat, far, MS, 2)
    (beat,) = pad.advance(1050 * MS)
    assert list(pad.repeats(beat, far, MS, 2)) == [2050 * MS, 3050 * MS]
