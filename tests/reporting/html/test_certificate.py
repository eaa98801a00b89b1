"""certificate.pdf: verdict and requirements for a signature; what is said without the extra."""

from __future__ import annotations

from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path

import pytest

from hil_tests.reporting.html import CERTIFICATE, write_report
from tests.reporting.html.making import HEAD, HOSTILE, failed, make_run, passed, result
from tests.run.harness import ROOT, judge_apart

pytestmark = pytest.mark.slow
with_extra = pytest.mark.skipif(not find_spec("weasyprint"), reason="weasyprint is not installed")

STARTS = """
@pytest.mark.requirement("NMT-02")
def test_start(bench, power):
    power.on()
    bench.check(True, "it is on")
"""


@with_extra
def test_a_certificate_lies_beside_the_report(tmp_path: Path) -> None:
    """It is a PDF; the report does not count it among the evidence."""
    run = make_run(tmp_path / "run", result(1, passed(), failed(), outcome="failed", text="x"))
    report = write_report(run, {}, pdf=True)
    assert (run / CERTIFICATE).read_bytes().startswith(b"%PDF-")
    assert CERTIFICATE not in write_report(run, {}).read_text("utf-8")
    assert report.name == "report.html"


@with_extra
def test_hostile_texts_load_nothing(tmp_path: Path) -> None:
    """Markup and addresses in a run are text on the certificate, too."""
    bad = failed()._replace(requirement=HOSTILE, what=HOSTILE, text=HOSTILE)
    one = replace(result(1, bad, outcome="failed", text=HOSTILE), test=HOSTILE, title=HOSTILE)
    head = {**HEAD, "command": [HOSTILE], "bench": {"name": HOSTILE, "facilities": [HOSTILE]}}
    run = make_run(tmp_path / "run", one, head=head)
    write_report(run, {HOSTILE: [HOSTILE]}, pdf=True)
    assert (run / CERTIFICATE).stat().st_size > 5000


@with_extra
def test_a_run_writes_it_where_asked(tmp_path: Path) -> None:
    """--can-report-pdf leaves the certificate in the folder of the run."""
    done = judge_apart(tmp_path, STARTS, "--can-report-pdf")
    assert done.status == 0, done.text
    assert (done.folder / CERTIFICATE).is_file()


@pytest.mark.parametrize(
    ("raises", "hint"),
    [
        ("ImportError('none here')", "pip install 'nodeproof[pdf]'"),
        ("OSError('cannot load libpango')", "lacks a library of the system, Pango most likely"),
    ],
)
def test_without_the_extra_the_run_is_refused(tmp_path: Path, raises: str, hint: str) -> None:
    """Wrong use, before anything is touched; the text names what is missing and the remedy."""
    hidden = tmp_path / "hidden"
    hidden.mkdir()
    (hidden / "weasyprint.py").write_text(f"raise {raises}\n", "utf-8")
    done = judge_apart(tmp_path, STARTS, "--can-report-pdf", PYTHONPATH=f"{hidden}:{ROOT}")
    assert done.status == 4
    assert (
        f"--can-report-pdf: {'a certificate' if 'Import' in raises else 'weasyprint'}" in done.text
    )
    assert hint in done.text
    assert not done.reports.exists()
