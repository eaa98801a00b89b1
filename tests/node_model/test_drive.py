"""The drive: its errors, and the phases of a SYNC."""

from __future__ import annotations

from importlib import resources
from pathlib import Path

import pytest

from node_model.devices import make_device
from node_model.drive import loads
from node_model.frame import Frame
from node_model.node import MS, US
from node_model.world import World
from tests.node_model.rig import Refused, Rig

PROFILE = (resources.files("node_model.profiles") / "drive.toml").read_text("utf-8")
OVERCURRENT = Frame(0x085, bytes((0x10, 0x23, 0x03, 1, 2, 3, 4, 5)))
NO_ERROR = Frame(0x085, bytes(8))
ENABLED = 0x0237


def running(state: int = 1, profile: str = "drive") -> Rig:
    """A drive that was sent to a state, without heartbeat."""
    rig = Rig(make_device(profile, settings={"heartbeat_ms": 0}))
    rig.power_on()
    rig.nmt(state)
    rig(100)
    return rig


def enabled() -> Rig:
    """A drive that may move."""
    rig = running()
    for word in (0x06, 0x07, 0x0F):
        rig.write(0x6040, 0, word, 2)
    assert rig.read(0x6041) == ENABLED
    return rig


# The profile.


def test_the_profile_says_what_it_is() -> None:
    """Errors with code, bits of the register and the maker's bytes; the unit of 1007h."""
    facts = loads(PROFILE)
    assert facts.window_unit_ns == US
    assert facts.faults["vendor"].code == 0xFF01
    assert facts.faults["vendor"].register == 0x80
    assert facts.faults["overcurrent"].manufacturer == bytes((1, 2, 3, 4, 5))
    assert loads(PROFILE.replace('"us"', '"ms"')).window_unit_ns == MS


@pytest.mark.parametrize(
    ("good", "bad"), [("code = 0x2310", 'code = "x"'), ('register = ["current"]', "register = 2")]
)
def test_a_wrong_fault_is_refused(good: str, bad: str) -> None:
    """Its code is a number, its register a list of names."""
    with pytest.raises(ValueError, match="is no fault"):
        loads(PROFILE.replace(good, bad))


# Errors (EM-01 to EM-08).


def test_an_error_is_told_once_and_its_end_too() -> None:
    """EMCY with code, register and the maker's bytes; 1003h has it; then no error."""
    rig = running(0x80)
    assert rig.fail("overcurrent") == [OVERCURRENT]
    assert rig.fail("overcurrent") == []
    assert rig.read(0x1001) == 0x03
    assert rig.read(0x1003, 1) == 0x0103_2310
    assert rig.fail() == [NO_ERROR]
    assert rig.read(0x1001) == 0
    assert rig.read(0x1003, 0) == 1


def test_errors_come_before_others_go() -> None:
    """So that there is no instant without error, and no false end is told."""
    rig = running(0x80)
    rig.fail("overcurrent")
    (told,) = rig.fail("encoder")
    assert told.data[:3] == bytes((0x05, 0x73, 0x23))
    assert rig.read(0x1001) == 0x21


def test_an_error_in_stopped_is_told_later() -> None:
    """On leaving it."""
    rig = running(2)
    assert rig.fail("overcurrent") == []
    assert rig.nmt(0x80) == [OVERCURRENT]


def test_an_error_at_power_on_follows_the_boot_up() -> None:
    """Who has an error while it starts tells it right after."""
    rig = Rig(make_device("drive", settings={"heartbeat_ms": 0}))
    assert rig.fail("overcurrent") == []
    assert rig.power_on() == [Frame(0x705, b"\0"), OVERCURRENT]
    rig.power_off()
    assert rig.power_on() == [Frame(0x705, b"\0"), OVERCURRENT]


