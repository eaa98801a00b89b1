"""The python-can port on `virtual` (marks own frames) and `udp_multicast` (does not)."""

from __future__ import annotations

import contextlib
import os
import secrets
import socket
from collections.abc import Iterator

import can
import pytest

from hil_tests.bus.pythoncan import PythonCanPort
from hil_tests.clock import MS, S
from hil_tests.errors import BenchError, BusUnavailable
from hil_tests.trace import BusEvent, EventKind, Sighting
from node_model.frame import Frame

GROUP = "239.74.163.2"


def free_port() -> int:
    """A UDP port that nobody uses."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("", 0))
        return int(probe.getsockname()[1])


def has_multicast() -> bool:
    """Whether this machine delivers multicast to itself."""
    try:
        with can.Bus(GROUP, interface="udp_multicast", port=free_port()) as bus:
            bus.send(can.Message(arbitration_id=1))
            return bus.recv(0.2) is not None
    except (can.CanError, OSError):
        return False


Pair = tuple[PythonCanPort, can.BusABC]


@pytest.fixture(params=["virtual", "udp_multicast"])
def pair(request: pytest.FixtureRequest) -> Iterator[Pair]:
    """A port, and a stranger on the same bus."""
    if request.param == "virtual":
        channel = secrets.token_hex(4)
        stranger = can.Bus(channel, interface="virtual")
    else:
        if not has_multicast():
            pytest.skip("this machine delivers no multicast to itself")
        number = free_port()
        channel = f"{GROUP}:{number}"
        stranger = can.Bus(GROUP, interface="udp_multicast", port=number)
    with contextlib.closing(PythonCanPort(request.param, channel)) as port, stranger:
        yield port, stranger


def message(frame: Frame) -> can.Message:
    """The stranger's message for a frame."""
    return can.Message(
        arbitration_id=frame.can_id,
        data=None if frame.remote else frame.data,
        dlc=frame.dlc,
        is_remote_frame=frame.remote,
        is_extended_id=frame.extended,
    )


def take(port: PythonCanPort) -> Sighting | BusEvent:
    """The next thing; it must come."""
    found = port.next(port.now() + 10 * S)
    assert found is not None
    return found


FRAMES = [
    Frame(0x705, b"\x05"),
    Frame(0x7FF, bytes(8)),
    Frame(0x705, remote=True, dlc=1),
    Frame(0x1FFFFFFF, b"ab", extended=True),
]


@pytest.mark.parametrize("frame", FRAMES, ids=str)
def test_own_frame_comes_back_marked(frame: Frame, pair: Pair) -> None:
    """What was sent is seen once, as own, and the stranger gets it unchanged."""
    port, stranger = pair
    port.send(frame)
    seen = take(port)

    assert isinstance(seen, Sighting)
    assert (seen.frame, seen.own) == (frame, True)
    assert port.next(0) is None
    got = stranger.recv(10)
    assert got is not None
    assert bytes(got.data) == frame.data
    assert got.dlc == frame.dlc


@pytest.mark.parametrize("frame", FRAMES, ids=str)
def test_equal_frame_of_a_stranger_is_not_own(frame: Frame, pair: Pair) -> None:
    """Equal frames of two senders are told apart, and keep their order."""
    port, stranger = pair
    stranger.send(message(frame))
    port.send(frame)
    stranger.send(message(frame))
    seen = [take(port) for _ in range(3)]

    assert all(isinstance(item, Sighting) and item.frame == frame for item in seen)
    assert [item.own for item in seen if isinstance(item, Sighting)] == [False, True, False]


def test_stamps_are_of_the_ports_clock(pair: Pair) -> None:
    """A stamp lies between the instants before and after, to the resolution of a float."""
    port, _ = pair
    began = port.now()
    port.send(Frame(1))
    seen = take(port)

    assert began - 1000 <= seen.at <= port.now() + 1000


def test_descriptor_ends_the_wait(pair: Pair) -> None:
    """Something readable beside the bus ends `next` at once."""
    port, _ = pair
    reader, writer = os.pipe()
    os.write(writer, b"x")

    assert port.next(port.now() + 3600 * S, [reader]) is None
    os.close(reader)
    os.close(writer)


def test_frame_wins_over_the_descriptor(pair: Pair) -> None:
    """What has arrived is handed out first."""
    port, stranger = pair
    stranger.send(message(Frame(5)))
    reader, writer = os.pipe()
    os.write(writer, b"x")

    assert take(port) is not None
    os.close(reader)
    os.close(writer)


def test_what_is_no_classical_frame_is_an_event(pair: Pair) -> None:
    """CAN FD and error frames are told, not judged."""
    port, stranger = pair
    stranger.send(can.Message(arbitration_id=0x22, is_fd=True, data=bytes(12)))
    stranger.send(can.Message(is_error_frame=True))
    kinds = [item.kind for item in (take(port), take(port)) if isinstance(item, BusEvent)]

    assert kinds == [EventKind.FD_FRAME, EventKind.ERROR]


def test_long_length_code_is_refused(pair: Pair) -> None:
    """python-can cannot send a DLC above 8; better told than changed."""
    port, _ = pair
    with pytest.raises(BenchError, match="DLC 12"):
        port.send(Frame(1, bytes(8), dlc=12))


