"""An EDS or DCF as a device takes it: its objects for any node id, and the facts about it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from node_model.eds.described import Described, counted, flag
from node_model.eds.errors import EdsError, Remark
from node_model.eds.objects import objects_of
from node_model.eds.second import opinion
from node_model.eds.text import LARGEST, Paragraph, Text, read_text
from node_model.od import Entry

RATES = (10, 20, 50, 125, 250, 500, 800, 1000)
"""kbit/s."""
LAST_NODE_ID = 127
NO_NODE_ID = 255
"""A device that waits for LSS to tell it one (CiA 305); formulas count with 0 meanwhile."""


@dataclass(frozen=True, slots=True)
class Info:
    """[DeviceInfo], [DummyUsage] and [DeviceCommissioning].

    Args:
        vendor_name: VendorName.
        vendor: VendorNumber; 0 where it is not told, as the next two.
        product_name: ProductName.
        product: ProductNumber.
        revision: RevisionNumber.
        order_code: OrderCode.
        bit_rates: bit/s that the device can have.
        lss: it has LSS.
        granularity: bits of the smallest object in a PDO; 8 where it is not told.
        rx_pdos: NrOfRXPDO.
        tx_pdos: NrOfTXPDO.
        dummies: data types that may fill gaps of RPDOs.
        node_id: of a DCF, or None.
        bit_rate: of a DCF, bit/s, or None.
    """

    vendor_name: str
    vendor: int
    product_name: str
    product: int
    revision: int
    order_code: str
    bit_rates: frozenset[int]
    lss: bool
    granularity: int
    rx_pdos: int
    tx_pdos: int
    dummies: frozenset[int]
    node_id: int | None
    bit_rate: int | None


@dataclass(frozen=True, slots=True)
class Sheet:
    """A file that was read.

    Args:
        file: its path.
        node_id: that was asked for, or that a DCF tells; None = neither.
        info: facts about the device.
        objects: what it describes.
        remarks: what is not as it should be, by line.
        corrections: where the canopen package reads something else than the text says.
    """

    file: str
    node_id: int | None
    info: Info
    objects: tuple[Described, ...]
    remarks: tuple[Remark, ...]
    corrections: tuple[Remark, ...]

    def entries(self, node_id: int | None = None) -> list[Entry]:
        """New entries for a device.

        Args:
            node_id: 1..127, or 255 for none yet; left out it is the sheet's own.

        Raises:
            EdsError: no node id is known, or it is none.
        """
        node_id = self.node_id if node_id is None else node_id
        if node_id == NO_NODE_ID:
            return [each.entry(0) for each in self.objects]
        if node_id is None or not 1 <= node_id <= LAST_NODE_ID:
            raise EdsError(self.file, 0, f"the node id is {node_id}", "give one of 1..127")
        return [each.entry(node_id) for each in self.objects]


def load_eds(path: str | Path, node_id: int | None = None, *, checked: bool = True) -> Sheet:
    """Read an EDS or DCF.

    Args:
        path: of the file.
        node_id: of the device; None = what a DCF says, if it is one.
        checked: ask the second reader too, for `corrections`. It takes long to import and
            to read, and a bundled file needs it in tests only.

    Raises:
        EdsError: it cannot be opened or read; the message names line, value and remedy.
    """
    try:
        with Path(path).open("rb") as file:
            data = file.read(LARGEST + 1)
    except (OSError, ValueError) as error:
        raise EdsError(str(path), 0, f"it cannot be opened: {error}", "check the path") from None
    return parse_eds(str(path), data, node_id, checked=checked)


def parse_eds(
    file: str, data: bytes, node_id: int | None = None, *, checked: bool = True
) -> Sheet:
    """As `load_eds`, from the bytes of a file.

    Raises:
        EdsError: it cannot be read.
    """
    text = read_text(file, data)
    objects = objects_of(text)
    if not objects:
        raise text.refuse(0, "there is no object", "add sections like [1000]; is this an EDS?")
    info = _info(text)
    return Sheet(
        file,
        info.node_id if node_id is None else node_id,
        info,
        tuple(objects),
        tuple(sorted(text.remarks, key=lambda remark: remark.line)),
        opinion(objects) if checked else (),
    )


def _info(text: Text) -> Info:
    device = text.paragraph("deviceinfo")
    dummy = text.paragraph("dummyusage")
    set_up = text.paragraph("devicecommissioning", "devicecomissioning")
    if not device.line:
        text.remark(0, "there is no section [DeviceInfo]")
    rate = _told(text, set_up, "baudrate")
    return Info(
        vendor_name=device.words("vendorname"),
        vendor=_told(text, device, "vendornumber") or 0,
        product_name=device.words("productname"),
        product=_told(text, device, "productnumber") or 0,
        revision=_told(text, device, "revisionnumber") or 0,
        order_code=device.words("ordercode"),
        bit_rates=frozenset(r * 1000 for r in RATES if flag(text, device, f"baudrate_{r}")),
        lss=flag(text, device, "lss_supported"),
        granularity=8 if (bits := _told(text, device, "granularity")) is None else bits,
        rx_pdos=_told(text, device, "nrofrxpdo") or 0,
        tx_pdos=_told(text, device, "nroftxpdo") or 0,
        dummies=frozenset(code for code in range(1, 8) if flag(text, dummy, f"dummy{code:04}")),
        node_id=_told(text, set_up, "nodeid"),
        bit_rate=None if rate is None else rate * 1000,
    )


def _told(text: Text, where: Paragraph, option: str) -> int | None:
    said = where.said(option)
    return None if said is None else counted(text, said, option)
