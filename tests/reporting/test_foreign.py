"""Recordings of other programs: read as they are, and refused with file, place and remedy."""

from __future__ import annotations

import random
import struct
import zlib
from pathlib import Path

import pytest

from hil_tests.reporting.export import FORMS, export
from hil_tests.reporting.files import RecordUnreadable
from hil_tests.reporting.foreign import is_pcapng, read_foreign
from hil_tests.reporting.pcapng import PcapngSink
from hil_tests.trace import BusEvent, EventKind, Sighting
from node_model.frame import Frame

S = 1_000_000_000
EIGHT = bytes.fromhex("1122334455667788")


def log(folder: Path, *lines: str) -> Path:
    """A candump log with these lines."""
    path = folder / "a.log"
    path.write_text("\n".join(lines) + "\n", "ascii")
    return path


@pytest.mark.parametrize(
    ("line", "frame", "own"),
    [
        ("(1.000001) can0 70A#00", Frame(0x70A, b"\0"), False),
        ("(1.000001) can0 70A#00 R", Frame(0x70A, b"\0"), False),
        ("(1.000001) can0 000#0105 T", Frame(0, b"\1\5"), True),
        ("(1.000001) can0 705#R", Frame(0x705, remote=True), False),
        ("(1.000001) can0 705#R8", Frame(0x705, remote=True, dlc=8), False),
        ("(1.000001) can0 1FFFFFFF#", Frame(0x1FFFFFFF, extended=True), False),
        ("(1.000001) can0 123#1122334455667788_B", Frame(0x123, EIGHT, dlc=11), False),
        (" (1.000001)  can0  70A   [2]  00 7F", Frame(0x70A, b"\0\x7f"), False),
        (" (1.000001)  can0  TX - -  70A   [1]  00", Frame(0x70A, b"\0"), True),
        (" (1.000001)  can0  705   [3]  remote request", Frame(0x705, remote=True, dlc=3), False),
    ],
)  # fmt: skip
def test_a_line_of_candump_is_a_frame(line: str, frame: Frame, own: bool, tmp_path: Path) -> None:
    """The log form and the one that is shown, with direction, remote frames and long lengths."""
    path = log(tmp_path, "# a comment", "", line)
    assert list(read_foreign(path)) == [Sighting(frame, S + 1000, 0, own)]


def test_error_frames_and_can_fd_are_events(tmp_path: Path) -> None:
    """They are no frames of CANopen, and not lost either."""
    path = log(
        tmp_path,
        "(1.0) can0 20000004#0004000000000000",
        "(2.0) can0 705##1001122",
        "(3.0)  can0  705   [12]  00 11 22 33 44 55 66 77 88 99 AA BB",
    )
    kinds = [entry.kind for entry in read_foreign(path) if isinstance(entry, BusEvent)]
    assert kinds == [EventKind.ERROR, EventKind.FD_FRAME, EventKind.FD_FRAME]


@pytest.mark.parametrize(
    ("lines", "said"),
    [
        (["(1.0) can0 705#05", "nonsense"], "line 2: 'nonsense' is no frame with a stamp"),
        (["(1.0) can0 705#0"], "line 1"),
        (["(1.0) can0 FFF#00"], "line 1: .*record with candump -L"),
        (["(1.0) can0 705#R9"], "line 1"),
        ([" can0  70A   [1]  00"], "line 1: .*no frame with a stamp"),
        (["(1.0) can0  70A   [8]  00"], r"line 1: \[8\] and 1 bytes"),
        (["(1.0) can0  70A   [99]  00"], r"line 1: \[99\] and 1 bytes"),
        (["x" * 5000], "line 1: 'xxx"),
        (["(2.0) can0 705#05", "(1.9) can0 705#05"], "line 2: the stamp is 100 ms earlier"),
        (["(1.0) can0 705#05", "(1.0) can1 705#05"], "line 2: .*'can1'.*--channel"),
        ([""], "no CAN frame in it"),
    ],
)
def test_what_is_wrong_is_told_with_its_line(lines: list[str], said: str, tmp_path: Path) -> None:
    """And what to do about it."""
    with pytest.raises(RecordUnreadable, match=said):
        list(read_foreign(log(tmp_path, *lines)))


def test_one_channel_of_several_can_be_chosen(tmp_path: Path) -> None:
    """The others are passed over; one that is not there is told."""
    path = log(tmp_path, "(1.0) can0 705#05", "(1.0) can1 706#05", "(2.0) can0 705#7F")
    assert len(list(read_foreign(path, "can0"))) == 2
    with pytest.raises(RecordUnreadable, match="no CAN frame of channel 'can7'"):
        list(read_foreign(path, "can7"))


