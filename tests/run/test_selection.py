"""Which tests run on a bench: facilities, markers, clauses, ids."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.run.harness import judge

pytest_plugins = ["pytester"]

TWO = """
@pytest.mark.requirement("NMT-02")
def test_nmt(bench):
    bench.start()

@pytest.mark.requirement("HB-01", "KEY-04")
def test_beat(bench, leds):
    bench.start()
"""

DESK = """
[bench]
name = "desk-2"
[bus]
interface = "virtual"
channel = "{channel}"
[device]
profile = "keypad"
[power]
driver = "operator"
[keys]
driver = "operator"
"""


def desk(pytester: pytest.Pytester, channel: str) -> str:
    """The option for a bench with power and keys in the hands of an operator."""
    path = pytester.path / "desk.toml"
    path.write_text(DESK.format(channel=channel), "utf-8")
    return f"--can-bench={path}"


@pytest.mark.slow
def test_what_a_bench_lacks_is_known_before_it_is_opened(pytester: pytest.Pytester) -> None:
    """The reason names the bench, what it lacks, what it has, and the remedy."""
    run = judge(pytester, TWO, desk(pytester, "lacks"), "-k", "beat")
    why = "bench 'desk-2' has no Leds (it has Power, Keys); add [leds] to its file"
    assert why in run.section("not run")
    assert run.outcomes == {"test_beat": "not run"}
    assert run.results["results"][0]["text"] == why
    assert run.status == 12


@pytest.mark.slow
def test_without_a_bench_file_the_remedy_is_to_write_one(pytester: pytest.Pytester) -> None:
    """An external device without a bench file has no facilities."""
    options = ["--can-interface=virtual", "--can-iface=bare", "--can-device=external"]
    run = judge(pytester, TWO, *options, "-k", "beat")
    assert (
        "has no Leds (it has nothing); add [leds] to a bench file (--can-bench FILE)" in run.text
    )


@pytest.mark.parametrize(
    ("marker", "why"),
    [
        ('virtual("an hour of it")', "runs in virtual time only: an hour of it"),
        ("virtual", "runs in virtual time only: see the test"),
        ('timed("bits count")', "marked is an untimed wire: bits count"),
    ],
)
def test_markers_keep_a_test_from_a_bench_that_cannot_show_it(
    pytester: pytest.Pytester, marker: str, why: str
) -> None:
    """Off virtual time, or on a wire without bit times, a marked test is not run."""
    body = f"""
@pytest.mark.requirement("NMT-02")
@pytest.mark.{marker}
def test_marked(bench):
    raise AssertionError("it ran")
"""
    options = ["--can-interface=virtual", "--can-iface=marked", "--can-device=external"]
    run = judge(pytester, body, *options)
    assert why in run.section("not run")
    assert run.status == 12


def test_markers_do_not_matter_in_virtual_time(pytester: pytest.Pytester) -> None:
    """The virtual wire is timed, and its time is virtual."""
    body = """
@pytest.mark.requirement("NMT-02")
@pytest.mark.virtual("long")
@pytest.mark.timed("bits")
def test_marked(bench):
    bench.start()
"""
    assert judge(pytester, body).status == 0


@pytest.mark.parametrize(
    ("clauses", "chosen"),
    [
        (["NMT"], ["test_nmt"]),
        (["hb"], ["test_beat"]),
        (["KEY-04"], ["test_beat"]),
        (["HB", "NMT-02"], ["test_nmt", "test_beat"]),
    ],
)
def test_a_clause_chooses_the_tests_that_claim_it(
    pytester: pytest.Pytester, clauses: list[str], chosen: list[str]
) -> None:
    """Whoever claims a requirement that begins so is run; the others are deselected."""
    foreign = "\ndef test_foreign():\n    pass\n"
    run = judge(pytester, TWO + foreign, *(f"--can-clause={name}" for name in clauses))
    assert list(run.outcomes) == chosen
    assert f"{3 - len(chosen)} deselected" in run.text


@pytest.mark.parametrize(
    ("options", "hints"),
    [
        (["--can-clause=HB-77"], ["--can-clause HB-77: no requirement begins so", "HB-01, HB-02"]),
        (["--can-clause=xyz"], ["--can-clause xyz", "COM, HB, KEY, LED, NMT, ROB"]),
        (["--can-clause=HB-77", "--can-clause=xyz"], ["HB-77", "xyz"]),
    ],
)
def test_an_unknown_clause_is_refused(
    pytester: pytest.Pytester, options: list[str], hints: list[str]
) -> None:
    """All beginnings that no requirement has are told at once, with near misses."""
    run = judge(pytester, TWO, *options)
    assert run.status == 4
    assert all(hint in run.text for hint in hints)
    assert not run.reports.exists()


def test_an_unknown_requirement_id_is_refused(pytester: pytest.Pytester) -> None:
    """Every wrong id is told, with its test and what may have been meant; nothing is opened."""
    body = """
@pytest.mark.requirement("hb_1")
def test_one(bench): pass

@pytest.mark.requirement("NMT-02", "NTM-3")
def test_two(bench): pass

@pytest.mark.requirement()
def test_three(bench): pass
"""
    run = judge(pytester, body)
    assert run.status == 4
    assert "test_device.py::test_one: unknown requirement 'hb_1'; did you mean HB-01" in run.text
    assert "test_device.py::test_two: unknown requirement 'NTM-3'; did you mean NMT-03" in run.text
    assert "test_device.py::test_three: unknown requirement ''" in run.text
    assert not run.reports.exists()


def test_collecting_touches_no_bus_and_writes_nothing(pytester: pytest.Pytester) -> None:
    """--collect-only works on a laptop without the bench, and names what would be tested."""
    options = ["--collect-only", "--can-iface=can77", "--can-device=external"]
    run = judge(pytester, TWO, *options)
    assert run.status == 0
    assert "device: external device, profile keypad (command line)" in run.text
    assert "test_device.py" in run.text
    assert not run.reports.exists()


def test_collecting_shows_a_wrong_bench_file(pytester: pytest.Pytester, tmp_path: Path) -> None:
    """Files are read when tests are collected: their errors come before any bus."""
    broken = tmp_path / "desk.toml"
    broken.write_text("[bus]\nchanel = 'can0'\n")
    run = judge(pytester, TWO, "--collect-only", f"--can-bench={broken}")
    assert run.status == 4
    assert "bus.chanel" in run.text
    assert "did you mean channel" in run.text


MIXED = """
@pytest.mark.requirement("SYN-01")
def test_of_a_drive(bench):
    raise ValueError("never run on a keypad")

@pytest.mark.requirement("EM-01", "NMT-02")
def test_of_both(bench):
    bench.start()
"""


def test_tests_of_other_kinds_of_devices_are_not_collected(pytester: pytest.Pytester) -> None:
    """Deselected, so that nothing is missing; a test of both claims what concerns this kind."""
    run = judge(pytester, MIXED, "--can-require-all")
    assert run.outcomes == {"test_of_both": "passed"}
    assert run.results["results"][0]["requirements"] == ["NMT-02"]
    assert run.status == 0
