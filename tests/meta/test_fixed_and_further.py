"""Rules on objects that no bundled device has: each is proved on a device with its own sheet.

The sheet is the drive's, with a second SDO server in use and with one mapping that is fixed.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path

import pytest

from hil_tests.bench.kinds import bench_for
from hil_tests.bench.virtual import VirtualStage
from hil_tests.run import outcome
from node_model import devices, generic
from node_model.composition import Parts
from node_model.frame import Frame
from node_model.node import Frames, Panel
from node_model.sdo import Channel, SdoServer
from tests.meta.proving import Suite, collect, try_case

EDS = Path("node_model/profiles/drive.eds")
PROFILE = """
[device]
name = "sheet"
kind = "generic"
description = "a drive with two SDO servers and a fixed mapping"
eds = "sheet.eds"

[factory]
node_id = 5
bit_rate = 250000
heartbeat_ms = 0
"""
FURTHER = {1: "$NODEID+0x640", 2: "$NODEID+0x5C0"}


def entry(sub: int, data_type: int, access: str, default: object) -> str:
    """A sub-index of 1201h."""
    return (
        f"[1201sub{sub}]\nParameterName=p{sub}\nObjectType=0x7\nDataType=0x{data_type:04X}\n"
        f"AccessType={access}\nDefaultValue={default}\nPDOMapping=0\n\n"
    )


def sheet() -> str:
    """The drive's, with 1201h, and with a mapping of TPDO 4 that cannot be written."""
    text = EDS.read_text("utf-8")
    text = re.sub(r"(\[1A03sub\d\][^\[]*AccessType=)rw", r"\1ro", text)
    head, optional, rest = text.partition("[OptionalObjects]\nSupportedObjects=")
    count, _, rest = rest.partition("\n")
    record = "[1201]\nParameterName=SDO server 2\nObjectType=0x9\nSubNumber=3\n\n"
    record += entry(0, 5, "const", 2)
    record += "".join(entry(sub, 7, "rw", default) for sub, default in FURTHER.items())
    more = int(count) + 1
    return f"{head}{optional}{more}\n{more}=0x1201\n{rest}\n{record}"


class FurtherServerReadsZeros(SdoServer):
    """Reads through a server besides the default one give 0."""

    def receive(self, frame: Frame, now: int) -> Frames:
        """Its answer, without what was asked for."""
        found = super().receive(frame, now)
        if frame.can_id == 0x600 + self.node_id:
            return found
        return tuple(Frame(each.can_id, each.data[:4] + bytes(4)) for each in found)


class TakesWritesToAFixedMapping(Channel):
    """A write to a mapping that cannot be written is answered as done."""

    def start_download(self, data: bytes, now: int) -> Frames:
        """Nothing is written."""
        if data[2] == 0x1A:
            return self.answer(b"\x60", data, 0)
        return super().start_download(data, now)


MODELS: Mapping[str, Parts] = {
    "": Parts(),
    "C-SD-19": Parts(sdo=FurtherServerReadsZeros),
    "C-PC-11": Parts(sdo=partial(SdoServer, channel=TakesWritesToAFixedMapping)),
}
"""A device that breaks the rule; "" = one that breaks none."""


@pytest.fixture(scope="module")
def suite(tmp_path_factory: pytest.TempPathFactory) -> tuple[str, Suite]:
    """The profile of the device, and the tests that concern these rules."""
    folder = tmp_path_factory.mktemp("sheet")
    (folder / "sheet.eds").write_text(sheet(), "utf-8")
    profile = folder / "sheet.toml"
    profile.write_text(PROFILE, "utf-8")
    found = collect("--can-profile", str(profile))
    cases = tuple(case for case in found.cases if set(case.claims) & set(MODELS))
    return str(profile), replace(found, cases=cases)


@pytest.mark.slow
@pytest.mark.parametrize("broken", MODELS)
def test_such_a_device_is_judged_by_them(suite: tuple[str, Suite], broken: str) -> None:
    """The right one passes; one that breaks a rule fails on that rule alone."""
    profile, tests = suite
    plan = tests.plan

    def make(facts: generic.Profile, image: bytes) -> Panel:
        return generic.make(facts, image, MODELS[broken])

    blueprint = replace(devices.read(profile), maker=make)
    bench = bench_for(VirtualStage(blueprint, "own sheet"), plan.profile, plan.home)
    results = [try_case(case, bench, plan) for case in tests.cases]
    assert len(results) == 2
    wanted = {outcome.PASSED} if not broken else {outcome.PASSED, outcome.FAILED}
    assert {each.outcome for each in results} == wanted, results
    found = {finding.requirement for each in results for finding in each.findings}
    assert found == ({broken} if broken else set())
