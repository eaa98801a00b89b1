"""Two readers, written apart from each other, say the same about each file."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from hil_tests.eds import lint, read_sheet
from node_model.eds import EdsError, load_eds
from node_model.od import ObjectDictionary
from tests.eds.agreement import NODE_ID, real_files, said_to_device, said_to_tester
from tests.eds.reading import FILES

OURS = sorted(FILES.iterdir())
SHIPPED = sorted((Path(__file__).parents[2] / "node_model" / "profiles").glob("*.eds"))
REAL = real_files()


@pytest.mark.parametrize("path", [*OURS, *SHIPPED], ids=lambda path: path.name)
def test_both_readers_agree(path: Path) -> None:
    """On every object of the files here, and on the facts about the device."""
    tester, device = read_sheet(path), load_eds(path)
    if path in SHIPPED:
        assert (lint(tester), device.remarks, device.corrections) == ((), (), ())
    assert said_to_tester(tester) == said_to_device(device)
    mine, theirs = tester.device, device.info
    assert (mine.vendor or 0, mine.product or 0, mine.revision or 0) == (
        theirs.vendor, theirs.product, theirs.revision
    )  # fmt: skip
    assert (mine.vendor_name, mine.product_name) == (theirs.vendor_name, theirs.product_name)
    assert set(mine.bit_rates) == theirs.bit_rates
    assert (mine.rx_pdos or 0, mine.tx_pdos or 0) == (theirs.rx_pdos, theirs.tx_pdos)
    assert (mine.lss, mine.granularity) == (theirs.lss, theirs.granularity)
    assert mine.dummies == theirs.dummies
    assert (mine.node_id, mine.bit_rate) == (theirs.node_id, theirs.bit_rate)


def is_known_weakness(correction: str) -> bool:
    """The canopen package reads nothing, or a negative number in hexadecimal as positive.

    Limits between which there is nothing are kept there and dropped here.
    """
    mine, theirs = re.findall(r"(?:is|reads) (.*?)(?:;|$)", correction)
    if theirs == "'None'" or mine == "'None'":
        return True
    here, there = int(mine.strip("'")), int(theirs.strip("'"))
    return there - here in {1 << 8, 1 << 16, 1 << 32}


@pytest.mark.slow
@pytest.mark.skipif(not REAL, reason="no folder with EDS files of other devices is here")
@pytest.mark.parametrize("path", REAL, ids=lambda path: path.name)
def test_files_of_others_make_a_dictionary_or_are_refused(path: Path) -> None:
    """Both readers agree; what the device's refuses, the tester's names with the same line."""
    tester = read_sheet(path)
    try:
        device = load_eds(path, NODE_ID)
    except EdsError as error:
        assert str(error).startswith(f"{path}:")
        assert error.line in {finding.line for finding in tester.findings}
        return
    for remark in device.corrections:
        assert is_known_weakness(remark.text), remark
    od = ObjectDictionary(device.entries())
    assert od.indices == {each.index for each in tester}
    assert said_to_tester(tester) == said_to_device(device)
