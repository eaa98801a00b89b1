"""The oracle of lights: what the LEDs may show after any row of frames (LED-01..22)."""

from __future__ import annotations

import pytest

from hil_tests.clock import MS
from hil_tests.judge.lights import (
    Broken,
    Chance,
    Event,
    Leave,
    LightRules,
    Look,
    Restart,
    Write,
    judge_lights,
)
from hil_tests.judge.verdict import Outcome, Verdict

RULES = LightRules({"a": 0, "b": 1, "c": 2, "d": 7}, size=1)
WIDE = LightRules({"a": 0, "i": 8}, size=2)
BLINK_WINS = LightRules({"a": 0, "b": 1}, size=1, steady_wins=False)


def steady(data: str, acts: Chance = Chance.SURE) -> Write:
    """A frame with the on/off map."""
    return Write(blink=False, data=bytes.fromhex(data), acts=acts)


def blinks(data: str, acts: Chance = Chance.SURE) -> Write:
    """A frame with the blink map."""
    return Write(blink=True, data=bytes.fromhex(data), acts=acts)


def look(
    on: str = "",
    blink: str = "",
    *,
    at_ms: int = 100,
    names: str = "abcd",
    operational: bool = True,
) -> Look:
    """The LEDs that were seen on, and those that were seen blinking."""
    lights = {led: "on" if led in on else "blink" if led in blink else "off" for led in names}
    return Look(at_ms * MS, lights, operational)


def judged(*events: Event, rules: LightRules = RULES) -> list[Verdict]:
    """What is wrong."""
    return list(judge_lights(events, rules))


def blamed(*events: Event, rules: LightRules = RULES) -> str:
    """The requirement that is blamed, for certain; "" = nothing is wrong."""
    found = judged(*events, rules=rules)
    assert all(verdict.outcome is Outcome.FAIL for verdict in found)
    assert len(found) <= 1
    return found[0].requirement if found else ""


def test_without_a_frame_all_are_dark() -> None:
    """A device begins with both maps empty (LED-21); nobody looks, nothing is judged."""
    assert blamed() == ""
    assert blamed(steady("FF")) == ""
    assert blamed(look()) == ""
    assert blamed(look("a")) == "LED-01"
    assert blamed(look("", "a")) == "LED-02"


def test_each_map_is_shown_as_it_was_written() -> None:
    """Bit n of 200h + id is LED n steadily on, of 300h + id blinking; the last frame counts."""
    assert blamed(steady("83"), look("abd")) == ""
    assert blamed(blinks("83"), look("", "abd")) == ""
    assert blamed(steady("01"), steady("02"), look("b")) == ""
    assert blamed(steady("01"), blinks("04"), look("a", "c")) == ""


@pytest.mark.parametrize(
    ("seen", "blame"),
    [
        (look("a"), "LED-01"),
        (look("abd"), "LED-01"),
        (look(), "LED-01"),
        (look("", "ab"), "LED-02"),
        (look("ab", "c"), "LED-02"),
    ],
)
def test_the_map_in_which_the_difference_lies_is_blamed(seen: Look, blame: str) -> None:
    """An LED that blinks instead, or besides, is a matter of the blink map."""
    assert blamed(steady("03"), seen) == blame


def test_the_first_wrong_look_is_told() -> None:
    """With its instant and what was seen; what follows from it is not."""
    (verdict,) = judged(
        steady("01"), look("a", at_ms=1), look("b", "c", at_ms=2), look("d", at_ms=3)
    )
    assert verdict.at == 2 * MS
    assert verdict.text == "the LEDs show b on, c blink, which no LED frame explains"
    (dark,) = judged(steady("01"), look())
    assert "the LEDs show nothing" in dark.text


# Independence (LED-03).


