"""Whatever stops the suite or the host of a model, wherever: never a FAIL of a right device."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from contextlib import ExitStack

import pytest

from hil_tests.bench.keypad import KeypadBench
from hil_tests.bench.real import RealStage
from hil_tests.clock import MS, Interval, S
from hil_tests.config import Parameters, load_keypad
from hil_tests.judge import matchers
from hil_tests.judge.cobs import Nmt, State
from hil_tests.judge.verdict import DeviceFailure, InconclusiveResult, Outcome
from hil_tests.trace import BusEvent, Sighting
from node_model.frame import Frame

NODE = 5
PARAMETERS = Parameters(NODE, 2, 100, 0, 1)
BOOT_UP = Frame(0x705, b"\x00")


class SlowPort:
    """An untimed bus whose clock the test moves; frames come out when their time has come."""

    name = "slow (test)"
    timed = False
    clock = "the test's"
    doubt_ns = 0

    def __init__(self) -> None:
        self.time = 0
        self.plan: list[Sighting] = []
        self.on_idle: deque[Callable[[], None]] = deque()
        """Called when a reader has found nothing more: here the suite is stopped."""
        self.while_asking: deque[Callable[[], None]] = deque()
        """Called when a reader waits for an answer as well: here, too."""

    def now(self) -> int:
        """The present."""
        return self.time

    def frame(self, at: int, frame: Frame, *, own: bool = False) -> None:
        """A frame that ends at `at`."""
        self.plan.append(Sighting(frame, at, 0, own))
        self.plan.sort(key=lambda each: each.at)

    def beat(self, at: int, state: int = 0x7F) -> None:
        """A heartbeat."""
        self.frame(at, Frame(0x705, bytes((state,))))

    def send(self, frame: Frame) -> None:
        """Ours is on the bus at once."""
        self.frame(self.time, frame, own=True)

    def next(self, until: int, also: Sequence[int] = ()) -> Sighting | BusEvent | None:
        """Time passes."""
        if also and self.while_asking:
            self.while_asking.popleft()()
        if not self.plan or self.plan[0].at > max(until, self.time):
            self.time = max(until, self.time) if not also else self.time + MS
            if self.on_idle:
                self.on_idle.popleft()()
            return None
        self.time = max(self.time, self.plan[0].at)
        return self.plan.pop(0)

    def set_bit_rate(self, bit_rate: int) -> None:
        """There is none."""

    def close(self) -> None:
        """Nothing to close."""


class Reply:
    """An action that has its answer at an instant.

    Args:
        ready_at: when it comes.
        answer: what it is.
    """

    def __init__(self, ready_at: int, answer: Callable[[], object]) -> None:
        self.wake_at = ready_at
        self.descriptors: Sequence[int] = (0,)
        self._answer = answer

    def start(self, now: int) -> None:
        """Asked."""

    def poll(self, now: int) -> bool:
        """Whether it is there."""
        return now >= self.wake_at

    def result(self) -> object:
        """What it is."""
        return self._answer()


class Host:
    """A model's host that tells its lateness, and switches the supply.

    Args:
        port: the bus.
    """

    def __init__(self, port: SlowPort) -> None:
        self._port = port
        self.pairs: list[tuple[int, int]] = []
        self.answers_at = 0

    def late(self) -> Reply:
        """See HealthDriver."""
        return Reply(max(self._port.time, self.answers_at), self._told)

    def _told(self) -> list[tuple[int, int]]:
        told = [pair for pair in self.pairs if pair[1] <= self._port.time]
        self.pairs = [pair for pair in self.pairs if pair[1] > self._port.time]
        return told

    def switch(self, on: bool) -> Reply:  # noqa: ARG002  the verb of a driver
        """See PowerDriver: done 1 ms after it was asked for; `answers_at` = when we read it."""
        done = self._port.time + MS
        return Reply(max(done, self.answers_at), lambda: Interval(done, done))


@pytest.fixture
def port() -> SlowPort:
    """The bus."""
    return SlowPort()


@pytest.fixture
def host(port: SlowPort) -> Host:
    """The host of the device."""
    return Host(port)


@pytest.fixture
def bench(port: SlowPort, host: Host) -> KeypadBench:
    """A bench with a device that beats every 100 ms."""
    stage = RealStage(
        "test", port, 250_000, exclusive=True, writes_allowed=True, leave=ExitStack()
    )
    stage.power = host  # type: ignore[assignment]  # a Reply is an Action of anything
    stage.health = host  # type: ignore[assignment]
    made = KeypadBench(stage, load_keypad("keypad"), PARAMETERS)
    made.begin()
    return made


def failures(bench: KeypadBench) -> list[str]:
    """What the monitors hold against the device."""
    return [str(each) for each in bench.end() if each.outcome is Outcome.FAIL]


def test_stopped_between_reading_and_judging(bench: KeypadBench, port: SlowPort) -> None:
    """The suite reads all, sleeps for 500 ms and judges: beats of that time are not missing."""
    for number in range(1, 10):
        port.beat(number * 100 * MS)
    bench.wait(250 * MS)

    def sleep() -> None:
        port.time += 500 * MS

    port.on_idle.extend((sleep, sleep))
    assert failures(bench) == []


def test_real_silence_is_still_seen(bench: KeypadBench, port: SlowPort) -> None:
    """No beat for half a second, and nobody was stopped."""
    port.beat(100 * MS)
    bench.wait(600 * MS)
    (found,) = failures(bench)
    assert "no heartbeat for 500 ms" in found


def test_answer_and_frame_wait_together(bench: KeypadBench, port: SlowPort, host: Host) -> None:
    """Stopped while the supply is switched: the boot-up is not taken to come before it."""
    host.answers_at = 300 * MS
    port.frame(51 * MS, BOOT_UP)
    port.beat(151 * MS)
    port.beat(251 * MS)
    port.while_asking.append(lambda: setattr(port, "time", 300 * MS))
    assert bench.power is not None
    on = bench.power.on()
    bench.expect(matchers.boot_up(NODE), after=on, within=S)
    assert failures(bench) == []
    entries = list(bench.trace.entries())
    assert entries[0] is on


def test_boot_up_while_the_answer_is_awaited(
    bench: KeypadBench, port: SlowPort, host: Host
) -> None:
    """A slow relay says "done" long after the contact closed: the device has booted by then."""
    host.answers_at = 300 * MS
    port.frame(51 * MS, BOOT_UP)
    port.beat(151 * MS)
    port.beat(251 * MS)
    assert bench.power is not None
    on = bench.power.on()
    boot = bench.expect(matchers.boot_up(NODE), after=on, within=S)
    bench.expect(matchers.heartbeat(NODE), after=boot, within=S)
    assert failures(bench) == []
    entries = list(bench.trace.entries())
    assert entries[0] is on
    assert len(entries) == 4


def test_state_shown_by_a_beat_kept_back(bench: KeypadBench, port: SlowPort, host: Host) -> None:
    """Stopped from 190 to 380 ms: the beat of 200 ms, before the command, shows the old state."""
    port.beat(100 * MS, 0x05)
    bench.wait(250 * MS)
    port.beat(380 * MS, 0x05)
    port.beat(381 * MS, 0x04)
    port.beat(400 * MS, 0x04)
    host.pairs = [(200 * MS, 380 * MS), (300 * MS, 381 * MS)]
    sent = bench.nmt(Nmt.STOP)
    assert sent.at == 250 * MS
    assert bench.shown_state(sent) is State.STOPPED


def test_state_shown_by_beats_that_may_all_be_older(
    bench: KeypadBench, port: SlowPort, host: Host
) -> None:
    """A key frame was kept back with them, and nobody knows which was due when: no FAIL."""
    port.beat(200 * MS, 0x05)
    bench.wait(250 * MS)
    port.frame(418 * MS, Frame(0x185, b"\0"))
    port.beat(419 * MS, 0x04)
    port.beat(420 * MS, 0x04)
    port.beat(500 * MS, 0x04)
    host.pairs = [(250 * MS, 418 * MS), (300 * MS, 419 * MS), (400 * MS, 420 * MS)]
    sent = bench.nmt(Nmt.STOP)
    with pytest.raises(InconclusiveResult) as caught:
        bench.shown_state(sent)
    assert caught.value.verdict.measured == (80 * MS, 200 * MS)


def test_row_of_a_stopped_host(bench: KeypadBench, port: SlowPort, host: Host) -> None:
    """A beat that stays away for longer than the patience is waited for if the host slept."""
    port.beat(100 * MS)
    port.beat(900 * MS)
    host.answers_at = 900 * MS
    host.pairs.append((200 * MS, 900 * MS))
    beats = bench.beats(matchers.heartbeat(NODE), 2, after=0, patience_ns=300 * MS)
    assert [beat.at // MS for beat in beats] == [100, 900]
    assert bench.when(beats[1]) == (200 * MS, 900 * MS)


def test_collected_is_also_what_was_kept_back(
    bench: KeypadBench, port: SlowPort, host: Host
) -> None:
    """A frame that was due before the end of the span belongs to it, one due later does not."""
    port.beat(100 * MS)
    port.beat(400 * MS)
    port.beat(401 * MS)
    host.answers_at = 402 * MS
    host.pairs.append((200 * MS, 400 * MS))
    bench.wait(250 * MS)
    found = bench.collect(matchers.heartbeat(NODE), after=0, until=bench.now())
    assert [seen.at // MS for seen in found][:2] == [100, 400]
    port.beat(500 * MS)
    bench.wait_until(600 * MS)
    found = bench.collect(matchers.heartbeat(NODE), after=0, until=450 * MS)
    assert [seen.at // MS for seen in found] == [100, 400, 401]


def test_first_waits_for_what_was_kept_back(
    bench: KeypadBench, port: SlowPort, host: Host
) -> None:
    """Due at 90 ms, sent at 300: it is the first before 100 ms; one due at 200 ms is not."""
    port.frame(300 * MS, BOOT_UP)
    host.answers_at = 300 * MS
    host.pairs.append((90 * MS, 300 * MS))
    found = bench.first(matchers.boot_up(NODE), 0, 100 * MS)
    assert found is not None
    port.frame(700 * MS, BOOT_UP)
    host.answers_at = 700 * MS
    host.pairs.append((600 * MS, 700 * MS))
    assert bench.first(matchers.boot_up(NODE), 400 * MS, 500 * MS) is None


def test_missing_is_said_of_what_is_known(bench: KeypadBench, port: SlowPort, host: Host) -> None:
    """A frame that nobody sent is missing; one that the host kept back comes too late at most."""
    with pytest.raises(DeviceFailure):
        bench.expect(matchers.boot_up(NODE), after=0, within=100 * MS)
    after = Interval(port.time, port.time)
    port.frame(port.time + 450 * MS, BOOT_UP)
    host.answers_at = port.time + 450 * MS
    host.pairs.append((port.time + 50 * MS, port.time + 450 * MS))
    with pytest.raises(Exception, match="boot-up") as caught:
        bench.expect(matchers.boot_up(NODE), after=after, within=100 * MS)
    assert not isinstance(caught.value, DeviceFailure)


def test_health_is_asked_again_where_frames_came_meanwhile(
    bench: KeypadBench, port: SlowPort, host: Host
) -> None:
    """A late frame right behind the host's answer is known to be late."""
    port.beat(100 * MS)
    bench.wait(120 * MS)
    port.beat(320 * MS)
    host.pairs.append((200 * MS, 320 * MS))
    told = host.late

    def late() -> Reply:
        reply = told()
        port.time = 320 * MS
        host.late = told  # type: ignore[method-assign]
        return Reply(reply.wake_at, list)

    host.late = late  # type: ignore[method-assign]
    bench.settle()
    assert [seen.at for seen in bench.frames_seen()] == [100 * MS, 320 * MS]
    assert len(bench.lateness) == 1


def test_a_frame_is_judged_when_its_host_has_told(
    bench: KeypadBench, port: SlowPort, host: Host
) -> None:
    """`when` asks for the lateness with a frame that is newer than the last answer."""
    port.beat(400 * MS)
    host.pairs.append((100 * MS, 400 * MS))
    seen = bench.first(matchers.heartbeat(NODE), 0, 500 * MS)
    assert seen is not None
    assert bench.when(seen) == (100 * MS, 400 * MS)
