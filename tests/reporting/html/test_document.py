"""report.html: what it says, that it stands alone, and that no text in it can act."""

from __future__ import annotations

import base64
import hashlib
import json
import re
import shutil
from dataclasses import replace
from pathlib import Path
from urllib.parse import unquote

import pytest

from hil_tests.reporting.files import RecordUnreadable
from hil_tests.reporting.html import write_report
from tests.reporting.html.making import HEAD, HOSTILE, Page, failed, make_run, passed, result

SAMPLE = Path(__file__).parents[3] / "reports" / "sample"


def page_of(folder: Path, aimed: dict[str, list[str]] | None = None) -> Page:
    """The report of a run, read."""
    return Page(write_report(folder, aimed or {}).read_text("utf-8"))


@pytest.fixture(name="bad")
def _bad(tmp_path: Path) -> Path:
    """A run with a test that failed and one that passed."""
    first = result(1, passed())
    second = result(2, passed(), failed(), outcome="failed", text="NMT-02\n  failed: too late")
    return make_run(tmp_path / "run", first, second)


def test_the_verdict_comes_first_and_leads_to_the_failure(bad: Path) -> None:
    """The page says Failed, and its first button leads to the page of the failed test."""
    page = page_of(bad)
    heading = next(place for place, (tag, _) in enumerate(page.elements) if tag == "h1")
    assert "1 test failed." in page.text[:400]
    assert heading < 30
    buttons = [each for each in page.of("a") if each.get("class") == "button"]
    assert [each["href"] for each in buttons] == ["#t2"]
    assert "First failure: test_2" in page.text


def test_every_link_leads_somewhere(bad: Path) -> None:
    """Anchors are on the page, files are in the folder of the run."""
    page = page_of(bad)
    anchors = {attributes.get("id") for _, attributes in page.elements}
    links = [str(each["href"]) for each in page.of("a")]
    assert links
    for link in links:
        if link.startswith("#"):
            assert link[1:] in anchors
        else:
            assert (bad / unquote(link)).is_file()


def test_ids_are_unique(bad: Path) -> None:
    """No two elements have the same id."""
    ids = [each["id"] for _, each in page_of(bad).elements if "id" in each]
    assert len(ids) == len(set(ids))


def test_the_policy_allows_nothing_but_what_is_inside(bad: Path) -> None:
    """Style and script act by their hashes alone; nothing is loaded, nothing is sent."""
    text = write_report(bad, {}).read_text("utf-8")
    page = Page(text)
    policy = next(str(each["content"]) for each in page.of("meta") if "http-equiv" in each)
    assert policy.startswith("default-src 'none'; base-uri 'none'; form-action 'none'; ")
    for tag in ("style", "script"):
        inside = re.findall(rf"<{tag}>(.*?)</{tag}>", text, re.DOTALL)
        assert len(inside) == 1
        digest = base64.b64encode(hashlib.sha256(inside[0].encode()).digest()).decode()
        assert f"{tag}-src 'sha256-{digest}'" in policy
    assert "unsafe" not in policy


def test_nothing_in_it_reaches_for_the_network(bad: Path) -> None:
    """No element loads anything, no attribute is a style or an event handler."""
    page = page_of(bad)
    assert not {"img", "link", "iframe", "object", "embed", "form", "base"} & {
        tag for tag, _ in page.elements
    }
    for _, attributes in page.elements:
        assert not {"src", "srcset", "style", "xlink:href"} & attributes.keys()
        assert not any(name.startswith("on") for name in attributes)


def test_a_requirement_shows_its_worst_verdict_and_margin(bad: Path) -> None:
    """The failed check counts, with its margin in time and in units of doubt."""
    text = page_of(bad, {"NMT-02": ["emcy-late", "no-boot-up"]}).text
    assert "failed 2 passed −12" not in text
    assert "-12 ms = -6.0 × doubt" in text
    assert "2 aimed" in text


def test_what_was_not_tested_is_there_in_grey(bad: Path) -> None:
    """A requirement of the catalogue without a test has a row of its own."""
    rows = {each.get("id"): each.get("class") for each in page_of(bad).of("tr")}
    assert rows["r-NMT-02"] == "failed"
    assert rows["r-HB-01"] == "untested"


def test_found_mutants_come_from_the_matrix(bad: Path) -> None:
    """With matrix.json in the folder, found and aimed are counted."""
    mutants = {
        "emcy-late": {"violates": ["NMT-02"], "killed_by": ["t"]},
        "sly": {"violates": ["NMT-02"], "killed_by": []},
    }
    (bad / "matrix.json").write_text(json.dumps({"mutants": mutants}), "utf-8")
    assert "1 of 3 found" in page_of(bad, {"NMT-02": ["no-boot-up"]}).text


@pytest.mark.parametrize("text", ["[]", "{", '{"mutants": 1}'])
def test_a_broken_matrix_is_named(bad: Path, text: str) -> None:
    """A matrix.json that is none costs a sentence, not the report."""
    (bad / "matrix.json").write_text(text, "utf-8")
    assert re.search(r"matrix\.json (cannot be read|is no table)", page_of(bad).text)


def test_a_failure_is_told_with_its_frames(bad: Path) -> None:
    """Story, chart and decoded frames stand on the page of the failed test."""
    page = page_of(bad)
    assert "failed: too late" in page.text
    assert "boot-up of node 1" in page.text
    assert "NMT start -> node 1" in page.text
    assert [each["aria-label"] for each in page.of("svg")] == ["Message sequence chart"]


