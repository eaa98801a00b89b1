"""`nodeproof replay FILE`: recordings of others, judged without stimuli; a run of its own."""

from __future__ import annotations

from argparse import Namespace
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from hil_tests.bench.terms import expected_of
from hil_tests.clock import MS, US, parse_span, show_span
from hil_tests.config import DeviceProfile, KeypadProfile, load_profile
from hil_tests.errors import ConfigError
from hil_tests.judge.expected import Expected, Family
from hil_tests.judge.verdict import Outcome
from hil_tests.replay.onlooker import Findings, Onlooker, grain, nodes
from hil_tests.replay.shown import Shown, shown
from hil_tests.reporting.files import RecordUnreadable
from hil_tests.reporting.foreign import read_foreign
from hil_tests.reporting.pcapng import PcapngSink
from hil_tests.reporting.rows import TestResult, TraceFile, VerdictRow
from hil_tests.reporting.rundir import RunDirectory
from hil_tests.requirements import LENIENT, Requirement, load
from hil_tests.run import outcome, papers
from hil_tests.run.checkout import git_state
from hil_tests.run.header import requirement_facts, sha256_of, versions
from hil_tests.run.ledger import Account, Ledger
from hil_tests.run.rows import trace_file

DOUBT_NS = 1 * MS
"""Of a stamp of which nobody says how good it is: what an adapter and its driver add."""

_SHOWN = 110
_NAMED = 6


def judge(options: Namespace, command: Sequence[str]) -> int:
    """Judge recordings, print what came of each requirement; the exit status.

    Args:
        options: recording, profile, node_id, heartbeat, bitrate, doubt, channel, strict,
            reports; see `replay.command`.
        command: the words that were given.

    Raises:
        ConfigError: no recording, or options that are wrong; with the remedy.
    """
    profile = load_profile(options.profile or "generic")
    requirements = load(profile.kind)
    started = datetime.now(UTC)
    try:
        expected = _expected(profile, options)
        folder = RunDirectory.create(Path(options.reports), started)
        ledger = Ledger(folder, started)
        ledger.open(_header(options, profile, expected, requirements, started, command))
        lines = [
            line
            for path in options.recording
            for line in _judge_file(path, expected, requirements, options, ledger)
        ]
    except RecordUnreadable as error:
        raise ConfigError(str(error)) from None
    status = ledger.close(0, require_all=False)
    print("\n".join(lines))
    print(f"results and traces: {folder.path}")
    print(papers.write(folder.path, pdf=False))
    return status


# The device.


def _expected(profile: DeviceProfile, options: Namespace) -> Expected:
    """The device as it should be, with others on the bus."""
    node_id = options.node_id or _only_node(options)
    if node_id not in profile.node_ids:
        ids = profile.node_ids
        raise ConfigError(
            f"--node-id {node_id}: a {profile.name} has one of {ids[0]} .. {ids[-1]}"
        )
    of_its_kind: dict[str, Any] = {"family": Family.CIA301}
    if isinstance(profile, KeypadProfile):
        bytes_ns = {"key_bytes": profile.key_frame_bytes, "emcy_ns": profile.limits.emcy_ns}
        of_its_kind = {"family": Family.KEYPAD, **bytes_ns}
    known = expected_of(profile, None, exclusive=False, **of_its_kind)
    known = replace(known, node_id=node_id)
    period_ns = _span("--heartbeat", options.heartbeat)
    return known if period_ns is None else known.beating(period_ns)


def _span(name: str, text: str | None) -> int | None:
    if text is None:
        return None
    try:
        return parse_span(text)
    except ValueError as error:
        raise ConfigError(f"{name}: {error}") from None


def _only_node(options: Namespace) -> int:
    """The only node whose error control is heard.

    Raises:
        ConfigError: there is none, or several.
    """
    heard: Counter[int] = Counter()
    for path in options.recording:
        heard += nodes(read_foreign(path, options.channel))
    if len(heard) == 1:
        return next(iter(heard))
    if not heard:
        raise ConfigError("no node sends error control in it; say whom to judge with --node-id N")
    names = ", ".join(f"{node} ({count} frames)" for node, count in sorted(heard.items()))
    raise ConfigError(f"several nodes send error control: {names}; choose one with --node-id N")


# A recording.


