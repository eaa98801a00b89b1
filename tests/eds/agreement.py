"""What both readers of EDS files say about a file, in one form, to be compared."""

from __future__ import annotations

import os
from pathlib import Path

from hil_tests.eds import Sheet
from hil_tests.eds.values import Value
from node_model.eds import Sheet as DeviceSheet

NODE_ID = 5
Facts = dict[tuple[int, int], tuple[object, ...]]


def real_files() -> list[Path]:
    """Files of other people's devices, where somebody has put some beside the checkout."""
    beside = Path(__file__).parents[3] / "shared" / "eds"
    folder = Path(os.environ.get("NODEPROOF_EDS_FILES") or beside)
    return sorted(path for path in folder.glob("*") if path.suffix in {".eds", ".dcf"})


def _limit(value: Value | None) -> float | None:
    return None if value is None else value.at(NODE_ID)


def said_to_tester(sheet: Sheet) -> Facts:
    """Type, access, mapping, power-on bytes and limits of each object."""
    facts: Facts = {}
    for each in sheet:
        value = each.configured or each.default
        data = bytes(each.kind.size) if value is None else value.bytes_at(NODE_ID)
        low, high = _limit(each.low), _limit(each.high)
        if low is not None and high is not None and low > high:
            low = high = None
        if value is None and each.kind.is_number:
            nearest = sorted((0.0 if low is None else low, 0, 0.0 if high is None else high))[1]
            data = Value("", 0, each.kind, number=nearest).bytes_at(NODE_ID)
        code = each.data_type if each.kind.name != "DOMAIN" else 0x0F
        facts[each.index, each.sub] = (
            each.name, code, each.access, each.pdo, data, low, high
        )  # fmt: skip
    return facts


def said_to_device(sheet: DeviceSheet) -> Facts:
    """The same of the device's reader."""
    return {
        (e.index, e.sub): (
            e.name, int(e.data_type), e.access.value, e.pdo, e.value, e.low, e.high
        )
        for e in sheet.entries(NODE_ID)
    }  # fmt: skip
