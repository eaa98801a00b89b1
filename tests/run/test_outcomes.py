"""Every outcome: its word, its letter, its exit status, and which one prevails."""

from __future__ import annotations

from itertools import combinations

import pytest

from hil_tests.judge.verdict import DeviceFailure, Outcome, Verdict
from hil_tests.requirements import load
from hil_tests.run import outcome
from tests.run.harness import judge

pytest_plugins = ["pytester"]

STARTS = "bench.start()"
RAISES = {
    "fails": ("NMT-02", 'bench.fail("not so")'),
    "asserts": ("NMT-02", "assert bench.node_id == 99"),
    "gives_up": ("NMT-02", 'pytest.fail("no good")'),
    "derived": ("NMT-20", 'bench.fail("not as we read it")'),
    "doubtful": ("NMT-02", 'bench.measure(Interval(1, 5), Limits(2, 9), "a span")'),
    "lacking": ("NMT-02", 'raise NotRun("no crane here")'),
    "skipping": ("NMT-02", 'pytest.skip("not today")'),
    "alone": ("NMT-02", 'raise OperatorAbsent("nobody answered")'),
    "foreign": ("NMT-02", 'raise NotApplicable("it has no wings")'),
    "broken": ("NMT-02", 'raise BenchError("the relay is stuck")'),
    "buggy": ("NMT-02", "bench.no_such_verb()"),
    "passes": ("NMT-02", STARTS),
}


def body(name: str) -> str:
    """A test that ends in a certain way."""
    requirement, line = RAISES[name]
    return f"""
@pytest.mark.requirement("{requirement}")
def test_{name}(bench):
    {line}
"""


@pytest.mark.parametrize(
    ("name", "found", "letter", "status"),
    [
        ("passes", "passed", ".", 0),
        ("fails", "failed", "F", 1),
        ("asserts", "failed", "F", 1),
        ("gives_up", "failed", "F", 1),
        ("derived", "observation", "o", 0),
        ("doubtful", "inconclusive", "?", 10),
        ("lacking", "not run", "-", 12),
        ("skipping", "not run", "-", 12),
        ("alone", "not run", "-", 12),
        ("foreign", "not applicable", "n", 12),
        ("broken", "error", "E", 11),
        ("buggy", "error", "E", 11),
    ],
)
def test_each_outcome_has_letter_word_and_exit_status(
    pytester: pytest.Pytester, name: str, found: str, letter: str, status: int
) -> None:
    """What a test raises decides what the terminal shows, the results say, and the run returns."""
    run = judge(pytester, body(name))
    assert f"test_device.py {letter}" in run.text
    assert run.outcomes == {f"test_{name}": found}
    assert run.results["totals"][found] == 1
    assert run.results["summary"]["exit_status"] == status
    assert run.status == status
    assert "INTERNALERROR" not in run.text


@pytest.mark.slow
def test_words_in_a_verbose_run(pytester: pytest.Pytester) -> None:
    """With -v each outcome has its own word, and the closing lines count them apart."""
    run = judge(pytester, "".join(map(body, RAISES)), "-v")
    for name, word in {
        "fails": "FAILED",
        "derived": "OBSERVATION",
        "doubtful": "INCONCLUSIVE",
        "lacking": "NOT RUN",
        "foreign": "NOT APPLICABLE",
        "broken": "ERROR",
        "passes": "PASSED",
    }.items():
        assert f"::test_{name} {word}" in run.text
    not_run = run.section("not run").split()
    expected = (
        "1 no crane here test_lacking 1 nobody answered test_alone 1 not today test_skipping"
    )
    assert not_run == expected.split()
    assert "it has no wings" in run.section("not applicable")
    assert "test_derived" in run.section("observation")
    assert "NMT-20: not as we read it" in run.section("observation")
    assert "measured 1 ns .. 5 ns; allowed 2 ns .. 9 ns" in run.section("inconclusive")
    assert "trace: " in run.section("inconclusive")
    counts = "1 passed, 3 failed, 1 observation, 1 inconclusive, 3 not run, 1 not applicable"
    assert f"{counts}, 2 error" in run.text
    assert run.status == 1


def test_a_run_without_anything_special_has_no_extra_sections(pytester: pytest.Pytester) -> None:
    """Sections are there only if they have something to say."""
    run = judge(pytester, body("passes"))
    for title in (*outcome.REPORTED, "bench broken", "problems of the bench"):
        assert run.section(title) == ""
    assert "1 passed; 0.00 bus hours, " in run.section("nodeproof")


@pytest.mark.parametrize(
    ("name", "options", "status"),
    [
        ("derived", ["--can-strict"], 1),
        ("derived", ["--can-require-all"], 0),
        ("lacking", ["--can-require-all"], 1),
        ("foreign", ["--can-require-all"], 1),
        ("lacking", ["--can-strict"], 12),
        ("doubtful", ["--can-strict", "--can-require-all"], 10),
    ],
)
def test_strict_and_require_all(
    pytester: pytest.Pytester, name: str, options: list[str], status: int
) -> None:
    """--can-strict makes observations fail, --can-require-all what was not seen."""
    assert judge(pytester, body(name), *options).status == status


@pytest.mark.slow
def test_a_failure_that_was_expected_is_an_observation(pytester: pytest.Pytester) -> None:
    """A known deviation (xfail) is shown, does not fail, and fails with --can-strict."""
    known = '\n@pytest.mark.xfail(reason="known")' + body("fails")
    run = judge(pytester, known)
    assert (run.status, run.outcomes) == (0, {"test_fails": "observation"})
    assert judge(pytester, known, "--can-strict").status == 1


