"""The matrix for programs (matrix.json) and for people (docs/mutants.md)."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from tests.meta.models import Kind as DeviceKind
from tests.meta.proof import Listed, Proof, function_of

SCHEMA = "nodeproof-matrix/1"
SHOWN = 4
"""So many tests are named in a row; the others are counted."""

HEAD = """# {title}: mutants and variants

The acceptance suite is proved by putting it in front of faulty {kind}s, which it must find, and of
different but conforming ones, which it must spare. `tox -e mutants` does that with every test, in
virtual time. It fails if a mutant survives, if a test blames a device for a requirement that it
keeps, if a variant is harmed, if a judged requirement has no mutant, or if a test finds none. This
page is what it found; `python -m tests.meta.matrix --write-docs` writes it again.

- A mutant is *killed* by a test that claims a requirement which the mutant violates, and fails on
  such a requirement.
- Try one: `pytest --can-mutant NAME`. `pytest --can-mutant list` prints their names.
"""


def as_data(proofs: Sequence[Proof], wrong: Sequence[str], seconds: float) -> dict[str, Any]:
    """The matrix as JSON values: the models of all kinds in one table."""
    parts = [_part(proof) for proof in proofs]
    tables = ("mutants", "variants", "tests", "broken")
    joined = {table: {k: v for part in parts for k, v in part[table].items()} for table in tables}
    return {"schema": SCHEMA, "seconds": round(seconds, 1), **joined, "problems": list(wrong)}


def _part(proof: Proof) -> dict[str, dict[str, Any]]:
    """The table of one kind; its right model goes by the name of the kind."""
    alone = proof.sole_killers()
    mutants, variants, kind = proof.kind.mutants, proof.kind.variants, proof.kind
    return {
        "mutants": {
            name: {
                "kind": kind.name,
                "text": mutants[name].text,
                "violates": list(mutants[name].violates),
                "killed_by": proof.killers[name],
                "kills": proof.kills[name],
                "false_blames": proof.false[name],
            }
            for name in proof.killers
        },
        "variants": {
            name or kind.name: {
                "kind": kind.name,
                "text": variants[name].text if name else kind.title,
                "allowed_by": variants[name].allowed_by if name else "",
                "harmed": harm,
            }
            for name, harm in proof.harmed.items()
        },
        "tests": {
            test: {
                "kind": kind.name,
                "claims": list(proof.tests[test]),
                "kills": kills,
                "alone": alone.get(test, []),
            }
            for test, kills in proof.killed_by().items()
        },
        "broken": {name or kind.name: errors for name, errors in proof.broken.items()},
    }


def from_data(data: Mapping[str, Any], kind: DeviceKind) -> Proof:
    """The table of one kind as it was written."""
    mutants, variants, tests = (
        {name: each for name, each in data[table].items() if each["kind"] == kind.name}
        for table in ("mutants", "variants", "tests")
    )
    own = {kind.name: ""}
    return Proof(
        kind=kind,
        kills={name: each["kills"] for name, each in mutants.items()},
        killers={name: each["killed_by"] for name, each in mutants.items()},
        false={name: each["false_blames"] for name, each in mutants.items()},
        harmed={own.get(name, name): each["harmed"] for name, each in variants.items()},
        broken={
            own.get(name, name): errors
            for name, errors in data["broken"].items()
            if name in {*mutants, *variants}
        },
        tests={name: tuple(each["claims"]) for name, each in tests.items()},
    )


def page(proof: Proof, listed: Listed) -> str:
    """The page of one kind of device."""
    kind = proof.kind
    head = HEAD.format(kind=kind.name, title=kind.name.capitalize())
    parts = [head, _by_requirement(proof), _by_test(proof, listed), _variants(kind)]
    if listed.collateral:
        parts.append(_collateral(listed))
    return "\n".join(parts)


def _by_requirement(proof: Proof) -> str:
    lines = [
        f"## {len(proof.kind.mutants)} mutants, by the requirement that they violate",
        "",
        "A test stands beside a mutant if it claims the requirement and fails on it. Where there",
        "is none, the mutant is found by another requirement that it violates.",
    ]
    proven = set(proof.kind.proven())
    for name, requirement in proof.kind.requirements.items():
        rows = list(_mutant_rows(name, proof))
        if not rows and name not in proven and not name.startswith(proof.kind.groups):
            continue
        lines += ["", f"### {name} ({requirement.kind.value})", "", requirement.text]
        if rows:
            lines += ["", *_table(("mutant", "its fault", "killed by"), rows)]
    return "\n".join([*lines, ""])


def _mutant_rows(requirement: str, proof: Proof) -> Iterator[tuple[str, ...]]:
    for mutant in proof.kind.mutants.values():
        if requirement in mutant.violates:
            kills = proof.kills.get(mutant.name, {})
            elsewhere = next(iter(kills), "its other requirements")
            tests = _tests(kills.get(requirement, ())) or f"see {elsewhere}"
            yield f"`{mutant.name}`", mutant.text, tests


def _by_test(proof: Proof, listed: Listed) -> str:
    alone = proof.sole_killers()
    rows = []
    for test, mutants in proof.killed_by().items():
        only = ", ".join(f"`{name}`" for name in alone.get(test, ()))
        rows.append((_short(test), ", ".join(proof.tests[test]), str(len(mutants)), only))
    lines = [
        "## Tests",
        "",
        "How many mutants each kills, and which of them no other test kills.",
        "",
    ]
    lines += _table(("test", "claims", "kills", "alone"), rows)
    if listed.idle:
        lines += ["", "These kill no mutant, and stay:", ""]
        lines += [f"- {_short(test)}: {reason}" for test, reason in listed.idle.items()]
    return "\n".join([*lines, ""])


def _variants(kind: DeviceKind) -> str:
    rows = [
        (f"`{each.name}`", each.text, each.allowed_by, ", ".join(each.departs))
        for each in kind.variants.values()
    ]
    text = "No test fails on any of these, but on readings of ours that it *departs from*."
    head = ("variant", "its difference", "allowed by", "departs from")
    return "\n".join([f"## {len(kind.variants)} variants", "", text, "", *_table(head, rows), ""])


def _collateral(listed: Listed) -> str:
    lines = [
        "## Blames that cannot be helped",
        "",
        "These mutants fail a requirement that they do not violate in the narrow sense.",
        "",
    ]
    rows = [
        (f"`{mutant}`", requirement, reason)
        for mutant, known in listed.collateral.items()
        for requirement, reason in known.items()
    ]
    return "\n".join([*lines, *_table(("mutant", "requirement", "why"), rows), ""])


def _table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> Iterator[str]:
    yield f"| {' | '.join(head)} |"
    yield f"| {' | '.join('---' for _ in head)} |"
    for row in rows:
        yield f"| {' | '.join(row)} |"


def _tests(tests: Sequence[str]) -> str:
    """A few names, and how many there are besides."""
    names = list(dict.fromkeys(map(_short, map(function_of, tests))))
    more = len(names) - SHOWN
    return ", ".join(names[:SHOWN]) + (f" and {more} more" if more > 0 else "")


def _short(test: str) -> str:
    return f"`{test.rpartition('::')[2].removeprefix('test_')}`"
