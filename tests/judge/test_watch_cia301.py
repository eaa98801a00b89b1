"""The watch of a device with an object dictionary: its frames, and what was set in it."""

from __future__ import annotations

from dataclasses import replace

import pytest

from hil_tests.clock import MS
from hil_tests.judge.cobs import Nmt
from hil_tests.judge.expected import Family
from hil_tests.judge.settings import Role
from hil_tests.judge.verdict import Outcome
from node_model.frame import Frame
from tests.judge.cia301_scene import drive, running, write
from tests.judge.scene import NODE, Scene, device

FRAMES = {
    "SYNC": (Frame(0x080), "C-NMT-16"),
    "EMCY": (Frame(0x085, bytes(8)), "C-EM-17"),
    "TIME": (Frame(0x100, bytes(6)), "C-NMT-16"),
    "TPDO1": (Frame(0x185, b"\x01"), "C-TP-01"),
    "TPDO4": (Frame(0x485, bytes(8)), "C-TP-01"),
    "SDO answer": (Frame(0x585, bytes(8)), "C-NMT-16"),
}


@pytest.mark.parametrize("name", FRAMES)
def test_in_operational_every_service_speaks(name: str) -> None:
    """None of its frames is blamed."""
    scene = running()
    scene.see(FRAMES[name][0], 200)
    assert scene.blamed(300) == []


@pytest.mark.parametrize("name", FRAMES)
def test_in_stopped_none_does(name: str) -> None:
    """Each is blamed by the rule that forbids it; what may have come before the command is not."""
    frame, rule = FRAMES[name]
    scene = running()
    scene.command(Nmt.STOP, 200)
    scene.see(frame, 240)
    assert scene.blamed(300) == []
    scene.see(frame, 300)
    assert scene.blamed(400) == [rule]
    scene.see(Frame(0x7E4, bytes(8)), 310)
    assert scene.blamed(400) == [rule]


def test_in_pre_operational_no_pdo_is_sent() -> None:
    """The others are."""
    scene = Scene(drive(heartbeat_ms=0)).started()
    for frame, _ in FRAMES.values():
        scene.see(frame, 100)
    assert scene.blamed(200) == ["C-TP-01", "C-TP-01"]


def test_where_the_host_was_late_the_state_is_in_doubt() -> None:
    """A PDO that was due before the command and sent late is held against nobody for certain."""
    scene = running()
    scene.command(Nmt.STOP, 200)
    scene.see(FRAMES["TPDO1"][0], 300)
    scene.lateness.add(190 * MS, 300 * MS)
    assert [each.outcome for each in scene.verdicts(400)] == [Outcome.INCONCLUSIVE]


@pytest.mark.parametrize(
    ("frame", "rule"),
    [
        (Frame(0x123, b"\x01"), "C-RB-01"),
        (Frame(0x186, b"\x01"), "C-RB-01"),
        (Frame(0x185, remote=True, dlc=1), "C-RB-02"),
        (Frame(0x185, b"\x01", extended=True), "C-RB-02"),
        (Frame(0x085, bytes(7)), "C-RB-02"),
        (Frame(0x585, bytes(7)), "C-RB-02"),
        (Frame(0x100, bytes(8)), "C-RB-02"),
        (Frame(0x080, bytes(2)), "C-RB-02"),
    ],
)
def test_strange_and_ill_formed_frames_are_blamed(frame: Frame, rule: str) -> None:
    """Whatever the state is."""
    scene = running()
    scene.see(frame, 200)
    assert scene.blamed(300) == [rule]


def test_on_a_shared_bus_only_its_identifiers_are_its_own() -> None:
    """Until it is given another one."""
    scene = running(exclusive=False)
    scene.see(Frame(0x186, b"\x01"), 200)
    scene.see(Frame(0x1C0, bytes(2)), 201)
    assert scene.blamed(300) == []
    write(scene, "23001801C0010000", 300)
    scene.command(Nmt.STOP, 310)
    scene.see(Frame(0x1C0, bytes(2)), 400)
    assert scene.blamed(500) == ["C-TP-01"]


