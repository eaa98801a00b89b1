"""The report by the rules of axe-core: for those who do not see it, or not its colours."""

from __future__ import annotations

import importlib.util
from collections.abc import Iterator
from pathlib import Path

import pytest

from hil_tests.reporting.html import write_report
from tests.reporting.html.chromium import PROGRAM, READY, Browser, browser
from tests.reporting.html.making import failed, make_run, passed, result

_PACKAGE = importlib.util.find_spec("axe_core_python")
"""The Python package that brings axe-core; nothing else of it is used."""

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not PROGRAM, reason="chromium is not installed"),
    pytest.mark.skipif(_PACKAGE is None, reason="axe-core-python is not installed"),
]

UNFOLD = "document.querySelectorAll('details').forEach(each => { each.open = true; })"
AXE = """axe.run(document, {resultTypes: ['violations']}).then(found => found.violations.map(
  each => `${each.impact} ${each.id}: ${each.nodes.map(node => node.html).join(' ')}`))"""


@pytest.fixture(name="tab", scope="module")
def _tab(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    """A browser for all tests of this file."""
    with browser(tmp_path_factory.mktemp("chromium")) as tab:
        yield tab


def opened(tab: Browser, page: Path) -> None:
    """A report with everything unfolded, its first timeline drawn, and axe-core at hand."""
    assert _PACKAGE is not None
    assert _PACKAGE.origin is not None
    tab.open(page)
    tab.run(UNFOLD)
    assert tab.run(READY)
    source = (Path(_PACKAGE.origin).parent / "axe.min.js").read_text("utf-8")
    tab.run(f"{source}; true")


def report(folder: Path, outcome: str) -> Path:
    """The page of a run that passed, or failed."""
    bad = [result(2, passed(), failed(), outcome="failed", text="late")] * (outcome == "failed")
    return write_report(make_run(folder / outcome, result(1, passed()), *bad), {})


@pytest.mark.parametrize("outcome", ["passed", "failed"])
@pytest.mark.parametrize("ground", ["light", "dark"])
def test_it_breaks_no_rule(ground: str, outcome: str, tab: Browser, tmp_path: Path) -> None:
    """Names, roles, headings, contrast: of a run that passed and of one that failed."""
    tab.prefer(ground)
    opened(tab, report(tmp_path, outcome))
    assert tab.run(AXE) == []


def test_a_broken_rule_would_be_found(tab: Browser, tmp_path: Path) -> None:
    """Pale ink, a timeline without a name, a page without a language."""
    tab.prefer("light")
    opened(tab, report(tmp_path, "failed"))
    tab.run(
        """(() => {
          document.documentElement.removeAttribute('lang');
          document.documentElement.style.setProperty('--dim', '#d0d0d0');
          document.querySelector('#tests .scroll').removeAttribute('aria-label');
          document.querySelector('.button').textContent = '';
        })()"""
    )
    found = tab.run(AXE)
    rules = {each.split()[1] for each in found}
    assert {"html-has-lang:", "link-name:", "color-contrast:"} <= rules, found
