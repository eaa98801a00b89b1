"""What a device says of itself: objects 1018h, 1008h, 1009h and 100Ah, read over SDO.

Law: nothing is written and nothing is judged. Whatever goes wrong is a reason in words, and
what the run finds later does not depend on it. CiA 301 4.2.0, 7.5.2.8 .. 7.5.2.10, 7.5.2.21.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from hil_tests.bench.bench import Bench
from hil_tests.bench.sdo import Sdo
from hil_tests.bench.terms import interval_of
from hil_tests.clients.sdo import Abort, Breach, Requests, Upload, show
from hil_tests.clients.values import number
from hil_tests.clock import S
from hil_tests.errors import BenchError
from hil_tests.judge import matchers
from hil_tests.judge.verdict import DeviceFailure, InconclusiveResult, NotRun

IDENTITY = 0x1018
NUMBERS = ("vendor", "product", "revision", "serial")
"""1018h:01 to 04; a device has the first one at least."""
TEXTS: Mapping[str, int] = {"name": 0x1008, "hardware": 0x1009, "software": 0x100A}
_MOST_ANSWERS = 64
"""A text of 300 characters and more is no name."""
_U32_BYTES = 4
PATIENCE_NS = 1 * S
"""How late an answer may be is judged by tests; here it is waited for."""


@dataclass(frozen=True, slots=True)
class Told:
    """What a device has told.

    Args:
        numbers: those of 1018h that it has, by name.
        texts: its name and versions, as far as it has them.
        not_read: why there is nothing more; "" = all was asked for.
    """

    numbers: Mapping[str, int] = field(default_factory=dict)
    texts: Mapping[str, str] = field(default_factory=dict)
    not_read: str = ""


class _Short(Upload):
    """An upload that gives up on a server without end."""

    _answers = 0

    def answer(self, data: bytes) -> Requests:
        """See `Transfer`."""
        self._answers += 1
        if self._answers > _MOST_ANSWERS:
            raise Breach("", f"{self.name} has no end")
        return super().answer(data)


def ask(bench: Bench, *, switch: bool) -> Told:
    """Ask the device who it is.

    Args:
        bench: afterwards its trace holds what was done; a test begins with one of its own.
        switch: the supply may be switched on for that.
    """
    numbers: dict[str, int] = {}
    texts: dict[str, str] = {}
    why = ""
    try:
        if switch:
            _wake(bench)
        _read_numbers(bench, numbers)
        for name, index in TEXTS.items():
            found = _read(bench, index)
            if isinstance(found, bytes):
                texts[name] = printable(found)
    except (DeviceFailure, InconclusiveResult) as error:
        why = error.verdict.text
    except (BenchError, NotRun) as error:
        why = str(error).partition("\n")[0]
    return Told(numbers, texts, printable(why.encode()))


def _wake(bench: Bench) -> None:
    """Supply on, where it is not; and the time that a start takes."""
    if bench.stage.virtual:
        bench.fresh()
    if bench.power is None or bench.power.is_on:
        return
    on = bench.power.on()
    until = interval_of(on).latest + bench.profile.limits.boot_up_ns
    bench.first(matchers.boot_up(bench.node_id), on, until)


def _read_numbers(bench: Bench, numbers: dict[str, int]) -> None:
    """Those of 1018h; what came before a failure is kept."""
    count = _read(bench, IDENTITY)
    if isinstance(count, Abort):
        raise NotRun(f"the read of 1018h was refused with {count.code:08X}h")
    for sub, name in enumerate(NUMBERS[: number(count)], 1):
        found = _read(bench, IDENTITY, sub)
        if isinstance(found, Abort):
            continue
        if len(found) != _U32_BYTES:
            raise NotRun(f"1018h:{sub:02X} has 4 bytes; the answer was {show(found)}")
        numbers[name] = number(found)


def _read(bench: Bench, index: int, sub: int = 0) -> bytes | Abort:
    return Sdo(bench, PATIENCE_NS).run(_Short(index, sub))


def printable(text: bytes) -> str:
    """A text of a device for people: nothing in it can move a cursor."""
    shown = text.rstrip(b"\0").decode("utf-8", "replace")
    return "".join(each if each.isprintable() else "\N{REPLACEMENT CHARACTER}" for each in shown)
