"""Writes `report.html` into the folder of a run, and the certificate beside it.

Laws of the report: one file, no network, no library; a content security policy that allows
nothing but the style and the script inside, by their hashes; every text that comes from a
device, a file or a person is escaped; without JavaScript everything can be read but the
timelines.
"""

from __future__ import annotations

import base64
import gc
import hashlib
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from hil_tests.reporting.files import replace_file
from hil_tests.reporting.html import certificate
from hil_tests.reporting.html.layout import page, source
from hil_tests.reporting.html.subject import CERTIFICATE, REPORT, Subject, read_run


def write_report(folder: Path, aimed: Mapping[str, Iterable[str]], *, pdf: bool = False) -> Path:
    """Write `report.html` into the folder of a run; an older one is replaced as a whole.

    Args:
        folder: of the run.
        aimed: requirement -> names of the faulty models that violate it; {} = not known.
        pdf: write `certificate.pdf` as well.

    Returns:
        Where the report is.

    Raises:
        RecordUnreadable: no readable `results.json`.
        BenchError: no PDF can be made here; the report is written.
        OSError: the folder cannot be written.
    """
    path = folder / REPORT
    with _uncollected():
        subject = read_run(folder, aimed)
        replace_file(path, _render(subject).encode("utf-8", "replace"))
    if pdf:
        replace_file(folder / CERTIFICATE, certificate.render(subject))
    return path


@contextmanager
def _uncollected() -> Iterator[None]:
    """No search for garbage: a run of many objects has none, and looking costs a third."""
    was_on = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_on:
            gc.enable()


def _render(subject: Subject) -> str:
    """The report as one HTML text."""
    style = source("report.css")
    script = source("report.js") + source("timeline.js")
    policy = _policy(style, script)
    return page("report.html.j2", subject, style=style, script=script, policy=policy)


def _policy(style: str, script: str) -> str:
    """Nothing may be loaded; only this style and this script may act."""
    hashes = [
        base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()
        for text in (style, script)
    ]
    return (
        "default-src 'none'; base-uri 'none'; form-action 'none'; "
        f"style-src 'sha256-{hashes[0]}'; script-src 'sha256-{hashes[1]}'"
    )
