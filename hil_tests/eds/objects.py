"""One object of an EDS: what a section [1018] or [1018sub1] says."""

from __future__ import annotations

from dataclasses import dataclass

from hil_tests.eds.lines import Document, Option, Section
from hil_tests.eds.values import KINDS, Kind, Unreadable, Value, is_octal_trap, number_of, value_of

VAR, ARRAY, RECORD = 7, 8, 9
DOMAIN_CODE = 0x0F
ACCESSES = ("ro", "wo", "rw", "rwr", "rww", "const")
VALUES = "C-EDS-03"
STRUCTURE = "C-EDS-01"


@dataclass(frozen=True, slots=True)
class Object:
    """A sub-index that can be read or written.

    Args:
        index: 0000h..FFFFh.
        sub: 0..255.
        name: ParameterName.
        line: of its section.
        data_type: code of the type, CiA 301 table 44.
        kind: the type; DOMAIN where the code is not known.
        access: "ro", "wo", "rw", "rwr", "rww" or "const".
        pdo: it can be mapped into PDOs.
        default: DefaultValue, or None.
        low: LowLimit, or None.
        high: HighLimit, or None.
        configured: ParameterValue of a DCF, or None.
        flags: ObjFlags; bit 0 refuses writing by a download of the whole DCF.
    """

    index: int
    sub: int
    name: str
    line: int
    data_type: int
    kind: Kind
    access: str
    pdo: bool = False
    default: Value | None = None
    low: Value | None = None
    high: Value | None = None
    configured: Value | None = None
    flags: int = 0

    @property
    def readable(self) -> bool:
        """SDO upload is allowed."""
        return self.access != "wo"

    @property
    def writable(self) -> bool:
        """SDO download is allowed."""
        return self.access not in {"ro", "const"}

    @property
    def place(self) -> str:
        """As people write it: 1018h:01."""
        return f"{self.index:04X}h:{self.sub:02X}"


def number_option(
    document: Document, section: Section, name: str, default: int, rule: str = STRUCTURE
) -> int:
    """An option that is a number; a finding and the default where it is none."""
    option = section.get(name)
    if option is None:
        return default
    try:
        return number_of(option.text)
    except Unreadable as error:
        document.error(option.line, rule, f"{option.name} is {option.text[:40]!r}", str(error))
        return default


def read_object(
    document: Document, section: Section, index: int, sub: int, source: Section | None = None
) -> Object | None:
    """The object that a section describes.

    Args:
        document: takes the findings.
        section: of the object.
        index: of the object.
        sub: of the object.
        source: the section that holds type and access, where that is another.

    Returns:
        None where the type is missing: such an object cannot be understood.
    """
    source = source or section
    code = number_option(document, source, "DataType", 0)
    if code == 0:
        document.error(
            source.line,
            STRUCTURE,
            f"[{section.name}] has no DataType",
            "write e.g. DataType=0x0007",
        )
        return None
    code, outer = _resolved(document, source, code)
    kind = KINDS.get(code) or _unknown_kind(document, source, code)
    known = source if code in KINDS else Section(source.name, source.line)
    return Object(
        index=index,
        sub=sub,
        name=section.text("ParameterName"),
        line=section.line,
        data_type=code,
        kind=kind,
        access=_access(document, source),
        pdo=number_option(document, source, "PDOMapping", 0) != 0,
        default=value_option(document, known, "DefaultValue", kind),
        low=_limit(document, outer or known, "LowLimit", kind),
        high=_limit(document, outer or known, "HighLimit", kind),
        configured=value_option(document, known, "ParameterValue", kind),
        flags=number_option(document, source, "ObjFlags", 0),
    )


def _unknown_kind(document: Document, source: Section, code: int) -> Kind:
    option = source.get("DataType")
    line = source.line if option is None else option.line
    text = f"data type {code:04X}h is not known; the object is read as a DOMAIN, without values"
    document.warn(line, STRUCTURE, text, "use a type of CiA 301")
    return KINDS[DOMAIN_CODE]


def _resolved(document: Document, source: Section, code: int) -> tuple[int, Section | None]:
    """A type that the file defines for itself: [A0] with the real one in [A0sub1].

    Editors write that for a type with limits: sub 1 is the type, 2 and 3 the limits.
    """
    if code in KINDS:
        return code, None
    inner = document.section(f"{code:X}sub1", f"{code:04X}sub1")
    if inner is None:
        return code, None
    limits = Section(source.name, source.line)
    for sub, name in ((2, "LowLimit"), (3, "HighLimit")):
        outer = document.section(f"{code:X}sub{sub}", f"{code:04X}sub{sub}")
        if outer is not None and (option := outer.get("DefaultValue")) is not None:
            limits.options[name.lower()] = option
    return number_option(document, inner, "DefaultValue", code), limits


def _access(document: Document, source: Section) -> str:
    option = source.get("AccessType")
    if option is None:
        document.error(
            source.line, STRUCTURE, f"[{source.name}] has no AccessType", "write AccessType=rw"
        )
        return "ro"
    access = option.text.partition(";")[0].strip().lower()
    if access not in ACCESSES:
        document.error(
            option.line,
            STRUCTURE,
            f"AccessType is {option.text[:40]!r}",
            f"write one of {', '.join(ACCESSES)}",
        )
        return "ro"
    return access


def value_option(document: Document, section: Section, name: str, kind: Kind) -> Value | None:
    """A value of a type; a finding and None where it is none."""
    option = section.get(name)
    return None if option is None else read_value(document, option, kind)


def read_value(document: Document, option: Option, kind: Kind) -> Value | None:
    """What an option says as a value of a type; a finding and None where it says nothing."""
    try:
        value = value_of(option.text, option.line, kind)
    except Unreadable as error:
        # The value of a DOMAIN has no form of its own in CiA 306; editors write 0.
        tell = document.warn if kind is KINDS[DOMAIN_CODE] else document.error
        text = f"{option.name} is {option.text[:40]!r}, no {kind.name}"
        tell(option.line, VALUES, text, str(error))
        return None
    if kind.is_number and kind.form != "real" and is_octal_trap(option.text):
        document.warn(
            option.line,
            VALUES,
            f"{option.name} is {option.text!r}, which is octal to some readers",
            "drop the leading zeros",
        )
    return value


def _limit(document: Document, section: Section, name: str, kind: Kind) -> Value | None:
    if not kind.is_number:
        return None
    return value_option(document, section, name, kind)
