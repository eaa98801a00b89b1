"""canopen's clients and our drive in virtual time: software that nobody here wrote is content."""

from __future__ import annotations

from collections.abc import Iterator
from random import Random

import canopen
import pytest
from canopen.sdo.exceptions import SdoAbortedError

from node_model.node import MS, S
from tests.second_opinion.virtual_canopen import VirtualNetwork, virtual_network

DOMAIN = 0x2000
LIMITED, SPEED = 0x2011, 0x2020


@pytest.fixture
def pair() -> Iterator[tuple[VirtualNetwork, canopen.RemoteNode]]:
    """A network with a drive that has booted."""
    with virtual_network() as both:
        yield both


Pair = tuple[VirtualNetwork, canopen.RemoteNode]


def block_write(node: canopen.RemoteNode, data: bytes, crc: bool = True) -> None:
    """Write the domain in blocks."""
    with node.sdo.open(
        DOMAIN, 0, "wb", size=len(data), block_transfer=True, request_crc_support=crc
    ) as file:
        file.write(data)


def block_read(node: canopen.RemoteNode) -> bytes:
    """Read the domain in blocks."""
    with node.sdo.open(DOMAIN, 0, "rb", block_transfer=True) as file:
        return bytes(file.read())


def test_expedited_transfers(pair: Pair) -> None:
    """What canopen writes it reads."""
    _, node = pair
    node.sdo[0x1017].raw = 250
    assert node.sdo[0x1017].raw == 250
    assert node.sdo[0x1018][1].raw == 0x7E57
    assert node.sdo.upload(0x1000, 0) == bytes.fromhex("92010200")


def test_segmented_transfers(pair: Pair) -> None:
    """Names and long values, byte for byte."""
    _, node = pair
    assert node.sdo[0x1008].raw == "nodeproof drive"
    data = bytes(range(256)) * 5
    node.sdo.download(DOMAIN, 0, data, force_segment=True)
    assert node.sdo.upload(DOMAIN, 0) == data


@pytest.mark.parametrize("size", [1, 4, 5, 7, 8, 14, 888, 889, 890, 895, 896])
def test_block_transfers(pair: Pair, size: int) -> None:
    """Both ways, on both sides of a segment and of a block."""
    _, node = pair
    data = bytes(step * 7 & 0xFF for step in range(size))
    block_write(node, data)
    assert node.sdo.upload(DOMAIN, 0) == data
    assert block_read(node) == data


@pytest.mark.slow
def test_a_megabyte_in_blocks(pair: Pair) -> None:
    """There and back in blocks, byte for byte, with a CRC."""
    _, node = pair
    data = bytes(step * 31 + (step >> 8) & 0xFF for step in range(1 << 20))
    block_write(node, data)
    assert block_read(node) == data


@pytest.mark.slow
def test_a_hundred_thousand_transactions(pair: Pair) -> None:
    """Reads and writes in turn: every one is answered, and nothing comes besides."""
    network, node = pair
    client = node.sdo
    for turn in range(50_000):
        client.download(SPEED, 0, (turn % 1000 + 1).to_bytes(4, "little"))
        assert client.upload(SPEED, 0) == (turn % 1000 + 1).to_bytes(4, "little")
    assert client.responses.strays == 0
    assert network.frames > 200_000


@pytest.mark.slow
def test_every_way_of_transfer_brings_the_same_for_every_size(pair: Pair) -> None:
    """1 to 2000 bytes: written in segments (or at once), read in blocks; and the other way."""
    _, node = pair
    made = Random(2000)
    for size in range(1, 2001):
        data, other = made.randbytes(size), made.randbytes(size)
        node.sdo.download(DOMAIN, 0, data)
        assert block_read(node) == data, size
        block_write(node, other)
        assert node.sdo.upload(DOMAIN, 0) == other, size
    assert node.sdo.responses.strays == 0


@pytest.mark.slow
@pytest.mark.parametrize("size", [1, 2, 3, 4])
def test_short_values_come_at_once_or_in_a_segment(pair: Pair, size: int) -> None:
    """What may be expedited may be segmented as well."""
    _, node = pair
    for segmented in (False, True):
        data = bytes((0xA0 + size + segmented,)) * size
        node.sdo.download(DOMAIN, 0, data, force_segment=segmented)
        assert node.sdo.upload(DOMAIN, 0) == block_read(node) == data


@pytest.mark.parametrize(
    ("index", "sub", "data", "code"),
    [
        (0x1000, 0, bytes(4), 0x0601_0002),
        (0x5FFF, 0, bytes(4), 0x0602_0000),
        (0x1018, 9, bytes(4), 0x0609_0011),
        (LIMITED, 0, b"\x65\x00", 0x0609_0031),
        (LIMITED, 0, b"\x9b\xff", 0x0609_0032),
        (0x1017, 0, bytes(4), 0x0607_0012),
        (0x1017, 0, bytes(1), 0x0607_0013),
    ],
)
def test_refusals_have_their_codes(
    pair: Pair, index: int, sub: int, data: bytes, code: int
) -> None:
    """As canopen decodes them."""
    _, node = pair
    with pytest.raises(SdoAbortedError) as caught:
        node.sdo.download(index, sub, data)
    assert caught.value.code == code


