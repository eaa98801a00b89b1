"""Frames in words: each service once, each oddity told, nothing ever refused."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hil_tests.clock import MS, S
from hil_tests.decode import decode, show_frames
from hil_tests.trace import Sighting, Trace
from node_model.frame import MAX_BASE_ID, Frame


def frame(text: str) -> Frame:
    """A frame from candump's notation, e.g. 705#05 or 705#R1."""
    ident, _, rest = text.partition("#")
    extended = len(ident) > 3
    if rest.startswith("R"):
        return Frame(int(ident, 16), remote=True, extended=extended, dlc=int(rest[1:]))
    return Frame(int(ident, 16), bytes.fromhex(rest), extended=extended)


SERVICES = {
    "000#0105": "NMT start -> node 5",
    "000#0205": "NMT stop -> node 5",
    "000#8005": "NMT enter pre-operational -> node 5",
    "000#8100": "NMT reset node -> all",
    "000#8207": "NMT reset communication -> node 7",
    "000#3305": "NMT unknown command 33h -> node 5",
    "000#01": "NMT command of 1 byte instead of 2: 01",
    "000#010500": "NMT start -> node 5 (3 bytes instead of 2)",
    "000#R2": "unknown (remote): 2 bytes asked for",
    "080#": "SYNC",
    "080#07": "SYNC, counter 7",
    "080#0000": "SYNC (2 bytes instead of 0)",
    "100#E80300000A00": "TIME: 1000 ms after midnight, day 10 since 1984-01-01",
    "100#00": "TIME (1 byte instead of 6): 00",
    "085#0050010000000000": "EMCY of node 5: 5000h hardware, register 01h",
    "085#3081110102030405": (
        "EMCY of node 5: 8130h life guard or heartbeat error, register 11h, 01 02 03 04 05"
    ),
    "085#0000000000000000": "EMCY of node 5: 0000h no error, register 00h",
    "085#0123000000000000": "EMCY of node 5: 2301h current, output side, register 00h",
    "085#0001000000000000": "EMCY of node 5: 0100h unknown code, register 00h",
    "085#005001": "EMCY of node 5: 5000h hardware, register 01h (3 bytes instead of 8)",
    "085#00": "EMCY of node 5 (1 byte instead of 8): 00",
    "705#00": "boot-up of node 5",
    "705#05": "heartbeat of node 5: operational",
    "705#04": "heartbeat of node 5: stopped",
    "705#7F": "heartbeat of node 5: pre-operational",
    "705#2A": "heartbeat of node 5: unknown state 2Ah",
    "705#80": "guarding answer of node 5: initialising, toggle 1",
    "705#85": "guarding answer of node 5: operational, toggle 1",
    "705#0500": "error control of node 5 (2 bytes instead of 1): 05 00",
    "705#R1": "remote request to node 5 for error control (guarding)",
    "185#R1": "remote request to node 5 for TPDO1",
    "1C5#01": "TPDO1 of node 69: 01",
    "285#0102": "TPDO2 of node 5: 01 02",
    "305#": "LED blink map to node 5: no data",
    "505#FF": "RPDO4 to node 5: FF",
    "00000705#05": "extended identifier: 05",
    "00000705#R1": "extended identifier (remote): 1 byte asked for",
    "700#05": "unknown: 05",
    "664#": "SDO request to node 100: no data (0 bytes instead of 8)",
    "7FF#": "unknown: no data",
}


@pytest.mark.parametrize(("sent", "said"), SERVICES.items(), ids=list(SERVICES))
def test_each_service_has_its_words(sent: str, said: str) -> None:
    """Services of CiA 301, and what is odd about a frame."""
    assert decode(frame(sent), 5) == said


KEYPAD = {
    "185#03": "key frame of node 5: 00000011",
    "185#0180": "key frame of node 5: 00000001 10000000",
    "205#01": "LED steady map to node 5: 00000001",
    "305#80": "LED blink map to node 5: 10000000",
    "4F8#050300640001": (
        "commissioning 4F8h: node id 5, 125 kbit/s (code 3), heartbeat 100 ms, sync 0 ms, "
        "debounce 100 ms"
    ),
    "3F8#0507FFFF02FF0000": (
        "echo 3F8h: node id 5, 250 kbit/s (code 7), heartbeat 65535 ms, sync 20 ms, "
        "debounce 25500 ms, then 00 00"
    ),
    "4F8#0503": "commissioning 4F8h (2 bytes, at least 6 are needed): 05 03",
}


