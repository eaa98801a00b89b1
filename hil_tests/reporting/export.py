"""`nodeproof export`: recordings in the forms of other programs, written by python-can.

What a form cannot hold is said. The record of a verdict stays the pcapng file.
"""

from __future__ import annotations

from argparse import ArgumentParser
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hil_tests.errors import ConfigError
from hil_tests.reporting.files import RecordUnreadable
from hil_tests.reporting.foreign import is_pcapng, read_foreign
from hil_tests.reporting.pcapng import PcapngSink, read_pcapng
from hil_tests.trace import BusEvent, Entry, EventKind, Mark, Sighting

if TYPE_CHECKING:
    import can

CHANNEL = "can0"
"""Name of the only channel in a form that names channels."""

_NOTES = "what the bench did, verdicts, the doubt of stamps, marks of lost frames"
_LENGTHS = "lengths of remote frames and data length codes above 8"


@dataclass(frozen=True, slots=True)
class Form:
    """A form of recordings.

    Args:
        writer: name of python-can's class for it; "" = our own.
        options: for it.
        loses: what it cannot hold, for people; "" = nothing.
    """

    writer: str
    options: dict[str, Any]
    loses: str


FORMS = {
    "log": Form(
        "CanutilsLogWriter",
        {"channel": CHANNEL},
        f"{_NOTES}; digits of stamps below 1 us; what an error frame says; {_LENGTHS}",
    ),
    "blf": Form(
        "BLFWriter",
        {"channel": 1},
        f"{_NOTES}; digits of stamps below 0.3 us; the origin of virtual time"
        " (years before 1990); what an error frame says",
    ),
    "asc": Form(
        "ASCWriter",
        {"channel": 1},
        f"{_NOTES}; the absolute time (stamps count from the first frame, its date is whole ms);"
        f" digits below 1 us; what an error frame says; data length codes above 8",
    ),
    "pcapng": Form("", {}, ""),
}


def export(source: Path, form: str, target: Path) -> None:
    """Write a recording in another form.

    Args:
        source: a trace of ours, or a candump, BLF, ASC or pcapng file.
        form: one of `FORMS`.
        target: a new file.

    Raises:
        RecordUnreadable: the source is none.
        ConfigError: the target is there already, or cannot be written.
    """
    if target.exists():
        raise ConfigError(f"{target} is there already; remove it, or name another with -o")
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        if form == "pcapng":
            _to_pcapng(_entries(source), target)
        else:
            _through_can(_entries(source), FORMS[form], target)
    except OSError as error:
        raise ConfigError(
            f"{target}: {error.strerror or error}; name another place with -o"
        ) from error


def _entries(source: Path) -> Iterator[Entry | Mark]:
    """Everything that a recording holds."""
    return iter(read_pcapng(source) if is_pcapng(source) else read_foreign(source))


def _to_pcapng(entries: Iterator[Entry | Mark], target: Path) -> None:
    with PcapngSink(target, interface=CHANNEL, clock="of the recording", flush=False) as sink:
        for entry in entries:
            sink.write(entry)


def _through_can(entries: Iterator[Entry | Mark], form: Form, target: Path) -> None:
    import can  # noqa: PLC0415 - 0.2 s, only where it is used

    make: Callable[..., Any] = getattr(can, form.writer)
    with make(str(target), **form.options) as writer:
        for entry in entries:
            message = _message(can.Message, entry)
            if message is not None:
                writer.on_message_received(message)


def _message(make: type[can.Message], entry: Entry | Mark) -> can.Message | None:
    """What python-can makes of an entry; None = nothing."""
    if isinstance(entry, BusEvent) and entry.kind is EventKind.ERROR:
        return make(timestamp=entry.at / 1e9, is_error_frame=True, is_extended_id=False)
    if not isinstance(entry, Sighting):
        return None
    frame = entry.frame
    return make(
        timestamp=entry.at / 1e9,
        arbitration_id=frame.can_id,
        is_extended_id=frame.extended,
        is_remote_frame=frame.remote,
        is_rx=not entry.own,
        dlc=min(frame.dlc, 8),
        data=frame.data,
    )


def run(parser: ArgumentParser, words: Sequence[str]) -> int:
    """The command; returns its exit status."""
    parser.description = "Write recordings in a form that other programs read; say what it loses."
    parser.add_argument("source", type=Path, metavar="RUN|TRACE", help="folder of a run, or file")
    parser.add_argument("--to", required=True, choices=FORMS, help="the form")
    parser.add_argument("-o", "--out", type=Path, metavar="PATH", help="file, or folder for a run")
    options = parser.parse_args(words)
    source: Path = options.source
    try:
        for each, target in _pairs(source, options.to, options.out):
            export(each, options.to, target)
            print(target)
    except RecordUnreadable as error:
        raise ConfigError(str(error)) from None
    loses = FORMS[options.to].loses
    print(f"{options.to} cannot hold: {loses}" if loses else f"{options.to} holds everything")
    return 0


def _pairs(source: Path, form: str, out: Path | None) -> Iterator[tuple[Path, Path]]:
    """Each recording, and where it goes."""
    if not source.is_dir():
        yield source, out or source.with_suffix(f".{form}")
        return
    traces = sorted((source / "traces").glob("*.pcapng"))
    if not traces:
        raise ConfigError(
            f"{source}: no traces/*.pcapng there; give the folder of a run or a file"
        )
    folder = out or source / f"export-{form}"
    for trace in traces:
        yield trace, folder / f"{trace.stem}.{form}"