def test_frames_may_be_swapped_by_a_little(tmp_path: Path) -> None:
    """Two ways through an adapter; 10 ms back is nothing, a ns more is told."""
    assert list(read_foreign(log(tmp_path, "(1.010) can0 705#05", "(1.000) can0 705#05")))
    with pytest.raises(RecordUnreadable, match="earlier"):
        list(read_foreign(log(tmp_path, "(1.010000001) can0 705#05", "(1.000) can0 705#05")))


NOW = 1_700_000_000 * S
SAMPLE: list[Sighting | BusEvent] = [
    Sighting(Frame(0x000, b"\x01\x05"), NOW, 0, True),
    Sighting(Frame(0x705, b"\x05"), NOW + 400_000),
    Sighting(Frame(0x1ABCDEF0, b"\1\2\3", extended=True), NOW + 1 * S),
    Sighting(Frame(0x705, remote=True, dlc=1), NOW + 2 * S),
    BusEvent(EventKind.ERROR, NOW + 3 * S),
    Sighting(Frame(0x18A, bytes(8)), NOW + 4 * S),
]


@pytest.mark.parametrize("form", FORMS)
def test_what_is_exported_can_be_read_back(form: str, tmp_path: Path) -> None:
    """Frames, owners and spans survive; what does not is what the form says that it loses."""
    source, target = tmp_path / "a.pcapng", tmp_path / f"there/b.{form}"
    with PcapngSink(source, interface="can0", clock="c", flush=False) as sink:
        for entry in SAMPLE:
            sink.write(entry)
    export(source, form, target)
    found = list(read_foreign(target))
    starts_at = 0 if form != "asc" else SAMPLE[0].at  # its stamps count from the first frame
    assert [entry.at for entry in found] == [entry.at - starts_at for entry in SAMPLE]
    frames = [entry for entry in found if isinstance(entry, Sighting)]
    assert [each.own for each in frames] == [True, False, False, False, False]
    kept = [each.frame for each in SAMPLE if isinstance(each, Sighting)]
    if form == "log":
        kept[3] = Frame(0x705, remote=True)  # "lengths of remote frames"
    assert [each.frame for each in frames] == kept
    assert is_pcapng(target) == (form == "pcapng")


@pytest.mark.slow
@pytest.mark.parametrize("form", FORMS)
def test_a_damaged_file_is_told_and_nothing_else(form: str, tmp_path: Path) -> None:
    """Cut anywhere, or with bytes turned: frames, or an error that names the file."""
    source, target = tmp_path / "a.pcapng", tmp_path / f"b.{form}"
    with PcapngSink(source, interface="can0", clock="c", flush=False) as sink:
        for number in range(300):
            sink.write(Sighting(Frame(0x705, b"\x05"), number * S))
    export(source, form, target)
    whole, chance = target.read_bytes(), random.Random(7)
    for _ in range(150):
        cut = bytearray(whole[: chance.randrange(len(whole))])
        for _ in range(chance.randrange(8) if cut else 0):
            cut[chance.randrange(len(cut))] = chance.randrange(256)
        target.write_bytes(bytes(cut))
        try:
            list(read_foreign(target))
        except RecordUnreadable as error:
            assert str(target) in str(error)


@pytest.mark.parametrize("begin", [b"", b"\x0a\x0d\x0d\x0a", b"LOGG", b"date "])
def test_random_bytes_are_no_recording(begin: bytes, tmp_path: Path) -> None:
    """However they begin."""
    path = tmp_path / "x"
    path.write_bytes(begin + random.Random(3).randbytes(3000))
    with pytest.raises(RecordUnreadable, match=str(path)):
        list(read_foreign(path))


def test_a_container_that_would_fill_the_memory_is_refused(tmp_path: Path) -> None:
    """Before it is unpacked whole."""
    packed = zlib.compress(bytes(1 << 25))
    container = struct.pack("<4sHHLLHxxxxxxLxxxx", b"LOBJ", 16, 1, 32 + len(packed), 10, 2, 100)
    path = tmp_path / "bomb.blf"
    path.write_bytes(b"LOGG" + (144).to_bytes(4, "little") + bytes(136) + container + packed)
    with pytest.raises(RecordUnreadable, match="offset 144: a container too large"):
        list(read_foreign(path))
    path.write_bytes(b"LOGG" + (144).to_bytes(4, "little") + bytes(136) + b"LOBJ" + b"\xff" * 12)
    with pytest.raises(RecordUnreadable, match="offset 144: no BLF object"):
        list(read_foreign(path))


def test_a_file_that_is_not_there_is_told(tmp_path: Path) -> None:
    """With its name."""
    with pytest.raises(RecordUnreadable, match="No such file"):
        list(read_foreign(tmp_path / "none.log"))