@pytest.mark.parametrize("state", ["OPERATIONAL", "STOPPED", "PRE-OPERATIONAL"])
def test_nmt_commands_lead_where_they_say(pair: Pair, state: str) -> None:
    """As the next heartbeat shows."""
    _, node = pair
    node.sdo[0x1017].raw = 100
    node.nmt.state = state
    assert node.nmt.wait_for_heartbeat(0.5) == state


@pytest.mark.parametrize("command", ["RESET", "RESET COMMUNICATION"])
def test_a_reset_brings_a_boot_up(pair: Pair, command: str) -> None:
    """Within a second."""
    _, node = pair
    node.nmt.state = command
    node.nmt.wait_for_bootup(1)


def test_pdos_are_read_configured_and_exchanged(pair: Pair) -> None:
    """canopen maps objects, sends an RPDO, and gets a TPDO with each SYNC."""
    network, node = pair
    sent, received = node.rpdo[2], node.tpdo[1]
    for one in (sent, received):
        one.read()
        one.clear()
    sent.add_variable(0x2010, 10)
    sent.trans_type = 255
    received.add_variable(0x2010, 10)
    received.add_variable(0x2010, 4)
    received.trans_type = 1
    for one in (sent, received):
        one.enabled = True
        one.save()
    node.sdo.download(0x2010, 4, b"\x01\x02\x03")
    node.nmt.state = "OPERATIONAL"
    sent[0].raw = 0x42
    sent.transmit()
    network.run(10 * MS)
    network.sync.transmit()
    assert received.wait_for_reception(0.1)
    assert bytes(received.data) == b"\x42\x01\x02\x03"


def test_an_emcy_is_received(pair: Pair) -> None:
    """A short RPDO is 8210h."""
    network, node = pair
    node.rpdo.read()
    node.nmt.state = "OPERATIONAL"
    network.send_message(0x305, b"\x00")
    emcy = node.emcy.wait(timeout=0.2)
    assert (emcy.code, emcy.register & 1) == (0x8210, 1)


def test_errors_of_the_bench_come_and_go(pair: Pair) -> None:
    """An error that is raised and healed: active, then over."""
    network, node = pair
    device = network.device
    network.world.act(network.controller, lambda now: device.fail(frozenset({"encoder"}), now))
    assert node.emcy.wait(timeout=0.2).code == 0x7305
    assert [error.code for error in node.emcy.active] == [0x7305]
    network.world.act(network.controller, lambda now: device.fail(frozenset(), now))
    assert node.emcy.wait(timeout=0.2).code == 0
    assert node.emcy.active == []


def test_lss_finds_and_names_a_device(pair: Pair) -> None:
    """Selected by its identity it tells its node id, and takes another one."""
    network, node = pair
    lss = network.lss
    identity = [node.sdo[0x1018][sub].raw for sub in range(1, 5)]
    assert lss.send_switch_state_selective(*identity)
    assert lss.inquire_node_id() == 5
    lss.configure_node_id(9)
    lss.send_switch_state_global(lss.WAITING_STATE)
    node.nmt.state = "RESET COMMUNICATION"
    other = network.join(9)
    other.nmt.wait_for_bootup(1)
    assert other.sdo[0x1018][1].raw == 0x7E57


def test_lss_fast_scan_finds_a_device_without_a_node_id(pair: Pair) -> None:
    """Its whole identity; then it gets a node id and boots up."""
    network, node = pair
    lss = network.lss
    identity = [node.sdo[0x1018][sub].raw for sub in range(1, 5)]
    lss.send_switch_state_global(lss.CONFIGURATION_STATE)
    lss.configure_node_id(255)
    lss.send_switch_state_global(lss.WAITING_STATE)
    node.nmt.state = "RESET COMMUNICATION"
    network.run(1 * S)
    found, numbers = lss.fast_scan()
    assert (found, numbers) == (True, identity)
    lss.configure_node_id(7)
    other = network.join(7)
    lss.send_switch_state_global(lss.WAITING_STATE)
    other.nmt.wait_for_bootup(1)


def test_a_stopped_device_is_silent(pair: Pair) -> None:
    """SDO gets no answer, which canopen tells as a time-out."""
    _, node = pair
    node.nmt.state = "STOPPED"
    with pytest.raises(canopen.SdoCommunicationError):
        node.sdo.upload(0x1000, 0)
    node.nmt.state = "PRE-OPERATIONAL"
    assert node.sdo.upload(0x1000, 0)
