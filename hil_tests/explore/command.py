"""The subcommands `explore`, `play` and `distil`: what they take, and what they print."""

from __future__ import annotations

import argparse
import shlex
import sys
import time
from collections.abc import Sequence
from difflib import get_close_matches
from pathlib import Path

from hil_tests.clock import S, parse_span, show_span
from hil_tests.decode import show_frames
from hil_tests.errors import ConfigError
from hil_tests.explore.distil import Distiller, Target, finds, thinned
from hil_tests.explore.lab import Lab
from hil_tests.explore.soak import Found, Progress, Soak, cores, run
from hil_tests.reporting.files import replace_file
from hil_tests.scenarios.corpus import Stored, parsed, written
from hil_tests.scenarios.families import FAMILIES
from hil_tests.scenarios.scenario import scenario
from node_model.faults import MUTANTS

FAILED = 1
"""Exit status: a device broke something."""
INTERRUPTED = 2
"""Exit status: ended by Ctrl-C, as pytest has it; what was found stands above."""
NOT_JUDGED = 12
"""Exit status: nothing was judged, as pytest's runs have it."""
LOST = 11
"""A worker process is gone."""


def _span(text: str) -> float:
    """Seconds."""
    try:
        return parse_span(text) / S
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from None


def _add_profile(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--profile", default="keypad", metavar="NAME|FILE", help="device profile (default keypad)"
    )


def _add_mutant(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--mutant",
        metavar="NAME",
        help="this faulty or different model; `nodeproof mutants` lists them",
    )


# Explore.


def explore(parser: argparse.ArgumentParser, words: Sequence[str]) -> int:
    """Walk through scenarios in virtual time, and print one line for each finding."""
    parser.description = (
        "Play made-up scenarios on the bundled model in virtual time, on every core, judged by\n"
        "every oracle there is. Each finding is one line that plays again anywhere."
    )
    parser.add_argument(
        "--for", dest="span", type=_span, default=60.0, metavar="TIME",
        help='how long, e.g. 10min or 1h (default "60 s")',
    )  # fmt: skip
    parser.add_argument("--seed", type=int, default=0, help="another seed, other scenarios")
    parser.add_argument(
        "--jobs", type=int, default=cores(), help="worker processes (default: the cores)"
    )
    parser.add_argument(
        "--family", action="append", default=[], choices=sorted(FAMILIES), metavar="KIND",
        help="only this kind of scenario (see below); may be repeated",
    )  # fmt: skip
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.epilog = "kinds of scenarios:\n" + "\n".join(
        f"  {name:12s}{family.about}" for name, family in FAMILIES.items()
    )
    _add_profile(parser)
    _add_mutant(parser)
    options = parser.parse_args(words)
    if options.jobs < 1:
        parser.error("--jobs: at least one")
    return _explored(
        Soak(
            options.profile,
            options.mutant,
            options.seed,
            options.span,
            options.jobs,
            tuple(options.family),
        )
    )


def _explored(soak: Soak) -> int:
    Lab(soak.profile, soak.model)  # what is wrong with the names is told at once
    print(f"seed {soak.seed}; the same again: {shlex.join(_again(soak))}", flush=True)
    screen = _Screen(soak)
    try:
        whole = run(soak, screen.tell)
    except KeyboardInterrupt:
        screen.close()
        return INTERRUPTED
    screen.close()
    if not whole:
        print("a worker was lost; what it had found by then is above", file=sys.stderr)
    return FAILED if screen.findings else 0 if whole else LOST


def _again(soak: Soak) -> list[str]:
    """The command that explores the same."""
    span = show_span(round(soak.seconds * S)).replace(" ", "")
    command = ["nodeproof", "explore", f"--seed={soak.seed}", f"--jobs={soak.jobs}"]
    families = [f"--family={name}" for name in soak.families]
    return [*command, f"--for={span}", *families, *_named(soak)]


def _named(soak: Soak) -> list[str]:
    """The options that name the model."""
    named = [] if soak.profile == "keypad" else [f"--profile={soak.profile}"]
    return [*named, f"--mutant={soak.model}"] if soak.model else named


