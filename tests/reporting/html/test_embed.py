"""Timelines: columns that come back exactly, a budget, and what is left out is said."""

from __future__ import annotations

import base64
import json
import zlib
from pathlib import Path
from typing import Any

import pytest

from hil_tests.clock import MS, S
from hil_tests.reporting.html.embed import embed
from hil_tests.reporting.html.view import TestView, views_of
from hil_tests.reporting.pcapng import PcapngSink
from hil_tests.reporting.results_reader import load_results
from hil_tests.reporting.rows import VerdictRow
from hil_tests.trace import Entry, Moment, Sighting
from node_model.frame import Frame
from tests.reporting.html.making import failed, make_run, passed, result


def views(folder: Path, budget: int | None = None) -> list[TestView]:
    """The tests of a run with their timelines."""
    found = views_of(folder, load_results(folder / "results.json"), "keypad")
    embed(found, *([budget] if budget is not None else []))
    return found


def unpack(data: str) -> tuple[dict[str, Any], list[int], list[int]]:
    """Head, instants and kinds, as a browser reads them."""
    raw = zlib.decompress(base64.b64decode(data), -15)
    size = int.from_bytes(raw[:4], "little")
    head: dict[str, Any] = json.loads(raw[4 : 4 + size])
    body, count = raw[4 + size :], head["n"]
    assert len(body) == 9 * count
    planes = [body[plane * count : (plane + 1) * count] for plane in range(9)]
    at, kinds, now = [], [], 0
    for frame in range(count):
        step = sum(planes[plane][frame] << 8 * plane for plane in range(6))
        now += step - (step >> 47 << 48)
        at.append(now)
        kinds.append(sum(planes[6 + plane][frame] << 8 * plane for plane in range(3)))
    return head, at, kinds


def run_with(folder: Path, *entries: Entry, row: VerdictRow | None = None) -> Path:
    """A run of one test with that recording."""
    rows = (row,) if row else ()
    run = make_run(folder, result(1, *rows, outcome=row.outcome if row else "passed"))
    with PcapngSink(
        run / "traces" / "t1.pcapng", interface="vcan0", clock="test", flush=False
    ) as sink:
        for entry in entries:
            sink.write(entry)
    return run


def test_frames_come_back_to_the_nanosecond(tmp_path: Path) -> None:
    """Instants, texts, direction and doubt of each frame are those of the recording."""
    written = [
        Sighting(Frame(0x701, b"\x00"), 1_700_000_000_000_000_123, 20_000),
        Sighting(Frame(0x000, b"\x01\x01"), 1_700_000_000_000_000_124, 0, own=True),
        Sighting(Frame(0x701, b"\x05"), 1_700_000_000_100_000_129, 20_000),
    ]
    (test,) = views(run_with(tmp_path / "run", *written))
    head, at, kinds = unpack(test.data)
    assert int(head["origin"]) == written[0].at
    assert at == [0, 1, 100_000_006]
    shown = [head["words"][kind] for kind in kinds]
    assert [(raw, own, doubt) for raw, _, _, own, doubt in shown] == [
        ("701#00", 0, 20_000),
        ("000#0101", 1, 0),
        ("701#05", 0, 20_000),
    ]
    assert shown[0][1] == "boot-up of node 1"


def test_stamps_that_step_back_are_sorted(tmp_path: Path) -> None:
    """A timeline runs from left to right, whatever the port stamped."""
    frames = [Sighting(Frame(0x701, bytes([n])), at) for n, at in enumerate((50, 90, 70))]
    (test,) = views(run_with(tmp_path / "run", *frames))
    head, at, kinds = unpack(test.data)
    assert at == sorted(at)
    assert [head["words"][kind][0] for kind in kinds] == ["701#00", "701#02", "701#01"]


def test_each_identifier_has_a_lane_and_states_have_spans(tmp_path: Path) -> None:
    """Lanes by identifier; supply, keys and NMT state from one change to the next."""
    run = make_run(tmp_path / "run", result(1, passed()))
    head, _, _ = unpack(views(run)[0].data)
    assert [name.split()[0] for name in head["lanes"]] == ["000", "081", "181", "701"]
    spans = {name: [span[2] for span in spans] for name, spans in head["spans"]}
    assert spans == {"supply": ["on"], "keys": ["k3"], "node 1": ["boot-up"]}
    assert [kind for _, kind, _ in head["events"]] == ["error frame"]


def test_a_state_ends_with_the_supply(tmp_path: Path) -> None:
    """A node without power is in no state, though nothing said so on the bus."""
    entries: list[Entry] = [
        Sighting(Frame(0x701, b"\x05"), 10 * MS),
        Moment("power", 20 * MS, 20 * MS, {"on": False}),
        Sighting(Frame(0x702, b"\x05"), 90 * MS),
    ]
    head, _, _ = unpack(views(run_with(tmp_path / "run", *entries))[0].data)
    spans = dict(head["spans"])
    assert spans["node 1"] == [[0, 10 * MS, "operational", "operational"]]


def test_watched_leds_have_lanes(tmp_path: Path) -> None:
    """Each LED that was watched is lit from one change to the next; strange edges are left out."""
    edges = [[10, 12, "k3", True], [30, 30, "k3", False], [40, 41, "k4", True], "?", [1, 2]]
    moment = Moment("lights", 0, 100, {"start": {"aut": True}, "edges": edges})
    head, _, _ = unpack(views(run_with(tmp_path / "run", moment))[0].data)
    spans = {name: [span[:2] for span in spans] for name, spans in head["spans"]}
    assert spans == {"LED k3": [[12, 30]], "LED aut": [[0, 100]], "LED k4": [[41, 100]]}


