"""What a frame is: function, node and the numbers in it, as far as its bytes go.

By the pre-defined connection set of CiA 301 (4.2.0, 7.3.3) and the fixed identifiers of CiA 305.
`decode` puts these facts into words; another decoder can be held against them. What is too short
for a number simply has none.
"""

from __future__ import annotations

from dataclasses import dataclass

from hil_tests.decode_sdo import SdoFrame, read_sdo
from node_model.frame import Frame

UNKNOWN = "unknown"
LSS_REQUEST, LSS_ANSWER = "LSS request", "LSS answer"
ERROR_CONTROL = "error control"
SDO_REQUEST, SDO_ANSWER = "SDO request", "SDO answer"

_FIXED = {0x000: "NMT", 0x080: "SYNC", 0x100: "TIME", 0x7E5: LSS_REQUEST, 0x7E4: LSS_ANSWER}
"""Identifiers that belong to a service, not to a node."""

_PDOS = ("TPDO1", "RPDO1", "TPDO2", "RPDO2", "TPDO3", "RPDO3", "TPDO4", "RPDO4")
"""From 180h on, 80h apart."""

_OF_NODES = {
    0x080: "EMCY",
    **{0x180 + 0x80 * place: name for place, name in enumerate(_PDOS)},
    0x580: SDO_ANSWER,
    0x600: SDO_REQUEST,
    0x700: ERROR_CONTROL,
}
"""Function by the upper four bits of the identifier; the lower seven are the node."""


@dataclass(frozen=True, slots=True)
class Facts:
    """What a frame is; None = it has no such thing, or is too short for it.

    Args:
        function: of its identifier; "unknown" = none.
        node: to which it belongs, 1..127.
        remote: it asks for the data of that function.
        data: its data bytes.
        command: of NMT node control.
        target: node that an NMT command is for; 0 = all.
        state: NMT state that error control tells; 0 = boot-up.
        toggle: bit of a guarding answer, or of an SDO segment.
        code: error code of an EMCY message.
        register: error register in an EMCY message.
        counter: of SYNC.
        service: command specifier of LSS.
        sdo: an SDO frame taken apart.
    """

    function: str
    node: int | None = None
    remote: bool = False
    data: bytes = b""
    command: int | None = None
    target: int | None = None
    state: int | None = None
    toggle: int | None = None
    code: int | None = None
    register: int | None = None
    counter: int | None = None
    service: int | None = None
    sdo: SdoFrame | None = None


def facts(frame: Frame) -> Facts:
    """The facts of any frame."""
    function, node = _function(frame)
    if frame.remote or function == UNKNOWN:
        return Facts(function, node, remote=frame.remote, data=frame.data)
    reader = _READERS.get(function)
    return reader(function, node, frame.data) if reader else Facts(function, node, data=frame.data)


def _function(frame: Frame) -> tuple[str, int | None]:
    if frame.extended:
        return UNKNOWN, None
    fixed = _FIXED.get(frame.can_id)
    if fixed:
        return fixed, None
    node = frame.can_id & 0x7F
    function = _OF_NODES.get(frame.can_id & 0x780) if node else None
    return (function, node) if function else (UNKNOWN, None)


def _byte(data: bytes, place: int) -> int | None:
    return data[place] if len(data) > place else None


def _nmt(function: str, node: int | None, data: bytes) -> Facts:
    """CiA 301, 7.2.8.3.1."""
    return Facts(function, node, data=data, command=_byte(data, 0), target=_byte(data, 1))


def _sync(function: str, node: int | None, data: bytes) -> Facts:
    """CiA 301, 7.2.5.3."""
    return Facts(function, node, data=data, counter=data[0] if len(data) == 1 else None)


def _emcy(function: str, node: int | None, data: bytes) -> Facts:
    """CiA 301, 7.2.7.3."""
    code = int.from_bytes(data[:2], "little") if len(data) > 1 else None
    return Facts(function, node, data=data, code=code, register=_byte(data, 2))


def _error_control(function: str, node: int | None, data: bytes) -> Facts:
    """CiA 301, 7.2.8.3.2: a frame of another length than one tells no state."""
    if len(data) != 1:
        return Facts(function, node, data=data)
    return Facts(function, node, data=data, state=data[0] & 0x7F, toggle=data[0] >> 7)


def _sdo(function: str, node: int | None, data: bytes) -> Facts:
    """CiA 301, 7.2.4.3."""
    sdo = read_sdo(data, from_client=function == SDO_REQUEST)
    return Facts(function, node, data=data, toggle=sdo.toggle if sdo else None, sdo=sdo)


def _lss(function: str, node: int | None, data: bytes) -> Facts:
    """CiA 305, 6."""
    return Facts(function, node, data=data, service=_byte(data, 0))


_READERS = {
    "NMT": _nmt,
    "SYNC": _sync,
    "EMCY": _emcy,
    ERROR_CONTROL: _error_control,
    SDO_REQUEST: _sdo,
    SDO_ANSWER: _sdo,
    LSS_REQUEST: _lss,
    LSS_ANSWER: _lss,
}
