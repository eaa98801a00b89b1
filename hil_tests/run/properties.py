"""How property tests run: explored in virtual time, written examples only elsewhere."""

from __future__ import annotations

import sys
from collections.abc import Iterable

import pytest

from hil_tests.run import stash

_PROFILE = "nodeproof"


def prepare(config: pytest.Config) -> None:
    """Load Hypothesis' settings for this run, before any of our tests is imported.

    No wall-clock deadline (virtual time has another pace), no example database (a run
    depends on its seed alone), one failure a property (a report tells one story), and off
    virtual time no exploration: there an example costs real time and a power cycle, and
    shrinking would repeat it many times.
    """
    import hypothesis  # noqa: PLC0415 - 0.3 s, only for our own tests
    from hypothesis import core  # noqa: PLC0415

    plan = stash.plan_of(config)
    phases = (
        tuple(phase for phase in hypothesis.Phase if phase is not hypothesis.Phase.explain)
        if plan.virtual and plan.recording is None
        else (hypothesis.Phase.explicit,)
    )
    # Under CI Hypothesis would go without chance by itself; here the seed alone decides.
    hypothesis.settings.register_profile(
        _PROFILE,
        deadline=None,
        derandomize=False,
        database=None,
        phases=phases,
        report_multiple_bugs=False,
        suppress_health_check=[hypothesis.HealthCheck.too_slow],
        print_blob=True,  # a replay repeats the example with it
    )
    hypothesis.settings.load_profile(_PROFILE)
    if core.global_force_seed is None:
        core.global_force_seed = plan.settings["can_seed"]


def fit(config: pytest.Config, ours: Iterable[pytest.Item]) -> None:
    """The same for properties of other folders than ours, which were imported before.

    What their authors set on the test itself stays, but for what would break a law of
    ours: the deadline, the database, and exploring a real device.
    """
    found = [item for item in ours if stash.is_property(item)]
    if not found or "hypothesis" not in sys.modules:
        return
    import hypothesis  # noqa: PLC0415 - it is there

    prepare(config)
    for item in found:
        test = getattr(item, "obj")  # noqa: B009  only functions have one
        test = getattr(test, "__func__", test)
        own = getattr(test, "_hypothesis_internal_use_settings", None)
        if own is not None:
            base = hypothesis.settings.get_profile(_PROFILE)
            test._hypothesis_internal_use_settings = hypothesis.settings(
                own,
                deadline=None,
                derandomize=False,
                database=None,
                phases=[phase for phase in own.phases if phase in base.phases],
                report_multiple_bugs=False,
                print_blob=True,
            )
