"""A second opinion: the canopen package reads the same objects, and is compared.

It is given the sections in order and without what it stumbles over. Known weaknesses (24-bit
limits, octal numbers, node ids in lower case, semicolons in strings, bits of reals) make it
read nothing or something else; the raw text is right then, and what it said is noted.
"""

from __future__ import annotations

import io
import logging
from collections.abc import Iterable, Iterator
from typing import Any

from node_model.eds.described import Described
from node_model.eds.errors import Remark, excerpt
from node_model.od import DataType

NODE_ID = 1
_RECORD = 9


def feed(objects: Iterable[Described]) -> str:
    """The objects as an EDS that canopen can read."""
    lines = ["[DeviceInfo]"]
    last = -1
    for each in objects:
        if each.index != last:
            last = each.index
            lines += [f"[{each.index:04X}]", f"ParameterName=x{each.index:X}"]
            lines += [f"ObjectType={_RECORD}"]
        lines += [f"[{each.index:04X}sub{each.sub:X}]", f"ParameterName=x{each.sub:X}"]
        lines += [f"DataType={int(each.kind)}", f"AccessType={each.access.value}"]
        lines += [f"PDOMapping={each.pdo:d}"]
        lines += [f"{name}={value}" for name, value in each.raw]
    return "\n".join(lines) + "\n"


def opinion(objects: list[Described]) -> tuple[Remark, ...]:
    """Where canopen reads the objects otherwise.

    Args:
        objects: as they were read here.
    """
    from canopen.objectdictionary import eds  # noqa: PLC0415 - takes long, and only this needs it

    read: Any = eds.import_eds  # annotated in part
    logger = logging.getLogger("canopen")
    level = logger.level
    logger.setLevel(logging.ERROR)
    try:
        theirs = read(io.StringIO(feed(objects)), NODE_ID)
        return tuple(remark for each in objects for remark in _compared(each, theirs))
    except Exception as error:  # noqa: BLE001 - whatever it stumbles over is its opinion
        return (Remark(0, f"canopen cannot read the objects: {excerpt(str(error))}"),)
    finally:
        logger.setLevel(level)


def _compared(each: Described, theirs: Any) -> Iterator[Remark]:
    place = f"{each.index:04X}h:{each.sub:02X}"
    variable = theirs[each.index].subindices[each.sub]
    for what, mine, other in (
        ("type", int(each.kind), variable.data_type),
        ("access", each.access.value, variable.access_type),
        ("mapping", each.pdo, variable.pdo_mappable),
        ("default", _default(each), variable.default),
        ("low limit", each.low and each.low.of(NODE_ID), variable.min),
        ("high limit", each.high and each.high.of(NODE_ID), variable.max),
    ):
        if mine != other:
            text = f"{place} {what} is {excerpt(str(mine))}; canopen reads {excerpt(str(other))}"
            yield Remark(each.line, text)


def _default(each: Described) -> object:
    """The default in the form that canopen gives it."""
    if not any(name == "DefaultValue" for name, _ in each.raw):
        return None
    if each.kind.is_number:
        return each.default and each.default.of(NODE_ID)
    if each.kind is DataType.VISIBLE_STRING:
        return each.data.decode("utf-8", "replace")
    if each.kind is DataType.UNICODE_STRING:
        return each.data.decode("utf-16-le", "replace")
    return int.from_bytes(each.data, "little") if each.kind.size else each.data
