"""An independent reader of our recordings: Wireshark's tshark."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

from hil_tests.reporting.pcapng import PcapngSink
from hil_tests.trace import BusEvent, EventKind, Mark, Moment, Sighting
from node_model.frame import Frame

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not shutil.which("tshark"), reason="tshark is not installed"),
]


@pytest.fixture(name="recording", scope="module")
def _recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("tshark") / "t.pcapng"
    with PcapngSink(path, interface="vcan7", clock="virtual time", flush=False) as sink:
        sink.write(Sighting(Frame(0x705, b"\x00"), 5))
        sink.write(Moment("power", 1_000, 2_000, {"on": False}))
        sink.write(Sighting(Frame(0x000, b"\x01\x05"), 1_000_000_007, 20_000, own=True))
        sink.write(BusEvent(EventKind.GAP, 1_500_000_000, "ring is full", lost=7))
        for step in range(20):
            sink.write(Sighting(Frame(0x085, bytes(8)), 2_000_000_000 + step, step + 1))
        sink.write(Mark(3_000_000_000, "HB-01 failed", {"measured_ns": [99, 101]}))
        sink.write(Sighting(Frame(0x705, remote=True, dlc=1), 4_000_000_000, own=True))
    return path


def ask(path: Path, *arguments: str) -> str:
    """What tshark says."""
    command = ["tshark", "-r", str(path), "-d", "can.subdissector,canopen", *arguments]
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    return done.stdout


def fields(path: Path, *names: str) -> list[list[str]]:
    """These fields of each packet."""
    wanted = [word for name in names for word in ("-e", name)]
    return [line.split("\t") for line in ask(path, "-T", "fields", *wanted).splitlines()]


def test_frames_are_dissected_as_canopen(recording: Path) -> None:
    """Boot-up, NMT command and EMCY are recognised; nothing is malformed."""
    shown = ask(recording, "-V")
    assert "State: Boot-up (0x00)" in shown
    assert "Command specifier: Start remote node (0x01)" in shown
    assert "Remote Transmission Request Flag: True" in shown
    assert "Malformed" not in shown


def test_stamps_direction_and_interface_are_seen(recording: Path) -> None:
    """To the nanosecond; own frames are outbound, the others inbound."""
    rows = fields(recording, "frame.time_epoch", "frame.packet_flags_direction")
    assert [rows[0][0], rows[2][0]] == ["0.000000005", "1.000000007"]
    assert [int(rows[0][1], 0), int(rows[2][1], 0)] == [1, 2]
    names = fields(recording, "frame.interface_name", "frame.interface_description")
    assert names[0] == ["vcan7", "virtual time"]
    assert names[2] == ["vcan7", "virtual time; stamp late by at most 20000 ns"]


def test_stimuli_events_and_marks_stand_among_the_frames(recording: Path) -> None:
    """Each has a line of text for people, in its place."""
    rows = fields(recording, "frame.comment", "_ws.col.Protocol")
    assert rows[1] == ['power {"on":false}, took effect within 1 us', "nodeproof/JSON"]
    assert rows[3][0] == "frames lost: ring is full (7 frames lost)"
    assert rows[24][0] == "HB-01 failed"


def test_the_json_of_a_note_unfolds(recording: Path) -> None:
    """tshark reads it as JSON, member by member."""
    rows = fields(recording, "frame.comment", "json.member_with_value")
    (row,) = (row for row in rows if row[0] == "HB-01 failed")
    assert "text:HB-01 failed" in row[1]


def test_rare_doubts_are_comments(recording: Path) -> None:
    """Past sixteen interfaces the doubt stands beside the frame."""
    rows = fields(recording, "frame.comment")
    assert rows[23] == ["stamp late by at most 20 ns"]