def test_rare_identifiers_share_a_lane(tmp_path: Path) -> None:
    """Garbage on hundreds of identifiers does not make hundreds of lanes."""
    frames = [Sighting(Frame(n), n) for n in range(1, 300)]
    head, _, kinds = unpack(views(run_with(tmp_path / "run", *frames))[0].data)
    assert len(head["lanes"]) == 25
    assert head["lanes"][-1] == "other identifiers"
    assert {head["words"][kind][2] for kind in kinds} == set(range(25))


def test_a_measured_check_has_cause_and_effect(tmp_path: Path) -> None:
    """The arrow leads from what a check counted from to the frame that was judged."""
    run = make_run(tmp_path / "run", result(1, passed(), failed(), outcome="failed"))
    head, _, _ = unpack(views(run)[0].data)
    power, emcy = head["checks"]
    assert (power["cause"], power["effect"]) == (1000, 50 * MS)
    assert (emcy["cause"], emcy["effect"]) == (50 * MS, 161 * MS)
    assert emcy["limits"] == [None, 100 * MS]


def test_an_arrow_ends_where_a_frame_does(tmp_path: Path) -> None:
    """On a wire with bit times a frame was asked for earlier by its length, which is known."""
    boot = Sighting(Frame(0x701, b"\x00"), 50 * MS)
    asked_at = boot.at - boot.frame.bits * 4000
    key = Moment("keys", asked_at - 7, asked_at - 5, {"held": ["k1"]})

    def drawn(cause: int, effect: int) -> dict[str, Any]:
        ends = (cause, cause), (effect, effect)
        row = VerdictRow("HB-01", "passed", "x", (0, 0), cause_at=ends[0], effect_at=ends[1])
        run = run_with(tmp_path / f"run{cause}-{effect}", key, boot, row=row)
        (check,) = unpack(views(run)[0].data)[0]["checks"]
        origin_at = key.began_at
        return {name: check[name] + origin_at for name in ("at", "cause", "effect")}

    assert drawn(asked_at - 5, asked_at) == {
        "at": boot.at,
        "cause": asked_at - 5,
        "effect": boot.at,
    }
    assert drawn(asked_at, asked_at + 1)["effect"] == asked_at + 1, "no rate fits: it stays"
    assert drawn(asked_at, boot.at)["cause"] == boot.at


def test_what_never_came_has_a_cause_alone(tmp_path: Path) -> None:
    """The place from which its time counted is shown; no arrow leads anywhere."""
    row = VerdictRow("NMT-02", "failed", "none came", at=90 * MS, cause_at=(0, 1000))
    head, _, _ = unpack(views(make_run(tmp_path / "run", result(1, row)))[0].data)
    (check,) = head["checks"]
    assert check["cause"] == 1000
    assert "effect" not in check


def beats(count: int, period_ns: int = S) -> list[Sighting]:
    """Heartbeats with stamps that no packer can foresee."""
    return [
        Sighting(Frame(0x701, b"\x05"), n * period_ns + (n * 7919 * 104729) % 1_000_003)
        for n in range(count)
    ]


def test_what_is_argued_about_is_kept_first(tmp_path: Path) -> None:
    """With room for one timeline, the failed test has it."""
    run = make_run(
        tmp_path / "run", result(1, passed()), result(2, passed(), failed(), outcome="failed")
    )
    plenty = {test.number: len(test.data) for test in views(run)}
    first, second = views(run, budget=plenty[2])
    assert first.data == ""
    assert second.data


def test_a_long_recording_keeps_windows(tmp_path: Path) -> None:
    """Where the whole is too much, five seconds on both sides of what matters are kept."""
    row = VerdictRow("HB-01", "failed", "late", text="late", at=1000 * S)
    run = run_with(tmp_path / "run", *beats(2000), row=row)
    whole = len(views(run)[0].data)
    (test,) = views(run, budget=whole - 1)
    head, at, _ = unpack(test.data)
    assert at[0] > 994 * S
    assert at[-1] < 1006 * S
    assert sum(count for _, _, count in head["left"]) == 2000 - head["n"]
    assert [head["left"][0][0], head["left"][1][1]] == [0, pytest.approx(1999 * S, abs=2 * MS)]


def test_without_a_finding_the_ends_are_kept(tmp_path: Path) -> None:
    """Of a long test that passed, the beginning and the end are shown."""
    run = run_with(tmp_path / "run", *beats(2000))
    whole = len(views(run)[0].data)
    (test,) = views(run, budget=whole - 1)
    head, at, _ = unpack(test.data)
    assert at[0] == 0
    assert at[-1] > 1998 * S
    assert len(head["left"]) == 1


def test_without_budget_there_is_no_timeline(tmp_path: Path) -> None:
    """Nothing is embedded that cannot be afforded."""
    run = make_run(tmp_path / "run", result(1, passed()))
    assert [test.data for test in views(run, budget=0)] == [""]


@pytest.mark.slow
def test_an_hour_of_bus_stays_small(tmp_path: Path) -> None:
    """A tenth of an hour, 24 000 frames with jitter, takes less than 5 bytes a frame."""
    run = run_with(tmp_path / "run", *beats(24_000, 15 * MS))
    assert len(views(run)[0].data) < 5 * 24_000
