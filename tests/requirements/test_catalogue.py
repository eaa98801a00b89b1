"""The catalogue: complete, consistent with the profile, and strict about its own file."""

from __future__ import annotations

import contextlib
import dataclasses
import re
import tomllib
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

import hil_tests
from hil_tests.errors import ConfigError
from hil_tests.requirements import (
    FACILITIES,
    Kind,
    Requirement,
    load,
    load_all,
    load_with_sheet,
    near,
    parse,
)

ROOT = Path(hil_tests.__file__).parents[1]
SPECIFICATION = ROOT / ".." / "shared" / "spec" / "keypad.md"
PROFILE = ROOT / "node_model" / "profiles" / "keypad.toml"
ENTRY = """
[HB-01]
text = "t"
source = "s"
clause = "c"
class = "must"
origin = "source"
"""


def errors(text: str) -> list[str]:
    """What the reader says to this text."""
    with pytest.raises(ConfigError) as caught:
        parse(text, "x.toml")
    return str(caught.value).splitlines()


def test_ids_and_classes_are_those_of_the_specification() -> None:
    """Each row of its tables, in its order, and nothing else."""
    if not SPECIFICATION.exists():
        pytest.skip(f"the keypad's table of requirements is not here: {SPECIFICATION}")
    rows = re.findall(
        r"^\| ([A-Z]+-\d+) \| (\w+) \|", SPECIFICATION.read_text("utf-8"), re.MULTILINE
    )
    assert [(one.id, one.kind.value) for one in load("keypad").values()] == rows


def test_the_groups_are_complete() -> None:
    """How many there are of each group, for where the specification is not at hand."""
    groups = [name.split("-")[0] for name in load("keypad")]
    counts = {group: groups.count(group) for group in groups}
    assert counts == {"COM": 22, "NMT": 10, "HB": 6, "KEY": 11, "LED": 9, "ROB": 4}


def test_limits_are_limits_of_the_profile_with_its_defaults() -> None:
    """The default in a requirement is the shipped profile's value."""
    limits = tomllib.loads(PROFILE.read_text("utf-8"))["limits"]
    for requirement in load("keypad").values():
        for limit in requirement.limits:
            assert limits[limit.name] == limit.default, requirement.id


def test_every_limit_of_the_profile_judges_something() -> None:
    """A limit that no requirement names would be dead."""
    asked = (*load("keypad").values(), *load_with_sheet("keypad").values())
    used = {limit.name for one in asked for limit in one.limits}
    assert used == set(tomllib.loads(PROFILE.read_text("utf-8"))["limits"])


@pytest.mark.parametrize("requirement", load("keypad").values(), ids=lambda one: one.id)
def test_an_entry_is_fit_for_a_report(requirement: Requirement) -> None:
    """One or two full sentences (a few need three), a clause, and limits for what is timed."""
    assert requirement.text.endswith(".")
    assert len(requirement.text) <= 260
    assert requirement.clause
    assert requirement.source in {"keypad specification", "CiA 301"}
    assert set(requirement.needs) <= set(FACILITIES)
    assert (requirement.kind is not Kind.TIMING) or requirement.limits


def test_what_is_ours_is_never_a_failure_by_itself() -> None:
    """Own readings are derived, a set or a choice; what others say is a must or timing."""
    for requirement in load("keypad").values():
        ours = requirement.kind in {Kind.DERIVED, Kind.SET, Kind.CHOICE}
        assert ours == (requirement.origin == "reading"), requirement.id


def test_requirements_are_values() -> None:
    """Frozen, hashable, equal when equal; two loads share nothing that could be changed."""
    first, second = load("keypad"), load("keypad")
    assert first == second
    assert first is not second
    assert len(set(first.values())) == len(first)
    with pytest.raises(dataclasses.FrozenInstanceError):
        first["HB-01"].text = "x"  # type: ignore[misc]
    with pytest.raises(TypeError):
        first["HB-99"] = first["HB-01"]  # type: ignore[index]


def test_an_unknown_kind_names_those_there_are() -> None:
    """Also where the name tries to leave the folder."""
    for kind in ("oven", "../keypad", ""):
        with pytest.raises(ConfigError, match="there are some for: keypad"):
            load(kind)


@pytest.mark.parametrize(
    ("wrong", "meant"),
    [
        ("hb-1", ["HB-01"]),
        ("HB_01", ["HB-01"]),
        ("hb 01", ["HB-01"]),
        ("HB01", ["HB-01"]),
        ("HB-001", ["HB-01"]),
        ("HP-01", ["HB-01"]),
        ("", []),
        ("zzz", []),
        ("x" * 9999, []),
    ],
)
def test_near_misses(wrong: str, meant: list[str]) -> None:
    """What people type for HB-01."""
    assert near(["HB-01", "NMT-20"], wrong) == meant


