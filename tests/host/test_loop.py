"""The laws of the loop: order of time, lateness told, deaf and mute at another bit rate."""

from __future__ import annotations

import pytest

from node_model.frame import Frame
from node_model.host.loop import LATE_NS, RETRY_NS, Loop
from node_model.node import MS, S
from tests.host.fakes import PERIOD_NS, Clock, FakePanel, FakeWire

ASK = Frame(0x123, b"x")


class Bench:
    """A loop with its fakes, switched on."""

    def __init__(self) -> None:
        self.clock = Clock()
        self.wire = FakeWire(self.clock)
        self.node = FakePanel()
        self.loop = Loop(self.node, self.wire, self.clock)
        self.start = self.clock.now
        self.loop.power(True, self.loop.instant())

    def hear(self, after_ns: int, frame: Frame = ASK) -> None:
        """A frame that ends `after_ns` after power-on."""
        self.wire.incoming.append((frame, self.start + after_ns))

    def turn_at(self, after_ns: int) -> None:
        """The loop comes round that long after power-on."""
        self.clock.now = self.start + after_ns
        self.loop.catch_up()

    def told(self) -> list[tuple[str, int]]:
        """What the node was told, with spans from power-on in ms."""
        return [(verb, (at - self.start) // MS) for verb, at in self.node.log]


@pytest.fixture
def bench() -> Bench:
    """A loop with its fakes, switched on."""
    return Bench()


def test_stall_changes_nothing_but_the_sending() -> None:
    """A host that is stopped for a second tells the node the same as one that is not."""
    prompt, stopped = Bench(), Bench()
    for bench in (prompt, stopped):
        bench.hear(50 * MS)
        bench.hear(250 * MS)
        bench.hear(250 * MS + 1)
    for step in range(1, 1001):
        stop_at = step * MS
        due = [item for item in prompt.wire.incoming if item[1] <= prompt.start + stop_at]
        later = [item for item in prompt.wire.incoming if item not in due]
        prompt.wire.incoming.clear()
        prompt.wire.incoming.extend(due)
        prompt.turn_at(stop_at)
        prompt.wire.incoming.extend(later)
    stopped.turn_at(1000 * MS)

    assert stopped.told() == prompt.told()
    assert [frame for frame, _ in stopped.wire.sent] == [frame for frame, _ in prompt.wire.sent]


def test_frames_and_deadlines_are_done_in_order_of_time(bench: Bench) -> None:
    """A frame waits for the deadlines before its stamp; at one instant these come first."""
    bench.hear(150 * MS)
    bench.hear(200 * MS)
    bench.turn_at(310 * MS)

    assert bench.told() == [
        ("power_on", 0),
        ("advance", 100),
        ("receive 123#78", 150),
        ("advance", 200),
        ("receive 123#78", 200),
        ("advance", 300),
    ]


def test_time_never_goes_back(bench: Bench) -> None:
    """A stamp before the node's time (two processors) counts as the node's time."""
    bench.hear(150 * MS)
    bench.hear(150 * MS - 700)
    bench.turn_at(160 * MS)

    assert [at for verb, at in bench.told() if verb.startswith("receive")] == [150, 150]


def test_node_is_never_called_before_its_deadline(bench: Bench) -> None:
    """Turning idly tells the node nothing."""
    for step in range(99):
        bench.turn_at(step * MS)

    assert bench.told() == [("power_on", 0)]


def test_late_frames_are_told_with_due_and_sent(bench: Bench) -> None:
    """Due is the deadline, or the stamp of the frame that caused it."""
    bench.hear(120 * MS)
    bench.turn_at(200 * MS + LATE_NS + 1)
    start = bench.start
    sent = start + 200 * MS + LATE_NS + 1

    assert list(bench.loop.late) == [
        (start + 100 * MS, sent),
        (start + 120 * MS, sent),
        (start + 200 * MS, sent),
    ]


def test_prompt_frames_are_not_late(bench: Bench) -> None:
    """Up to half a millisecond is the usual cost of a turn."""
    bench.turn_at(PERIOD_NS + LATE_NS)

    assert not bench.loop.late


def test_lateness_is_read_after_the_send(bench: Bench) -> None:
    """What sending itself takes counts, too."""
    bench.clock.takes_ns = LATE_NS + 1
    bench.turn_at(PERIOD_NS)

    ((due, sent),) = bench.loop.late
    assert sent - due > LATE_NS


def test_full_queue_is_tried_again_in_order(bench: Bench) -> None:
    """Nothing is lost, nothing overtakes, and the loop comes back soon."""
    bench.wire.sent.clear()
    bench.wire.full = 2
    bench.turn_at(PERIOD_NS)
    assert bench.loop.wake_at() == bench.clock.now + RETRY_NS
    bench.hear(PERIOD_NS + 1)
    bench.turn_at(PERIOD_NS + MS)

    assert [frame.can_id for frame, _ in bench.wire.sent] == [0x701, 0x124]


@pytest.mark.parametrize(("rate", "hears"), [(None, True), (125_000, True), (250_000, False)])
def test_node_at_another_bit_rate_is_deaf_and_mute(
    rate: int | None, hears: bool, bench: Bench
) -> None:
    """Without a word on the tester's rate it is taken to be the same."""
    bench.loop.tester_rate = rate
    bench.wire.sent.clear()
    bench.hear(50 * MS)
    bench.turn_at(PERIOD_NS)

    assert bool(bench.wire.sent) == hears
    assert any(verb.startswith("receive") for verb, _ in bench.told()) == hears


def test_node_without_power_is_deaf(bench: Bench) -> None:
    """A frame that comes while it is off is not kept for later."""
    bench.loop.power(False, bench.loop.instant())
    bench.hear(50 * MS)
    bench.turn_at(60 * MS)

    assert not any(verb.startswith("receive") for verb, _ in bench.told())


@pytest.mark.parametrize(
    ("frame", "heard"),
    [
        (Frame(0x123), True),
        (Frame(0x123, remote=True), True),
        (Frame(0x124), False),
        (Frame(0x123, extended=True), False),
    ],
)
def test_acceptance_filter_is_kept(frame: Frame, heard: bool, bench: Bench) -> None:
    """Only base frames with the identifiers that the node names get through."""
    bench.hear(MS, frame)
    bench.turn_at(2 * MS)

    assert any(verb.startswith("receive") for verb, _ in bench.told()) == heard


def test_open_filter_lets_everything_through(bench: Bench) -> None:
    """None stands for every frame of any kind."""
    bench.node.listens_to = None
    bench.hear(MS, Frame(0x77, extended=True))
    bench.turn_at(2 * MS)

    assert bench.told()[-1] == ("receive 00000077#", 1)


def test_full_bus_does_not_keep_the_loop(bench: Bench) -> None:
    """Frames that come faster than they are read do not starve the rest."""
    bench.clock.takes_ns = 0
    for number in range(100):
        bench.hear(10 * MS + number * MS)
    bench.turn_at(20 * MS)

    assert len(bench.wire.incoming) == 88


def test_stimulus_comes_after_everything_due_before_it(bench: Bench) -> None:
    """A key that moves now cannot be in a report that was due a moment ago."""
    bench.clock.now = bench.start + 250 * MS
    at = bench.loop.instant()
    bench.loop.hold(frozenset("a"), at)

    assert at == bench.clock.now
    assert bench.told()[1:] == [("advance", 100), ("advance", 200), ("hold ['a']", 250)]
    assert bench.loop.held == {"a"}


def test_idle_node_needs_no_waking() -> None:
    """Without power there is nothing to wait for but frames."""
    clock = Clock()
    loop = Loop(FakePanel(), FakeWire(clock), clock)

    assert loop.wake_at() is None
    loop.power(True, loop.instant())
    assert loop.wake_at() == clock.now + PERIOD_NS
    assert S > PERIOD_NS
