"""The matrix mutant x suite: is each faulty model blamed, and each different one spared?

    python -m tests.meta.matrix                  every mutant and every variant
    python -m tests.meta.matrix NAME [NAME ...]  these alone

A mutant is killed when, with --can-strict, a test that claims a requirement which the
mutant violates ends with a FAIL on such a requirement. A variant is harmed when any test
fails on it; with --can-strict on rows that it departs from it may.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from node_model.faults import MUTANTS, VARIANTS, Mutant, Variant

ROOT = Path(__file__).parents[2]
WORKERS = 2
BAD = ("failed", "error", "inconclusive")


@dataclass(frozen=True, slots=True)
class Cell:
    """What the suite said of one model.

    Args:
        name: of the mutant or variant.
        good: killed and blamed, or spared.
        text: by which test, or what is wrong.
        seconds: wall time.
    """

    name: str
    good: bool
    text: str
    seconds: float


def results_of(name: str, *options: str) -> list[dict[str, Any]]:
    """Run the acceptance suite against a model; the results of its tests."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider"]
        command += [f"--can-reports={folder}", f"--can-mutant={name}", *options]
        done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
        found = list(Path(folder).glob("2*/results.json"))
        if not found:
            raise RuntimeError(f"{name}: no results\n{done.stdout[-2000:]}{done.stderr[-2000:]}")
        results: list[dict[str, Any]] = json.loads(found[0].read_text())["results"]
        return results


def blames(result: dict[str, Any], violates: Sequence[str]) -> bool:
    """Whether a test claims one of these requirements and fails on one of them."""
    claims = set(result["requirements"]) & set(violates)
    fails = any(
        row["outcome"] == "failed" and row["requirement"] in violates for row in result["verdicts"]
    )
    return bool(claims) and fails


def try_mutant(mutant: Mutant) -> Cell:
    """Put a mutant under the tests that claim what it violates; first failure first."""
    began = time.perf_counter()
    clauses = [f"--can-clause={name}" for name in mutant.violates]
    seen: list[str] = []
    for extra in (["--maxfail=1"], []):
        results = results_of(mutant.name, "--can-strict", *clauses, *extra)
        killers = [each["test"] for each in results if blames(each, mutant.violates)]
        if killers:
            text = killers[0].rpartition("/")[2]
            return Cell(mutant.name, True, text, time.perf_counter() - began)
        seen = [
            f"{row['requirement']} in {each['test'].rpartition('::')[2]}"
            for each in results
            for row in each["verdicts"]
            if row["outcome"] == "failed"
        ]
    blamed = f"blamed instead: {', '.join(sorted(set(seen))[:3])}" if seen else "survives"
    text = f"violates {', '.join(mutant.violates)}; {blamed}"
    return Cell(mutant.name, False, text, time.perf_counter() - began)


def try_variant(variant: Variant) -> Cell:
    """Put a variant under the whole suite, strictly; rows that it departs from may fail."""
    began = time.perf_counter()
    departs = set(getattr(variant, "departs", ()))
    harmed = []
    for each in results_of(variant.name, "--can-strict"):
        rows = [row for row in each["verdicts"] if row["outcome"] in BAD]
        if each["outcome"] in BAD and not rows:
            harmed.append(f"{each['test'].rpartition('::')[2]}: {each['text'][:100]}")
        harmed += [
            f"{each['test'].rpartition('::')[2]}: {row['text'][:120]}"
            for row in rows
            if row["requirement"] not in departs
        ]
    text = "; ".join(harmed[:3]) if harmed else "spared"
    return Cell(variant.name, not harmed, text, time.perf_counter() - began)


def _try(model: Mutant | Variant) -> Cell:
    try:
        return try_mutant(model) if isinstance(model, Mutant) else try_variant(model)
    except RuntimeError as error:
        return Cell(model.name, False, str(error)[-300:], 0.0)


def try_all(models: Iterable[Mutant | Variant]) -> Iterable[Cell]:
    """Try models on every core, in order."""
    with ThreadPoolExecutor(WORKERS) as pool:
        yield from pool.map(_try, models)


Trial = Callable[[Iterable[Mutant | Variant]], Iterable[Cell]]


def main(names: Sequence[str], trial: Trial = try_all) -> int:
    """Print the matrix; exit status 1 where a mutant survives or a variant is harmed."""
    models: list[Mutant | Variant] = [*MUTANTS.values(), *VARIANTS.values()]
    chosen = [model for model in models if not names or model.name in names]
    wrong = 0
    for cell in trial(chosen):
        wrong += not cell.good
        mark = "ok " if cell.good else "BAD"
        print(f"{mark} {cell.name:42s} {cell.seconds:6.1f} s  {cell.text}", flush=True)  # noqa: T201
    print(f"{len(chosen)} models, {wrong} wrong")  # noqa: T201
    return int(bool(wrong))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
