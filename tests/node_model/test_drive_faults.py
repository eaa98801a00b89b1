"""The faulty and the different drives: the registry, and what they do."""

from __future__ import annotations

import importlib
import inspect
import pkgutil
import re
from functools import cache, partial

import pytest

from node_model import devices
from node_model.devices import make_device
from node_model.drive import Drive, Profile
from node_model.faults import DRIVE_MUTANTS, DRIVE_VARIANTS, MODELS, drive, mutants_of, variants_of
from node_model.faults.drive_parts import assemble_drive
from node_model.faults.parts import Deviation, Fault
from node_model.faults.registry import name_of
from node_model.frame import Frame
from node_model.node import Withdrawing
from tests.node_model.drive_scripts import drive_scripts
from tests.node_model.driving import Record, play

FACTS: Profile = devices.read("drive").facts
SCRIPTS = drive_scripts()
TOPICS = [
    importlib.import_module(f"{drive.__name__}.{module.name}")
    for module in pkgutil.iter_modules(drive.__path__)
]


def test_nothing_is_forgotten() -> None:
    """Every class of every topic is a mutant or a variant, and no name is double."""
    written = [
        part
        for topic in TOPICS
        for _, part in inspect.getmembers(topic, inspect.isclass)
        if part.__module__ == topic.__name__ and issubclass(part, Fault | Deviation)
    ]
    assert sorted(map(name_of, written)) == sorted([*DRIVE_MUTANTS, *DRIVE_VARIANTS])
    kinds = ("keypad", "drive")
    count = sum(len(of(kind)) for kind in kinds for of in (mutants_of, variants_of))
    assert len(MODELS) == count


def test_there_are_enough_of_them() -> None:
    """What the project promises; a kind without models has none."""
    assert len(mutants_of("drive")) >= 60
    assert len(variants_of("drive")) >= 10
    assert not mutants_of("generic")
    assert not variants_of("generic")


@pytest.mark.parametrize("name", [*DRIVE_MUTANTS, *DRIVE_VARIANTS])
def test_each_says_what_it_is_in_one_sentence(name: str) -> None:
    """A name for the command line, a sentence for people, ids of requirements."""
    model = MODELS[name]
    assert re.fullmatch(r"[a-z]+(-[a-z]+)*", name)
    assert re.fullmatch(r"[A-Z0-9]([^.]|\d\.\d|\d\.\.\d)*\.", model.text), model.text
    assert model.kind == "drive"
    if name in DRIVE_MUTANTS:
        ids = DRIVE_MUTANTS[name].violates
    else:
        ids = (DRIVE_VARIANTS[name].allowed_by, *DRIVE_VARIANTS[name].departs)
    assert ids
    for one in ids:
        assert re.fullmatch(r"(SYN|EM|EC|MGR|C-[A-Z]+)-\d\d", one)


def test_a_fault_replaces_a_part() -> None:
    """One that is derived from no part cannot be built; a drive keeps its memory."""
    with pytest.raises(TypeError, match="Fault replaces no part of a drive; derive it from"):
        assemble_drive(Fault, FACTS)
    image = devices.read("drive").memory({"node_id": 9})
    assert make_device("drive", model="boots-slowly", image=image).image() == image


def test_a_link_takes_back_what_its_device_would() -> None:
    """Nothing while there is no window."""
    device = make_device("drive", model="takes-its-time-for-emergencies")
    assert isinstance(device, Withdrawing)
    assert not device.withdraws(Frame(0x185), 0, 0)


@cache
def right(number: int) -> tuple[Record, ...]:
    """What the right drive does in a script."""
    return tuple(play(Drive(FACTS), SCRIPTS[number][1]))


ABOUT = {
    "network": "network",
    "heartbeat": "error control",
    "guarding": "error control",
    "consuming": "error control",
    "emergencies": "emergencies",
    "error_field": "emergencies",
    "pdo_parameters": "parameters",
    "objects": "objects",
    "sdo": "transfers",
    "sdo_blocks": "blocks",
    "storing": "storing",
    "lss": "lss",
    "edges": "edges",
    "basics": "basics",
}
"""Module of a fault -> topic of the scripts that most likely show it; else that of PDOs."""


def in_order(name: str) -> list[int]:
    """Numbers of the scripts, the likely ones first."""
    maker = MODELS[name].make
    assert isinstance(maker, partial)
    topic = ABOUT.get(maker.args[0].__module__.rpartition(".")[2], "pdos")
    return sorted(range(len(SCRIPTS)), key=lambda number: SCRIPTS[number][0] != topic)


@pytest.mark.parametrize("name", [*DRIVE_MUTANTS, *DRIVE_VARIANTS])
def test_each_differs_from_the_right_drive(name: str) -> None:
    """In at least one script its frames, bit rate, deadlines or memory are others."""
    make = partial(MODELS[name].make, FACTS)
    assert any(
        tuple(play(make(), SCRIPTS[number][1])) != right(number) for number in in_order(name)
    )