def test_near_misses_of_a_number_that_does_not_exist() -> None:
    """At most three, of the same group."""
    found = near(load("keypad"), "KEY-29")
    assert 1 <= len(found) <= 3
    assert all(name.startswith("KEY-") for name in found)


def test_the_smallest_entry_is_read() -> None:
    """Limits and needs may be left out."""
    assert parse(ENTRY, "x.toml")["HB-01"] == Requirement(
        "HB-01", "t", "s", "c", Kind.MUST, "source"
    )


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("[HB-01]", "[hb-1]", "'hb-1': is no id; write e.g. HB-01"),
        ('text = "t"', "", "HB-01.text: write a text in quotes"),
        ('text = "t"', "text = 3", "HB-01.text: write a text in quotes"),
        ('text = "t"', 'text = "t"\nclaus = 1', "HB-01.claus: unknown key; known: clause"),
        ('text = "t"', 'text = "t"\nq = 1', "HB-01.q: unknown key; known: text, source"),
        ('"must"', '"bench"', "HB-01.class: 'bench': unknown; write one of must, timing, set"),
        ('"source"', '"rumour"', "HB-01.origin: 'rumour': unknown; write one of source, cia301"),
        ('text = "t"', 'text = "t"\nneeds = ["x"]', "HB-01.needs: write a list of power, keys"),
        ('text = "t"', 'text = "t"\nneeds = "keys"', "HB-01.needs: write a list of power"),
        ('text = "t"', 'text = "t"\nlimits = { led = 5 }', "HB-01.limits: write e.g."),
        ('text = "t"', 'text = "t"\nlimits = "led"', "HB-01.limits: write e.g."),
        ('text = "t"', 'text = "t"\nuntested = ""', "HB-01.untested: write the reason in quotes"),
        ('text = "t"', 'text = "t"\nuntested = 1', "HB-01.untested: write the reason in quotes"),
        ("[HB-01]", 'x = 1\n["HB-01"]', "'x': is no id"),
    ],
)
def test_a_slip_in_the_file_is_told(old: str, new: str, said: str) -> None:
    """Users may write catalogues of their own one day."""
    found = errors(ENTRY.replace(old, new, 1))
    assert found[0].startswith(f"x.toml: {said}")


def test_all_slips_are_told_at_once() -> None:
    """Two entries, three slips."""
    text = ENTRY.replace('"t"', "1").replace('"must"', '"x"') + "[HB-2]\n"
    assert len(errors(text)) == 2 + 6


def test_a_file_that_is_no_toml_is_told_with_its_line() -> None:
    """The same id twice is an error of TOML."""
    assert "line 8" in errors(ENTRY + "[HB-01]\n")[0]


@given(st.text(alphabet='[]{}="\n.-HB01textclassneedslimits ', max_size=60))
def test_any_text_is_read_or_refused(text: str) -> None:
    """Never a traceback."""
    with contextlib.suppress(ConfigError):
        parse(text, "x.toml")


SOURCES = {
    "nmt-and-error-control.md": ("MGR", "EC"),
    "sync-and-emcy.md": ("SYN", "EM"),
}


@pytest.mark.parametrize("page", SOURCES)
def test_every_id_of_a_page_is_a_requirement(page: str) -> None:
    """Each row of its table, in its order, and nothing else."""
    path = SPECIFICATION.with_name(page)
    if not path.exists():
        pytest.skip(f"the table of requirements is not here: {path}")
    rows = re.findall(r"^\| ([A-Z]+-\d+) \|", path.read_text("utf-8"), re.MULTILINE)
    assert [name for name in load("drive") if name.split("-")[0] in SOURCES[page]] == rows


def test_a_kind_of_device_is_judged_by_the_catalogues_of_its_sources() -> None:
    """A generic device has no synchronous axis, and every id is known once."""
    drive, generic = load("drive"), load("generic")
    assert set(generic) < set(drive)
    assert set(load_all()) == set(load("keypad")) | set(drive)
    assert not set(load("keypad")) & set(drive)


def test_limits_of_a_device_with_dictionary_are_those_of_its_profile() -> None:
    """The default in a requirement is the shipped profile's value."""
    limits = tomllib.loads(PROFILE.with_name("drive.toml").read_text("utf-8"))["limits"]
    for requirement in load("drive").values():
        for limit in requirement.limits:
            assert limits[limit.name] == limit.default, requirement.id
