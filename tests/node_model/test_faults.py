"""The registry of faulty and different devices, what they do, and links."""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterator
from functools import cache

import pytest

from node_model.faults import MUTANTS, VARIANTS, link, make
from node_model.faults.mutants import (
    answers,
    commissioning,
    debounce,
    echo,
    heartbeat,
    keys,
    leds,
    light,
    memory,
    narrow,
    nmt,
    rare,
    request,
    robustness,
    start,
)
from node_model.faults.parts import Deviation, Fault, assemble
from node_model.faults.registry import name_of
from node_model.frame import Frame
from node_model.keypad import Keypad, load
from node_model.node import MS, Panel
from tests.node_model.driving import Record, Step, frames_of, play
from tests.node_model.scripts import BOTH, PROFILE, START, Script, factory, scripts, steps

TOPICS = (
    answers,
    commissioning,
    debounce,
    echo,
    heartbeat,
    keys,
    leds,
    light,
    memory,
    narrow,
    nmt,
    rare,
    request,
    robustness,
    start,
)
SCRIPTS: tuple[Script, ...] = tuple(scripts())


# The registry.


def test_nothing_is_forgotten() -> None:
    """Every class of every topic that names a requirement is a mutant, and no name is double."""
    written = [
        part
        for topic in TOPICS
        for _, part in inspect.getmembers(topic, inspect.isclass)
        if issubclass(part, Fault) and part.violates and part.__module__ == topic.__name__
    ]
    assert sorted(map(name_of, written)) == sorted(MUTANTS)
    assert not set(MUTANTS) & set(VARIANTS)


def test_there_are_enough_of_them() -> None:
    """What the project promises."""
    assert len(MUTANTS) >= 45
    assert len(VARIANTS) >= 10


def facts(name: str) -> tuple[str, tuple[str, ...]]:
    """Text and requirement ids of a device."""
    if name in MUTANTS:
        return MUTANTS[name].text, MUTANTS[name].violates
    variant = VARIANTS[name]
    return variant.text, (variant.allowed_by, *variant.departs)


@pytest.mark.parametrize("name", [*MUTANTS, *VARIANTS])
def test_each_says_what_it_is_in_one_sentence(name: str) -> None:
    """A name for the command line, a sentence for people, ids of requirements."""
    assert re.fullmatch(r"[a-z]+(-[a-z]+)*", name)
    text, ids = facts(name)
    assert re.fullmatch(r"[A-Z0-9]([^.]|\d\.\d|\d\.\.\d)*\.", text), text
    assert ids
    for one in ids:
        assert re.fullmatch(r"(COM|NMT|HB|KEY|LED|ROB)-\d\d", one)


def test_the_right_keypad_has_no_name() -> None:
    """None makes it, with the memory given."""
    pad = make(None, PROFILE, b"\1" * 22)
    assert type(pad) is Keypad
    assert pad.image() == b"\1" * 22


@pytest.mark.parametrize("name", ["echo-stops", "slow-boot", "emcy-late"])
def test_others_are_made_by_name(name: str) -> None:
    """Mutants, variants, and those behind a link."""
    panel = make(name, PROFILE, b"\1" * 22)
    assert panel.image() == b"\1" * 22
    assert panel.name == "keypad"
    assert panel.keys == panel.leds == Keypad(PROFILE).keys


def test_an_unknown_name_gets_near_misses() -> None:
    """So that a typing error costs no search."""
    with pytest.raises(ValueError, match=r"no mutant or variant 'echo-stop'; did you mean echo-s"):
        make("echo-stop", PROFILE)
    with pytest.raises(ValueError, match=r"'xyzzy'; no name is near it"):
        make("xyzzy", PROFILE)


def test_a_fault_replaces_a_part() -> None:
    """One that is derived from no part cannot be built."""
    with pytest.raises(TypeError, match="Fault replaces no part of a keypad; derive it from"):
        assemble(Fault, PROFILE)
    with pytest.raises(TypeError, match="Deviation replaces no part"):
        assemble(Deviation, PROFILE)


# What they do.


@cache
def right(number: int) -> tuple[Record, ...]:
    """What the right keypad does in a script."""
    profile, script = SCRIPTS[number]
    return tuple(play(Keypad(profile), script))


@pytest.mark.parametrize("name", [*MUTANTS, *VARIANTS])
def test_each_differs_from_the_right_keypad(name: str) -> None:
    """In at least one script its frames, bit rate, lamps, deadlines or memory are others."""
    assert any(
        tuple(play(make(name, profile), script)) != right(number)
        for number, (profile, script) in enumerate(SCRIPTS)
    )


def linked(effect: link.Effect) -> link.PanelLink:
    """A keypad behind an effect."""
    return link.PanelLink(Keypad(load()), effect)


def said(effect: link.Effect) -> list[Frame]:
    """What such a keypad says in its first two seconds."""
    return frames_of(play(linked(effect), steps((0, True))))


def test_a_watchdog_bites_every_twenty_seconds() -> None:
    """Twenty seconds after each boot-up the node boots again."""
    device = make("restarts-every-twenty-seconds", PROFILE)
    frames = frames_of(play(device, (Step(0, True), Step(45_000 * MS, None))))
    assert [frame.data for frame in frames].count(b"\0") == 3