@pytest.mark.parametrize(
    ("first", "second", "seen"),
    [
        (blinks("06"), steady("01"), look("a")),  # the other map is cleared
        (steady("06"), blinks("01"), look("", "a")),
        (blinks("06"), steady("02"), look("b", "c")),  # steady first, then only c blinks
        (steady("06"), blinks("02"), look("bc")),
    ],
)
def test_a_write_leaves_the_other_map_alone(first: Write, second: Write, seen: Look) -> None:
    """Where both maps are as they were written nothing is wrong; cleared ones break LED-03."""
    right = {
        "06 01": look("a", "bc"),
        "01 06": look("bc", "a"),
        "06 02": look("b", "c"),
        "02 06": look("bc"),
    }
    steady_map, blink_map = (second, first) if first.blink else (first, second)
    key = f"{blink_map.data.hex()} {steady_map.data.hex()}"
    assert blamed(first, second, right[key]) == ""
    if seen != right[key]:
        assert blamed(first, second, seen) == "LED-03"


@pytest.mark.parametrize("blink", [False, True], ids=["steady", "blink"])
def test_bits_that_a_write_takes_from_the_other_map_show_later(blink: bool) -> None:
    """An LED set in both maps stays in the other one when this one is cleared."""
    this, other = (blinks, steady) if blink else (steady, blinks)
    events = (other("06"), this("02"), this("00"))
    kept, taken = (look("bc"), look("c")) if blink else (look("", "bc"), look("", "c"))
    assert blamed(*events, kept) == ""
    assert blamed(*events, taken) == "LED-03"


# Where a frame acts (LED-04), resets (LED-21), leaving (LED-22).


def test_outside_operational_a_frame_is_ignored() -> None:
    """One that acted nevertheless is blamed on LED-04; where the state is open both are right."""
    assert blamed(steady("01", Chance.NO), look()) == ""
    assert blamed(steady("01", Chance.NO), look("a")) == "LED-04"
    assert blamed(blinks("01", Chance.NO), look("", "a")) == "LED-04"
    for seen in (look(), look("a")):
        assert blamed(steady("01", Chance.PERHAPS), seen) == ""
    assert blamed(steady("01", Chance.PERHAPS), look("b")) == "LED-01"


def test_a_perhaps_is_decided_once() -> None:
    """Both maps that may be there are carried on; a later frame makes it sure again."""
    events = (steady("01"), steady("02", Chance.PERHAPS))
    assert blamed(*events, blinks("04"), look("a", "c")) == ""
    assert blamed(*events, blinks("04"), look("b", "c")) == ""
    assert blamed(*events, steady("04"), look("c")) == ""
    assert blamed(*events, steady("04"), look("a")) == "LED-01"


def test_a_reset_makes_all_dark() -> None:
    """What is still lit breaks LED-21; where the reset may not have been heard both are right."""
    assert blamed(steady("01"), Restart(), look()) == ""
    assert blamed(steady("01"), Restart(), look("a")) == "LED-21"
    assert blamed(blinks("01"), Restart(), look("", "a")) == "LED-21"
    for seen in (look(), look("a")):
        assert blamed(steady("01"), Restart(Chance.PERHAPS), seen) == ""
    assert blamed(steady("01"), Restart(), steady("02"), look("b")) == ""


def test_a_reset_that_lights_them_all() -> None:
    """Lit instead of dark is LED-21, too; an LED that is lit by itself is LED-01."""
    assert blamed(Restart(), look("abcd")) == "LED-21"
    assert blamed(Restart(), steady("01"), look("abcd")) == "LED-01"
    assert blamed(Restart(), look("b")) == "LED-01"


def test_leaving_operational_keeps_them_or_not() -> None:
    """LED-22 leaves it to the maker, then and after coming back, but invents no other light."""
    for seen in (look(), look("a")):
        assert blamed(steady("01"), Leave(), seen) == ""
        assert blamed(steady("01"), Leave(), seen._replace(operational=False)) == ""
    assert blamed(steady("01"), Leave(), look("b")) == "LED-01"
    assert blamed(steady("01"), Leave(), blinks("02"), look("", "b")) == ""
    assert blamed(steady("01"), Leave(), blinks("02"), look("a", "b")) == ""


