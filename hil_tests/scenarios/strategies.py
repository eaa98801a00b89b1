"""Strategies: scenarios made up by Hypothesis, near the limits that matter.

A step is one small number, so that drawing is cheap and shrinking is quick; a mapped
strategy prints the scenario that it stands for.
"""

from __future__ import annotations

from functools import cache

from hypothesis import strategies as st

from hil_tests.scenarios.scenario import Scenario, Step

SCAN_MS = 10
KEY_FRAME_MS = 20
"""Limits of the default profile; with others the spans are less telling, never wrong."""

KEYS = 3
"""How many keys take part: one, its neighbour, and one more to tell masks apart."""

MOST_STEPS = 12
_TOGGLES = tuple(range(1, 1 << KEYS))


@cache
def spans_ms(debounce: int) -> tuple[int, ...]:
    """Spans on either side of each limit: bounce, scan, debounce time, key frame."""
    time_ms = 100 * debounce
    near = (-SCAN_MS - 2, -SCAN_MS + 2, -2, 2, SCAN_MS - 2, SCAN_MS + 2, SCAN_MS + KEY_FRAME_MS)
    wanted = {1, 3, SCAN_MS - 2, SCAN_MS + 2, 2 * time_ms + 50, 60, *(time_ms + by for by in near)}
    return tuple(sorted(span for span in wanted if span > 0))


def decode(debounce: int, codes: list[int]) -> Scenario:
    """The scenario that a list of small numbers stands for."""
    spans = spans_ms(debounce)
    steps: list[Step] = []
    held, running = 0, True
    for code in codes:
        action, at = divmod(code, len(spans))
        if action < len(_TOGGLES):
            held ^= _TOGGLES[action]
            steps.append((spans[at], held))
        else:
            # Out of operational and back in turn; which way out is the span's parity.
            word = ("stop", "pre-operational")[at % 2] if running else "start"
            running = not running
            steps.append((spans[at], word))
    return Scenario(debounce, tuple(steps))


@cache
def key_scenarios(debounce: int, *, commands: bool = True) -> st.SearchStrategy[Scenario]:
    """Scenarios of several keys that bounce near the debounce time.

    Args:
        debounce: as commissioned, x 100 ms.
        commands: the node leaves and enters operational in between.
    """
    actions = len(_TOGGLES) + (2 if commands else 0)
    codes = st.integers(0, actions * len(spans_ms(debounce)) - 1)
    return st.lists(codes, min_size=1, max_size=MOST_STEPS).map(lambda c: decode(debounce, c))
