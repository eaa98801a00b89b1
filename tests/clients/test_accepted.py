"""Sets of abort codes."""

from __future__ import annotations

from hil_tests.clients import accepted
from hil_tests.clients.accepted import Accepted, show_code
from hil_tests.decode_sdo import ABORTS


def test_every_code_of_every_set_is_one_of_cia_301() -> None:
    """No set names a code that the clause does not list, and none names one twice."""
    sets = [value for value in vars(accepted).values() if isinstance(value, Accepted)]
    assert len(sets) > 20
    for one in sets:
        assert set(one.codes) <= set(ABORTS)
        assert len(set(one.codes)) == len(one.codes)


def test_the_first_code_is_the_preferred_one() -> None:
    """The others are accepted; the set is shown in that order."""
    assert accepted.READ_ONLY.preferred == 0x0601_0002
    assert 0x0800_0000 in accepted.READ_ONLY
    assert 0x0602_0000 not in accepted.READ_ONLY
    assert str(accepted.READ_ONLY) == "06010002h or 06010000h or 08000000h"


def test_a_code_is_shown_with_its_meaning() -> None:
    """Also one that nobody knows."""
    assert show_code(0x0602_0000) == "06020000h (no such object)"
    assert show_code(1) == "00000001h (unknown code)"