@pytest.mark.parametrize(("sent", "said"), KEYPAD.items(), ids=list(KEYPAD))
def test_a_keypad_gives_its_own_meaning_to_some_identifiers(sent: str, said: str) -> None:
    """Keys, LED maps, commissioning, as its source has them."""
    assert decode(frame(sent), 5) == said
    assert decode(frame(sent), None) == said


def test_for_other_devices_the_same_identifiers_are_pdos() -> None:
    """Another kind of device, or another node than the one under test."""
    assert decode(frame("185#03"), 5, "drive") == "TPDO1 of node 5: 03"
    assert decode(frame("3F8#050300640001"), 5, "drive") == "TPDO3 of node 120: 05 03 00 64 00 01"
    assert decode(frame("186#03"), 5) == "TPDO1 of node 6: 03"
    assert decode(frame("190#03"), None) == "TPDO1 of node 16: 03"


TRANSFERS = {
    "605#4000100000000000": "SDO request to node 5: read 1000h:00",
    "585#4300100092010200": "SDO answer of node 5: value of 1000h:00 = 92 01 02 00 (131474)",
    "605#2B171000E8030000": "SDO request to node 5: write 1017h:00 = E8 03 (1000)",
    "605#2217100001000000": "SDO request to node 5: write 1017h:00 = 01 00 00 00 (1)",
    "605#2117100010000000": "SDO request to node 5: write 1017h:00 in segments, 16 bytes",
    "585#6017100000000000": "SDO answer of node 5: written 1017h:00",
    "585#8000200000000206": "SDO answer of node 5: abort of 2000h:00: 06020000h no such object",
    "605#8000200078563412": "SDO request to node 5: abort of 2000h:00: 12345678h unknown code",
    "605#6000000000000000": "SDO request to node 5: next segment, toggle 0",
    "605#7000000000000000": "SDO request to node 5: next segment, toggle 1",
    "585#0041424344454647": ("SDO answer of node 5: segment, toggle 0: 41 42 43 44 45 46 47"),
    "585#1B41420000000000": "SDO answer of node 5: segment, toggle 1, last: 41 42",
    "605#0041424344454647": ("SDO request to node 5: segment, toggle 0: 41 42 43 44 45 46 47"),
    "585#3000000000000000": "SDO answer of node 5: segment written, toggle 1",
    "605#A408100020000000": (
        "SDO request to node 5: block read 1008h:00, 32 segments a block, with CRC"
    ),
    "605#A300000000000000": "SDO request to node 5: block read, start",
    "605#A2057F0000000000": (
        "SDO request to node 5: block read, received up to segment 5, 127 segments a block"
    ),
    "605#A100000000000000": "SDO request to node 5: block read, end",
    "585#C61F100110000000": "SDO answer of node 5: block read 101Fh:01, 16 bytes, with CRC",
    "585#C934120000000000": "SDO answer of node 5: block read, end, CRC 1234h, 2 bytes unused",
    "605#C01F100110000000": "SDO request to node 5: block write 101Fh:01",
    "585#A01F10017F000000": ("SDO answer of node 5: block write 101Fh:01, 127 segments a block"),
    "585#A2027F0000000000": (
        "SDO answer of node 5: block write, received up to segment 2, 127 segments a block"
    ),
    "605#C534120000000000": "SDO request to node 5: block write, end, CRC 1234h, 1 byte unused",
    "585#A100000000000000": "SDO answer of node 5: block write, end",
    "585#A300000000000000": "SDO answer of node 5: unknown command A3h: 00 00 00 00 00 00 00",
    "585#C61F1001": ("SDO answer of node 5: block read 101Fh:01, with CRC (4 bytes instead of 8)"),
    "605#E000000000000000": "SDO request to node 5: unknown command E0h: 00 00 00 00 00 00 00",
    "605#400010": "SDO request to node 5: 40 00 10 (3 bytes instead of 8)",
    "605#40001000": "SDO request to node 5: read 1000h:00 (4 bytes instead of 8)",
    "605#2B171000E803": (
        "SDO request to node 5: write 1017h:00 = E8 03 (1000) (6 bytes instead of 8)"
    ),
    "605#2B171000": "SDO request to node 5: write 1017h:00 without a value (4 bytes instead of 8)",
    "7E5#0401000000000000": "LSS request: switch mode global, configuration",
    "7E5#1105000000000000": "LSS request: configure node id 5",
    "7E5#1300040000000000": "LSS request: configure bit timing, table 0 index 4 (125 kbit/s)",
    "7E5#5A00000000000000": "LSS request: inquire vendor",
    "7E4#1100000000000000": "LSS answer: configure node id, done",
    "7E4#1101000000000000": "LSS answer: configure node id, error 1",
    "7E4#5A78563412000000": "LSS answer: inquire vendor 12345678h",
    "7E4#5A7856": "LSS answer: inquire vendor (78 56) (3 bytes instead of 8)",
    "7E4#5E05000000000000": "LSS answer: inquire node id 5",
    "7E5#4378563412000000": "LSS request: switch mode selective: serial number 12345678h",
    "7E5#4878563412000000": "LSS request: identify remote device: revision low 12345678h",
    "7E4#4F00000000000000": "LSS answer: identified",
    "7E5#15E8030000000000": "LSS request: activate bit timing after 1000 ms",
    "7E5#5178563412080203": "LSS request: fastscan 12345678h, bit 8, part 2, next part 3",
    "7E5#5178563412": "LSS request: fastscan (78 56 34 12) (5 bytes instead of 8)",
    "7E5#99": "LSS request: unknown service 99h (1 byte instead of 8)",
    "7E5#": "LSS request without data (0 bytes instead of 8)",
}


