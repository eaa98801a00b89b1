"""canopen's clients and our hosted drive in real time, over UDP multicast: two processes."""

from __future__ import annotations

import contextlib
import socket
import subprocess
import sys
from collections.abc import Iterator

import canopen
import pytest
from canopen.sdo.exceptions import SdoAbortedError

pytestmark = pytest.mark.slow

GROUP = "239.74.163.9"
EDS = "node_model/profiles/drive.eds"
NODE = 5
DOMAIN = 0x2000


def free_port() -> int:
    """A port that nobody has now."""
    with contextlib.closing(socket.socket(socket.AF_INET, socket.SOCK_DGRAM)) as probe:
        probe.bind(("", 0))
        return int(probe.getsockname()[1])


@pytest.fixture(scope="module")
def network() -> Iterator[canopen.Network]:
    """A network on a bus of its own with the hosted drive, which is powered at once."""
    port = free_port()
    command = [sys.executable, "-m", "node_model", "--profile", "drive", "--leash"]
    command += ["--interface", "udp_multicast", "--channel", f"{GROUP}:{port}"]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        assert process.stdout is not None
        assert process.stdout.readline().startswith(b"ready")
        network = canopen.Network()
        network.NOTIFIER_CYCLE = 0.01  # a disconnect lasts as long
        network.connect(interface="udp_multicast", channel=GROUP, port=port)
        try:
            yield network
        finally:
            network.disconnect()
            process.terminate()
            process.wait(5)


@pytest.fixture(scope="module")
def node(network: canopen.Network) -> canopen.RemoteNode:
    """The drive, which is heard."""
    node = network.add_node(NODE, EDS)
    node.sdo.RESPONSE_TIMEOUT = 2.0  # the computer may be busy
    node.nmt.wait_for_heartbeat(3)
    return node


def test_expedited_and_segmented_transfers(node: canopen.RemoteNode) -> None:
    """Numbers and a name."""
    node.sdo[0x1017].raw = 200
    assert node.sdo[0x1017].raw == 200
    assert node.sdo[0x1008].raw == "nodeproof drive"
    with pytest.raises(SdoAbortedError, match="0x06020000"):
        node.sdo.upload(0x5FFF, 0)


def test_block_transfers(node: canopen.RemoteNode) -> None:
    """64 KiB there and back, byte for byte."""
    data = bytes(step * 31 + (step >> 8) & 0xFF for step in range(1 << 16))
    with node.sdo.open(DOMAIN, 0, "wb", size=len(data), block_transfer=True) as file:
        file.write(data)
    with node.sdo.open(DOMAIN, 0, "rb", block_transfer=True) as file:
        assert file.read() == data


def test_nmt_pdo_sync_and_emcy(network: canopen.Network, node: canopen.RemoteNode) -> None:
    """Started, the drive answers a SYNC with its TPDO and a short RPDO with an EMCY."""
    node.nmt.state = "OPERATIONAL"
    assert node.nmt.wait_for_heartbeat(2) == "OPERATIONAL"
    node.tpdo.read()
    received: list[bytes] = []
    node.tpdo[1].add_callback(lambda pdo: received.append(bytes(pdo.data)))
    for _ in range(3):
        network.sync.transmit()
        node.tpdo[1].wait_for_reception(2)
    assert received
    assert len(received[0]) == 6
    node.rpdo.read()
    network.send_message(0x300 + NODE, b"\x00")
    node.sdo.upload(0x1000, 0)  # an answer that comes later than the EMCY
    assert 0x8210 in [error.code for error in node.emcy.log]


def test_lss_selects_it(network: canopen.Network, node: canopen.RemoteNode) -> None:
    """By its identity; it tells its node id."""
    identity = [node.sdo[0x1018][sub].raw for sub in range(1, 5)]
    network.lss.RESPONSE_TIMEOUT = 2.0
    # Three of its four requests are not answered, and canopen waits for an answer to none.
    assert network.lss.send_switch_state_selective(*identity)
    assert network.lss.inquire_node_id() == NODE
    network.lss.send_switch_state_global(network.lss.WAITING_STATE)
