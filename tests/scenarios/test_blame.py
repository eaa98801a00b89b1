"""Which requirement a wrong state is blamed on: what came just before tells it better."""

from __future__ import annotations

import pytest

from hil_tests.clock import MS
from hil_tests.judge.verdict import Outcome, Verdict
from hil_tests.scenarios.blame import better
from node_model.frame import Frame
from tests.bench.fakes import bench_of
from tests.scenarios.labs import first

BEAT = "706#05"
BOOT = "706#00"
NEIGHBOUR = "000#0107"
STOP = "000#0206"
GARBAGE = "123#00"


def blamed(requirement: str, *frames: str, at_ms: float | None = None) -> Verdict:
    """What is made of a verdict about the last of some frames; those with > are our own."""
    bench, stage = bench_of()
    for index, text in enumerate(frames, 1):
        own = text.startswith(">")
        can_id, _, data = text.removeprefix(">").partition("#")
        frame = Frame(int(can_id, 16), bytes.fromhex(data))
        if own:
            bench.wait_until(index * 10 * MS - 100_000)
            bench.post(frame)
        else:
            stage.port.plays(frame, index * 10 * MS)
        bench.wait_until(index * 10 * MS)
    at = bench.trace.frame(len(bench.trace) - 1).at if at_ms is None else round(at_ms * MS)
    return better(bench, 6, Verdict(requirement, Outcome.FAIL, "it is wrong", at=at))


def test_a_lure_that_looks_like_a_command() -> None:
    """Right until a frame came with identifier 0 that is no command for it: NMT-05."""
    found = blamed("NMT-07", BEAT, f">{NEIGHBOUR}", "706#04")
    assert found.requirement == "NMT-05"
    assert found.text == "it is wrong, after 000#0107"
    assert found.outcome is Outcome.FAIL


@pytest.mark.parametrize("requirement", ["KEY-05", "HB-01", "LED-01", "COM-05", "ROB-02"])
def test_verdicts_that_no_state_leads_to_are_left_alone(requirement: str) -> None:
    """A key that is late is late, whatever was sent before."""
    assert blamed(requirement, BEAT, f">{NEIGHBOUR}", "706#04").requirement == requirement


def test_a_missing_key_frame_is_of_the_lure_where_no_beat_denies_it() -> None:
    """A beat that shows operational after the lure: it was ignored, and the key is at fault."""
    assert blamed("KEY-06", BEAT, f">{NEIGHBOUR}", GARBAGE).requirement == "NMT-05"
    assert blamed("KEY-06", BEAT, f">{NEIGHBOUR}", "706#04", GARBAGE).requirement == "NMT-05"
    assert blamed("KEY-06", BEAT, f">{NEIGHBOUR}", BEAT, GARBAGE).requirement == "KEY-06"


def test_a_command_for_the_device_explains_more() -> None:
    """After one that it must obey, the transition itself is wrong."""
    assert blamed("NMT-07", BEAT, f">{STOP}", f">{NEIGHBOUR}", BEAT).requirement == "NMT-07"
    assert blamed("NMT-07", BEAT, f">{NEIGHBOUR}", f">{STOP}", BEAT).requirement == "NMT-07"
    assert blamed("NMT-07", BEAT, ">000#0200", BEAT).requirement == "NMT-07"


def test_what_was_wrong_before_the_lure_is_not_its_doing() -> None:
    """Without a beat or boot-up between the last command and the lure nobody can tell."""
    assert blamed("NMT-07", f">{NEIGHBOUR}", "706#04").requirement == "NMT-07"
    assert blamed("NMT-07", "186#00", f">{NEIGHBOUR}", "706#04").requirement == "NMT-07"


def test_a_restart_after_any_other_frame() -> None:
    """A boot-up that nobody asked for: it is the traffic that the device does not stand."""
    assert blamed("NMT-02", BEAT, f">{GARBAGE}", BOOT).requirement == "ROB-01"
    assert blamed("NMT-02", BEAT, f">{GARBAGE}", BEAT).requirement == "NMT-02"
    assert blamed("NMT-02", BEAT, f">{GARBAGE}", "706#").requirement == "NMT-02"
    assert blamed("NMT-07", BEAT, f">{GARBAGE}", BOOT).requirement == "NMT-07"
    assert blamed("NMT-02", BEAT, BOOT).requirement == "NMT-02"


def test_a_verdict_without_an_instant_is_left_alone() -> None:
    """Nobody can look at what was before it."""
    bench, _ = bench_of()
    verdict = Verdict("NMT-07", Outcome.FAIL, "it is wrong")
    assert better(bench, 6, verdict) is verdict


def test_an_instant_after_the_last_frame_looks_back_from_there() -> None:
    """What is missing has no frame of its own."""
    found = blamed("NMT-07", BEAT, f">{NEIGHBOUR}", "706#04", at_ms=9999)
    assert found.requirement == "NMT-05"


@pytest.mark.parametrize(
    ("model", "step", "requirement"),
    [
        ("obeys-its-neighbour", "nmt stop other", "NMT-05"),
        ("compares-four-bits-of-node-id", "nmt stop alike", "NMT-05"),
        ("obeys-unknown-commands", "nmt 05", "NMT-05"),
        ("sdo-restarts", "send +600#4000100000000000", "ROB-01"),
    ],
)
def test_faulty_models_are_blamed_for_the_cause(model: str, step: str, requirement: str) -> None:
    """On the models that were made to fall for such frames."""
    text = f"pre-operational heartbeat_ms=50 node_id=6: 110ms {step}; 160ms wait"
    if "stop" in step:
        text = text.replace("pre-operational", "operational")
    assert first(text, model) == requirement


@pytest.mark.parametrize(
    ("frames", "requirement"),
    [
        ([GARBAGE, "706#04"], "NMT-07"),
        ([GARBAGE, BEAT], "KEY-01"),
        ([GARBAGE, BOOT], "KEY-01"),
        ([GARBAGE, f">{STOP}", "706#04"], "KEY-01"),
        ([GARBAGE, ">000#0207", "706#04"], "NMT-07"),
        ([GARBAGE], "KEY-01"),
    ],
    ids=["elsewhere", "operational", "starts", "sent away since", "another sent", "silent"],
)
def test_a_device_that_did_not_enter_owes_no_key_frame(
    frames: list[str], requirement: str
) -> None:
    """Its next heartbeat tells that the command led to another state."""
    found = blamed("KEY-01", BEAT, ">000#0106", *frames, at_ms=30)
    assert found.requirement == requirement


@pytest.mark.parametrize(
    ("lure", "requirement"),
    [
        ("206#0F", "NMT-02"),
        ("306#F0", "NMT-02"),
        ("206#", "ROB-01"),
        ("206#0F00", "ROB-01"),
        ("207#0F", "ROB-01"),
    ],
)
def test_a_regular_frame_for_its_leds_leads_to_no_restart(lure: str, requirement: str) -> None:
    """It is there for them; a frame that is too short or too long, or another's, is traffic."""
    assert blamed("NMT-02", BEAT, f">{lure}", BEAT, BOOT).requirement == requirement
