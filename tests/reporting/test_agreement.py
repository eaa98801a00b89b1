"""tshark and our decoder on the same frames: every kind of service, and acceptance tests."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from hil_tests.reporting.pcapng import PcapngSink
from hil_tests.trace import Sighting
from node_model.frame import Frame
from tests.reporting.agreement import (
    PREDICATES,
    Agreement,
    compare_all,
    dissected,
    known_differences,
    main,
)
from tests.run.harness import judge_apart

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not shutil.which("tshark"), reason="tshark is not installed"),
]

SDO = """
605#2F17100005000000 605#2B171000E8030000 605#2118100010000000 605#2017100000000000
605#2217100001000000 585#6017100000000000 605#0041424344454647 605#1D41000000000000
585#2000000000000000 585#3000000000000000 605#4018100100000000 585#4318100178563412
585#4F18100178000000 585#4118100110000000 605#6000000000000000 605#7000000000000000
585#0041424344454647 585#1B41420000000000 605#8018100100000206 585#8018100100000206
605#C21F100110000000 605#C61F100110000000 585#A41F10017F000000 585#A01F10017F000000
605#0141424344454647 605#8241424344454647 585#A2027F0000000000 605#D534120000000000
585#A100000000000000 605#A01F10017F000000 605#A41F10017F000000 585#C21F100110000000
585#C61F100110000000 605#A300000000000000 585#0141424344454647 605#A2027F0000000000
585#C934120000000000 605#A100000000000000 605#E000000000000000 585#E000000000000000
585#A300000000000000 605#40171000 605#80 605#A300 5E1#AD42 599#D23A77 67F#4000100000000000
"""
LSS = """
7E5#0401000000000000 7E5#0400000000000000 7E5#4078563412000000 7E5#4178563412000000
7E5#4278563412000000 7E5#4378563412000000 7E4#4400000000000000 7E5#4678563412000000
7E5#4778563412000000 7E5#4878563412000000 7E5#4978563412000000 7E5#4A78563412000000
7E5#4B78563412000000 7E4#4F00000000000000 7E5#4C00000000000000 7E4#5000000000000000
7E5#5178563412800001 7E5#1105000000000000 7E4#1100000000000000 7E4#1101000000000000
7E5#1300020000000000 7E4#1300000000000000 7E4#1301000000000000 7E5#15E8030000000000
7E5#1700000000000000 7E4#1700000000000000 7E4#1702000000000000 7E5#5A00000000000000
7E4#5A78563412000000 7E5#5B00000000000000 7E4#5B78563412000000 7E5#5C00000000000000
7E4#5C78563412000000 7E5#5D00000000000000 7E4#5D78563412000000 7E5#5E00000000000000
7E4#5E05000000000000 7E5#9900000000000000 7E5#5178563412 7E5#04 7E5#
"""
OTHERS = """
000#0105 000#0200 000#8005 000#8105 000#8205 000#3305 000#81 080# 080#07 080#F0 080#0700
100#E80300000A00 100#00 081#0000000000000000 085#0050010000000000 085#3081110102030405
0FF#00FF800000000000 085#0050 701#00 705#00 705#05 705#04 705#7F 705#85 705#84 705#FF 705#80
705#2A 77F#05 705#0500 705# 705#R1 185#R1 605#R8 080#R0 000#R2 7E5#R8 181#01 185#0102
205#01 285#01 305#01 385#01 405#01 485#01 505#0102030405060708 185#
6FF#00 3F8#050300000001 4F8#050300000001 700#05 580#4018100100000000 7FF#01 001#01 120#01
780#05 00000705#05 00000005#05 1FFFFFFF#00 00000080# 00000705#R1 185#R8
"""


def frame(text: str) -> Frame:
    """A frame from candump's notation."""
    ident, _, rest = text.partition("#")
    extended = len(ident) > 3
    if rest.startswith("R"):
        return Frame(int(ident, 16), remote=True, extended=extended, dlc=int(rest[1:]))
    return Frame(int(ident, 16), bytes.fromhex(rest), extended=extended)


def recorded(path: Path, texts: str) -> Path:
    """A trace of these frames."""
    with PcapngSink(path, interface="vcan7", clock="virtual time", flush=False) as sink:
        for place, text in enumerate(texts.split()):
            sink.write(Sighting(frame(text), place * 1_000_000))
    return path


def test_both_decoders_agree_on_every_kind_of_frame(tmp_path: Path) -> None:
    """SDO, LSS, PDO, NMT, EMCY, SYNC, TIME, error control; each known difference is needed."""
    known = known_differences()
    agreement = Agreement(known)
    assert compare_all([recorded(tmp_path / "a.pcapng", SDO + LSS + OTHERS)], agreement) == []
    assert agreement.frames == len((SDO + LSS + OTHERS).split())
    assert {name for name in known if not agreement.used[name]} == set()
    assert {each.frames for each in known.values()} == set(PREDICATES)


def test_several_traces_are_one_capture(tmp_path: Path) -> None:
    """tshark reads them section by section, in their order."""
    paths = [recorded(tmp_path / "a.pcapng", LSS), recorded(tmp_path / "b.pcapng", SDO)]
    agreement = Agreement(known_differences())
    assert compare_all(paths, agreement) == []
    assert agreement.frames == len((SDO + LSS).split())


@pytest.mark.parametrize(
    ("field", "value", "sent", "said"),
    [
        ("canopen.node_id", "0x06", "705#05", "node 5 to us, 6 to tshark"),
        ("canopen.nmt_guard.state", "0x04", "705#05", "state 5 to us, 4 to tshark"),
        ("canopen.nmt_ctrl.cd", "0x02", "000#0105", "command 1 to us, 2 to tshark"),
        ("canopen.em.err_code", "0x8110", "085#0050010000000000", "code 20480 to us, 33040"),
        ("canopen.sdo.main_idx", "0x1018", "605#4017100000000000", "index 4119 to us, 4120"),
        ("canopen.lss.cs", "0x05", "7E5#0401000000000000", "service 4 to us, 5 to tshark"),
        ("_ws.col.Info", "PDO1 (tx)", "705#05", "function error control to us, TPDO1 to tshark"),
        ("_ws.malformed", "[Malformed]", "705#05", "malformed to tshark, and to us heartbeat"),
        ("can.id", "1", "705#05", "identifier"),
    ],
)
def test_a_difference_is_found(
    tmp_path: Path, field: str, value: str, sent: str, said: str
) -> None:
    """Each thing that is compared: the comparison is no rubber stamp."""
    (told,) = dissected([recorded(tmp_path / "a.pcapng", sent)])
    agreement = Agreement(known_differences())
    assert agreement.compare(frame(sent), told) == []
    assert said in " ".join(agreement.compare(frame(sent), {**told, field: value}))


def test_an_acceptance_run_is_read_without_a_difference(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Every frame of what the suite records; CI does the same with a complete run."""
    tests = "hil_tests.acceptance.test_start_and_nmt"
    run = judge_apart(tmp_path, "", "--pyargs", tests, "--can-clause=NMT-0")
    assert run.status == 0, run.text
    assert main([str(run.folder)]) == 0
    assert " 0 differences" in capsys.readouterr().out


def test_no_run_is_wrong_use(tmp_path: Path) -> None:
    """Nothing compared is no agreement."""
    assert main([str(tmp_path)]) == 2
    (tmp_path / "traces").mkdir()
    recorded(tmp_path / "traces" / "a.pcapng", "")
    assert main([str(tmp_path)]) == 1
