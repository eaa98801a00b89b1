"""What a run leaves besides its results: `report.html` for people, `junit.xml` for CI systems.

Both are made of its folder, at its end or later.
"""

from __future__ import annotations

from pathlib import Path

from hil_tests.errors import BenchError, ConfigError
from hil_tests.reporting.files import replace_file

MATRIX = "matrix.json"
"""The table of faulty models, as `tox -e mutants` writes it."""


def write(folder: Path, *, pdf: bool) -> str:
    """Write the papers of a run that has ended; where they are, or why there are none.

    A paper is made from the results and recordings, which are there already: that it could
    not be made is said, and changes no verdict.

    Args:
        folder: of the run.
        pdf: whether there is to be a certificate.
    """
    try:
        return f"report: {_report(folder, pdf=pdf)}"
    except Exception as error:  # noqa: BLE001 - the end of a run reports, it never raises
        why = f"{type(error).__name__}: {error}"
        return f"NO REPORT ({why}); once that is mended: nodeproof report {folder}"


def make_again(folder: Path, *, pdf: bool = False, matrix: Path | None = None) -> Path:
    """Write `report.html` and `junit.xml` of a run, also of one that was killed.

    Args:
        folder: of the run.
        pdf: whether there is to be a certificate.
        matrix: a table of faulty models, which the folder gets as `matrix.json`.

    Raises:
        ConfigError: it is no folder of a run, or cannot be written to, or no PDF can be made.
    """
    if not (folder / "results.json").is_file():
        raise ConfigError(
            f"{folder}: no folder of a run, there is no results.json in it; "
            "name one, e.g. reports/latest"
        )
    try:
        if matrix is not None:
            replace_file(folder / MATRIX, matrix.read_bytes())
        return _report(folder, pdf=pdf)
    except (BenchError, OSError) as error:
        raise ConfigError(str(error)) from error


def _take_matrix(folder: Path) -> None:
    """The table of faulty models that lies beside the runs, unless the run has one of its own."""
    own, beside = folder / MATRIX, folder.absolute().parent / MATRIX
    if beside.is_file() and not own.exists():
        replace_file(own, beside.read_bytes())


def _report(folder: Path, *, pdf: bool) -> Path:
    from hil_tests.reporting.html import write_report  # noqa: PLC0415 - jinja2, when needed
    from hil_tests.reporting.junit import write_junit  # noqa: PLC0415 - with it
    from hil_tests.run.catalogue import mutants_by_requirement  # noqa: PLC0415

    write_junit(folder)
    _take_matrix(folder)
    return write_report(folder, mutants_by_requirement(), pdf=pdf)