def test_without_heartbeat_traffic_cannot_delay_it() -> None:
    """A fault that has nothing to act on does nothing."""
    device = make("traffic-delays-heartbeat", factory(heartbeat_ms=0))
    frames = frames_of(play(device, steps((0, True), (100, Frame(0x456)))))
    assert [frame.can_id for frame in frames] == [0x701, 0x081]


# Links.


def test_a_link_without_effect_is_the_node_itself() -> None:
    """The same records in every third script."""
    for number in range(0, len(SCRIPTS) - 1, 3):
        profile, script = SCRIPTS[number]
        panel = link.PanelLink(Keypad(profile), link.Effect())
        assert tuple(play(panel, script)) == right(number)


def test_a_drop_loses_every_nth_frame() -> None:
    """Of boot-up, EMCY and a heartbeat the second is lost."""
    effect = link.Drop()
    effect.every = 2
    assert [frame.can_id for frame in said(effect)] == [0x701, 0x701]
    assert [frame.can_id for frame in said(link.Effect())] == [0x701, 0x081, 0x701]


def test_a_delay_keeps_order_and_span() -> None:
    """Every frame comes 35 ms late; a power-off loses what is on its way."""
    panel = linked(link.Delay())
    panel.power_on(0)
    assert panel.powered
    assert panel.advance(84 * MS) == ()
    assert panel.deadline() == 85 * MS
    assert [frame.can_id for frame in panel.advance(85 * MS)] == [0x701, 0x081]
    panel.advance(1060 * MS)
    assert panel.deadline() == 1085 * MS
    assert panel.power_off(1070 * MS) == ()
    assert (panel.powered, panel.deadline()) == (False, None)


def test_a_slow_node_hears_late() -> None:
    """What it hears at 100 ms acts at 160 ms; its lamps are said to change then."""
    panel = linked(link.Slow())
    panel.power_on(0)
    panel.advance(50 * MS)
    assert panel.lamp_change(50 * MS) is None
    assert panel.receive(START, 100 * MS) == ()
    assert panel.deadline() == panel.lamp_change(100 * MS) == 160 * MS
    assert [frame.can_id for frame in panel.advance(160 * MS)] == [0x181]


def test_a_duplicate_comes_twice_and_pairs_are_reordered() -> None:
    """Of three frames the last waits for its partner."""
    one, two, three = said(link.Effect())
    assert said(link.Duplicate()) == [one, one, two, two, three, three]
    assert said(link.Reorder()) == [two, one]


@pytest.mark.parametrize(
    ("effect", "before", "after"),
    [
        (link.Corrupt, Frame(1, b"\x00\x01"), Frame(1, b"\x10\x01")),
        (link.Corrupt, Frame(1), Frame(1)),
        (link.WrongLength, Frame(1, b"\x05"), Frame(1, b"\x05\x00")),
        (link.WrongLength, Frame(1, bytes(8)), Frame(1, bytes(7))),
        (link.WrongLength, Frame(1, remote=True, dlc=2), Frame(1, remote=True, dlc=2)),
        (link.AsRemote, Frame(1, b"\x05\x06"), Frame(1, remote=True, dlc=2)),
        (link.AsExtended, Frame(1, b"\x05"), Frame(1, b"\x05", extended=True)),
    ],
)
def test_an_effect_changes_a_frame(effect: type[link.Effect], before: Frame, after: Frame) -> None:
    """One field each; what it cannot change it spares."""
    assert list(effect().outgoing(before, 7)) == [(7, after)]


def test_a_link_hands_on_errors() -> None:
    """What the device says of them goes through the effect; a keypad has none."""
    panel = linked(link.Effect())
    assert panel.faults == ()
    assert list(panel.fail(frozenset(), 0)) == []
    with pytest.raises(ValueError, match="no fault heat; this keypad has none"):
        panel.fail(frozenset(("heat",)), 0)


def test_a_wrong_oscillator_doubles_the_bit_rate() -> None:
    """Off stays off."""
    panel = linked(link.WrongRate())
    assert panel.bit_rate == 0
    play(panel, (Step(0, BOTH), Step(0, True), Step(60 * MS, None)))
    assert panel.bit_rate == 250_000


def test_what_an_effect_does_not_pick_it_spares() -> None:
    """A slow reader of NMT alone takes other frames at once."""

    class SlowNmt(link.Slow):
        """NMT only."""

        def picks(self, frame: Frame) -> bool:
            return frame.can_id == 0

    assert list(SlowNmt().incoming(Frame(0x201), 5)) == [(5, Frame(0x201))]
    assert list(SlowNmt().outgoing(Frame(0), 5)) == [(5, Frame(0))]
    assert list(SlowNmt().incoming(Frame(0), 5)) == [(5 + 60 * MS, Frame(0))]


def devices() -> Iterator[Panel]:
    """One of each."""
    for name in (*MUTANTS, *VARIANTS):
        yield make(name, PROFILE)


def test_every_device_is_off_when_it_is_made() -> None:
    """No bit rate, nothing due, nothing lit, no power."""
    for device in devices():
        assert not device.powered
        assert device.bit_rate == 0
        assert device.deadline() is None
        assert not any(device.lit(led, 0) for led in device.leds)