def test_simulated_wire_takes_any_bit_rate(pair: Pair) -> None:
    """There is none, so setting it changes nothing."""
    port, _ = pair
    port.set_bit_rate(500_000)
    port.send(Frame(1))

    assert isinstance(take(port), Sighting)


def test_closed_port_says_so(pair: Pair) -> None:
    """Closing twice is allowed, using it afterwards is not."""
    port, _ = pair
    port.close()
    port.close()

    with pytest.raises(BusUnavailable, match="was closed"):
        port.next(0)
    with pytest.raises(BusUnavailable, match="was closed"):
        port.send(Frame(1))


def test_datagram_that_is_no_frame_is_an_event() -> None:
    """Anybody may send to a multicast group; that ends no run."""
    if not has_multicast():
        pytest.skip("this machine delivers no multicast to itself")
    number = free_port()
    with (
        contextlib.closing(PythonCanPort("udp_multicast", f"{GROUP}:{number}")) as port,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger,
    ):
        stranger.sendto(b"no frame", (GROUP, number))
        event = take(port)
        port.send(Frame(1))

        assert isinstance(event, BusEvent)
        assert event.kind is EventKind.ERROR
        assert isinstance(take(port), Sighting)


def test_another_group_on_the_same_port_is_not_heard() -> None:
    """Linux hands a port's sockets the frames of every group: those of others are no evidence."""
    if not has_multicast():
        pytest.skip("this machine delivers no multicast to itself")
    number = free_port()
    elsewhere = can.Bus("239.74.163.3", interface="udp_multicast", port=number)
    here = can.Bus(GROUP, interface="udp_multicast", port=number)
    with (
        contextlib.closing(PythonCanPort("udp_multicast", f"{GROUP}:{number}")) as port,
        elsewhere,
        here,
    ):
        elsewhere.send(message(Frame(1)))
        here.send(message(Frame(2)))

        heard = take(port)
        assert isinstance(heard, Sighting)
        assert heard.frame == Frame(2)


def test_second_port_on_a_channel_is_refused(pair: Pair) -> None:
    """One tester at a time, on every interface type."""
    port, _ = pair
    channel, interface = port.name[:-1].split(" (")
    with pytest.raises(BusUnavailable, match="in use by another run"):
        PythonCanPort(interface, channel)


def test_wait_ends_at_its_instant(pair: Pair) -> None:
    """Nothing comes: None, and not before the instant."""
    port, _ = pair
    until = port.now() + 10 * MS

    assert port.next(until) is None
    assert port.now() >= until


@pytest.fixture
def quiet() -> Iterator[Pair]:
    """A port on an adapter that never shows its own frames."""
    channel = secrets.token_hex(4)
    with (
        contextlib.closing(PythonCanPort("virtual", channel)) as port,
        can.Bus(channel, interface="virtual") as stranger,
    ):
        port._bus.receive_own_messages = False  # type: ignore[attr-defined]
        port._echoes = False
        yield port, stranger


def test_frame_that_is_never_echoed_is_reported_with_its_doubt(quiet: Pair) -> None:
    """It ended between the call and a little after the hand-over; it comes before its effect."""
    port, stranger = quiet
    began = port.now()
    port.send(Frame(0x123, b"a"))
    ended = port.now()
    stranger.send(message(Frame(0x124)))
    own, effect = take(port), take(port)

    assert isinstance(own, Sighting)
    assert own.own
    assert own.at - own.doubt_ns >= began
    assert ended <= own.at <= ended + 5 * MS
    assert isinstance(effect, Sighting)
    assert not effect.own


def test_adapters_own_clock_is_followed(quiet: Pair) -> None:
    """Stamps that count from the adapter's start keep their spacing."""
    port, stranger = quiet
    port.timed = True
    stranger.preserve_timestamps = True  # type: ignore[attr-defined]
    for stamp in (5.0, 4.75):  # the second one took longer to arrive
        later = message(Frame(1))
        later.timestamp = stamp
        stranger.send(later)
    first, second = take(port), take(port)

    assert second.at - first.at == -S // 4
    assert abs(first.at - port.now()) < 10 * S


def test_adapter_that_stops_is_an_event_then_an_error(quiet: Pair) -> None:
    """Told once, and by every verb after that."""
    port, _ = quiet
    port._bus.shutdown()
    event = take(port)

    assert isinstance(event, BusEvent)
    assert event.kind is EventKind.DOWN
    with pytest.raises(BusUnavailable, match="check the adapter"):
        port.next(0)


def test_adapter_that_does_not_send_is_an_error(quiet: Pair) -> None:
    """With what to look at."""
    port, _ = quiet
    port._bus.shutdown()

    with pytest.raises(BusUnavailable, match="does not send"):
        port.send(Frame(1))


def test_bit_rate_of_an_adapter_is_set_by_opening_it_again(quiet: Pair) -> None:
    """python-can has no other way."""
    port, _ = quiet
    port.timed = True
    before = port._bus
    port.set_bit_rate(250_000)

    assert port._bus is not before


def test_step_of_the_clock_is_a_gap(quiet: Pair) -> None:
    """Intervals across it mean nothing."""
    port, _ = quiet
    port._steps._offset -= 5 * S
    event = take(port)

    assert isinstance(event, BusEvent)
    assert event.kind is EventKind.GAP
    assert "clock was set by" in event.text
