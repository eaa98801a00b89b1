"""Which parameters a device can have stored, from what it was sent and when it lost power.

Keypad specification: a valid 4F8h is kept for sure once power stayed on for the store time
after the first echo; a power cut before that leaves the old set or the new one, never a
mixture (COM-06, COM-26, COM-29).
"""

from __future__ import annotations

from collections.abc import Sequence

from hil_tests.api import Interval, Parameters
from hil_tests.judge.echoes import Echo, Request, taken


def decoded(data: bytes) -> Parameters:
    """The parameters in a payload of 4F8h, heartbeat high byte first."""
    node_id, code, high, low, sync_time, debounce = data[:6]
    return Parameters(
        node_id=node_id,
        bit_rate_code=code,
        heartbeat_ms=high << 8 | low,
        sync_time=sync_time,
        debounce=debounce,
    )


def stored(
    before: Parameters,
    requests: Sequence[Request],
    echoes: Sequence[Echo],
    off: Interval,
    store_ns: int,
) -> tuple[Parameters, ...]:
    """What the device can have stored when it lost power in commissioning: one set or two.

    Args:
        before: what it had stored.
        requests: every frame that it was sent.
        echoes: its echoes.
        off: when it lost power.
        store_ns: from the first echo to parameters that are safe, at most.
    """
    request = taken(requests)
    if request is None:
        return (before,)
    after = decoded(request.frame.data)
    if after == before:
        return (before,)
    echo = next((each for each in echoes if each.wanted.latest >= request.at), None)
    if echo is not None and off.earliest - echo.wanted.latest >= store_ns:
        return (after,)
    return (before, after)
