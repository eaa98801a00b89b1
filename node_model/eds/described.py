"""Objects as the file describes them, before a device with a node id has them."""

from __future__ import annotations

from dataclasses import dataclass, replace

from node_model.eds.errors import excerpt
from node_model.eds.numbers import Amount, NotThis, number, string, whole
from node_model.eds.text import Paragraph, Said, Text
from node_model.od import Access, DataType, Entry

_TYPES = {int(kind): kind for kind in DataType}
_ACCESSES = {access.value: access for access in Access}


@dataclass(frozen=True, slots=True)
class Described:
    """One sub-index.

    Args:
        index: 0000h..FFFFh.
        sub: 0..255.
        name: ParameterName.
        line: of its section.
        kind: its type.
        access: what SDO may do.
        pdo: it can be mapped.
        default: value of a numeric type; None = 0, or the limit next to it.
        data: value of another type.
        low: least allowed number.
        high: greatest allowed number.
        raw: what the file says, for the second reader.
    """

    index: int
    sub: int
    name: str
    line: int
    kind: DataType
    access: Access
    pdo: bool
    default: Amount | None
    data: bytes
    low: Amount | None
    high: Amount | None
    raw: tuple[tuple[str, str], ...] = ()

    def entry(self, node_id: int) -> Entry:
        """A new entry of a device with this node id."""
        kind = self.kind
        low = None if self.low is None else self.low.of(node_id)
        high = None if self.high is None else self.high.of(node_id)
        if self.default:
            value = kind.pack(self.default.of(node_id))
        elif kind.is_number:
            value = kind.pack(nearest_to_zero(low, high))
        else:
            value = self.data or bytes(kind.size)
        return Entry(
            self.index, self.sub, self.name, kind, self.access, value, value, low, high, self.pdo
        )


def nearest_to_zero(low: float | None, high: float | None) -> float:
    """What a number without a default is: 0, or the limit that is in between."""
    if low is not None and low > 0:
        return low
    return high if high is not None and high < 0 else 0


RAW = ("DefaultValue", "LowLimit", "HighLimit")


def describe(text: Text, where: Paragraph, index: int, sub: int) -> Described:
    """What a section says about a sub-index.

    Raises:
        EdsError: there is no type or access, or a value is none.
    """
    kind, limits = _kind(text, where)
    values = where.options if kind.known else {}
    low, high = _limits(text, limits or values, kind.type)
    chosen = Paragraph(where.title, where.line, values)
    said = chosen.said("parametervalue") or chosen.said("defaultvalue")
    default, data = _value(text, said, kind.type)
    return Described(
        index=index,
        sub=sub,
        name=where.words("parametername"),
        line=where.line,
        kind=kind.type,
        access=_access(text, where),
        pdo=flag(text, where, "pdomapping"),
        default=default,
        data=data,
        low=low,
        high=high,
        raw=tuple(
            (name, found.value)
            for name, found in (
                ("DefaultValue", said),
                ("LowLimit", chosen.said("lowlimit")),
                ("HighLimit", chosen.said("highlimit")),
            )
            if found
        ),
    )


@dataclass(frozen=True, slots=True)
class _Kind:
    type: DataType
    known: bool = True


def _kind(text: Text, where: Paragraph) -> tuple[_Kind, dict[str, Said] | None]:
    """The data type, and the limits that come with one that the file defines."""
    said = where.said("datatype")
    if said is None:
        raise text.refuse(
            where.line, f"[{where.title}] has no DataType", "write e.g. DataType=0x0007"
        )
    code = counted(text, said, "DataType")
    if code in _TYPES:
        return _Kind(_TYPES[code]), None
    inner = text.paragraphs.get(f"{code:x}sub1") if 0 <= code <= 0xFFFF else None
    if inner is not None and (own := inner.said("defaultvalue")) is not None:
        code = counted(text, own, "DefaultValue")
        if code in _TYPES:
            return _Kind(_TYPES[code]), _own_limits(text, said)
    text.remark(said.line, f"data type {excerpt(said.value)} is read as DOMAIN, without a value")
    return _Kind(DataType.DOMAIN, known=False), None


def _own_limits(text: Text, said: Said) -> dict[str, Said]:
    """Sub 2 and 3 of a type that the file defines are its limits."""
    code = whole(said.value)
    limits = {}
    for sub, name in ((2, "lowlimit"), (3, "highlimit")):
        found = text.paragraphs.get(f"{code:x}sub{sub}")
        if found is not None and (value := found.said("defaultvalue")) is not None:
            limits[name] = value
    return limits


def _access(text: Text, where: Paragraph) -> Access:
    said = where.said("accesstype")
    if said is None:
        raise text.refuse(
            where.line, f"[{where.title}] has no AccessType", "write e.g. AccessType=rw"
        )
    word = said.value.split(";", 1)[0].strip().lower()
    if word not in _ACCESSES:
        raise text.refuse(
            said.line,
            f"AccessType is {excerpt(said.value)}",
            f"write one of {', '.join(_ACCESSES)}",
        )
    return _ACCESSES[word]


def _value(text: Text, said: Said | None, kind: DataType) -> tuple[Amount | None, bytes]:
    """The value of a numeric type, the bytes of another."""
    if said is None:
        return None, b""
    try:
        if kind.is_number:
            return number(said.value, kind), b""
        return None, string(said.value, kind)
    except NotThis as problem:
        if kind is DataType.DOMAIN:
            text.remark(said.line, f"{excerpt(said.value)} is no content of a DOMAIN: left empty")
            return None, b""
        raise text.refuse(
            said.line, f"{excerpt(said.value)} is no {kind.name}", str(problem)
        ) from None


def _limits(
    text: Text, options: dict[str, Said], kind: DataType
) -> tuple[Amount | None, Amount | None]:
    """Least and greatest value; none where no value could be within."""
    if not kind.is_number:
        return None, None
    found: list[Amount | None] = []
    line = 0
    for name in ("lowlimit", "highlimit"):
        said = options.get(name)
        if said is None or not said.value:
            found.append(None)
            continue
        line = said.line
        try:
            found.append(number(said.value, kind))
        except NotThis as problem:
            what = f"limit {excerpt(said.value)} is no {kind.name}"
            raise text.refuse(said.line, what, str(problem)) from None
    low, high = found
    if low is not None and high is not None and low.of(1) > high.of(1):
        text.remark(line, "no value is within these limits: they are not kept")
        return None, None
    return low, high


def counted(text: Text, said: Said, name: str) -> int:
    """An option that must be a number.

    Raises:
        EdsError: it is none.
    """
    try:
        return whole(said.value)
    except NotThis as problem:
        what = f"{name} is {excerpt(said.value)}"
        raise text.refuse(said.line, what, str(problem)) from None


def flag(text: Text, where: Paragraph, option: str) -> bool:
    """An option that is 0 or 1, 0 where it is missing."""
    said = where.said(option)
    return said is not None and counted(text, said, option) != 0


def renumbered(model: Described, sub: int, name: str) -> Described:
    """The same object at another sub-index."""
    return replace(model, sub=sub, name=name)


def revalued(text: Text, model: Described, said: Said) -> Described:
    """The same object with another value."""
    default, data = _value(text, said, model.kind)
    raw = (("DefaultValue", said.value), *(each for each in model.raw if each[0] != RAW[0]))
    return replace(model, default=default, data=data, raw=raw)
