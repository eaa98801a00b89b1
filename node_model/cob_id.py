"""COB-IDs as objects hold them: an 11-bit identifier and flags (CiA 301 4.2.0, 7.2 and 7.5.2).

Bit 29 asks for a 29-bit identifier, which these devices do not support. Some identifiers
belong to services for ever and are refused everywhere else (7.3.5, restricted CAN-IDs).
"""

from __future__ import annotations

from node_model.od import AbortCode, SdoAbort

BIT_31 = 1 << 31
BIT_30 = 1 << 30
CAN_ID = 0x7FF

RESTRICTED = (
    range(0x080),
    range(0x101, 0x181),
    range(0x581, 0x600),
    range(0x601, 0x680),
    range(0x6E0, 0x700),
    range(0x701, 0x800),
)
"""NMT, SDO, error control and what is reserved: no PDO, SYNC, TIME or EMCY may use them."""


def is_restricted(can_id: int) -> bool:
    """Whether this identifier may not be configured."""
    return any(can_id in ids for ids in RESTRICTED)


def check_cob_id(value: int, flags: int, idle: bool = False) -> None:
    """Refuse a COB-ID that the device cannot have.

    Args:
        value: what the client wants to write.
        flags: the bits above the identifier that this object may have.
        idle: the value switches its service off; identifier 0 is right then.

    Raises:
        SdoAbort: 0609 0030h, other bits are set or the identifier is restricted.
    """
    if value & ~(flags | CAN_ID):
        raise SdoAbort(AbortCode.VALUE)
    can_id = value & CAN_ID
    if is_restricted(can_id) and not (idle and can_id == 0):
        raise SdoAbort(AbortCode.VALUE)


def check_same_can_id(old: int, new: int) -> None:
    """Refuse another identifier: the service is in use before and after.

    Raises:
        SdoAbort: 0609 0030h.
    """
    if (old ^ new) & CAN_ID:
        raise SdoAbort(AbortCode.VALUE)
