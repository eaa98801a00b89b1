"""A bench is brought to where it stood when a recorded test began."""

from __future__ import annotations

from collections.abc import Callable

from hil_tests.bench.bench import Bench
from hil_tests.config import DeviceProfile, Setup
from hil_tests.errors import ConfigError
from hil_tests.replay.record import TestRecord
from hil_tests.replay.stage import ReplayStage


def stand(bench: Bench, record: TestRecord) -> None:
    """The bench of a `ReplayStage` stands as it stood then, and tells this record from now on.

    Raises:
        ConfigError: the record is of another kind of device than the bench.
        RecordUnreadable: its beginning lacks a fact.
    """
    assert isinstance(bench.stage, ReplayStage)
    bench.stage.enter(record)
    bench.resume(
        parameters=setup_of(bench.profile, record, "parameters"),
        home=setup_of(bench.profile, record, "home"),
        heard=record.fact("heard", bool),
    )
    if bench.keys:
        bench.keys.held = frozenset(map(str, record.fact("held", list)))
    if bench.faults:
        bench.faults.active = frozenset(map(str, record.fact("active", list)))
    standing = record.opening.detail.get("power")
    if bench.power and isinstance(standing, dict):
        bench.power.stand(standing.get("on"), standing.get("off_since"))


def setup_of(profile: DeviceProfile, record: TestRecord, name: str) -> Setup | None:
    """What the device was set to, as a record has it; None = that was not known.

    Args:
        profile: says of which kind the device is.
        record: of a test.
        name: "parameters" or "home".

    Raises:
        ConfigError: another kind of device.
    """
    told = record.opening.detail.get(name)
    if not isinstance(told, dict):
        return None
    make: Callable[..., Setup] = type(profile.factory)
    try:
        return make(**told)
    except TypeError as error:
        raise ConfigError(
            f"profile {profile.path}: the recorded device is set to {told}, and a"
            f" {profile.kind} has other parameters ({error})"
        ) from None
