"""A finding made small: fewer frames, shorter waits, as long as something is wrong."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from benchmarks.fuzz.frames import Input

Fails = Callable[[list[Input]], bool]


def shrunk(inputs: list[Input], fails: Fails, tries: int = 400) -> list[Input]:
    """The smallest inputs that were found to fail; the same where there are none.

    Args:
        inputs: they fail.
        fails: whether others do.
        tries: how many are tried at most.
    """
    best, left = inputs, tries
    improved = True
    while improved and left > 0:
        improved = False
        for smaller in _smaller(best):
            left -= 1
            if fails(smaller):
                best, improved = smaller, True
                break
            if left <= 0:
                break
    return best


def _smaller(inputs: list[Input]) -> Iterator[list[Input]]:
    """Without a part, the large ones first, with or without its time; then without waits."""
    size = (len(inputs) + 1) // 2
    while size:
        for at in range(0, len(inputs), size):
            rest = inputs[at + size :]
            gone_ns = sum(each.wait_ns for each in inputs[at : at + size])
            yield inputs[:at] + rest
            if rest and gone_ns:
                later = rest[0]._replace(wait_ns=rest[0].wait_ns + gone_ns)
                yield [*inputs[:at], later, *rest[1:]]
        size //= 2
    for at, each in enumerate(inputs):
        if each.wait_ns:
            yield [*inputs[:at], each._replace(wait_ns=0), *inputs[at + 1 :]]
