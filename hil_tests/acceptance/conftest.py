"""Sets Hypothesis up before the tests of this folder are imported."""

from __future__ import annotations

import pytest


def pytest_configure(config: pytest.Config) -> None:
    """Properties explore in virtual time; elsewhere only their written examples run."""
    from hil_tests.run.properties import prepare  # noqa: PLC0415 - imports Hypothesis

    prepare(config)