def test_an_expected_failure_that_did_not_come_fails_where_it_is_strict(
    pytester: pytest.Pytester,
) -> None:
    """A strict xfail that passes is pytest's failure, and ours."""
    run = judge(pytester, "\n@pytest.mark.xfail(strict=True)" + body("passes"))
    assert (run.status, run.outcomes) == (1, {"test_passes": "failed"})


def test_an_error_after_the_test_is_told_besides_its_outcome(pytester: pytest.Pytester) -> None:
    """A bench that breaks while a fixture puts it back is an error; the verdict stays."""
    fixture = """
@pytest.fixture
def lamp(bench):
    yield
    raise BenchError("the lamp does not go out")
"""
    run = judge(pytester, fixture + body("passes").replace("(bench)", "(bench, lamp)"))
    assert run.outcomes == {"test_passes": "passed", "test_passes (teardown)": "error"}
    assert "BenchError: the lamp does not go out" in run.text
    assert run.status == 11


def test_somebody_elses_failure_is_a_failure(pytester: pytest.Pytester) -> None:
    """A failing test without a requirement gives 1, whatever came of ours."""
    foreign = "\ndef test_other():\n    assert False\n"
    run = judge(pytester, body("doubtful") + foreign)
    assert run.outcomes == {"test_doubtful": "inconclusive"}
    assert run.status == 1


def test_the_bench_is_for_tests_that_claim_something(pytester: pytest.Pytester) -> None:
    """A test that asks for the bench and claims no requirement is told what to add."""
    run = judge(pytester, "\ndef test_nothing_claimed(bench):\n    pass\n")
    assert "@pytest.mark.requirement(ID)" in run.text
    assert run.status == 1


def test_a_failure_reads_like_a_colleague(pytester: pytest.Pytester) -> None:
    """Requirement, clause, what was seen on the bus, where, the trace, and how to repeat it."""
    text = body("fails").replace("bench.fail", "bench.start(); bench.fail")
    run = judge(pytester, text)
    for part in (
        "NMT-02 (must; keypad specification",
        "requires: After power-on",
        "failed: not so",
        "<- 701#00",
        "checked at: test_device.py:",
        "trace: ",
        "repeat: pytest --can-reports=",
        "--can-seed=0 test_device.py::test_fails",
    ):
        assert part in run.text
    assert "Traceback" not in run.text


OUTCOMES = (
    outcome.PASSED,
    outcome.OBSERVATION,
    outcome.NOT_RUN,
    outcome.NOT_APPLICABLE,
    outcome.INCONCLUSIVE,
    outcome.ERROR,
    outcome.FAILED,
)


def expected_status(found: set[str]) -> int:
    """The table of the design, read line by line."""
    for name, status in ((outcome.FAILED, 1), (outcome.ERROR, 11), (outcome.INCONCLUSIVE, 10)):
        if name in found:
            return status
    return 0 if {outcome.PASSED, outcome.OBSERVATION} & found else 12


@pytest.mark.parametrize("size", range(len(OUTCOMES) + 1))
def test_precedence_of_exit_statuses(size: int) -> None:
    """For every set of outcomes: failed before error before inconclusive before nothing judged."""
    for found in combinations(OUTCOMES, size):
        own = 1 if {outcome.FAILED, outcome.ERROR} & set(found) else 0
        status = outcome.exit_status(found, own, require_all=False, broken=False)
        assert status == expected_status(set(found)), found


@pytest.mark.parametrize(
    ("found", "own", "status"),
    [
        (["passed"], 2, 2),
        (["failed"], 2, 1),
        (["error"], 2, 11),
        (["inconclusive"], 2, 2),
        ([], 2, 2),
        ([], 5, 12),
        (["passed"], 6, 6),
    ],
)
def test_pytest_own_status_stays_unless_ours_is_graver(
    found: list[str], own: int, status: int
) -> None:
    """An interrupted run keeps its status unless the device failed or the bench broke."""
    assert outcome.exit_status(found, own, require_all=False, broken=False) == status


@pytest.mark.parametrize(
    ("found", "status"), [("passed", 11), ("failed", 1), ("inconclusive", 11)]
)
def test_a_bench_that_could_not_be_put_back_costs_the_good_end(found: str, status: int) -> None:
    """What went wrong at the end gives 11, unless the device failed as well."""
    own = 1 if found == "failed" else 0
    assert outcome.exit_status([found], own, require_all=False, broken=True) == status


def failure(requirement: str) -> DeviceFailure:
    """A device that broke a requirement."""
    return DeviceFailure(Verdict(requirement, Outcome.FAIL, "not so"))


@pytest.mark.parametrize(
    ("body_says", "strict", "ends_on"),
    [("LED-06", False, "NMT-02"), ("LED-06", True, "LED-06"), ("LED-01", False, "LED-01")],
)
def test_a_must_that_a_monitor_sees_broken_is_no_observation(
    body_says: str, strict: bool, ends_on: str
) -> None:
    """What the test itself found is told, unless it weighs less than what a monitor found."""
    error = failure(body_says)
    came_of_body = outcome.classify(error, load("keypad"), strict)
    ends_with = outcome.prevails(error, failure("NMT-02"), came_of_body)
    assert isinstance(ends_with, DeviceFailure)
    assert ends_with.verdict.requirement == ends_on
