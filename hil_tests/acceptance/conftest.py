"""Sets Hypothesis up before the tests of this folder are imported; hands out stored scenarios."""

from __future__ import annotations

import pytest


def pytest_configure(config: pytest.Config) -> None:
    """Properties explore in virtual time; elsewhere only their written examples run."""
    from hil_tests.run.properties import prepare  # noqa: PLC0415 - imports Hypothesis

    prepare(config)


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """One test for each scenario that this run plays."""
    if "stored" not in metafunc.fixturenames:
        return
    from hil_tests.run import stash, stories  # noqa: PLC0415 - where it is needed

    try:
        plan = stash.plan_of(metafunc.config)
    except pytest.UsageError:
        # Told as wrong use once all tests are collected; here it would be a broken test file.
        parameters = [pytest.param(None, marks=pytest.mark.requirement("none"))]
    else:
        parameters = stories.parameters(plan)
    metafunc.parametrize("stored", parameters)
