"""Opens the report of a run in a browser, where there is a screen to show it on."""

from __future__ import annotations

import os
import sys
import webbrowser
from collections.abc import Callable, Mapping
from pathlib import Path

from hil_tests.errors import BenchError, ConfigError
from hil_tests.reporting.check import results_path
from hil_tests.run import papers

_SCREENS = ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER")


def show(
    run: Path,
    surroundings: Mapping[str, str] = os.environ,
    browse: Callable[[str], bool] = webbrowser.open,
) -> Path:
    """Open the report; made first where it is missing or older than the results.

    Args:
        run: folder of a run, or its name in reports/.
        surroundings: environment variables; without a screen nothing is opened, because a
            browser in the terminal would take it over.
        browse: opens an address.

    Returns:
        Where the report lies.

    Raises:
        ConfigError: there is no such run, or its report cannot be made.
    """
    try:
        results = results_path(run)
    except BenchError as error:
        raise ConfigError(str(error)) from None
    report = results.parent.resolve() / "report.html"
    if not report.is_file() or report.stat().st_mtime < results.stat().st_mtime:
        report = papers.make_again(results.parent.resolve())
    if sys.platform != "linux" or any(map(surroundings.get, _SCREENS)):
        browse(report.as_uri())
    return report