def test_an_error_that_goes_during_a_reset_is_gone() -> None:
    """Nothing is told of it; the axis can be acknowledged."""
    rig = running(0x80)
    rig.fail("overcurrent")
    rig.nmt(0x82)
    assert rig.fail() == []
    assert rig(130) == [Frame(0x705, b"\0")]
    assert rig.read(0x6041) == 0x0218
    rig.write(0x6040, 0, 0x80, 2)
    assert rig.read(0x6041) == 0x0240


def test_an_sdo_error_is_no_emergency() -> None:
    """EM-02."""
    rig = running(0x80)
    with pytest.raises(Refused):
        rig.write(0x1000, 0, 1, 4)
    assert rig(200) == []


# The axis.


def test_it_is_enabled_step_by_step() -> None:
    """06h, 07h, 0Fh; the status word shows each state, and a PDO tells of it."""
    rig = running()
    seen = []
    for word in (0x0F, 0x06, 0x0F, 0x0F, 0x07, 0x0F, 0x0B, 0x06, 0x00):
        rig.write(0x6040, 0, word, 2)
        seen.append(rig.read(0x6041))
    assert seen == [0x240, 0x231, 0x233, 0x237, 0x233, 0x237, 0x240, 0x231, 0x240]


def test_it_goes_straight_to_its_target() -> None:
    """At the speed of 2020h, in increments a millisecond, from where it is."""
    rig = enabled()
    rig.write(0x2020, 0, 10, 4)
    rig.write(0x607A, 0, -1000, 4)
    rig(150)
    assert rig.read(0x6064, signed=True) == -500
    rig.write(0x607A, 0, 0, 4)
    rig(160)
    assert rig.read(0x6064, signed=True) == -400
    rig.write(0x2020, 0, 100, 4)
    rig(162)
    assert rig.read(0x6064, signed=True) == -200
    rig(300)
    assert rig.read(0x6064, signed=True) == 0


def test_it_stands_still_when_it_is_disabled() -> None:
    """And goes on from there."""
    rig = enabled()
    rig.write(0x2020, 0, 10, 4)
    rig.write(0x607A, 0, 1000, 4)
    rig(150)
    rig.write(0x6040, 0, 0, 2)
    rig(200)
    assert rig.read(0x6064) == 500


def test_an_error_stops_it_until_it_is_acknowledged() -> None:
    """A rising bit 7 of the control word, once no error is left; 603Fh names the last one."""
    rig = enabled()
    rig.fail("overcurrent", "encoder")
    assert (rig.read(0x6041), rig.read(0x603F)) == (0x0218, 0x7305)
    rig.fail("encoder")
    rig.write(0x6040, 0, 0x80, 2)
    assert rig.read(0x6041) == 0x0218
    rig.fail()
    rig.write(0x6040, 0, 0x80, 2)
    assert rig.read(0x6041) == 0x0218
    rig.write(0x6040, 0, 0x00, 2)
    rig.write(0x6040, 0, 0x80, 2)
    assert (rig.read(0x6041), rig.read(0x603F)) == (0x0240, 0)


def test_modes_are_shown() -> None:
    """6061h follows 6060h; a mode that it has not is refused."""
    rig = running()
    assert rig.write(0x6060, 0, 1, 1) == [Frame(0x285, b"\x40\x02\x01")]
    assert rig.read(0x6061) == 1
    with pytest.raises(Refused, match=str(0x0609_0030)):
        rig.write(0x6060, 0, 3, 1)


def test_a_mode_that_it_has_already_is_no_news() -> None:
    """No PDO tells of it."""
    assert running().write(0x6060, 0, 8, 1) == []


def test_a_set_point_for_others_does_not_concern_it() -> None:
    """An RPDO may carry any object; the axis heeds its own."""
    rig = running(0x80)
    rig.write(0x1602, 1, 0x2013_0108, 4)
    rig.write(0x1602, 0, 1, 1)
    rig.write(0x1402, 2, 255, 1)
    rig.write(0x1402, 1, 0x405, 4)
    rig.nmt(1)
    rig(110)
    assert rig.send(0x405, 0x77) == []
    assert (rig.read(0x2013, 1), rig.read(0x6041)) == (0x77, 0x0240)