class _Screen:
    """Findings as lines; progress on a line of its own where somebody watches."""

    def __init__(self, soak: Soak) -> None:
        self._soak = soak
        self._latest: dict[int, Progress] = {}
        self._began_at = time.monotonic()
        self._return = "\r" if sys.stdout.isatty() else ""
        self.findings = 0

    def tell(self, message: Progress | Found) -> None:
        """What a worker says."""
        if isinstance(message, Found):
            self.findings += 1
            command = ["nodeproof", "play", message.scenario, *_named(self._soak)]
            print(f"{self._return}{message.text} | {shlex.join(command)}", flush=True)
            return
        self._latest[message.worker] = message
        if self._return:
            print(f"\r{self._line()}", end="", flush=True)

    def _line(self) -> str:
        latest = self._latest.values()
        played = sum(each.played for each in latest)
        hours = sum(each.bus_ns for each in latest) / (3600 * S)
        spent = max(time.monotonic() - self._began_at, 0.001)
        return (
            f"{played} scenarios ({played / spent:.0f}/s), {hours:.2f} bus hours,"
            f" {sum(each.frames for each in latest)} frames, {self.findings} findings"
        )

    def close(self) -> None:
        """The closing line."""
        print(f"{self._return}{self._line()}", flush=True)


# Play.


def play(parser: argparse.ArgumentParser, words: Sequence[str]) -> int:
    """Play one scenario on a model in virtual time, and show what happened."""
    parser.description = (
        "Play one scenario on the bundled model in virtual time: every frame, and what is wrong."
        " On a real bench: pytest --can-iface NAME --can-scenario TEXT"
    )
    parser.add_argument("scenario", help="the line that a finding printed")
    _add_profile(parser)
    _add_mutant(parser)
    options = parser.parse_args(words)
    lab = Lab(options.profile, options.mutant)
    try:
        finding = lab.play(scenario(options.scenario))
    except ValueError as error:
        raise ConfigError(str(error)) from None
    trace = lab.bench.trace
    if len(trace):
        node_id = lab.bench.parameters.node_id if lab.bench.parameters else None
        print("\n".join(show_frames(trace, 0, len(trace), node_id, trace.frame(0).at)))
    for verdict in finding.verdicts if finding else ():
        print(f"FAIL {verdict}")
    if lab.why_not:
        print(f"not played to its end: {lab.why_not}")
        return NOT_JUDGED
    if finding is None:
        print("nothing is wrong")
    return FAILED if finding else 0


# Distil.


def distil(parser: argparse.ArgumentParser, words: Sequence[str]) -> int:
    """Find a small set of scenarios that shows every faulty model."""
    parser.description = (
        "For every faulty model find a scenario that shows it, make it small, and store the set:"
        " on real benches it is played instead of exploring."
    )
    parser.add_argument("file", type=Path, help="TOML file to write; what is in it is kept")
    parser.add_argument("--seed", type=int, default=0, help="another seed, other scenarios")
    parser.add_argument(
        "--patience", type=_span, default=60.0, metavar="TIME",
        help='how long to look for one fault (default "60 s" of processor time)',
    )  # fmt: skip
    _add_profile(parser)
    parser.add_argument(
        "--mutant", action="append", default=[], metavar="NAME",
        help="only for this faulty model; may be repeated",
    )  # fmt: skip
    options = parser.parse_args(words)
    targets = _targets(options.mutant)
    known = _known(options.file)
    distiller = Distiller(options.profile, options.seed, options.patience, time.process_time)
    missed = []
    for number, target in enumerate(targets, 1):
        found = distiller.show(target, known)
        if found is None:
            missed.append(target.name)
        elif found not in known:
            known.append(found)
            _store(options.file, known)
        how = "MISSED" if found is None else f"by {found.name}"
        print(f"{number}/{len(targets)} {target.name}: {how}", flush=True)
    if not options.mutant:
        shown = {target.name: list(finds(options.profile, known, target)) for target in targets}
        _store(options.file, kept := thinned(known, shown))
        span = show_span(sum(each.cost_ns for each in kept))
        print(f"{len(kept)} scenarios, about {span} on a real bench")
    print(f"{len(missed)} missed: {', '.join(missed)}" if missed else "none missed")
    return FAILED if missed else 0


def _targets(names: Sequence[str]) -> list[Target]:
    unknown = sorted(set(names) - set(MUTANTS))
    if unknown:
        raise ConfigError("\n".join(map(_unknown, unknown)))
    return [
        Target(each.name, frozenset(each.violates))
        for each in MUTANTS.values()
        if not names or each.name in names
    ]


def _unknown(name: str) -> str:
    """That there is no such mutant, and what may have been meant."""
    near = get_close_matches(name, MUTANTS)
    hint = f"did you mean {' or '.join(near)}?" if near else "`nodeproof mutants` lists them"
    return f"no mutant {name!r}; {hint}"


def _known(path: Path) -> list[Stored]:
    return list(parsed(path.read_text("utf-8"), str(path))) if path.exists() else []


def _store(path: Path, entries: Sequence[Stored]) -> None:
    replace_file(path, written(entries).encode())
