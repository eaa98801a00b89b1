"""A node that is silent after 4F8h at 125 kbit/s: what it is blamed for, and what was tried."""

from __future__ import annotations

import attrs
import pytest

from hil_tests.bench.keypad import KeypadBench, payload
from hil_tests.bench.virtual import VirtualStage
from hil_tests.clock import MS
from hil_tests.config import Parameters
from hil_tests.judge.verdict import DeviceFailure, Verdict
from hil_tests.trace import BusEvent, EventKind
from node_model import devices
from node_model.frame import Frame
from tests.bench.fakes import HOME, PROFILE, FakePort, FakeStage, bench_of

AT_500 = attrs.evolve(HOME, node_id=7, bit_rate_code=1)
AT_125 = attrs.evolve(HOME, node_id=7, bit_rate_code=3)


def blamed(fault: str, home: Parameters, target: Parameters) -> Verdict:
    """The verdict on a faulty model that is commissioned from one set of parameters to another."""
    bench = KeypadBench(VirtualStage(devices.read("keypad", fault)), PROFILE, home)
    bench.begin()
    bench.fresh()
    with pytest.raises(DeviceFailure) as failure:
        bench.commission(target)
    return failure.value.verdict


class AtStoredRate(FakePort):
    """A device that waits at 250 kbit/s, on a wire that lets frames of any rate pass unnoticed."""

    stage: FakeStage

    def send(self, frame: Frame) -> None:
        """Echo 4F8h, where the tester is at its rate."""
        super().send(frame)
        if frame.can_id == 0x4F8 and self.stage.bit_rate == HOME.bit_rate:
            self.plays(Frame(0x3F8, frame.data), self.at + 100 * MS)


@pytest.mark.parametrize("target", [AT_125, AT_500, HOME])
def test_a_node_that_waits_at_the_stored_rate_is_found_there(target: Parameters) -> None:
    """It is powered up for commissioning once more, at the rate that it was known to have."""
    port = AtStoredRate()
    bench, stage = bench_of(port)
    port.stage = stage
    bench.begin()
    with pytest.raises(DeviceFailure, match="an echo came at 250000 bit/s") as failure:
        bench.commission(target)
    assert failure.value.verdict.requirement == "COM-02"
    assert stage.asked[-1] == "power on"
    assert "bitrate 250000" in stage.asked


@pytest.mark.parametrize(("target", "rate"), [(AT_500, 500_000), (HOME, 250_000)])
def test_an_echo_at_the_new_rate_is_heard_there(target: Parameters, rate: int) -> None:
    """The rate is to blame, and not the echo."""
    verdict = blamed("echoes-at-new-rate", HOME, target)
    assert verdict.requirement == "COM-02"
    assert verdict.text == f"commissioning runs at 125 kbit/s; an echo came at {rate} bit/s"


@pytest.mark.parametrize(
    ("home", "target", "where"),
    [
        (HOME, AT_500, ", nor at 500000 bit/s, nor at 250000 bit/s"),
        (HOME, AT_125, ", nor at 250000 bit/s"),
        (AT_125, AT_125, ""),
    ],
)
def test_a_node_that_answers_nowhere_owes_the_echo(
    home: Parameters, target: Parameters, where: str
) -> None:
    """A rate is not to blame then; the failure tells where nothing came."""
    target = attrs.evolve(target, sync_time=7)
    verdict = blamed("ignores-request-with-sync-time", home, target)
    assert verdict.requirement == "COM-05"
    assert verdict.text.endswith(f" at 125 kbit/s; none came{where}")


def test_what_was_stored_is_remembered_over_a_failure() -> None:
    """After a first failure nothing is known, and the old rate is tried still."""
    bench, stage = bench_of()
    for _ in range(2):
        bench.begin()
        stage.asked.clear()
        with pytest.raises(DeviceFailure):
            bench.commission(AT_125)
        assert "bitrate 250000" in stage.asked


def test_nobody_looks_where_nobody_knows_what_was_stored() -> None:
    """A device of which nothing was ever known is listened to at the rate that it was told."""
    bench, stage = bench_of(parameters=None)
    bench.begin()
    with pytest.raises(DeviceFailure, match=r"none came, nor at 500000 bit/s\n"):
        bench.commission(AT_500)
    assert len(stage.port.sent) == 1


def silent(stage: FakeStage) -> KeypadBench:
    """A bench at 125 kbit/s whose device does not answer."""
    stage.bit_rate = 125_000
    bench = KeypadBench(stage, PROFILE, AT_125)
    bench.begin()
    return bench


def test_a_bench_of_one_bit_rate_does_not_look() -> None:
    """Without [bitrate] the missing echo is all that is known."""
    bench = silent(FakeStage(FakePort(), without=["bitrate"]))
    with pytest.raises(DeviceFailure, match=r"none came\n") as failure:
        bench.commission(AT_500)
    assert failure.value.verdict.requirement == "COM-05"


def test_a_bus_that_is_never_free_tells_nothing() -> None:
    """Nothing was found elsewhere: what the missing echo means is said as soon as it is known."""
    stage = FakeStage(FakePort(timed=True))
    bench = silent(stage)
    bench.enter_commissioning()
    request = bench.request(AT_500)
    stage.port.tells(BusEvent(EventKind.ERROR, request.at + 300 * MS - 1, "an error frame"))
    bench.seek_answer(request, payload(AT_500), "COM-04")
    assert stage.asked[-1] == "bitrate 500000"
    assert bench.verdicts == []
