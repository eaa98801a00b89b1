"""The keypad's object dictionary over SDO."""

from __future__ import annotations

import pytest

from node_model.devices import make_device
from node_model.frame import Frame
from node_model.node import MS
from node_model.sheets import shipped
from tests.node_model.rig import Refused, Rig


def running(heartbeat_ms: int = 0, node_id: int = 3) -> Rig:
    """A keypad in pre-operational."""
    settings = {"node_id": node_id, "bit_rate_code": 2, "heartbeat_ms": heartbeat_ms}
    pad = make_device("keypad", settings={**settings, "sync_time": 0, "debounce": 0})
    rig = Rig(pad, node_id)
    rig.power_on()
    return rig


def test_it_tells_who_it_is() -> None:
    """Device type, identity, COB-IDs of its node id, the error register of its EMCY."""
    rig = running()
    assert rig.read(0x1000) == 0x0003_0191
    assert rig.read(0x1018, 2) == 0x401
    assert rig.read(0x1014) == 0x83
    assert rig.read(0x1200, 1) == 0x603
    assert rig.read(0x1800, 1) == 0x4000_0183
    assert rig.read(0x1001) == 1
    assert rig.read(0x1017) == 0
    with pytest.raises(Refused, match=str(0x0602_0000)):
        rig.read(0x1016)


def test_keys_and_leds_are_objects() -> None:
    """6000h shows the keys, 6200h and 2200h the LEDs; a client can switch these."""
    rig = running()
    rig.nmt(1)
    rig.keep(rig.device.hold(frozenset(("k3", "on_off")), rig.now))
    rig.send(0x203, 0x0F)
    rig.send(0x303, 0x30)
    assert [rig.read(index, 1) for index in (0x6000, 0x6200, 0x2200)] == [0x05, 0x0F, 0x30]
    rig.write(0x6200, 1, 0x80, 1)
    assert rig.read(0x2200, 1) == 0x30
    assert [led for led in rig.device.leds if rig.device.lit(led, rig.now)] == ["k5", "k6", "k8"]


def test_a_new_heartbeat_time_acts_at_once_until_the_next_reset() -> None:
    """Then the commissioned one counts again."""
    rig = running(100)
    rig.write(0x1017, 0, 20, 2)
    assert rig(105) == 2 * [Frame(0x703, b"\x7f")]
    rig.nmt(0x82)
    rig(320)
    beats = [at for at, frame in rig.said if frame == Frame(0x703, b"\x7f")]
    assert beats[-2:] == [215 * MS, 315 * MS]
    assert rig.read(0x1017) == 100


def test_stopped_is_silent_and_ends_a_transfer() -> None:
    """A segmented upload is not taken up again; the next request is served."""
    rig = running()
    assert rig.request(0x40, 0x08, 0x10)[0].data[0] == 0x41
    rig.nmt(2)
    assert rig.request(0x40, 0x00, 0x10) == []
    rig.nmt(0x80)
    assert rig.request(0x60)[0].data[0] == 0x80
    assert rig.read(0x1000) == 0x0003_0191


def test_only_data_frames_are_requests() -> None:
    """No remote frame, no extended one; no block transfer either."""
    rig = running()
    assert rig.send(0x603, remote=True) == []
    assert rig.device.receive(Frame(0x603, bytes(8), extended=True), rig.now) == ()
    assert rig.request(0xA4, 0x08, 0x10, 0, 127)[0].data[4:] == bytes((1, 0, 4, 5))


def test_commissioning_knows_no_sdo() -> None:
    """COM-03: every SDO is ignored."""
    rig = Rig(make_device("keypad"), 1)
    rig.device.hold(frozenset(("on_off", "aut")), 0)
    rig.power_on()
    assert rig.request(0x40, 0x00, 0x10) == []


def test_it_serves_the_objects_of_the_eds_file_that_it_is_given() -> None:
    """Those of keys and LEDs may be missing there; heartbeat and error register are its own."""
    settings = {"node_id": 3, "bit_rate_code": 2, "heartbeat_ms": 50}
    sheet = shipped("drive.eds")
    pad = make_device("keypad", settings={**settings, "sync_time": 0, "debounce": 0}, eds=sheet)
    rig = Rig(pad, 3)
    rig.power_on()
    assert rig.read(0x1017) == 50
    assert rig.read(0x1001) == 1
    with pytest.raises(Refused, match=str(0x0602_0000)):
        rig.read(0x6200, 1)