@pytest.mark.parametrize(("sent", "said"), TRANSFERS.items(), ids=list(TRANSFERS))
def test_sdo_and_lss_are_read_frame_by_frame(sent: str, said: str) -> None:
    """Multiplexer, value, abort reason; settings of LSS."""
    assert decode(frame(sent), 5) == said


@given(can_id=st.integers(0, MAX_BASE_ID), data=st.binary(max_size=8), kind=st.text(max_size=2))
@settings(max_examples=80)
def test_any_frame_gives_one_line(can_id: int, data: bytes, kind: str) -> None:
    """Whatever is on the bus, a failure message can show it."""
    for node_id in (None, 5):
        for kinds in ("keypad", kind):
            said = decode(Frame(can_id, data), node_id, kinds)
            assert said.isprintable()
            assert said


@given(can_id=st.integers(0, MAX_BASE_ID), dlc=st.integers(0, 15))
@settings(max_examples=50)
def test_any_remote_frame_says_that_it_is_remote(can_id: int, dlc: int) -> None:
    """It never passes for a data frame."""
    assert "remote" in decode(Frame(can_id, remote=True, dlc=dlc), 5)


def trace_of(*frames: tuple[int, str, bool]) -> Trace:
    """A trace of these frames."""
    trace = Trace()
    for at, text, own in frames:
        trace.see(Sighting(frame(text), at, own=own))
    return trace


def test_frames_stand_in_columns() -> None:
    """Time since the origin, direction, raw frame, words."""
    trace = trace_of(
        (1 * S - 250 * MS, "705#7F", False),
        (1 * S + 123_449_999, "000#0105", True),
        (12 * S, "085#0050010000000000", False),
    )
    assert show_frames(trace, 0, 99, 5, 1 * S) == [
        " -0.2500 s  <- 705#7F                heartbeat of node 5: pre-operational",
        " +0.1234 s  -> 000#0105              NMT start -> node 5",
        "+11.0000 s  <- 085#0050010000000000  EMCY of node 5: 5000h hardware, register 01h",
    ]


def test_a_long_stretch_is_cut_in_the_middle() -> None:
    """The first and the last ones stay; how many are missing is said."""
    trace = trace_of(*((i * MS, "705#05", False) for i in range(352)))
    lines = show_frames(trace, 0, 352, 5, 0)
    assert len(lines) == 41
    assert lines[20] == "... 312 frames left out"
    assert lines[19].startswith("+0.0190 s")
    assert lines[21].startswith("+0.3320 s")


@pytest.mark.parametrize("most", [0, 1, 2, 3])
def test_any_limit_is_kept(most: int) -> None:
    """With an odd limit the end gets one more."""
    trace = trace_of(*((i * MS, "705#05", False) for i in range(4)))
    lines = show_frames(trace, 0, 4, 5, 0, most=most)
    assert len(lines) == most + 1
    assert f"... {4 - most} frame{'s' * (most < 3)} left out" in lines


def test_no_frames_are_no_lines() -> None:
    """An empty stretch, or one past the end."""
    assert show_frames(Trace(), 0, 10, None, 0) == []
    assert show_frames(trace_of((0, "705#05", False)), 1, 0, None, 0) == []