def test_nobody_can_say_whose_a_frame_is_without_a_node_id() -> None:
    """So none is blamed."""
    scene = Scene(replace(drive(heartbeat_ms=0), node_id=None))
    scene.see(Frame(0x123), 10)
    assert scene.blamed(100) == []


@pytest.mark.parametrize(
    ("request_", "can_id", "size"),
    [
        ("23001801C0010000", 0x1C0, 8),
        ("2314100081000000", 0x081, 8),
        ("2305100080000040", 0x080, 1),
        ("2312100010010040", 0x110, 6),
        ("2301120290050000", 0x590, 8),
        ("23FF1901C0010000", 0x1C0, 3),
    ],
)
def test_an_identifier_that_was_configured_is_its_own(
    request_: str, can_id: int, size: int
) -> None:
    """TPDO, emergency message, SYNC, TIME and SDO answer, from the answer on."""
    scene = running()
    before = len(scene.blamed(200))
    write(scene, request_, 200)
    scene.see(Frame(can_id, bytes(size)), 210)
    assert len(scene.blamed(300)) == before


@pytest.mark.parametrize(
    "request_",
    [
        "23001801C0010080",  # invalid
        "23001802C0010000",  # not the identifier
        "23140000C0010000",  # another object
        "2314100000000080",  # switched off
        "2305100082010000",  # no producer
        "2312100010010080",  # a consumer
        "2101180108000000",  # a segmented download
    ],
)
def test_what_gives_no_identifier_gives_none(request_: str) -> None:
    """Such a write admits nothing."""
    scene = running()
    write(scene, request_, 200)
    scene.see(Frame(0x1C0, bytes(8)), 210)
    assert scene.blamed(300) == ["C-RB-01"]


def test_an_identifier_of_its_data_sheet_is_its_own_from_the_start() -> None:
    """Also where somebody else may be on the bus."""
    for exclusive in (True, False):
        sheet = replace(drive(exclusive=exclusive, heartbeat_ms=0), speaks=((0x5C5, Role.SDO),))
        scene = Scene(sheet).started()
        scene.see(Frame(0x5C5, bytes(8)), 60)
        assert scene.blamed(100) == []
        scene.see(Frame(0x5C5, bytes(7)), 110)
        assert scene.blamed(200) == ["C-RB-02"]


def test_what_was_refused_admits_nothing() -> None:
    """Nor does an answer to something else, or one without a request."""
    request = "23001801C0010000"
    for answer in ("8000180130000906", "6001180100000000", "60"):
        scene = running()
        write(scene, request, 200, answer=answer)
        scene.see(Frame(0x1C0, bytes(8)), 210)
        assert "C-RB-01" in scene.blamed(300)
    scene = running()
    scene.see(Frame(0x585, bytes.fromhex("6000180100000000")), 200)
    scene.see(Frame(0x1C0, bytes(8)), 210)
    assert scene.blamed(300) == ["C-RB-01"]


def test_requests_that_are_none_are_not_heard() -> None:
    """Too short, extended, or an upload: the answer that follows means nothing."""
    data = bytes.fromhex("23001801C0010000")
    for frame in (
        Frame(0x605, data[:7]),
        Frame(0x605, data, extended=True),
        Frame(0x605, b"\x40" + data[1:]),
        Frame(0x606, data),
    ):
        scene = running()
        scene.see(frame, 200, own=True)
        scene.see(Frame(0x585, bytes.fromhex("6000180100000000")), 201)
        scene.see(Frame(0x1C0, bytes(8)), 210)
        assert scene.blamed(300) == ["C-RB-01"]


def poll(scene: Scene, at_ms: float) -> None:
    """A guarding request of the tester."""
    scene.see(Frame(0x700 + NODE, remote=True, dlc=1), at_ms, own=True)


