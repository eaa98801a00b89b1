"""The device is asked who it is before the first test; what it says goes with the run."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import pytest

from hil_tests import cli
from hil_tests.bench.identity import _MOST_ANSWERS, _Short, printable
from hil_tests.clients.sdo import Breach
from hil_tests.replay.record import load_record
from hil_tests.reporting.check import check_run
from hil_tests.run.identity import _numbers_in
from hil_tests.trace import Moment, Sighting
from tests.host.test_process import free_channel
from tests.run.harness import Judged, judge, judge_apart
from tests.run.test_identity import validated

pytest_plugins = ["pytester"]

STARTS = """
@pytest.mark.requirement("C-NMT-01")
def test_starts(bench):
    '''It starts.'''
    bench.start()
"""
DRIVE = "--can-profile=drive"
SERIAL = 0xC0FFEE


def device_of(run: Judged) -> dict[str, Any]:
    """What the results say of the device; they are valid."""
    return dict(validated(run)["device"])


def test_the_device_says_who_it_is(pytester: pytest.Pytester) -> None:
    """Numbers of 1018h, name and versions; serial number and firmware of the run are its own."""
    run = judge(pytester, STARTS, DRIVE)
    device, facts = device_of(run), device_of(run)["identity"]
    assert (facts["from"], facts["not_read"], facts["differs"]) == ("device", "", [])
    assert (facts["serial"], facts["name"]) == (SERIAL, "nodeproof drive")
    assert (device["serial"], device["serial_from"]) == (str(SERIAL), "1018h:04")
    assert (device["firmware"], device["firmware_from"]) == ("1.0", "100Ah")
    assert f"serial {SERIAL} (1018h:04)" in run.text
    assert run.outcomes == {"test_starts": "passed"}


def test_what_was_asked_is_recorded_and_counts_for_nothing(pytester: pytest.Pytester) -> None:
    """A recording of its own: reads alone; frames and checks of the run are those of its tests."""
    run = judge(pytester, STARTS, DRIVE)
    record = load_record(run.folder / device_of(run)["identity"]["trace"])
    own = [each.frame for each in record.entries if isinstance(each, Sighting) and each.own]
    assert {frame.can_id for frame in own} == {0x605}
    assert {frame.data[0] & 0xE0 for frame in own} == {0x40, 0x60}, "uploads, begun and gone on"
    whats = [each.what for each in record.entries if isinstance(each, Moment)]
    assert whats == ["renew", "power"]
    (row,) = run.results["results"]
    assert run.results["summary"]["frames"] == row["frames"] == row["trace_frames"]
    assert len(run.traces()) == 2
    report = (run.folder / "report.html").read_text("utf-8")
    assert "The run ended before this test did" not in report


@pytest.mark.parametrize(
    ("said", "differs"), [(str(SERIAL), False), ("0xC0FFEE", False), ("7", True), ("A-7", False)]
)
def test_a_label_that_is_another_number_is_told(
    pytester: pytest.Pytester, said: str, differs: bool
) -> None:
    """What people say goes with the run; a name cannot be held against a number."""
    run = judge(pytester, STARTS, DRIVE, f"--can-serial={said}", "--can-firmware=1.0")
    device = device_of(run)
    assert (device["serial"], device["serial_from"]) == (said, "command line")
    assert device["firmware_from"] == "command line"
    told = f"the device says {SERIAL} (00C0FFEEh in 1018h:04), and the command line 7"
    assert [told in text for text in device["identity"]["differs"]] == [True] * differs
    assert ("IDENTITY: serial number: " in run.text) is differs
    assert run.status == 0


def test_a_label_is_a_number_or_a_name() -> None:
    """Decimal digits may be meant as hexadecimal ones."""
    assert _numbers_in("10") == {10, 16}
    assert _numbers_in("0x1F") == _numbers_in("1fh") == _numbers_in("0000001F") - {1} == {31}
    assert _numbers_in("A-7") == _numbers_in("feed") == _numbers_in("") == set()


def test_what_goes_wrong_half_way_is_said(pytester: pytest.Pytester) -> None:
    """Numbers were read, texts in segments were not: both are said, and the tests run on."""
    run = judge(pytester, STARTS, DRIVE, "--can-mutant=sdo-segments-tell-wrong-size")
    device = device_of(run)
    facts = device["identity"]
    assert (facts["from"], device["serial"], device["firmware"]) == ("device", str(SERIAL), None)
    assert "1008h:00" in facts["not_read"]
    assert f"not read from the device: {facts['not_read']}" in run.text
    assert run.outcomes == {"test_starts": "passed"}


SILENT = """
from hil_tests.bench.identity import ask

@pytest.mark.requirement("C-NMT-01")
def test_asks(bench, power):
    bench.fresh()
    told = ask(bench, switch=False)
    assert told.numbers == told.texts == {}
    assert "nobody acknowledges" in told.not_read
    bench.power.on()
    assert ask(bench, switch=False).numbers["serial"] == 0xC0FFEE