def _judge_file(
    path: Path,
    expected: Expected,
    requirements: Mapping[str, Requirement],
    options: Namespace,
    ledger: Ledger,
) -> list[str]:
    """Judge one recording; what to print of it."""
    unit = grain(read_foreign(path, options.channel))
    doubt_ns = _span("--doubt", options.doubt)
    onlooker = Onlooker(
        expected,
        1_000_000_000 // options.bitrate if options.bitrate else 0,
        DOUBT_NS if doubt_ns is None else doubt_ns,
        unit if unit > US else 0,
    )
    target = ledger.folder.trace_path(path.name)
    with PcapngSink(target, interface=path.name, clock="of the recording", flush=False) as sink:
        for entry in onlooker.see_all(read_foreign(path, options.channel)):
            sink.write(entry)
    found = onlooker.finish()
    trace = trace_file(target, ledger.folder.relative(target), onlooker.index)
    rows = list(shown(requirements, expected, found))
    strict = bool(options.strict)
    for row in rows:
        result = _result(path, row, found, trace, requirements[row.requirement], strict=strict)
        ledger.add(result.to_json(), row.text)
    ledger.account = ledger.account.plus(Account(_span_ns(found), onlooker.index))
    return list(_table(path, expected, found, rows))


def _span_ns(found: Findings) -> int:
    return found.last_at - found.first_at if found.first_at is not None else 0


def _result(
    path: Path,
    row: Shown,
    found: Findings,
    trace: TraceFile,
    requirement: Requirement,
    *,
    strict: bool,
) -> TestResult:
    """One requirement of one recording, as results.json has it."""
    lenient = requirement.kind in LENIENT and not strict
    verdicts = [
        VerdictRow(
            requirement=row.requirement,
            outcome=_named(each.outcome, lenient=lenient),
            what=each.text,
            measured_ns=(each.measured[0], each.measured[1]) if each.measured else None,
            limits_ns=each.limits.ends if each.limits else None,
            text=str(each),
            at=each.at,
        )
        for each in row.verdicts
    ]
    return TestResult(
        test=f"{path.name}::{row.requirement}",
        outcome=_named(row.outcome, lenient=lenient),
        title=requirement.text,
        bus_ns=_span_ns(found) if verdicts else 0,
        requirements=(row.requirement,),
        verdicts=verdicts,
        trace=trace if verdicts else None,
        text=row.text,
    )


def _named(found: Outcome, *, lenient: bool) -> str:
    if found is Outcome.FAIL and lenient:
        return outcome.OBSERVATION
    return found.value


# For people.


def _table(
    path: Path, expected: Expected, found: Findings, rows: Sequence[Shown]
) -> Iterator[str]:
    counts = found.counts
    yield (
        f"{path}: {counts['frames']} frames in {show_span(_span_ns(found))}, {counts['device']} of"
        f" node {expected.node_id}; {counts['errors']} error frames, {counts['gaps']} gaps,"
        f" {counts['unheard']} commands while it was not heard"
    )
    by_reason: dict[str, list[str]] = {}
    for row in rows:
        if row.outcome is Outcome.NOT_RUN:
            by_reason.setdefault(row.text, []).append(row.requirement)
            continue
        for verdict in row.verdicts:
            text = str(verdict).removeprefix(f"{row.requirement}: ")
            text = text if len(text) <= _SHOWN else f"{text[: _SHOWN - 3]}..."
            yield f"  {row.requirement:10s}{verdict.outcome.value:14s}{text}"
        if row.text:
            yield f"  {row.requirement:10s}{row.text}"
    for reason, names in by_reason.items():
        more = f" and {len(names) - _NAMED} more" if len(names) > _NAMED else ""
        yield f"  not run   {reason}"
        yield f"            {', '.join(names[:_NAMED])}{more}"


def _header(
    options: Namespace,
    profile: DeviceProfile,
    expected: Expected,
    requirements: Mapping[str, Requirement],
    started: datetime,
    command: Sequence[str],
) -> dict[str, Any]:
    """Facts of the run, as results.json has them at its head."""
    chosen = {
        key: {"value": value if value is None else str(value), "source": "command line"}
        for key, value in vars(options).items()
        if key != "recording"
    }
    return {
        "started": started.isoformat(),
        "command": list(command),
        "options": chosen,
        "versions": versions(),
        "git": git_state(Path.cwd()),
        "bus": {
            "interface": "recording",
            "channel": ", ".join(str(path) for path in options.recording),
            "bit_rate": options.bitrate,
            "timed": bool(options.bitrate),
        },
        "device": {
            "kind": "external",
            "why": "recorded by others",
            "profile": {
                "name": profile.name,
                "kind": profile.kind,
                "path": profile.path,
                "sha256": sha256_of(profile.path),
            },
            "eds": None,
            "node_id": expected.node_id,
            "serial": None,
            "serial_from": None,
            "firmware": None,
            "firmware_from": None,
            "identity": {},
            "mutant": None,
        },
        "clock": {"text": "stamps of the recording", "doubt_ns": _span("--doubt", options.doubt)},
        "seed": 0,
        "bench": {"name": "recording", "file": None, "facilities": [], "drivers": {}},
        "requirements": {each.id: requirement_facts(each) for each in requirements.values()},
    }
