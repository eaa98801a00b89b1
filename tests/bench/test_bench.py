"""Bringing the device where a test starts from, within what the user allows; and back home."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from itertools import pairwise
from typing import Any

import attrs
import pytest

from hil_tests.bench.keypad import KeypadBench, payload
from hil_tests.bench.virtual import VirtualStage
from hil_tests.clock import MS, S
from hil_tests.config import Parameters
from hil_tests.errors import BenchError
from hil_tests.explore.lab import Lab
from hil_tests.judge.cobs import Nmt, State
from hil_tests.judge.verdict import DeviceFailure, NotRun
from hil_tests.trace import Sighting
from node_model import devices
from node_model.frame import Frame
from tests.bench.fakes import HOME, PROFILE, FakePort, FakeStage, bench_of

OTHER = attrs.evolve(HOME, node_id=7, heartbeat_ms=500)


class Device(FakePort):
    """A port with a device that echoes its parameters and boots; or does not."""

    def __init__(self, *, echoes: bool = True) -> None:
        super().__init__()
        self.echoes = echoes

    def send(self, frame: Frame) -> None:
        """Answer 4F8h with 3F8h, reset node with a boot-up."""
        super().send(frame)
        if frame.can_id == 0x4F8 and self.echoes:
            self.plays(Frame(0x3F8, frame.data), self.at + 100 * MS)
        if frame.can_id == 0 and frame.data[0] == Nmt.RESET_NODE:
            self.plays(Frame(0x700 + frame.data[1], b"\x00"), self.at + 10 * MS)


def test_the_payload_is_the_six_bytes_of_the_source() -> None:
    """Node id, code, heartbeat big-endian, sync time, debounce."""
    assert payload(Parameters(5, 2, 1000, 0, 3)) == bytes.fromhex("050203E80003")


def test_fresh_is_without_power_and_without_keys() -> None:
    """Keys are let go, the supply is switched off; nothing is commissioned needlessly."""
    bench, stage = bench_of()
    bench.begin()
    assert bench.keys is not None
    bench.keys.hold("k3")
    assert bench.fresh() == HOME
    assert stage.asked == ["keys k3", "keys -", "power off"]


def test_what_is_not_needed_is_not_preferred_where_it_is_not_allowed() -> None:
    """A preference costs nothing: without the permission to write the test runs as it is."""
    bench, stage = bench_of(writes_allowed=False)
    bench.begin()
    assert bench.fresh({"heartbeat_ms": 100}) == HOME
    assert stage.port.sent == []


def test_what_is_needed_wins_over_what_is_preferred() -> None:
    """A test of a long debounce time is not run with a short one because that is quicker."""
    bench = Lab().bench
    bench.begin_example()
    found = bench.fresh({"debounce": 1, "heartbeat_ms": 100}, debounce=5)
    assert (found.debounce, found.heartbeat_ms) == (5, 100)
    assert bench.fresh({"debounce": 1}).debounce == 1


@pytest.mark.parametrize(
    ("options", "reason"),
    [
        ({"writes_allowed": False}, "allow it with --can-allow-writes"),
        ({"without": ["power"]}, "bench 'desk' has no Power to commission with; add [power]"),
        (
            {"without": ["power", "keys"]},
            "has no Power and no Keys to commission with; add [power] and [keys]",
        ),
        ({"without": ["keys"], "writes_allowed": False}, "has no Keys"),
    ],
)
def test_why_a_bench_does_not_commission(options: dict[str, Any], reason: str) -> None:
    """The reason says what the test needs, and what to allow or to add; nothing was sent."""
    bench, stage = bench_of(**options)
    bench.begin()
    with pytest.raises(NotRun, match="the test needs debounce 5: ") as caught:
        bench.fresh(debounce=5)
    assert reason in str(caught.value)
    with pytest.raises(NotRun, match="commissioning"):
        bench.enter_commissioning()
    assert stage.port.sent == []


def test_what_is_not_known_must_be_commissioned_first() -> None:
    """Without [device] parameters a test that needs them is not run, and says why."""
    bench, _ = bench_of(parameters=None, writes_allowed=False)
    bench.begin()
    with pytest.raises(NotRun, match="what the device is commissioned to is not known"):
        bench.fresh()


def test_commissioning_is_the_whole_procedure() -> None:
    """Off, keys, 125 kbit/s, on, request, echo, time to store, off, keys released, bit rate."""
    port = Device()
    bench, stage = bench_of(port)
    bench.begin()
    bench.commission(OTHER)
    assert stage.asked == [
        "power off",
        "keys aut on_off",
        "bitrate 125000",
        "power on",
        "power off",
        "keys -",
        "bitrate 250000",
    ]
    assert port.sent == [Frame(0x4F8, payload(OTHER))]
    assert bench.parameters == OTHER


def test_a_device_that_does_not_echo_leaves_its_parameters_unknown() -> None:
    """After a failed commissioning nothing is assumed, and the next test commissions again."""
    port = Device(echoes=False)
    bench, _ = bench_of(port)
    bench.begin()
    with pytest.raises(DeviceFailure):
        bench.fresh(node_id=7)
    assert bench.parameters is None
    port.echoes = True
    bench.begin()
    assert bench.fresh() == HOME
    assert port.sent[-1] == Frame(0x4F8, payload(HOME))


def test_going_home_restores_and_reads_back() -> None:
    """What a test has changed is commissioned back, and seen in the boot-up."""
    port = Device()
    bench, stage = bench_of(port)
    bench.begin()
    bench.commission(OTHER)
    stage.asked.clear()
    port.sent.clear()
    bench.begin()

    def boots() -> None:
        port.plays("701#00", port.at + 5 * MS)

    power = bench.power
    assert power is not None
    switch = stage.switch

    def switched(on: bool) -> object:
        action = switch(on)
        if on and len(port.sent) == 1:
            boots()
        return action

    stage.switch = switched  # type: ignore[method-assign, assignment]
    bench.go_home()
    assert port.sent == [Frame(0x4F8, payload(HOME))]
    assert bench.parameters == HOME
    assert stage.asked[-1] == "power on"


def test_a_device_that_does_not_come_home_is_told() -> None:
    """No boot-up after the parameters were put back is an error that reaches the user."""
    port = Device()
    bench, _ = bench_of(port)
    bench.begin()
    bench.commission(OTHER)
    bench.begin()
    with pytest.raises(DeviceFailure, match="boot-up of node 1"):
        bench.go_home()


@pytest.mark.parametrize("parameters", [HOME, None])
def test_who_is_at_home_does_not_move(parameters: Parameters | None) -> None:
    """Nothing is done where nothing was changed, or nothing was ever known."""
    bench, stage = bench_of(parameters=parameters)
    bench.begin()
    bench.go_home()
    assert stage.asked == []
    assert stage.port.sent == []


def test_another_bit_rate_needs_somebody_to_set_it() -> None:
    """Without [bitrate] a test at another rate is not run, and says what to add."""
    bench, _ = bench_of(without=["bitrate"])
    bench.begin()
    with pytest.raises(NotRun, match=r"the bus at 250000; bench 'desk' has no \[bitrate\]"):
        bench.enter_commissioning()


def test_without_power_a_start_is_a_reset() -> None:
    """Where nobody can switch the supply, "reset node" brings the boot-up."""
    port = Device()
    bench, stage = bench_of(port, without=["power"])
    bench.begin()
    boot = bench.start()
    assert str(boot.frame) == "701#00"
    assert [str(frame) for frame in port.sent] == ["000#8101"]
    assert stage.asked == []


@pytest.mark.parametrize(
    ("need", "reason"),
    [
        (lambda bench: bench.needs_timed_wire("bits"), "fake0 is an untimed wire: bits"),
        (lambda bench: bench.needs_load([Frame(1)], 5), "cannot load the bus to a known share"),
        (lambda bench: bench.needs_error_frames(), "cannot put error frames on the bus"),
        (lambda bench: bench.needs_exclusive(), "say exclusive = true in [bus]"),
        (lambda bench: bench.needs_writes("it stores"), "it stores; allow it with --can-allow"),
    ],
)
def test_needs_say_why_a_test_is_not_run(need: object, reason: str) -> None:
    """Each need that the bench cannot fill names the bench and the remedy."""
    bench, stage = bench_of(writes_allowed=False)
    stage.exclusive = False
    with pytest.raises(NotRun) as caught:
        need(bench)  # type: ignore[operator]
    assert reason in str(caught.value)


def test_needs_that_are_filled_are_silent() -> None:
    """A bench that can do it all runs all."""
    bench, stage = bench_of(FakePort(timed=True))
    stage.loadable = True
    bench.needs_timed_wire("bits")
    bench.needs_load([Frame(1)], 5)
    bench.needs_error_frames()
    bench.needs_exclusive()
    bench.needs_writes("it stores")


def virtual(home: Parameters = HOME) -> KeypadBench:
    """A bench in virtual time."""
    stage = VirtualStage(devices.read("keypad", None))
    return KeypadBench(stage, PROFILE, home)


def test_in_virtual_time_every_start_can_be_had() -> None:
    """A fresh device has the parameters that were wished for, at once."""
    bench = virtual()
    bench.begin()
    boot = bench.start({"heartbeat_ms": 100}, node_id=9, bit_rate_code=1)
    assert str(boot.frame) == "709#00"
    assert bench.parameters is not None
    assert bench.parameters.heartbeat_ms == 100
    assert bench.stage.bit_rate == bench.parameters.bit_rate
    bench.fresh()
    assert bench.parameters == HOME


def test_operational_is_a_start_and_a_command() -> None:
    """The key frame tells that operational was entered."""
    bench = virtual()
    bench.begin()
    assert str(bench.operational().frame) == "181#00"
    assert bench.end() == []


def test_a_virtual_watch_sees_every_change_at_its_instant() -> None:
    """Light put on by a frame, blinking, put out by a reset: no instant is in doubt."""
    bench = virtual()
    bench.begin()
    bench.operational()
    assert bench.leds
    start = bench.now()
    for after_ms, frame in (
        (20, Frame(0x201, b"\1")),
        (30, Frame(0x301, b"\2")),
        (1600, Frame(0, b"\x81\0")),
    ):
        bench.at(start + after_ms * MS, partial(bench.post, frame))
    edges = bench.leds.watch(2 * S).edges
    assert all(when.earliest == when.latest for when, _, _ in edges)
    seen = [(led, lit, when.latest - start) for when, led, lit in edges]
    assert [(lit, at // (10 * MS)) for led, lit, at in seen if led == "on_off"] == [
        (True, 2),
        (False, 160),
    ]
    blinks = [at for led, _, at in seen if led == "aut"]
    assert {later - at for at, later in pairwise(blinks[1:-1])} == {500 * MS}


def test_virtual_commissioning_changes_the_device() -> None:
    """The whole procedure against the model: it starts with its new node id."""
    bench = virtual()
    bench.begin()
    bench.fresh()
    bench.commission(OTHER)
    assert str(bench.boot().frame) == "707#00"
    assert bench.end() == []


def test_a_request_leaves_the_parameters_unknown() -> None:
    """Who sends 4F8h by hand must say what came of it."""
    bench = virtual()
    bench.begin()
    bench.fresh()
    bench.enter_commissioning()
    bench.request(b"\x63" * 6)
    assert bench.parameters is None
    with pytest.raises(BenchError, match="not known"):
        _ = bench.node_id
    bench.leave_unknown(250_000)
    bench.wait(1 * S)
    assert bench.parameters is None


def test_fake_and_virtual_stages_are_stages() -> None:
    """What these tests stand on has the shape that benches ask for."""
    from hil_tests.bench.stage import Stage  # noqa: PLC0415

    stages: list[Stage] = [FakeStage(FakePort()), virtual().stage]
    assert len(stages) == 2


# Whom to blame.


def blamed(fault: str, act: Callable[[KeypadBench], object]) -> str:
    """The requirement on which a faulty keypad fails something."""
    stage = VirtualStage(devices.read("keypad", fault))
    bench = KeypadBench(stage, PROFILE, HOME)
    bench.begin()
    with pytest.raises(DeviceFailure) as failure:
        act(bench)
    return failure.value.verdict.requirement


@pytest.mark.parametrize(
    ("fault", "requirement"),
    [
        ("ignores-start", "NMT-04"),
        ("entry-frame-missing", "KEY-01"),
        ("entry-frame-late", "KEY-01"),
    ],
)
def test_who_is_not_operational_is_not_blamed_for_its_keys(fault: str, requirement: str) -> None:
    """A node that does not obey "start" owes no key frame; one that does owes it in time."""
    assert blamed(fault, KeypadBench.operational) == requirement


@pytest.mark.parametrize(
    ("fault", "requirement"),
    [("ignores-stop", "NMT-04"), ("heartbeat-shows-old-state", "HB-03")],
)
def test_a_state_that_is_shown_late_was_reached(fault: str, requirement: str) -> None:
    """Where the next heartbeat shows it the command was obeyed."""

    def stop(bench: KeypadBench) -> None:
        bench.start()
        sent = bench.nmt(Nmt.STOP)
        bench.expect_state(State.STOPPED, after=sent, requirement="NMT-04")

    assert blamed(fault, stop) == requirement


def test_a_device_is_judged_since_it_was_switched_on_once_it_is_recognised() -> None:
    """A second boot-up is found, though it came before anybody knew whose it was."""
    stage = VirtualStage(devices.read("keypad", "boot-up-twice"))
    bench = KeypadBench(stage, PROFILE, HOME)
    bench.begin()
    bench.fresh()
    bench.tolerate_missing_boot_up()
    assert bench.power
    on = bench.power.on()
    bench.wait(500 * MS)
    bench.recognised(on, HOME)
    assert [verdict.requirement for verdict in bench.end()] == ["NMT-02"]


def test_a_device_that_was_heard_before_is_proven_for_the_whole_run() -> None:
    """Its cable and supply are right: in a later test, silence is the device's."""
    bench, stage = bench_of()
    stage.port.coming.append(Sighting(Frame(0x701, b"\x7f"), 1 * MS))
    assert not bench.device_proven
    bench.begin()
    bench.wait(2 * MS)
    bench.end()
    bench.begin()
    assert not bench.was_heard()
    assert bench.device_proven
