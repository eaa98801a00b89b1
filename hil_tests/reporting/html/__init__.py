"""The report of a run for people: one HTML file, and a certificate as PDF.

Made from the folder of a run alone, so that it can be made of a killed run, too.
"""

from __future__ import annotations

from hil_tests.reporting.html.document import REPORT, write_report

__all__ = ["REPORT", "write_report"]
