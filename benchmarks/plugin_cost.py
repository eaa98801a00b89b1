"""What the pytest plugin costs: to import, and for each test over bare pytest.

    python -m benchmarks.plugin_cost

The import is timed in a fresh interpreter in which pytest is loaded already. The cost of a
test is that of 1000 trivial tests less that of one, with the plugin and without, so that
starting up is not counted. Other plugins are kept out. Medians of five, interleaved.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from statistics import median

from benchmarks.tables import against, interleaved, show

_ROOT = Path(__file__).resolve().parent.parent
_IMPORT_BAR_MS = 50.0
_TEST_BAR_MS = 1.5
_DEAREST = 5

_IMPORT = """
import sys, pytest
from time import perf_counter
began = perf_counter()
__import__(sys.argv[1])
print(perf_counter() - began)
"""


def _environment() -> dict[str, str]:
    """This one, with the checkout importable and no plugin loaded by itself."""
    known = os.environ.get("PYTHONPATH")
    paths = str(_ROOT) if known is None else os.pathsep.join((str(_ROOT), known))
    return {**os.environ, "PYTHONPATH": paths, "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"}


def _python(*arguments: str, folder: Path | None = None) -> subprocess.CompletedProcess[str]:
    """A fresh interpreter; its words are shown where it fails."""
    done = subprocess.run(
        (sys.executable, *arguments),
        cwd=folder,
        env=_environment(),
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode:
        print(done.stdout[-2000:], done.stderr[-2000:], sep="\n")
        done.check_returncode()
    return done


def import_s(plugin: str) -> float:
    """Seconds to import the plugin where pytest is loaded."""
    return float(_python("-c", _IMPORT, plugin).stdout)


def dearest(plugin: str) -> list[tuple[int, str]]:
    """The modules that cost most to import by themselves: us and name."""
    words = _python("-X", "importtime", "-c", f"import pytest; print(); import {plugin}").stderr
    lines = [line.partition(":")[2].split("|") for line in words.splitlines() if "|" in line]
    names = [line[2].strip() for line in lines]
    mine = lines[names.index("pytest") + 1 :]
    return sorted(((int(line[0]), line[2].strip()) for line in mine), reverse=True)[:_DEAREST]


def write_tests(folder: Path, count: int) -> None:
    """A folder with that many tests that do nothing."""
    folder.mkdir()
    (folder / "pytest.ini").write_text("[pytest]\n", "utf-8")
    tests = (f"def test_{number}():\n    pass\n" for number in range(count))
    (folder / "test_trivial.py").write_text("\n\n".join(tests), "utf-8")


def session_s(folder: Path, plugins: Sequence[str]) -> float:
    """Processor seconds of a pytest session in that folder."""
    before = os.times()
    _python("-m", "pytest", "-q", "-p", "no:cacheprovider", *plugins, ".", folder=folder)
    after = os.times()
    return (
        after.children_user + after.children_system - before.children_user - before.children_system
    )


def sessions(plugin: str, count: int, rounds: int) -> dict[str, list[float]]:
    """Seconds of the four kinds of session: with the plugin or bare, many tests or one."""
    with tempfile.TemporaryDirectory() as name:
        many, one = Path(name) / "many", Path(name) / "one"
        write_tests(many, count)
        write_tests(one, 1)
        loaded = ("-p", plugin)
        measures: dict[str, Callable[[], float]] = {
            "bare": partial(session_s, many, ()),
            "plugin": partial(session_s, many, loaded),
            "bare, one": partial(session_s, one, ()),
            "plugin, one": partial(session_s, one, loaded),
        }
        return interleaved(measures, rounds)


def each_ms(seconds: dict[str, list[float]], kind: str, count: int) -> list[float]:
    """Milliseconds a test, round by round, start-up left out."""
    pairs = zip(seconds[kind], seconds[f"{kind}, one"], strict=True)
    return [(many - one) / (count - 1) * 1e3 for many, one in pairs]


def show_import(plugin: str, rounds: int) -> None:
    """The cost of the import, and whose it is."""
    took_ms = median(import_s(plugin) for _ in range(rounds)) * 1e3
    bar = against(took_ms, _IMPORT_BAR_MS, least=False)
    show(f"Import of {plugin}, pytest being loaded", ("", "ms", "bar"), [
        ["all", f"{took_ms:.1f}", bar],
        *([f"  {name} itself", f"{us / 1e3:.1f}", ""] for us, name in dearest(plugin)),
    ])  # fmt: skip


def show_tests(plugin: str, count: int, rounds: int) -> None:
    """The cost of a test."""
    seconds = sessions(plugin, count, rounds)
    bare, loaded = each_ms(seconds, "bare", count), each_ms(seconds, "plugin", count)
    extra = median(with_it - without for with_it, without in zip(loaded, bare, strict=True))
    show(f"A test, of {count} trivial ones", ("", "ms/test", "bar"), [
        ["pytest alone", f"{median(bare):.3f}", ""],
        [f"with {plugin}", f"{median(loaded):.3f}", ""],
        ["the plugin's share", f"{extra:.3f}", against(extra, _TEST_BAR_MS, least=False)],
    ])  # fmt: skip


def main() -> int:
    """Measures and prints; 2 where there is no such plugin."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--plugin", default="hil_tests.plugin", metavar="MODULE")
    parser.add_argument("--tests", type=int, default=1000, metavar="N")
    parser.add_argument("--rounds", type=int, default=5, metavar="N")
    wanted = parser.parse_args()
    sys.path.insert(0, str(_ROOT))
    if find_spec(wanted.plugin) is None:
        print(f"no module {wanted.plugin} in this checkout: nothing to measure")
        return 2
    show_import(wanted.plugin, wanted.rounds)
    show_tests(wanted.plugin, wanted.tests, wanted.rounds)
    return 0


if __name__ == "__main__":
    sys.exit(main())
