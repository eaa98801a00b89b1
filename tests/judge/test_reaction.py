"""A communication error may change the NMT state: as 1029h says, and not otherwise."""

from __future__ import annotations

import pytest

from hil_tests.clock import MS
from hil_tests.judge.cobs import Nmt, State
from hil_tests.judge.expected import Expected
from node_model.frame import Frame
from tests.judge.cia301_scene import drive, write
from tests.judge.scene import NODE, Scene, device

EVENT = Frame(0x080 + NODE, bytes.fromhex("3081110000000000"))
RECOVERED = Frame(0x080 + NODE, bytes.fromhex("4081110000000000"))
OTHER = Frame(0x080 + NODE, bytes.fromhex("1023030000000000"))
SETTING = "2F291001{:02X}000000"
STATES = {0x7F: State.PRE_OPERATIONAL, 0x05: State.OPERATIONAL, 0x04: State.STOPPED}


def running(behaviour: int | None, known: Expected | None = None) -> Scene:
    """An operational device whose 1029h:01 was written at 350 ms, unless None."""
    scene = Scene(known or drive()).started()
    scene.command(Nmt.START, 60)
    for at_ms in (150, 250, 350):
        scene.beat(at_ms, 0x05)
    if behaviour is not None:
        write(scene, SETTING.format(behaviour), 360)
    return scene


def beat_on(scene: Scene, state: int, since_ms: int = 450, count: int = 5) -> list[str]:
    """Beats of a state; what is blamed then."""
    for turn in range(count):
        scene.beat(since_ms + 100 * turn, state)
    return scene.blamed(since_ms + 100 * (count - 1) + 10)


@pytest.mark.parametrize("shown", STATES)
@pytest.mark.parametrize(
    ("behaviour", "right"),
    [
        (0, {0x7F}),
        (1, {0x05}),
        (2, {0x04}),
        (3, set(STATES)),
        (None, set(STATES)),
    ],
)
@pytest.mark.parametrize("event", [EVENT, RECOVERED])
def test_an_event_leads_where_1029h_says(
    behaviour: int | None, right: set[int], event: Frame, shown: int
) -> None:
    """From operational; where it is not known, or the maker's own, each state is possible."""
    scene = running(behaviour)
    scene.see(event, 380)
    wanted = [] if shown in right else ["C-EM-22"]
    assert sorted(set(beat_on(scene, shown))) == wanted


def test_the_reaction_may_take_its_time() -> None:
    """As long as a command may; a beat after that shows it."""
    for at_ms, blamed in ((450, []), (450.001, ["C-EM-22"])):
        scene = running(0)
        scene.see(EVENT, 400)
        scene.beat(at_ms, 0x05)
        assert scene.blamed(460) == blamed


def test_a_late_host_does_not_look_like_a_missing_reaction() -> None:
    """The beat was due before it."""
    scene = running(0)
    scene.see(EVENT, 380)
    scene.beat(450, 0x05)
    scene.lateness.add(400 * MS, 450 * MS)
    assert scene.blamed(460) == []


@pytest.mark.parametrize("behaviour", [0, 1, 2])
def test_other_errors_lead_nowhere(behaviour: int) -> None:
    """A device that follows them is blamed, whatever 1029h says."""
    for shown in (0x7F, 0x04):
        scene = running(behaviour)
        scene.see(OTHER, 380)
        assert set(beat_on(scene, shown)) == {"C-NMT-04"}


def test_from_pre_operational_only_2_leads_on() -> None:
    """0 is for operational alone."""
    for behaviour, right in ((0, 0x7F), (1, 0x7F), (2, 0x04)):
        for shown in STATES:
            scene = Scene(drive()).started()
            write(scene, SETTING.format(behaviour), 60)
            scene.beat(150, 0x7F)
            scene.beat(250, 0x7F)
            scene.see(EVENT, 280)
            found = set(beat_on(scene, shown, 350))
            assert found == (set() if shown == right else {"C-EM-22"})


def test_a_command_afterwards_is_obeyed() -> None:
    """And what the event has led to is over."""
    scene = running(0)
    scene.see(EVENT, 380)
    assert beat_on(scene, 0x7F) == []
    scene.command(Nmt.START, 860)
    assert beat_on(scene, 0x05, 950) == []


