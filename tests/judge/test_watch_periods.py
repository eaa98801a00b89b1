"""The watch and 1017h: a heartbeat period that the tester writes, and what a reset makes of it."""

from __future__ import annotations

from hil_tests.clock import MS
from hil_tests.judge.cobs import Nmt
from hil_tests.trace import Sighting
from node_model.frame import Frame
from tests.judge.cia301_scene import running, write
from tests.judge.scene import Scene

HEARTBEAT_50 = "2B17100032000000"
HEARTBEAT_OFF = "2B17100000000000"


def test_a_new_heartbeat_period_counts_from_the_answer_on() -> None:
    """From 100 ms to 50: beats at the old period are blamed, those at the new one are not."""
    for step, blamed in ((50, []), (100, ["C-HB-04"])):
        scene = running(100)
        scene.beats([149, 249], state=0x05)
        write(scene, HEARTBEAT_50, 260)
        scene.beats([300, 300 + step, 300 + 2 * step], state=0x05)
        assert scene.blamed(320 + 2 * step)[:1] == blamed


def test_a_beat_at_once_after_a_new_period_is_free() -> None:
    """Some devices send one with the write; the next is a period later."""
    scene = running(100)
    scene.beats([149, 249], state=0x05)
    write(scene, HEARTBEAT_50, 260)
    scene.beats([261, 311, 361], state=0x05)
    assert scene.blamed(400) == []


def test_a_heartbeat_that_was_switched_off_stays_away() -> None:
    """One that was on its way is not blamed, a later one is."""
    scene = running(100)
    scene.beats([149], state=0x05)
    scene.see(Frame(0x605, bytes.fromhex(HEARTBEAT_OFF)), 240, own=True)
    scene.beats([249], state=0x05)
    scene.see(Frame(0x585, bytes.fromhex("6017100000000000")), 250)
    assert scene.blamed(1000) == []
    scene.beats([1100], state=0x05)
    assert scene.blamed(1200) == ["C-HB-06"]


def test_a_period_that_the_record_does_not_show_is_not_judged() -> None:
    """A segmented download: whatever comes then is right."""
    scene = running(100)
    scene.beats([149], state=0x05)
    write(scene, "2117100002000000", 200)
    scene.beats([210, 217, 900], state=0x05)
    assert scene.blamed(2000) == []


def test_a_reset_brings_the_old_period_back() -> None:
    """Reset node and power for certain; after reset communication nobody can say."""
    for command, late in ((Nmt.RESET_NODE, ["C-HB-04"]), (Nmt.RESET_COMMUNICATION, [])):
        scene = running(100)
        write(scene, HEARTBEAT_50, 100)
        scene.command(command, 120)
        scene.boot(200)
        scene.beats([250, 300])
        assert scene.blamed(310)[:1] == late
    scene = running(100)
    write(scene, HEARTBEAT_50, 100)
    scene.power(120, on=False)
    scene.started(400)
    scene.beats([550, 650])
    assert scene.blamed(700) == []


def test_who_watches_anew_knows_what_was_set() -> None:
    """Period and identifiers go over to the next watch of the same device."""
    scene = running(100)
    write(scene, HEARTBEAT_50, 100)
    write(scene, "23001801C0010000", 110)
    later = running(100)
    later.watch.goes_on_from(scene.watch)
    later.see(Frame(0x1C0, bytes(2)), 160)
    later.beats([170, 220, 270], state=0x05)
    assert later.blamed(300) == []
    same = running(100)
    same.watch.goes_on_from(running(100).watch)
    same.beats([170, 220, 270], state=0x05)
    assert same.blamed(300)[:1] == ["C-HB-13"]


REQUEST = bytes.fromhex("2B17100064000000")
"""1017h = 100 ms."""
BEAT = Frame(0x705, b"\x05")


def between(scene: Scene, answer: str) -> Scene:
    """1017h is written, a beat comes, then the answer, then beats 100 ms apart."""
    scene.see(Frame(0x605, REQUEST), 200, own=True)
    scene.see(BEAT, 201)
    scene.see(Frame(0x585, bytes.fromhex(answer)), 202)
    return scene


def test_a_beat_between_the_write_of_its_period_and_the_answer_is_no_fault() -> None:
    """A device may beat as soon as it takes the value, and answer then."""
    scene = between(running(), "6017100000000000")
    for at_ms in (301, 401, 501):
        scene.see(BEAT, at_ms)
    assert scene.blamed(550) == []
    assert scene.blamed(700) == ["C-HB-04"]


def test_a_period_that_was_refused_is_the_old_one_again() -> None:
    """Without a heartbeat every further beat is one too many."""
    scene = between(running(), "8017100030000906")
    assert scene.blamed(300) == []
    scene.see(BEAT, 301)
    assert scene.blamed(400) == ["C-HB-06"]


def test_a_reset_ends_the_wait_for_an_answer() -> None:
    """What the device starts with counts then, whatever is answered later."""
    scene = running()
    scene.see(Frame(0x605, REQUEST), 200, own=True)
    scene.command(Nmt.RESET_NODE, 210)
    scene.see(Frame(0x705, b"\x00"), 220)
    scene.see(Frame(0x585, bytes.fromhex("6008100000000000")), 230)
    scene.see(BEAT, 300)
    assert "C-HB-06" in scene.blamed(400)


def test_the_rule_on_the_first_beat_speaks_of_the_period_of_the_start() -> None:
    """After a boot-up it holds, unless 1017h was written since; between beats it never does."""
    scene = running(100)
    boot_up, beat = Frame(0x705, b"\x00"), Frame(0x705, b"\x05")
    assert scene.watch.rule_after(None) == "C-HB-04"
    assert scene.watch.rule_after(Sighting(beat, 150 * MS)) == "C-HB-04"
    assert scene.watch.rule_after(Sighting(boot_up, 150 * MS)) == "C-HB-13"
    write(scene, HEARTBEAT_50, 200)
    assert scene.watch.rule_after(Sighting(boot_up, 150 * MS)) == "C-HB-04"
    assert scene.watch.rule_after(Sighting(boot_up, 250 * MS)) == "C-HB-13"
