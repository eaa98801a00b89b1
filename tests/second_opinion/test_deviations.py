"""The suite and devices that nobody here wrote: it blames them for what they do, and no more.

Each departure is listed with its clause in deviations.toml. Each is found by a test that
claims the rule, and nothing else is blamed. The suite runs to its end on both devices.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable, Mapping
from pathlib import Path

import pytest

from hil_tests.requirements import load
from hil_tests.run import outcome
from tests.second_opinion.third_party import (
    BIT_RATE,
    EDS,
    VERSIONS,
    DurandDevice,
    LocalDevice,
    ThirdParty,
    durand_eds,
)
from tests.second_opinion.trial import Opinion, opinion_of, suite_for

LIST = Path(__file__).with_name("deviations.toml")
KNOWN = {"durand": "0.5.0", "canopen": "2.4.1"}
"""Versions that the list speaks of."""

Row = Mapping[str, str]


def rows(device: str) -> list[Row]:
    """The departures of a device."""
    return list(tomllib.loads(LIST.read_text("utf-8"))[device])


def local_eds() -> str:
    """The drive's, but for LSS and bit rates, of which LocalNode knows nothing."""
    text = Path(EDS).read_text("utf-8").replace("LSS_Supported=1", "LSS_Supported=0")
    return re.sub(rf"BaudRate_(?!{BIT_RATE // 1000}=)(\d+)=1", r"BaudRate_\1=0", text)


DEVICES: Mapping[str, tuple[Callable[[], str], Callable[[int], ThirdParty], int]] = {
    "durand": (durand_eds, DurandDevice, 0),
    "localnode": (local_eds, LocalDevice, 1000),
}


@pytest.fixture(scope="module", params=DEVICES)
def seen(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> tuple[str, Opinion]:
    """A device, and what the suite says of it."""
    eds, make, heartbeat_ms = DEVICES[request.param]
    folder = tmp_path_factory.mktemp(request.param)
    suite = suite_for(folder, request.param, eds(), heartbeat_ms)
    return request.param, opinion_of(suite, make)


def test_the_list_speaks_of_these_versions() -> None:
    """Another version may depart otherwise: the list is made anew then."""
    assert VERSIONS == KNOWN


@pytest.mark.parametrize("device", DEVICES)
def test_every_row_cites_its_clause(device: str) -> None:
    """Rules are known, once each, and cite what the catalogue does; what follows is listed."""
    known, listed = load("generic"), [row["rule"] for row in rows(device)]
    assert len(set(listed)) == len(listed)
    for row in rows(device):
        assert row["clause"] == known[row["rule"]].clause
        assert row["seen"].endswith(".")
        assert row.get("follows", row["rule"]) in listed


@pytest.mark.slow
def test_the_suite_runs_to_its_end(seen: tuple[str, Opinion]) -> None:
    """Every test comes to an outcome of ours, none breaks, most of them pass or do not apply."""
    _, opinion = seen
    judged = {outcome.PASSED, outcome.FAILED, outcome.NOT_APPLICABLE, outcome.INCONCLUSIVE}
    assert set(opinion.outcomes) <= judged, opinion.texts.get("broken")
    assert opinion.outcomes[outcome.PASSED] > 100


@pytest.mark.slow
def test_it_blames_what_is_listed_and_nothing_else(seen: tuple[str, Opinion]) -> None:
    """The rules of the list are those that were broken."""
    device, opinion = seen
    listed = {row["rule"] for row in rows(device)}
    unlisted = {rule: opinion.texts[rule] for rule in set(opinion.blamed) - listed}
    assert unlisted == {}
    assert listed - set(opinion.blamed) == set()


@pytest.mark.slow
def test_each_is_found_by_a_test_that_claims_it(seen: tuple[str, Opinion]) -> None:
    """But for what follows from another one."""
    device, opinion = seen
    sought = {row["rule"] for row in rows(device) if "follows" not in row}
    assert sought - {rule for rule in opinion.blamed if opinion.claimed[rule]} == set()
