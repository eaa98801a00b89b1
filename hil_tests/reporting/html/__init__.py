"""The report of a run for people: one HTML file, and a certificate as PDF.

Made from the folder of a run alone, so that it can be made of a killed run, too.
"""

from __future__ import annotations

from hil_tests.reporting.html.certificate import why_not
from hil_tests.reporting.html.document import write_report
from hil_tests.reporting.html.subject import CERTIFICATE, REPORT

__all__ = ["CERTIFICATE", "REPORT", "why_not", "write_report"]