def test_only_reset_node_ends_a_motion() -> None:
    """Reset communication leaves the application alone."""
    rig = enabled()
    rig.write(0x2020, 0, 10, 4)
    rig.write(0x607A, 0, 1000, 4)
    rig.nmt(0x82)
    rig(150)
    assert rig.read(0x6064) == 500
    rig.nmt(0x81)
    rig(200)
    assert (rig.read(0x6064), rig.read(0x6041)) == (0, 0x0240)


# The phases of a SYNC (SYN-01 to SYN-05).


def test_a_sync_takes_set_points_and_sends_actual_values() -> None:
    """The set-point received before is taken; the actual value of that instant is sent."""
    rig = enabled()
    assert rig.send(0x205, 0x0F, 0, 0xF4, 1, 0, 0) == []
    assert rig.read(0x607A) == 0
    assert rig.sync() == [Frame(0x185, bytes((0x37, 2, 0, 0, 0, 0)))]
    assert rig.read(0x607A) == 500
    assert rig.sync() == [Frame(0x185, bytes((0x37, 2, 0xF4, 1, 0, 0)))]


@pytest.mark.parametrize(("window_us", "frames"), [(299, 0), (300, 1), (599, 1), (600, 2)])
def test_tpdos_that_miss_the_window_are_dropped(window_us: int, frames: int) -> None:
    """The first is ready 300 us after the SYNC, the second 300 us later."""
    rig = running(0x80)
    rig.write(0x1A02, 1, 0x2014_0108, 4)
    rig.write(0x1A02, 0, 1, 1)
    rig.write(0x1802, 1, 0x385, 4)
    rig.write(0x1007, 0, window_us, 4)
    rig.nmt(1)
    rig(110)
    assert [frame.can_id for frame in rig.sync()] == [0x185, 0x385][:frames]


@pytest.mark.parametrize(
    ("unit", "steps", "at_us", "taken"),
    [("us", 1000, 1000, 7), ("us", 1000, 1001, 0), ("ms", 3, 3000, 7), ("ms", 3, 3001, 0)],
)
def test_a_set_point_after_the_window_is_ignored(
    tmp_path: Path, unit: str, steps: int, at_us: int, taken: int
) -> None:
    """The unit of 1007h is the profile's."""
    path = tmp_path / "mine.toml"
    path.write_text(PROFILE.replace('"us"', f'"{unit}"'))
    rig = running(1, str(path))
    rig.write(0x1007, 0, steps, 4)
    rig.send(0x080)
    rig(100 + at_us / 1000)
    rig.send(0x205, 0x0F, 0, 7, 0, 0, 0)
    rig(105)
    rig.sync()
    assert rig.read(0x607A) == taken


def test_a_busy_bus_keeps_an_actual_value_from_being_sent_after_the_window() -> None:
    """In virtual time: what goes first takes longer than the window; the next SYNC is answered."""
    world = World(250_000)
    tester = world.attach()
    drive = world.attach(make_device("drive", settings={"heartbeat_ms": 0}))
    assert drive.node is not None
    world.act(drive, drive.node.power_on)
    window = bytes((0x23, 0x07, 0x10, 0, 0xE8, 3, 0, 0))
    for frame in (Frame(0x605, window), Frame(0, b"\1\5"), Frame(0x80)):
        world.run(world.now + 100 * MS)
        world.send(tester, frame)
    for _ in range(5):
        world.send(tester, Frame(0x101, bytes(8)))
    heard = []
    for _ in range(2):
        while (found := world.next_frame(world.now + 10 * MS)) is not None:
            heard.append(found[0].can_id)
        world.send(tester, Frame(0x80))
    assert heard == [0x80, *[0x101] * 5, 0x80, 0x185]


def test_sync_outside_operational_leads_to_nothing() -> None:
    """SYN-07."""
    for state in (0x80, 2):
        assert running(state).sync() == []
