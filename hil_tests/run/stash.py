"""What a run keeps in pytest's config, and the marks by which its tests are known.

Imports pytest alone: every pytest run on the machine that has the plugin comes through here.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from hil_tests.run import options

if TYPE_CHECKING:
    from hil_tests.run.ledger import Ledger
    from hil_tests.run.plan import Plan
    from hil_tests.run.session import Run
    from hil_tests.run.spread import Gathering

MARKERS = (
    "requirement(*ids): the requirements that a test claims; checks blame the first one",
    "virtual(why): runs in virtual time only",
    "timed(why): needs a wire with arbitration and bit times",
    "needs(*facilities): facilities that a test needs besides those that it asks for",
    "explores: plays many examples; the record of the last one that fails is kept",
)

SETTINGS = pytest.StashKey[options.Settings]()
PLAN = pytest.StashKey["Plan"]()
RUN = pytest.StashKey["Run"]()
CLAIMS = pytest.StashKey[tuple[str, ...]]()
"""Of a test: the requirements that it claims, as far as they concern the kind of device."""
GATHERING = pytest.StashKey["Gathering"]()


def settings_of(config: pytest.Config) -> options.Settings:
    """What was chosen on command line, environment and ini file.

    Raises:
        pytest.UsageError: values that are none.
    """
    if SETTINGS not in config.stash:
        config.stash[SETTINGS] = options.settle(config)
    return config.stash[SETTINGS]


def plan_of(config: pytest.Config) -> Plan:
    """The plan of this run, made when it is first needed.

    Raises:
        pytest.UsageError: options or files are wrong.
    """
    if PLAN not in config.stash:
        from hil_tests.errors import ConfigError  # noqa: PLC0415 - first test of ours
        from hil_tests.run.plan import make_plan  # noqa: PLC0415

        try:
            config.stash[PLAN] = make_plan(settings_of(config))
        except ConfigError as error:
            raise pytest.UsageError(str(error)) from None
    return config.stash[PLAN]


def run_of(config: pytest.Config) -> Run | None:
    """The run under way; None before it began, and in projects without tests of ours."""
    return config.stash.get(RUN, None)


def gathering_of(config: pytest.Config) -> Gathering | None:
    """What this process gathers from workers; None where the tests are not spread."""
    return config.stash.get(GATHERING, None)


def ledger_of(config: pytest.Config) -> Ledger | None:
    """The findings of this run, or of those that this process gathers; None = there are none."""
    run, gathering = run_of(config), gathering_of(config)
    if run is not None:
        return run.ledger
    return gathering.ledger if gathering is not None and gathering.begun else None


def claimed(item: pytest.Item) -> tuple[str, ...]:
    """The requirements that a test claims; of the kind under test, once that is known."""
    if CLAIMS in item.stash:
        return item.stash[CLAIMS]
    marker = item.get_closest_marker("requirement")
    return tuple(str(each) for each in marker.args) if marker else ()


def is_ours(item: pytest.Item) -> bool:
    """Whether a test is judged by this project: it claims a requirement."""
    return item.get_closest_marker("requirement") is not None


def is_property(item: pytest.Item) -> bool:
    """Whether Hypothesis runs the test, many times."""
    if item.get_closest_marker("explores") is not None:
        return True
    return hasattr(getattr(item, "obj", None), "hypothesis")
