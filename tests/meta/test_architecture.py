"""The shape of the project: who imports whom, how long things are, what texts must have.

Judged from the source files as they lie in the checkout, and from pyproject.toml.
"""

from __future__ import annotations

import ast
import re
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PACKAGES = ("node_model", "hil_tests")
SOURCES = (*PACKAGES, "tests", "benchmarks")
MODULE_LINES = 400
TEST_MODULE_LINES = 500
"""A file of tests is a list of cases, read one at a time."""
OUTSIDER = "tests/external/device"
"""A device as somebody else would write it; it is no part of ours."""
FUNCTION_LINES = 70
TEXTS = {".c", ".cfg", ".eds", ".html", ".ini", ".j2", ".json", ".md", ".py", ".sh", ".toml"}

Function = ast.FunctionDef | ast.AsyncFunctionDef


def modules(*folders: str) -> list[str]:
    """Paths of the Python files below some folders of the checkout, relative to it."""
    found = (path for folder in folders for path in (ROOT / folder).rglob("*.py"))
    return sorted(str(path.relative_to(ROOT)) for path in found)


@cache
def parsed(module: str) -> ast.Module:
    """The syntax tree of a module."""
    return ast.parse((ROOT / module).read_text("utf-8"), module)


def functions(module: str) -> Iterator[Function]:
    """Every function and method of a module, nested ones included."""
    return (node for node in ast.walk(parsed(module)) if isinstance(node, Function))


def cases_of(module: str) -> Iterator[Function]:
    """The functions of a module that pytest collects."""
    return (function for function in functions(module) if function.name.startswith("test_"))


def texts() -> Iterator[Path]:
    """Every text file that belongs to the project, wherever it lies in the checkout."""
    folders = (*SOURCES, "docs", ".ci")
    yield from (path for path in ROOT.iterdir() if path.is_file() and path.suffix in TEXTS)
    for folder in folders:
        yield from (
            path
            for path in (ROOT / folder).rglob("*")
            if path.is_file() and (path.suffix in TEXTS or folder == ".ci")
        )