def test_only_while_it_may_be_elsewhere_darkness_is_free() -> None:
    """A device that shows nothing outside operational may show its maps again inside."""
    events = (steady("01"), Leave(), steady("03"))
    assert blamed(*events, look(operational=False)) == ""
    assert blamed(*events, look("ab", operational=False)) == ""
    assert blamed(*events, look()) == "LED-01"


# Lengths (LED-06).


def test_a_frame_shorter_than_the_map_is_ignored() -> None:
    """Its bytes must not be taken, nor the missing ones as zero."""
    assert blamed(steady("01"), steady(""), look("a")) == ""
    assert blamed(steady("01"), steady(""), look()) == "LED-06"
    assert blamed(steady("01"), look("a", names="ai"), rules=WIDE) == "LED-06"
    assert blamed(steady("01"), look(names="ai"), rules=WIDE) == ""
    assert blamed(steady("0101"), look("ai", names="ai"), rules=WIDE) == ""


def test_extra_bytes_mean_nothing() -> None:
    """The first bytes count; a device that refuses such a frame breaks LED-06."""
    for data in ("01FF", "01" + 7 * "FF"):
        assert blamed(steady(data), look("a")) == ""
        assert blamed(steady(data), look()) == "LED-06"
        assert blamed(blinks(data), look("", "a")) == ""
        assert blamed(blinks(data), look()) == "LED-06"


def test_bits_without_an_led_mean_nothing() -> None:
    """Only the bits of the profile's LEDs are looked at."""
    assert blamed(steady("78"), look()) == ""
    assert blamed(blinks("7A"), look("", "b")) == ""


# Both bits (LED-20).


def test_where_both_bits_are_set_the_led_is_steady() -> None:
    """Unless the profile says that it blinks; the other reading breaks LED-20."""
    events = (steady("01"), blinks("03"))
    assert blamed(*events, look("a", "b")) == ""
    assert blamed(*events, look("", "ab")) == "LED-20"
    assert blamed(*events, look("", "ab", names="ab"), rules=BLINK_WINS) == ""
    assert blamed(*events, look("a", "b", names="ab"), rules=BLINK_WINS) == "LED-20"


def test_a_light_that_hides_another_comes_back() -> None:
    """The blink bit below a steady one was kept all the time (LED-03)."""
    events = (blinks("01"), steady("01"), look("a", at_ms=1), steady("00"))
    assert blamed(*events, look("", "a", at_ms=2)) == ""
    assert blamed(*events, look(at_ms=2)) == "LED-03"


def test_what_a_reading_of_ours_explains_is_no_breach_of_the_source() -> None:
    """LED-20 explains a blinking LED as well as LED-03 does, until a look tells them apart."""
    events = (steady("01"), blinks("01"), look("", "a", at_ms=1))
    assert blamed(*events) == "LED-20"
    assert blamed(*events, blinks("00"), look("a", at_ms=2)) == "LED-20"
    assert blamed(*events, blinks("00"), look(at_ms=2)) == "LED-03"


def test_a_device_may_differ_in_several_readings() -> None:
    """Together they explain what none of them does alone: the source is not broken."""
    events = (steady("05"), Restart(), blinks("01"))
    assert blamed(*events, look("", "a")) == ""
    assert blamed(*events, look("ac")) == "LED-21"
    assert blamed(*events, look("c", "a")) == "LED-21"
    assert blamed(steady("01"), steady("02FF"), blinks("03"), look("", "ab")) == "LED-20"
    assert blamed(steady("01"), steady("06FF"), blinks("05"), look("", "ac")) == "LED-06"


def test_what_explains_the_first_look_alone_is_told() -> None:
    """Where nothing explains them all, a later look is a matter of its own."""
    events = (steady("01"), Restart(), look("a", at_ms=1))
    assert blamed(*events) == "LED-21"
    assert blamed(*events, look("", "d", at_ms=2)) == "LED-21"


@pytest.mark.parametrize("broken", list(Broken))
def test_every_way_to_be_broken_names_its_rule(broken: Broken) -> None:
    """Several ways belong to one rule."""
    assert broken.requirement in {"LED-03", "LED-04", "LED-06", "LED-20", "LED-21"}
