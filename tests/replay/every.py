"""Every faulty model recorded and judged again from its record: `python -m tests.replay.every`.

    python -m tests.replay.every                         all, by the tests that concern their fault
    python -m tests.replay.every --kind drive NAME ...   these alone

A job of its own, because it takes minutes; `test_mutants` does the same with some of them.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

from hil_tests.run.opening import open_bench
from tests.meta.models import KINDS
from tests.meta.proving import Suite, collect
from tests.replay.twice import concerned
from tests.replay.twice import record as recorded
from tests.replay.twice import replay as replayed

TESTS_EACH = 30
"""The first tests that concern its fault."""


def differences(
    suite: Suite, name: str, violates: tuple[str, ...], folder: Path
) -> tuple[int, list[str], bool]:
    """What a record of one model says otherwise than the bus said.

    Returns:
        How many tests were compared; those that differ; whether one of them shows the fault.
    """
    plan = replace(suite.plan, mutant=name)
    bench = open_bench(plan)
    cases = concerned(suite, violates, TESTS_EACH)
    different, shown = [], set[str]()
    for case in cases:
        on_the_bus = recorded(case, bench, plan, folder / "t.pcapng")
        if replayed(case, plan, folder / "t.pcapng") != on_the_bus:
            different.append(f"{name}: {case.test}")
        shown |= {finding.requirement for finding in on_the_bus.findings}
    return len(cases), different, bool(shown & set(violates))


def main() -> int:
    """Returns 0 if every record says what the bus said."""
    parser = argparse.ArgumentParser(prog="tests.replay.every", description=__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", help="of a mutant")
    parser.add_argument("--kind", choices=("keypad", "drive"), default="keypad")
    chosen = parser.parse_args()
    suite = collect(f"--can-profile={chosen.kind}")
    mutants = KINDS[chosen.kind].mutants
    pairs, wrong, unseen = 0, list[str](), list[str]()
    with TemporaryDirectory() as folder:
        for name in chosen.names or mutants:
            count, different, shown = differences(
                suite, name, mutants[name].violates, Path(folder)
            )
            pairs, wrong = pairs + count, wrong + different
            unseen += [] if shown else [name]
            print(f"{'ok ' if not different else 'NO '} {name} {count}", flush=True)  # noqa: T201
    print(*wrong, sep="\n")  # noqa: T201
    print(f"{pairs} tests on {len(chosen.names or mutants)} models, {len(wrong)} differ")  # noqa: T201
    print("not shown by these tests:", *unseen)  # noqa: T201
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