def test_an_answer_to_a_guarding_request_is_no_heartbeat() -> None:
    """With a period of 0; without a request, or a second time, it is one."""
    scene = running(0)
    for turn in range(4):
        poll(scene, 200 + 100 * turn)
        scene.beat(201 + 100 * turn, 0x05 | (0x80 if turn % 2 else 0))
    assert scene.blamed(600) == []
    scene.beat(602, 0x85)
    assert set(scene.blamed(700)) == {"C-HB-06", "C-HB-02"}


def test_an_answer_that_comes_much_too_late_is_none() -> None:
    """A quarter of a second after the request it is a heartbeat that should not be."""
    for at_ms, blamed in ((440, []), (460, ["C-HB-06"])):
        scene = running(0)
        poll(scene, 200)
        scene.beat(at_ms, 0x05)
        assert scene.blamed(600) == blamed


def test_what_comes_before_the_request_is_no_answer() -> None:
    """Asked for earlier, though seen later."""
    scene = running(0)
    poll(scene, 250)
    scene.see(Frame(0x705, b"\x05"), 240, 0)
    assert scene.blamed(600) == ["C-HB-06"]


def test_where_the_heartbeat_runs_no_request_is_answered() -> None:
    """What comes is a beat too many."""
    scene = running(100)
    scene.beats([149, 249], state=0x05)
    poll(scene, 280)
    scene.beat(281, 0x05)
    assert scene.blamed(300) == ["C-HB-04"]


@pytest.mark.parametrize("on", [True, False], ids=["power", "reset"])
@pytest.mark.parametrize(
    ("boot_ms", "until_ms", "blamed"),
    [
        (1000, 1001, []),
        (1001, 1002, ["C-NMT-20"]),
        (None, 1000, []),
        (None, 1001, ["C-NMT-20"]),
        (None, 2000, ["C-NMT-20"]),
        (None, 2001, ["missing"]),
    ],
)
def test_a_boot_up_comes_in_time_or_late_or_never(
    boot_ms: int | None, until_ms: int, blamed: list[str], *, on: bool
) -> None:
    """After twice its limit it is missing; before that nobody can say more than: late."""
    scene = Scene(drive(heartbeat_ms=0))
    if on:
        scene.power(0, on=True)
    else:
        scene.started(-100)
        scene.command(Nmt.RESET_NODE, 0)
    if boot_ms is not None:
        scene.boot(boot_ms)
    missing = "C-NMT-01" if on else "C-NMT-13"
    assert scene.blamed(until_ms) == [missing if name == "missing" else name for name in blamed]


def test_a_late_boot_up_is_told_once_where_the_next_reset_came_first() -> None:
    """That there is one for the earlier reset, after all, is no boot-up too many."""
    scene = Scene(drive(heartbeat_ms=0)).started()
    scene.command(Nmt.RESET_NODE, 100)
    scene.command(Nmt.RESET_NODE, 1200)
    scene.boot(1250)
    scene.boot(1300)
    assert scene.blamed(1400) == ["C-NMT-20"]


def test_requirements_of_a_start_are_those_of_cia_301() -> None:
    """Boot-up repeated, not first; a state that no command led to."""
    scene = running(100)
    scene.boot(150)
    assert scene.blamed(160) == ["C-NMT-13"]
    scene = Scene(drive(heartbeat_ms=0))
    scene.power(0, on=True)
    scene.see(Frame(0x085, bytes(8)), 30)
    scene.boot(50)
    assert "C-NMT-02" in scene.blamed(100)
    scene = Scene(drive()).started()
    scene.beat(149, 0x05)
    assert scene.blamed(160) == ["C-NMT-19"]


def test_a_device_without_limits_may_beat_as_it_likes() -> None:
    """Where nobody says what an interval may be, none is wrong."""
    known = replace(device(heartbeat_ms=None), family=Family.CIA301).beating(100 * MS)
    scene = Scene(known).started()
    scene.beats([60, 61, 900])
    assert scene.blamed(5000) == []