"""


def test_a_device_that_is_off_does_not_say(pytester: pytest.Pytester) -> None:
    """Why it was not read is said; nothing raises, and a supply is left alone where it must be."""
    assert judge(pytester, SILENT, DRIVE).outcomes == {"test_asks": "passed"}


def test_another_device_than_its_eds_is_told(pytester: pytest.Pytester) -> None:
    """A vendor that its data sheet does not name."""
    run = judge(pytester, STARTS, DRIVE, "--can-mutant=identity-without-vendor")
    (text,) = device_of(run)["identity"]["differs"]
    assert text == "vendor: the device says 00000000h, and its EDS 00007E57h"


def test_a_keypad_is_not_asked(pytester: pytest.Pytester) -> None:
    """Its profile names no EDS: nobody says that it has objects to read."""
    run = judge(pytester, STARTS.replace("C-NMT-01", "NMT-02"))
    device = device_of(run)
    assert (device["identity"], device["serial"], device["serial_from"]) == ({}, None, None)
    assert "identity:" not in run.text


def test_a_bench_file_can_name_the_device(pytester: pytest.Pytester) -> None:
    """After the command line, before the device."""
    path = pytester.path / "desk.toml"
    path.write_text('[bus]\nchannel = "nobody"\n[device]\nserial = "B-2"\nfirmware = "2"\n')
    run = judge(pytester, STARTS, DRIVE, f"--can-bench={path}", "--can-firmware=3")
    device = device_of(run)
    assert (device["serial"], device["serial_from"]) == ("B-2", "bench file")
    assert (device["firmware"], device["firmware_from"]) == ("3", "command line")
    assert device["identity"]["not_read"] == "there is no bench to ask it on"


def test_a_replay_asks_the_recording(pytester: pytest.Pytester) -> None:
    """It says the same; without that recording it says why it does not know."""
    run = judge(pytester, STARTS, DRIVE)
    recorded = pytester.path / "recorded"
    shutil.copytree(run.folder.resolve(), recorded)
    before = device_of(run)
    again = device_of(judge(pytester, STARTS, f"--can-replay={recorded}"))
    assert {**again, "why": before["why"]} == before
    traces = sorted((recorded / "traces").iterdir())
    told = judge(pytester, STARTS, *(f"--can-replay={trace}" for trace in traces))
    assert device_of(told)["identity"]["serial"] == SERIAL
    assert "every verdict is the recorded one" in told.section("replay")
    (recorded / before["identity"]["trace"]).unlink()
    assert any("is not there" in text for text in check_run(recorded))
    without = device_of(judge(pytester, STARTS, f"--can-replay={recorded}"))
    assert without["identity"]["not_read"] == "the recorded run did not ask it"


def test_workers_record_it_once(tmp_path: Path) -> None:
    """Each asks its own device; they are the same, and one recording stands for all."""
    run = judge_apart(tmp_path, STARTS + STARTS.replace("starts", "boots"), DRIVE, "-n", "2")
    assert device_of(run)["identity"]["serial"] == SERIAL
    assert len(run.traces()) == 3


def test_the_history_knows_it_by_its_own_number(
    pytester: pytest.Pytester, capsys: pytest.CaptureFixture[str]
) -> None:
    """Nobody need say it."""
    run = judge(pytester, STARTS, DRIVE)
    capsys.readouterr()
    told = pytester.path / "told.json"
    words = ["history", str(SERIAL), "--reports", str(run.reports), "--json", str(told)]
    assert cli.main(words) == 0
    assert str(SERIAL) in json.dumps(json.loads(told.read_text("utf-8")))


@pytest.mark.slow
def test_a_hosted_device_is_asked(tmp_path: Path) -> None:
    """In real time, over a bus; the replay hears the same."""
    options = ["--can-interface=udp_multicast", f"--can-iface={free_channel()}", DRIVE]
    run = judge_apart(tmp_path, STARTS, *options)
    assert device_of(run)["identity"]["serial"] == SERIAL, run.text
    recorded = tmp_path / "recorded"
    shutil.copytree(run.folder.resolve(), recorded)
    again = judge_apart(tmp_path, STARTS, f"--can-replay={recorded}")
    assert device_of(again)["identity"]["serial"] == SERIAL
    assert "every verdict is the recorded one" in again.section("replay")


def test_a_text_of_a_device_moves_no_cursor() -> None:
    """Escape sequences and bytes that are no text are shown as such."""
    assert printable(b"Drive \x1b[2J\xff\0\0") == "Drive \N{REPLACEMENT CHARACTER}[2J\ufffd"


def test_a_text_without_end_is_given_up() -> None:
    """A server that always has one more segment does not hold a run."""
    transfer = _Short(0x1008, 0)
    transfer.begin()
    transfer.answer(bytes.fromhex("4108100000000100"))
    for turn in range(_MOST_ANSWERS - 1):
        assert transfer.answer(bytes([turn % 2 << 4, *b"abcdefg"]))
    with pytest.raises(Breach, match="1008h:00 has no end"):
        transfer.answer(bytes([0x10, *b"abcdefg"]))