def test_a_beat_with_the_new_state_may_come_before_the_message() -> None:
    """A phase of its own, too."""
    scene = running(0)
    scene.beat(390, 0x7F)
    scene.see(EVENT, 390.5)
    assert beat_on(scene, 0x7F, 490) == []


def test_a_message_that_may_have_waited_proves_nothing() -> None:
    """It came after another one: an inhibit time may have kept it back since then."""
    for shown in (0x05, 0x7F):
        scene = running(0)
        scene.see(OTHER, 380)
        scene.beat(450, shown)
        scene.see(EVENT, 460)
        assert beat_on(scene, shown, 550) == []


def test_soon_after_a_command_nobody_knows_which_came_first() -> None:
    """The error may have been there before, in a state where it led nowhere."""
    scene = running(0)
    scene.command(Nmt.START, 400)
    scene.see(EVENT, 480)
    assert beat_on(scene, 0x05) == []


@pytest.mark.parametrize("request_", ["2314100085000080", "2B151000E8030000"])
@pytest.mark.parametrize(("behaviour", "shown"), [(0, 0x7F), (2, 0x04), (3, 0x04)])
def test_where_messages_are_held_back_an_error_may_stay_unseen(
    request_: str, behaviour: int, shown: int
) -> None:
    """1014h invalid, or an inhibit time: the state tells alone."""
    scene = running(behaviour)
    write(scene, request_, 365)
    assert beat_on(scene, shown) == []


def test_held_messages_excuse_only_where_1029h_leads() -> None:
    """1 leads nowhere; a reset brings back what the device starts with."""
    scene = running(1)
    write(scene, "2314100085000080", 365)
    assert set(beat_on(scene, 0x7F)) == {"C-NMT-04"}
    scene = running(0)
    write(scene, "2314100085000080", 365)
    scene.command(Nmt.RESET_NODE, 370)
    scene.boot(390)
    scene.command(Nmt.START, 395)
    assert set(beat_on(scene, 0x7F, 490)) == {"C-NMT-04"}


def test_an_inhibit_time_of_0_holds_nothing_back() -> None:
    """It is as if it had not been written."""
    scene = running(0)
    write(scene, "2B15100000000000", 365)
    assert set(beat_on(scene, 0x7F)) == {"C-NMT-04"}


def test_what_was_set_holds_in_the_next_watch() -> None:
    """Until the device starts anew."""
    scene = running(1)
    after = Scene(drive(), states=frozenset((State.OPERATIONAL,)))
    after.watch.goes_on_from(scene.watch)
    for at_ms in (450, 550):
        after.beat(at_ms, 0x05)
    after.see(EVENT, 580)
    after.beat(650, 0x7F)
    assert after.blamed(660) == ["C-EM-22"]
    scene.command(Nmt.RESET_COMMUNICATION, 370)
    scene.boot(390)
    scene.command(Nmt.START, 395)
    scene.beat(490, 0x05)
    scene.beat(590, 0x05)
    scene.see(EVENT, 600)
    assert beat_on(scene, 0x7F, 690) == []


def test_its_messages_are_known_by_the_identifier_it_was_given() -> None:
    """1014h gave it another one."""
    scene = running(0)
    write(scene, "2314100091000000", 365)
    scene.see(Frame(0x091, EVENT.data), 380)
    assert beat_on(scene, 0x7F) == []


def test_a_keypad_has_no_such_object() -> None:
    """Nor a state that an error leads to."""
    scene = Scene(device()).started()
    scene.command(Nmt.START, 60)
    scene.beat(150, 0x05)
    scene.see(EVENT, 160)
    scene.beat(250, 0x7F)
    assert "NMT-07" in scene.blamed(260)


def test_a_start_that_nobody_asked_for_may_lose_the_heartbeat_time() -> None:
    """1017h is what was stored, or what it was: the boot-up is wrong, the beats are not."""
    scene = Scene(drive(heartbeat_ms=0)).started()
    write(scene, "2B17100064000000", 60)
    for at_ms in (160, 260):
        scene.beat(at_ms, 0x7F)
    scene.boot(300)
    assert scene.blamed(2000) == ["C-NMT-13"]
