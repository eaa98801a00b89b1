"""Identifiers that an object may hold."""

from __future__ import annotations

import pytest

from node_model.cob_id import BIT_30, BIT_31, check_cob_id, check_same_can_id, is_restricted
from node_model.od import AbortCode, SdoAbort


@pytest.mark.parametrize(
    ("first", "last"),
    [
        (0x000, 0x07F),
        (0x101, 0x180),
        (0x581, 0x5FF),
        (0x601, 0x67F),
        (0x6E0, 0x6FF),
        (0x701, 0x7FF),
    ],
)
def test_restricted_identifiers_have_exact_bounds(first: int, last: int) -> None:
    """Both ends belong to the range, their neighbours do not."""
    assert is_restricted(first)
    assert is_restricted(last)
    assert not is_restricted(last + 1) or last == 0x7FF
    assert not is_restricted(first - 1) or first == 0


@pytest.mark.parametrize("value", [1 << 29 | 0x85, 1 << 11 | 0x85, BIT_30 | 0x85, 0x601, 0])
def test_other_bits_and_restricted_identifiers_are_refused(value: int) -> None:
    """29-bit identifiers, bits between, a flag that the object has not, SDO, NMT."""
    with pytest.raises(SdoAbort) as refusal:
        check_cob_id(value, BIT_31)
    assert refusal.value.code is AbortCode.VALUE


def test_identifier_0_is_right_for_what_is_off() -> None:
    """Many makers deliver unused objects as 8000 0000h; other restricted ones stay refused."""
    check_cob_id(BIT_31, BIT_31, idle=True)
    with pytest.raises(SdoAbort):
        check_cob_id(BIT_31 | 0x701, BIT_31, idle=True)


def test_flags_do_not_make_another_identifier() -> None:
    """Only the lowest eleven bits are compared."""
    check_same_can_id(0x85, BIT_31 | 0x85)
    with pytest.raises(SdoAbort):
        check_same_can_id(0x85, 0x86)
