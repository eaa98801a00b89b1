"""Terms that a bench and its judge share: when something was, and what is expected."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from hil_tests.clock import Interval, exactly
from hil_tests.judge.causal import Seen
from hil_tests.judge.expected import Expected
from hil_tests.trace import Moment

if TYPE_CHECKING:
    from hil_tests.config import DeviceProfile, Setup

When = Seen | Moment | Interval | int
"""What an expectation can count from."""


def interval_of(when: When) -> Interval:
    """The interval in which something happened."""
    if isinstance(when, int):
        return exactly(when)
    return when if isinstance(when, Interval) else when.when


def expected_of(
    profile: DeviceProfile,
    parameters: Setup | None,
    *,
    exclusive: bool,
    fades: bool = False,
    **of_its_kind: Any,
) -> Expected:
    """What the judge is told about a device.

    Args:
        profile: its facts and limits.
        parameters: what it is set to; None = not known.
        exclusive: nobody else is on the bus.
        fades: without supply it lives on for a while, at most as long as a power cycle takes.
        of_its_kind: what `Expected` holds of this kind of device besides.
    """
    limits = profile.limits
    known = Expected(
        node_id=parameters.node_id if parameters else None,
        heartbeat_ns=None,
        bit_rate=parameters.bit_rate if parameters else None,
        command_ns=limits.command_ns,
        boot_up_ns=limits.boot_up_ns,
        tolerances=limits.heartbeat_ns,
        fade_ns=limits.power_off_ns if fades else 0,
        exclusive=exclusive,
        **of_its_kind,
    )
    return known.beating(parameters.heartbeat_ns) if parameters else known


def facility_name(name: str) -> str:
    """A facility for people: its fixture is called in lower case."""
    return {"bitrate": "BitRate"}.get(name, name.capitalize())


def lacking(names: Sequence[str]) -> tuple[str, str]:
    """Facilities that a bench has not: in words, and the sections of a bench file to add."""
    missing = " and no ".join(map(facility_name, names))
    return f"no {missing}", " and ".join(f"[{name}]" for name in names)


def name_of(when: When) -> str:
    """What a check counts from, for people."""
    if isinstance(when, Seen):
        return str(when.frame)
    return _did(when) if isinstance(when, Moment) else "the instant given"


def _did(moment: Moment) -> str:
    """What the bench did, in words."""
    detail = moment.detail
    if moment.what == "power":
        return f"power-on ({detail.get('mode')} start)" if detail.get("on") else "power-off"
    if moment.what == "keys":
        held = detail.get("held")
        names = ", ".join(map(str, held)) if isinstance(held, list) else ""
        return f"keys held: {names}" if names else "keys released"
    if moment.what == "bitrate":
        return f"bit rate {detail.get('bit_rate')} bit/s"
    return moment.what
