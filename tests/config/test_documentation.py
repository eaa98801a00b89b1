"""The examples in docs/ are read by the readers that they document."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import hil_tests
from hil_tests.config import KeypadProfile, load_bench, load_keypad
from hil_tests.config.bench import bench_from
from hil_tests.config.document import parse_document
from hil_tests.config.profile import profile_from

DOCS = Path(hil_tests.__file__).parents[1] / "docs"


def examples(page: str) -> list[str]:
    """The TOML blocks of a page."""
    if not DOCS.exists():
        pytest.skip(f"no documentation beside the installed package: {DOCS}")
    return re.findall(r"```toml\n(.*?)```", (DOCS / page).read_text("utf-8"), re.DOTALL)


def test_the_profile_example_is_a_profile() -> None:
    """And its values differ from the defaults where it says so."""
    (text,) = examples("profile.md")
    profile = profile_from(parse_document(text, "profile.md"), "profile.md")
    assert isinstance(profile, KeypadProfile)
    assert profile.limits.heartbeat_each_ppm == 30_000
    assert profile.limits.emcy_ns == load_keypad("keypad").limits.emcy_ns


def test_the_bench_examples_are_benches() -> None:
    """The whole file and the power section."""
    full, command = examples("bench.md")
    bench = bench_from(parse_document(full, "bench.md"), "bench.md")
    assert bench.facilities == ("power", "keys", "leds", "bitrate")
    power = bench_from(parse_document(command, "bench.md"), "bench.md").power
    assert power is not None
    assert power.on == ("relay", "--port", "1", "on")


def test_a_section_alone_makes_a_facility(tmp_path: Path) -> None:
    """As the page says."""
    path = tmp_path / "bench.toml"
    path.write_text('[leds]\ndriver = "operator"\n', "utf-8")
    assert load_bench(str(path)).facilities == ("leds",)
