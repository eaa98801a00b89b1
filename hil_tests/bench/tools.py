"""What a test can ask a bench for by name, besides its facilities: masters, clients, facts.

Each is made when it is first asked for; what it needs is imported then.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING

from hil_tests.judge.verdict import NotRun

if TYPE_CHECKING:
    from hil_tests.bench.bench import Bench
    from hil_tests.bench.lss import Lss
    from hil_tests.bench.master import Master
    from hil_tests.bench.sdo import Sdo
    from hil_tests.chance import Chance
    from hil_tests.eds import Sheet


def sdo(bench: Bench) -> Sdo:
    """The SDO client."""
    from hil_tests.bench.sdo import Sdo  # noqa: PLC0415 - where a test asks for it

    return Sdo(bench, bench.profile.limits.sdo_ns)


def sheet(bench: Bench) -> Sheet:
    """The electronic data sheet of the device.

    Raises:
        NotRun: its profile names none.
    """
    from hil_tests.eds import sheet_of_device  # noqa: PLC0415 - where a test asks for it

    if bench.profile.eds is None:
        raise NotRun(f"{bench.profile.path} names no EDS; add eds = FILE to its [device]")
    return sheet_of_device(bench.profile.eds)


def lss(bench: Bench) -> Lss:
    """The LSS master."""
    from hil_tests.bench.lss import Lss  # noqa: PLC0415 - where a test asks for it

    return Lss(bench)


def manager(bench: Bench) -> Master:
    """The NMT master; `manager.meet()` begins with a device it knows nothing of."""
    from hil_tests.bench.master import Master  # noqa: PLC0415 - where a test asks for it

    return Master(bench)


def chance(bench: Bench) -> Chance:
    """What the seed of the run draws."""
    from hil_tests.chance import Chance  # noqa: PLC0415 - where a test asks for it

    return Chance(bench.seed)


TOOLS: Mapping[str, Callable[[Bench], object]] = MappingProxyType(
    {
        "bench": lambda bench: bench,
        "profile": lambda bench: bench.profile,
        "limits": lambda bench: bench.profile.limits,
        "sdo": sdo,
        "sheet": sheet,
        "lss": lss,
        "manager": manager,
        "chance": chance,
    }
)
"""Everything by the name of its fixture; facilities are attributes of the bench."""


def tool(bench: Bench, name: str) -> object:
    """What a test asks for by that name: a tool or a facility."""
    return TOOLS[name](bench) if name in TOOLS else getattr(bench, name)
