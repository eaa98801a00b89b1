"""The certificate: verdict and requirements as PDF, for a signature.

Made by WeasyPrint, an extra: `pip install 'nodeproof[pdf]'`. It loads nothing, whatever the
texts of a run say.
"""

from __future__ import annotations

from typing import Any, NoReturn

from hil_tests.errors import BenchError
from hil_tests.reporting.html.layout import page, source
from hil_tests.reporting.html.subject import Subject

EXTRA = "pip install 'nodeproof[pdf]'"


def why_not() -> str:
    """Why no PDF can be made here, with the remedy; "" = one can."""
    try:
        import weasyprint  # noqa: F401, PLC0415 - an extra, and slow to import
    except ImportError as error:
        return f"a certificate as PDF takes the package weasyprint ({error}): {EXTRA}"
    except OSError as error:
        return f"weasyprint lacks a library of the system, Pango most likely: {error}"
    return ""


def render(subject: Subject) -> bytes:
    """The certificate of a run.

    Raises:
        BenchError: WeasyPrint is not there, or not usable; the text names the remedy.
    """
    problem = why_not()
    if problem:
        raise BenchError(problem)
    import weasyprint  # noqa: PLC0415 - an extra

    text = page("certificate.html.j2", subject, style=source("certificate.css"))
    made: Any = weasyprint.HTML(string=text, url_fetcher=_refuse)
    return bytes(made.write_pdf())


def _refuse(url: str, *_: Any, **__: Any) -> NoReturn:
    """Nothing is loaded."""
    raise ValueError(f"{url}: a certificate loads nothing")