def test_files_are_named_with_their_hashes(bad: Path) -> None:
    """Every file of the run is listed with its SHA-256; the report is not its own evidence."""
    write_report(bad, {})
    text = page_of(bad).text
    for name in ("results.json", "traces/t1.pcapng"):
        assert hashlib.sha256((bad / name).read_bytes()).hexdigest() in text
    assert "report.html" not in text


def test_a_killed_run_has_a_report(tmp_path: Path) -> None:
    """It says that it was interrupted, and shows the recording of the test that never ended."""
    run = make_run(tmp_path / "run", result(1, passed()), finish=False)
    (run / "traces" / "t1.pcapng").rename(run / "traces" / "cut.pcapng")
    with (run / "traces" / "cut.pcapng").open("r+b") as file:
        file.truncate(600)
    page = page_of(run)
    assert "Interrupted" in page.text
    assert "The run ended before this test did" in page.text
    assert "the recording breaks off" in page.text
    assert "t1.pcapng: the file is not there" in page.text


def test_a_torn_results_file_is_told(tmp_path: Path) -> None:
    """What was whole is shown, and that the last entry was cut."""
    run = make_run(tmp_path / "run", result(1, passed()), result(2, passed()), finish=False)
    whole = (run / "results.json").read_bytes()
    (run / "results.json").write_bytes(whole[: whole.rindex(b'"reproduce"')])
    page = page_of(run)
    assert "cut in its last entry" in page.text


def test_without_results_there_is_no_report(tmp_path: Path) -> None:
    """A folder without a readable results.json is refused by name."""
    with pytest.raises(RecordUnreadable, match=r"results\.json"):
        write_report(tmp_path, {})


def test_the_sample_is_what_this_version_makes_of_it(tmp_path: Path) -> None:
    """The report that lies in reports/sample is made from the files beside it."""
    copy = tmp_path / "sample"
    shutil.copytree(SAMPLE, copy)
    page = page_of(copy)
    assert page.text.count("EMCY 50xxh of node 1 after 701#00") >= 2
    kept = Page((SAMPLE / "report.html").read_text("utf-8"))
    assert [tag for tag, _ in page.elements] == [tag for tag, _ in kept.elements]


IDENTITY = ("name", "hardware", "vendor_name", "product_name", "not_read", "from", "vendor")


def test_hostile_texts_are_only_text(tmp_path: Path) -> None:
    """Markup in every field of the results adds no element, and is shown as it is."""
    head = dict.fromkeys(HEAD, HOSTILE) | {
        "command": [HOSTILE],
        "options": {HOSTILE: {"value": HOSTILE, "source": HOSTILE}},
        "versions": {HOSTILE: HOSTILE},
        "bench": {"name": HOSTILE, "facilities": [HOSTILE]},
        "device": dict.fromkeys(
            ("kind", "node_id", "serial", "serial_from", "firmware", "mutant"), HOSTILE
        )
        | {"identity": dict.fromkeys(IDENTITY, HOSTILE) | {"differs": [HOSTILE]}}
        | {"profile": {"name": HOSTILE, "kind": HOSTILE}, "eds": {"name": HOSTILE}},
        "bus": {"interface": HOSTILE, "channel": HOSTILE, "bit_rate": HOSTILE},
        "clock": {"text": HOSTILE, "doubt_ns": HOSTILE},
        "requirements": {HOSTILE: dict.fromkeys(("text", "class", "source", "clause"), HOSTILE)},
    }
    bad = failed()._replace(requirement=HOSTILE, what=HOSTILE, text=HOSTILE)
    facts = {"requirements": (HOSTILE,), "text": HOSTILE, "reproduce": HOSTILE}
    hostile = replace(result(1, bad, outcome="failed", **facts), test=HOSTILE)
    tame = make_run(tmp_path / "tame", result(1, failed(), outcome="failed", text="x"))
    wild = make_run(tmp_path / "wild", hostile, head=head)
    page = page_of(wild)
    counted = {tag for tag, _ in page.elements} - {tag for tag, _ in page_of(tame).elements}
    assert counted == set()
    assert " ".join(HOSTILE.split()) in page.text
    assert not any(name.startswith("on") for _, each in page.elements for name in each)


@pytest.mark.parametrize("strange", [None, 7, [], {}, [[]], {"a": {"b": None}}, True])
def test_strange_facts_cost_nothing(tmp_path: Path, strange: object) -> None:
    """Facts of another type than ours in the head of the results leave a report."""
    run = make_run(tmp_path / "run", result(1, passed()), head=dict.fromkeys(HEAD, strange))
    assert "Passed" in page_of(run).text


def test_a_trace_outside_the_run_is_not_read(tmp_path: Path) -> None:
    """A results file cannot make the report read other files of the machine."""
    secret = make_run(tmp_path / "other", result(1, passed())) / "traces" / "t1.pcapng"
    run = make_run(tmp_path / "run", result(1, passed()), traces=False)
    text = (run / "results.json").read_text("utf-8")
    (run / "results.json").write_text(
        text.replace("traces/t1.pcapng", f"../other/traces/{secret.name}"), "utf-8"
    )
    page = page_of(run)
    assert "not in the folder of this run" in page.text
    assert not [each for each in page.of("a") if "other" in str(each["href"])]
