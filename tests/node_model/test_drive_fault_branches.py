"""Faults of the drive where they do not act: beside their fault they are like the right one."""

from __future__ import annotations

import pytest

from node_model.devices import make_device
from node_model.node import MS
from tests.node_model.rig import Rig

LSS_MASTER, LSS_SLAVE = 0x7E5, 0x7E4
LOAD = int.from_bytes(b"load", "little")


def running(model: str, heartbeat_ms: int = 0) -> Rig:
    """A faulty or different drive in operational."""
    rig = Rig(make_device("drive", model=model, settings={"heartbeat_ms": heartbeat_ms}))
    rig.power_on()
    rig.nmt(1)
    rig(100)
    return rig


def test_an_entry_that_watches_nobody_begins_no_watching() -> None:
    """A consumer that does not wait has nothing to wait for where the time is 0."""
    rig = running("consumer-does-not-wait")
    rig.write(0x1016, 1, 0x0003_0000, 4)
    assert rig(2000) == []


def test_a_good_sync_ends_no_error_that_there_was_not() -> None:
    """The list that holds ends of errors stays empty while there are none."""
    rig = running("field-holds-ends-of-errors")
    rig.sync()
    assert rig.read(0x1003) == 0


def test_a_heartbeat_that_cannot_be_switched_off_takes_other_periods() -> None:
    """Only the 0 has no effect."""
    rig = running("heartbeat-cannot-be-switched-off", heartbeat_ms=500)
    rig.write(0x1017, 0, 50, 2)
    assert len(rig(401)) == 6


def test_an_empty_or_remote_lss_frame_is_left_alone() -> None:
    """The slave that fills up short requests needs one byte to fill up from."""
    rig = running("lss-takes-short-requests")
    assert rig.send(LSS_MASTER) == []
    assert rig.send(LSS_MASTER, remote=True) == []


def test_a_device_without_node_id_takes_one_at_once() -> None:
    """The fault concerns a device that has a node id already."""
    right = Rig(make_device("drive"))
    right.power_on()
    for request in ((0x04, 1), (0x11, 0xFF), (0x17,)):
        right.send(LSS_MASTER, *bytes(request).ljust(8, b"\0"))
    right(2000)
    image = right.device.image()
    rig = Rig(make_device("drive", model="lss-node-id-needs-power", image=image))
    assert rig.power_on() == []
    rig.send(LSS_MASTER, 0x04, 1, 0, 0, 0, 0, 0, 0)
    (answer,) = rig.send(LSS_MASTER, 0x11, 7, 0, 0, 0, 0, 0, 0)
    assert (answer.can_id, answer.data[:2]) == (LSS_SLAVE, b"\x11\x00")
    rig.send(LSS_MASTER, 0x04, 0, 0, 0, 0, 0, 0, 0)
    assert rig(rig.now / MS + 1100)[0].can_id == 0x707


def test_an_expedited_upload_has_its_size() -> None:
    """Only segmented uploads tell one byte more."""
    assert running("sdo-segments-tell-wrong-size").read(0x1001) == 0


def test_restoring_one_group_leaves_the_others() -> None:
    """Communication parameters are restored at once, those of the application stay."""
    rig = running("restores-at-once")
    rig.write(0x6060, 0, 8, 1)
    rig.write(0x1015, 0, 77, 2)
    rig.write(0x1011, 2, LOAD, 4)
    assert rig.read(0x1015) != 77
    assert rig.read(0x6060) == 8


@pytest.mark.parametrize("model", ["first-beat-at-once", "first-beat-soon-after-boot-up"])
def test_without_heartbeat_no_beat_comes_early(model: str) -> None:
    """Where 1017h is 0 there is no first beat either."""
    rig = running(model)
    rig.write(0x1017, 0, 0, 2)
    assert rig(1500) == []


def test_a_reset_forgets_the_key_frames_that_waited() -> None:
    """Key frames after a pause: what was still to be sent is not sent after a reset."""
    pad = make_device("keypad", model="key-frame-after-pause", node_id=5)
    rig = Rig(pad)
    rig.power_on(200)
    rig.nmt(1)
    rig.nmt(0x82)
    assert [frame for frame in rig(900) if frame.can_id == 0x185] == []
