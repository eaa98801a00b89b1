"""What the seed of a run draws."""

from __future__ import annotations

from hil_tests.bench import tools
from hil_tests.chance import BORDERS, Chance
from tests.bench.fakes import bench_of


def numbers(seed: int, name: str) -> list[int]:
    """The beginning of a row."""
    row = Chance(seed).row(name)
    return [row.randrange(1000) for _ in range(8)]


def test_the_seed_and_the_name_decide_a_row() -> None:
    """The same both ways; another seed or another name draws others."""
    assert numbers(7, "period") == numbers(7, "period")
    assert numbers(7, "period") != numbers(8, "period")
    assert numbers(7, "period") != numbers(7, "sync time")


def test_rows_do_not_depend_on_each_other() -> None:
    """A test that is left out changes nothing for the others."""
    chance = Chance(7)
    chance.row("sync time").random()
    assert [chance.row("period").randrange(1000)] == numbers(7, "period")[:1]


def test_bytes_are_at_borders_half_of_the_time() -> None:
    """And every value comes up."""
    row = Chance(0).row("bytes")
    drawn = [Chance.byte(row) for _ in range(5000)]
    assert 2300 < sum(each in BORDERS for each in drawn) < 2900
    assert set(drawn) == set(range(256))


def test_the_bench_draws_from_the_seed_of_the_run() -> None:
    """Without a run it is 0."""
    bench, _ = bench_of()
    assert tools.chance(bench).seed == 0
    bench.seed = 5
    assert tools.chance(bench).seed == 5
