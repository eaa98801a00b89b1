"""How property tests run: explored in virtual time, written examples only elsewhere."""

from __future__ import annotations

import pytest


def prepare(config: pytest.Config) -> None:
    """Load Hypothesis' settings for this run, before any of our tests is imported.

    No wall-clock deadline (virtual time has another pace), no example database (a run
    depends on its seed alone), and off virtual time no exploration: there an example costs
    real time and a power cycle, and shrinking would repeat it many times.
    """
    import hypothesis  # noqa: PLC0415 - 0.3 s, only for our own tests
    from hypothesis import core  # noqa: PLC0415

    from hil_tests.plugin import plan_of  # noqa: PLC0415

    virtual = plan_of(config).virtual
    phases = (
        tuple(phase for phase in hypothesis.Phase if phase is not hypothesis.Phase.explain)
        if virtual
        else (hypothesis.Phase.explicit,)
    )
    hypothesis.settings.register_profile(
        "nodeproof",
        deadline=None,
        database=None,
        phases=phases,
        suppress_health_check=[hypothesis.HealthCheck.too_slow],
        print_blob=False,
    )
    hypothesis.settings.load_profile("nodeproof")
    if core.global_force_seed is None:
        core.global_force_seed = plan_of(config).settings["can_seed"]
