"""Which tests can be run on this bench, and which requirements were asked for."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING

import pytest

from hil_tests.bench import terms
from hil_tests.requirements import FACILITIES, Requirement, load_all, near
from hil_tests.run.stash import CLAIMS, claimed, is_ours

if TYPE_CHECKING:
    from hil_tests.run.plan import Plan


def check(items: Sequence[pytest.Item], plan: Plan) -> None:
    """Refuse ids and beginnings of ids that no requirement has.

    Raises:
        pytest.UsageError: all of them, each with its near misses.
    """
    check_ids(items, load_all())
    check_clauses(plan.settings["can_clause"], plan.requirements)


def of_device(
    items: Iterable[pytest.Item], plan: Plan
) -> tuple[list[pytest.Item], list[pytest.Item]]:
    """Tests that concern this device, and those that concern others alone.

    What is asked because of a data sheet alone is asked by the tests that claim it first:
    those that claim it besides are of services that this kind of device need not have.
    From here on a test claims those of its requirements that are asked of this device.
    """
    chosen: list[pytest.Item] = []
    others: list[pytest.Item] = []
    for item in items:
        concerned = True
        if is_ours(item):
            names = claimed(item)
            known = tuple(name for name in names if name in plan.requirements)
            concerned = known[:1] == names[:1] or bool(set(known) - plan.by_sheet)
            item.stash[CLAIMS] = known
        (chosen if concerned else others).append(item)
    return chosen, others


def mark_not_run(items: Iterable[pytest.Item], plan: Plan) -> None:
    """Skip what this bench cannot run, and say why; known before any bus is touched."""
    for item in items:
        reason = why_not(item, plan)
        if reason:
            item.add_marker(pytest.mark.skip(reason=reason))


def check_ids(items: Iterable[pytest.Item], known: Mapping[str, Requirement]) -> None:
    """Refuse markers with ids that are none.

    Raises:
        pytest.UsageError: all of them, each with its near misses.
    """
    wrong = []
    for item in items:
        for name in claimed(item) or ("",):
            if name not in known:
                hint = ", ".join(near(known, name)) or f"known are {', '.join(known)}"
                wrong.append(f"{item.nodeid}: unknown requirement {name!r}; did you mean {hint}?")
    if wrong:
        raise pytest.UsageError("\n".join(sorted(set(wrong))))


def check_clauses(prefixes: Sequence[str], known: Mapping[str, Requirement]) -> None:
    """Refuse --can-clause values that no requirement begins with.

    Raises:
        pytest.UsageError: all of them, each with its near misses.
    """
    wrong = []
    for prefix in prefixes:
        if not any(name.startswith(prefix.upper()) for name in known):
            group = prefix.upper().rpartition("-")[0] or prefix.upper()
            beside = [name for name in known if name.startswith(f"{group}-")]
            hint = ", ".join(near(known, prefix) or beside or groups(known))
            wrong.append(f"--can-clause {prefix}: no requirement begins so; there are {hint}")
    if wrong:
        raise pytest.UsageError("\n".join(wrong))


def groups(known: Iterable[str]) -> list[str]:
    """The beginnings of the ids, e.g. COM, NMT, C-HB."""
    return sorted({name.rpartition("-")[0] for name in known})


def by_clause(
    items: Iterable[pytest.Item], prefixes: Sequence[str]
) -> tuple[list[pytest.Item], list[pytest.Item]]:
    """Tests with a requirement that begins with one of the prefixes, and the others."""
    wanted = tuple(prefix.upper() for prefix in prefixes)
    chosen: list[pytest.Item] = []
    others: list[pytest.Item] = []
    for item in items:
        hit = not wanted or any(name.startswith(wanted) for name in claimed(item))
        (chosen if hit else others).append(item)
    return chosen, others


def why_not(item: pytest.Item, plan: Plan) -> str:
    """Why this bench cannot run a test, from its declaration alone; "" = it can."""
    marker = item.get_closest_marker("virtual")
    if marker and not plan.virtual:
        return f"runs in virtual time only: {_reason(marker)}"
    marker = item.get_closest_marker("timed")
    if marker and not plan.timed:
        return f"{plan.channel} is an untimed wire: {_reason(marker)}"
    names = {*getattr(item, "fixturenames", ()), *_needs(item)}
    lacks = [name for name in FACILITIES if name in names and name not in plan.facilities]
    if lacks:
        return lacking(plan, lacks)
    return ""


def lacking(plan: Plan, lacks: Sequence[str]) -> str:
    """Which facilities a bench has not, and how to add them."""
    has = ", ".join(map(terms.facility_name, plan.facilities)) or "nothing"
    missing, sections = terms.lacking(lacks)
    where = "its file" if plan.bench_file else "a bench file (--can-bench FILE)"
    return f"bench {plan.bench_name!r} has {missing} (it has {has}); add {sections} to {where}"


def by_scenario(items: Iterable[pytest.Item]) -> tuple[list[pytest.Item], list[pytest.Item]]:
    """The tests that play the scenarios of the command line, and the others."""
    chosen: list[pytest.Item] = []
    others: list[pytest.Item] = []
    for item in items:
        (chosen if "stored" in getattr(item, "fixturenames", ()) else others).append(item)
    return chosen, others


def _needs(item: pytest.Item) -> tuple[str, ...]:
    """Facilities that a test names in a marker."""
    marker = item.get_closest_marker("needs")
    return tuple(map(str, marker.args)) if marker else ()


def _reason(marker: pytest.Mark) -> str:
    return str(marker.args[0]) if marker.args else "see the test"