@pytest.mark.slow
def test_every_import_contract_is_kept() -> None:
    """Who may import whom, as pyproject.toml says under [tool.importlinter]."""
    command = [str(Path(sys.executable).with_name("lint-imports")), "--no-cache"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


def test_every_part_of_hil_tests_stands_in_a_contract() -> None:
    """A new module or package says what it may import; the api re-exports, so it may name all."""
    config = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
    contracts = config["tool"]["importlinter"]["contracts"]
    named = {
        module
        for contract in contracts
        for module in (*contract.get("source_modules", ()), *contract.get("protected_modules", ()))
    }
    parts = {
        f"hil_tests.{path.stem}"
        for path in (ROOT / "hil_tests").iterdir()
        if path.suffix == ".py" or (path / "__init__.py").is_file()
    }
    free = {"hil_tests.__init__", "hil_tests.__main__", "hil_tests.api"}
    assert parts - named - free == set()


@pytest.mark.parametrize("module", modules(*SOURCES))
def test_a_module_is_short_enough_to_read(module: str) -> None:
    """No module has more than 400 lines, no file of tests more than 500."""
    size = len((ROOT / module).read_text("utf-8").splitlines())
    limit = TEST_MODULE_LINES if module.startswith("tests") else MODULE_LINES
    assert size <= limit


@pytest.mark.parametrize("module", modules(*SOURCES))
def test_a_function_fits_on_a_screen(module: str) -> None:
    """No function has more than 70 lines, its docstring included."""
    long = {
        function.name: size
        for function in functions(module)
        if (size := (function.end_lineno or 0) - function.lineno + 1) > FUNCTION_LINES
    }
    assert long == {}


@pytest.mark.parametrize("module", modules(*SOURCES))
def test_a_module_says_what_it_is(module: str) -> None:
    """Every module that has code begins with a docstring."""
    tree = parsed(module)
    assert not tree.body or ast.get_docstring(tree)


@pytest.mark.parametrize("module", modules("tests", "hil_tests/acceptance"))
def test_a_test_states_its_fact(module: str) -> None:
    """Every test has a docstring whose first line is a whole sentence."""
    silent = []
    for function in cases_of(module):
        first = (ast.get_docstring(function) or "").partition("\n\n")[0].strip()
        if not first.endswith((".", "?", "!", ":")):
            silent.append(function.name)
    assert silent == []


@pytest.mark.parametrize("module", modules(OUTSIDER))
def test_the_outsider_shares_nothing_with_us(module: str) -> None:
    """The device that nobody here wrote imports no model and no suite, or it proves nothing."""
    names = {
        name
        for node in ast.walk(parsed(module))
        if isinstance(node, ast.Import | ast.ImportFrom)
        for name in (
            [node.module or ""]
            if isinstance(node, ast.ImportFrom)
            else [alias.name for alias in node.names]
        )
    }
    assert names
    assert not {name for name in names if name.partition(".")[0] in PACKAGES}


@pytest.mark.parametrize("module", modules("hil_tests/acceptance"))
def test_acceptance_tests_share_steps_and_no_tests(module: str) -> None:
    """No module imports a module of tests: what several need is a step, in a `*_steps.py`."""
    found = [
        node.module
        for node in ast.walk(parsed(module))
        if isinstance(node, ast.ImportFrom)
        and (node.module or "").rpartition(".")[2].startswith("test_")
    ]
    assert found == []


@pytest.mark.parametrize("module", modules("tests", "hil_tests/acceptance"))
def test_tests_do_not_sleep(module: str) -> None:
    """No test waits for the wall clock: nothing named sleep is called or imported."""
    sleepers = []
    for node in ast.walk(parsed(module)):
        if isinstance(node, ast.ImportFrom):
            sleepers += [node.lineno for name in node.names if name.name == "sleep"]
        elif isinstance(node, ast.Attribute) and node.attr == "sleep":
            sleepers.append(node.lineno)
    assert sleepers == []


@pytest.mark.parametrize("package", PACKAGES)
def test_a_package_says_that_it_is_typed(package: str) -> None:
    """Type checkers of users find the annotations (PEP 561)."""
    assert (ROOT / package / "py.typed").is_file()


@pytest.mark.parametrize("package", PACKAGES)
def test_every_folder_with_modules_is_a_package(package: str) -> None:
    """A folder without __init__.py would be missing from a wheel or from mypy."""
    folders = {path.parent for path in (ROOT / package).rglob("*.py")}
    bare = sorted(str(f.relative_to(ROOT)) for f in folders if not (f / "__init__.py").is_file())
    assert bare == []


def _words(path: Path) -> str:
    """What a text says; some EDS files of the tests are in other encodings, on purpose."""
    return path.read_bytes().replace(b"\0", b"").decode("utf-8", "replace")


def test_no_text_names_a_place_on_somebodys_machine() -> None:
    """No file holds an absolute path of a workplace or of a home."""
    place = re.compile(r"(?<![\w.)\]}*-])/(?:work|home|Users|tmp/np)/")
    found = [
        f"{path.relative_to(ROOT)}:{number}: {line.strip()}"
        for path in texts()
        if path != Path(__file__)
        for number, line in enumerate(_words(path).splitlines(), start=1)
        if place.search(line)
    ]
    assert found == []


def test_every_ignored_lint_rule_has_its_reason() -> None:
    """Each rule that ruff is told to ignore stands on a line with a comment."""
    text = (ROOT / "pyproject.toml").read_text("utf-8")
    section = text.partition("[tool.ruff.lint]")[2].partition("\nignore = [")[2]
    bare = [
        line.strip()
        for line in section.partition("\n[tool.ruff.lint.flake8")[0].splitlines()
        if re.search(r'"[A-Z]+[0-9]+"', line) and "  # " not in line and " # " not in line
    ]
    assert section
    assert bare == []


@pytest.mark.parametrize("module", modules(*SOURCES))
def test_a_silenced_checker_is_told_which_rule(module: str) -> None:
    """`noqa` and `type: ignore` name the rule, so that they silence nothing else."""
    blanket = re.compile(r"#\s*(?:noqa(?!: ?[A-Z])|type:\s*ignore(?!\[))")
    lines = (ROOT / module).read_text("utf-8").splitlines()
    found = [n for n, line in enumerate(lines, start=1) if blanket.search(line)]
    assert module == "tests/meta/test_architecture.py" or found == []
