"""Every requirement has a test, and every test claims requirements that there are."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

from hil_tests.requirements import load_all

ACCEPTANCE = Path(__file__).parents[2] / "hil_tests" / "acceptance"


def acceptance_tests() -> Iterator[tuple[str, ast.FunctionDef]]:
    """Every acceptance test, with the name of its file."""
    for path in sorted(ACCEPTANCE.rglob("test_*.py")):
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            if isinstance(node, ast.FunctionDef) and node.name.startswith("test_"):
                yield path.name, node


def claims(test: ast.FunctionDef) -> list[str]:
    """The ids in its `requirement` markers."""
    return [
        argument.value
        for mark in test.decorator_list
        if isinstance(mark, ast.Call) and ast.unparse(mark.func) == "pytest.mark.requirement"
        for argument in mark.args
        if isinstance(argument, ast.Constant) and isinstance(argument.value, str)
    ]


def test_every_requirement_has_a_test() -> None:
    """There is none without a test that claims it, but for those that say why none can."""
    claimed = {name for _, test in acceptance_tests() for name in claims(test)}
    untested = {name for name, each in load_all().items() if each.untested}
    assert sorted(set(load_all()) - claimed - untested) == []
    assert sorted(untested & claimed) == []


def test_every_test_claims_known_requirements() -> None:
    """There is no acceptance test without a requirement, and none with an unknown one."""
    known = set(load_all())
    wrong = [
        f"{file}:{test.lineno} {test.name}"
        for file, test in acceptance_tests()
        if not claims(test) or set(claims(test)) - known
    ]
    assert wrong == []


def test_every_test_says_in_a_sentence_what_it_shows() -> None:
    """Each acceptance test has a docstring that is a sentence."""
    silent = [
        f"{file}:{test.lineno} {test.name}"
        for file, test in acceptance_tests()
        if not (ast.get_docstring(test) or "").partition("\n\n")[0].strip().endswith(".")
    ]
    assert silent == []
