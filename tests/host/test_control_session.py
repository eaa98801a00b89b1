"""Lines, sessions and addresses of the control server."""

from __future__ import annotations

import contextlib
import json
import socket
from pathlib import Path

import pytest

from node_model.host.control import listen
from node_model.host.jsonline import LINE_LIMIT
from tests.host.lab import Lab


@pytest.mark.parametrize("ident", [7, "seven", 1.5, None, True, -1])
def test_id_is_repeated(ident: object, lab: Lab) -> None:
    """Whatever simple value it is."""
    lab.send(json.dumps({"id": ident, "do": "state"}).encode() + b"\n")

    assert lab.answers()[0]["id"] == ident


def test_several_requests_in_one_packet_and_one_in_several(lab: Lab) -> None:
    """A stream has no packets."""
    lines = b"".join(b'{"id": %d, "do": "state"}\r\n' % number for number in range(50))
    lab.send(lines)
    assert [answer["id"] for answer in lab.answers()] == list(range(50))
    for byte in lines:
        lab.send(bytes([byte]))

    assert [answer["id"] for answer in lab.answers()] == list(range(50))


def test_longest_line_is_still_taken(lab: Lab) -> None:
    """64 KiB are allowed, line feed not counted."""
    line = b'{"id": 3, "do": "state", "x": "'
    line += b"x" * (LINE_LIMIT - len(line) - 2) + b'"}'
    assert len(line) == LINE_LIMIT
    lab.send(line + b"\n")

    assert lab.answers()[0]["ok"] is True


def test_bye_ends_the_session_and_the_next_client_is_served(lab: Lab) -> None:
    """What the first one did stays; the second waited in the queue."""
    lab.ask(do="power", on=True)
    second = lab.join()
    lab.turn()
    assert lab.ask(do="bye") == {"id": 1, "ok": True}
    assert lab.client.recv(10) == b""
    lab.client.close()
    lab.client = second
    lab.turn()

    assert lab.ask(do="state")["power"] is True


def test_client_that_vanishes_in_a_sequence_stops_it(lab: Lab) -> None:
    """The next client finds a server with nothing to do."""
    lab.send(b'{"id": 1, "do": "keys", "sequence": [[0, ["a"]], [500, []]]}\n')
    lab.client.close()
    lab.turn()
    assert lab.loop.job is None
    lab.client = lab.join()
    lab.turn()

    assert lab.ask(do="state")["held"] == ["a"]


def test_client_that_does_not_read_is_held_back(lab: Lab) -> None:
    """Its answers are not piled up: requests wait until it reads, and none is lost."""
    count = 6000
    lines = b"".join(b'{"id": %d, "do": "state"}\n' % number for number in range(count))
    view, seen = memoryview(lines), 0
    while seen < count:
        with contextlib.suppress(BlockingIOError):
            view = view[lab.client.send(view) :] if view else view
        for _ in range(3):
            lab.turn()
        for answer in lab.answers():
            assert answer["id"] == seen
            seen += 1


@pytest.mark.parametrize("address", ["tcp", "tcp:5555", "tcp:host:port", "udp:a:1", "unix:", ""])
def test_strange_address_is_refused(address: str) -> None:
    """The message shows both forms."""
    with pytest.raises(ValueError, match="tcp:HOST:PORT or unix:PATH"):
        listen(address)


def test_tcp_port_0_is_replaced_by_the_real_one() -> None:
    """The ready line must name an address that can be connected to."""
    server, address = listen("tcp:127.0.0.1:0")
    with server, socket.create_connection(("127.0.0.1", int(address.rsplit(":", 1)[1]))):
        assert address.startswith("tcp:127.0.0.1:")


def test_stale_socket_file_is_replaced(tmp_path: Path) -> None:
    """A server that was killed leaves its file; one that lives keeps it."""
    server, address = listen(f"unix:{tmp_path}/s")
    with pytest.raises(OSError, match="in use"):
        listen(address)
    server.close()
    again, _ = listen(address)
    again.close()


def test_closed_server_leaves_no_file(lab: Lab, tmp_path: Path) -> None:
    """The socket file goes with it."""
    lab.server.close()

    assert not (tmp_path / "control").exists()
