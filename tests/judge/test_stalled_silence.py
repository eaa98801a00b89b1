"""A host that was stopped is no silence of the device, and a watch knows what it did not see."""

from __future__ import annotations

import pytest

from hil_tests.clock import MS
from hil_tests.judge.cobs import Nmt, State
from hil_tests.judge.timeline import ANY_STATE
from node_model.frame import Frame
from tests.judge.scene import Scene

ECHO = Frame(0x3F8, bytes((5, 3, 0, 100, 0, 1)))


def beating() -> Scene:
    """A node that beats at 150, 250 and 350 ms."""
    scene = Scene().started()
    scene.beats((150, 250, 350))
    return scene


@pytest.mark.parametrize(
    ("pair", "blamed"),
    [
        (None, ["HB-01"]),
        ((450, 501), []),
        ((455, 500), []),
        ((455, 499), ["HB-01"]),
        ((456, 501), ["HB-01"]),
    ],
)
def test_a_beat_kept_back_beyond_a_reset(pair: tuple[int, int] | None, blamed: list[str]) -> None:
    """At 500 ms a reset: the beat of 450 ms, limit 455 ms, had not come. Did its host sleep?"""
    scene = beating()
    scene.command(Nmt.RESET_NODE, 500)
    if pair:
        scene.lateness.add(pair[0] * MS, pair[1] * MS)
    assert scene.blamed(505) == blamed


def test_a_late_beat_behind_the_reset() -> None:
    """The whole of it: stopped at 400, reset at 500, all that was due comes at 600 ms."""
    scene = beating()
    scene.command(Nmt.RESET_NODE, 500)
    scene.beat(600)
    scene.boot(600.1)
    scene.lateness.add(450 * MS, 600 * MS)
    scene.lateness.add(550 * MS, 600 * MS)
    assert scene.blamed(650) == []


@pytest.mark.parametrize(("pair", "blamed"), [(None, ["NMT-02"]), ((1000, 1600), [])])
def test_a_boot_up_kept_back_beyond_power_off(
    pair: tuple[int, int] | None, blamed: list[str]
) -> None:
    """Power at 0, off at 1.5 s, no boot-up in between."""
    scene = Scene()
    scene.power(0, on=True)
    scene.power(1500, on=False)
    if pair:
        scene.lateness.add(pair[0] * MS, pair[1] * MS)
    assert scene.blamed(1700) == blamed


def test_watch_that_begins_amid_commissioning() -> None:
    """Echoes may go on from before; after a start seen by the watch they need a 4F8h."""
    scene = Scene(states=ANY_STATE)
    scene.see(ECHO, 10)
    assert scene.blamed(20) == []
    scene.power(30, on=True, mode="commissioning")
    scene.see(ECHO, 200)
    assert scene.blamed(210) == ["COM-01"]


def test_watch_that_begins_with_the_device_off() -> None:
    """Then nothing was asked for before it."""
    scene = Scene(states=frozenset((State.OFF, State.STARTING)))
    scene.power(0, on=True, mode="commissioning")
    scene.see(ECHO, 200)
    assert scene.blamed(210) == ["COM-01"]
