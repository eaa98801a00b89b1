"""The matrix mutant x test: is each faulty model blamed, and each different one spared?

    python -m tests.meta.matrix                  every mutant and every variant
    python -m tests.meta.matrix NAME [NAME ...]  these alone
    python -m tests.meta.matrix --write-docs     all, and docs/mutants*.md are written again
    python -m tests.meta.matrix --table FILE     nothing is run: an earlier table is judged again

Every test runs on every model, in virtual time, strictly; see `proving` for how and `proof`
for what is wrong. The table goes to `reports/<run>/matrix.json`; that of every model of a kind
also to `reports/matrix.json`, where the reports of later runs find it.
"""

from __future__ import annotations

import argparse
import difflib
import json
import os
import sys
import time
from collections.abc import Iterator, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from hil_tests.reporting.rundir import RunDirectory, replace_file
from tests.meta.models import KINDS, Kind
from tests.meta.proof import Proof, function_of, load_listed, problems, prove
from tests.meta.proof_pages import as_data, from_data, page
from tests.meta.proving import ROOT, Suite, Trial, collect, try_each

DOCS = {
    "keypad": ROOT / "docs" / "mutants.md",
    "drive": ROOT / "docs" / "mutants-drive.md",
}
EVERYBODY = tuple(name for kind in KINDS.values() for name in (kind.name, *kind.everybody[1:]))
"""The right model of each kind goes by the name of the kind."""


def arguments(words: Sequence[str]) -> argparse.Namespace:
    """The command line.

    Raises:
        SystemExit: wrong use; unknown models are named with their near misses.
    """
    parser = argparse.ArgumentParser(prog="python -m tests.meta.matrix", description=__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", help="of a mutant or variant")
    parser.add_argument("--table", type=Path, metavar="FILE", help="matrix.json of an earlier run")
    parser.add_argument("--kind", choices=KINDS, help="only the models of this kind")
    parser.add_argument("--write-docs", action="store_true", help="write docs/mutants*.md")
    help_text = "so many models at once (default: one a core); 0 = all in this process"
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1, help=help_text)
    parser.add_argument("--reports", type=Path, default=ROOT / "reports")
    found = parser.parse_args(words)
    for name in found.names:
        if name not in EVERYBODY:
            near = difflib.get_close_matches(name, EVERYBODY)
            parser.error(f"no mutant or variant {name!r}; did you mean {', '.join(near) or '-'}?")
    if found.write_docs and found.names:  # a page of some models would drop the others
        parser.error("--write-docs needs every model; leave the names out")
    return found


def line_of(suite: Suite, trial: Trial) -> str:
    """What came of one model."""
    name, proof = trial.model, prove(suite, [trial])
    if name in proof.killers:
        killers = list(dict.fromkeys(map(function_of, proof.killers[name])))
        good, text = bool(killers), f"killed by {len(killers)} tests: {', '.join(killers[:1])}"
    else:
        good, text = not proof.harmed[name], "HARMED" if proof.harmed[name] else "spared"
    mark = "ok " if good and name not in proof.broken else "BAD"
    return f"{mark} {name or proof.kind.title:44s} {trial.seconds:5.1f} s  {text}"


def run(suite: Suite, names: Sequence[str], workers: int) -> Proof:
    """Try models, say of each what came of it, and prove; the order of names is kept."""
    trials = {}
    for trial in try_each(suite, names, workers):
        print(line_of(suite, trial), flush=True)  # noqa: T201
        trials[trial.model] = trial
    return prove(suite, [trials[name] for name in names])


def wanted(kind: Kind, chosen: argparse.Namespace) -> list[str]:
    """The models of a kind that were asked for; the right one is called "" from here on."""
    if chosen.kind not in {None, kind.name}:
        return []
    own = {kind.name: ""}
    names = [own.get(name, name) for name in chosen.names]
    return [name for name in names if name in kind.everybody] if names else list(kind.everybody)


def proofs_of(chosen: argparse.Namespace) -> Iterator[Proof]:
    """The table of each kind of which models were asked for."""
    data = json.loads(chosen.table.read_text("utf-8")) if chosen.table else None
    for kind in KINDS.values():
        names = wanted(kind, chosen)
        if data is not None and names:
            yield from_data(data, kind)
        elif names:
            say(f"collecting the tests of the {kind.name}")
            suite = collect(f"--can-profile={kind.name}")
            say(f"{len(suite.cases)} tests on {len(names)} models; some seconds until the first")
            yield run(suite, names, chosen.workers)


def say(text: str) -> None:
    """What goes on before there is a line of the table."""
    print(text, file=sys.stderr, flush=True)  # noqa: T201


def keep_latest(path: Path, data: dict[str, Any]) -> None:
    """Write the last whole table of each kind; one of another kind that is there stays."""
    before = json.loads(path.read_text("utf-8")) if path.is_file() else {}
    kinds = {each["kind"] for each in data["variants"].values()}
    joined = dict(data)
    for table in ("mutants", "variants", "tests"):
        others = {k: v for k, v in before.get(table, {}).items() if v["kind"] not in kinds}
        joined[table] = {**others, **data[table]}
    replace_file(path, json.dumps(joined, indent=1).encode())


def main(words: Sequence[str]) -> int:
    """Print the matrix, write it down; exit status 1 where something is wrong with the suite."""
    chosen = arguments(words)
    began = time.monotonic()
    wrong: list[str] = []
    proofs = []
    for proof in proofs_of(chosen):
        listed = load_listed(proof.kind.reasons)
        whole = {*proof.killers, *proof.harmed} == set(proof.kind.everybody)
        wrong += problems(proof, listed, whole=whole)
        proofs.append(proof)
        if chosen.write_docs:
            DOCS[proof.kind.name].write_text(page(proof, listed), "utf-8")
    seconds = time.monotonic() - began
    table = chosen.table
    if not table:
        table = RunDirectory.create(chosen.reports, datetime.now(UTC)).path / "matrix.json"
        data = as_data(proofs, wrong, seconds)
        replace_file(table, json.dumps(data, indent=1).encode())
        if not chosen.names:
            keep_latest(chosen.reports / table.name, data)
    for line in wrong:
        print(line)  # noqa: T201
    count = sum(len(proof.killers) + len(proof.harmed) for proof in proofs)
    print(f"{count} models in {seconds:.0f} s, {len(wrong)} problems; {table}")  # noqa: T201
    return int(bool(wrong))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
