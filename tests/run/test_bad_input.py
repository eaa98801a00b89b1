"""Whatever a user gets wrong: a clear error, the remedy, the right status, no traceback."""

from __future__ import annotations

import pytest

from tests.run.harness import ROOT, Judged, judge

pytest_plugins = ["pytester"]

BODY = """
@pytest.mark.requirement("NMT-02")
def test_one(bench):
    bench.start()

@pytest.mark.requirement("NMT-02")
def test_two(bench):
    bench.start()
"""

PROFILE = (ROOT / "node_model" / "profiles" / "keypad.toml").read_text("utf-8")


def assert_readable(run: Judged) -> None:
    """No traceback of ours or of pytest's reaches the user."""
    for bad in ("Traceback", "INTERNALERROR", "site-packages", "raise "):
        assert bad not in run.text, run.text


@pytest.mark.parametrize(
    ("options", "hints"),
    [
        (["--can-node-id=0"], ["--can-node-id 0", "allowed 1 .. 127"]),
        (["--can-node-id=100"], ["node id 100: a keypad has one of 1 .. 15"]),
        (["--can-node-id=two"], ["invalid int value: 'two'"]),
        (["--can-bitrate=5"], ["--can-bitrate 5", "allowed 10000 .. 1000000"]),
        (["--can-seed=-1"], ["--can-seed -1", "out of range"]),
        (["--can-device=toaster"], ["invalid choice: 'toaster'", "external"]),
        (["--can-device=external"], ["--can-device external: on which bus?", "--can-iface NAME"]),
        (["--can-interface=pcan"], ["--can-interface pcan: on which bus?", "--can-iface NAME"]),
        (["--can-profile=keypda"], ["'keypda': no such profile; did you mean keypad?"]),
        (["--can-profile=./none.toml"], ["none.toml", "no such file"]),
        (["--can-bench=./none.toml"], ["none.toml", "no such file"]),
        (["--can-bench=./none.toml", "--can-profile=keypda"], ["none.toml", "keypda"]),
        (["--can-mutant=Boot-Up-Mising"], ["did you mean boot-up-missing", "list names them all"]),
        (["--can-mutant=zzz"], ["--can-mutant zzz: no such model; --can-mutant list"]),
        (
            ["--can-mutant=boot-up-late", "--can-iface=can0"],
            ["the device on can0 is external; add --can-device model"],
        ),
        (
            ["--can-interface=virtual", "--can-iface=x"],
            ["virtual ends at its own process", "use udp_multicast"],
        ),
        (["--can-budget=soon"], ["--can-budget 'soon' is no time", "ns, us, ms, s, min, h"]),
        (["--can-eds=x.eds"], ["--can-eds x.eds: no such file"]),
        (
            ["--can-profile=generic", "--can-eds=x.eds"],
            ["--can-eds x.eds: no such file"],
        ),
        (["--can-profile=generic"], ["say which with --can-eds FILE"]),
        (
            ["--can-node-id=100", "--can-budget=x", "--can-mutant=y"],
            ["node id 100", "--can-budget 'x' is no time", "--can-mutant y"],
        ),
        (["--can-no-such=1"], ["unrecognized arguments: --can-no-such=1"]),
    ],
)
def test_wrong_options(pytester: pytest.Pytester, options: list[str], hints: list[str]) -> None:
    """Exit status 4, every problem named with what would be right, and nothing opened."""
    run = judge(pytester, BODY, *options)
    assert run.status == 4
    for hint in hints:
        assert hint in run.text
    assert_readable(run)
    assert not run.reports.exists()


@pytest.mark.parametrize(
    ("edits", "hints"),
    [
        ({'blink_on = "': 'blnik_on = "'}, ["leds.blnik_on", "did you mean blink_on"]),
        ({"[keys]": "[keys"}, ["device.toml"]),
        (
            {'blink_on = "': 'blnik_on = "', "frame_bytes = 1": "frame_bytes = 9"},
            ["leds.blnik_on", "keys.frame_bytes", "9"],
        ),
    ],
)
def test_a_broken_profile(
    pytester: pytest.Pytester, edits: dict[str, str], hints: list[str]
) -> None:
    """All errors at once, each with file and path; exit status 4."""
    text = PROFILE
    for old, new in edits.items():
        assert old in text
        text = text.replace(old, new, 1)
    (pytester.path / "device.toml").write_text(text, "utf-8")
    run = judge(pytester, BODY, "--can-profile=./device.toml")
    assert run.status == 4
    assert "device.toml" in run.text
    for hint in hints:
        assert hint in run.text
    assert_readable(run)


@pytest.mark.parametrize(
    ("text", "hints"),
    [
        ("[bus\n", ["desk.toml"]),
        ("[buss]\nchannel = 'can0'\n", ["desk.toml: buss", "did you mean bus"]),
        (
            "[bus]\nchannel = 'can0'\nbitrate = 'fast'\n[device]\nnode_id = 300\n",
            ["bus.bitrate", "device.node_id", "300"],
        ),
        (
            "[bus]\nchannel = 'can0'\n[power]\ndriver = 'control'\n",
            ["power.driver", "needs [control]"],
        ),
        (
            "[bus]\nchannel = 'can0'\n[power]\ndriver = 'operator'\ntimeout = '3 apples'\n",
            ["power.timeout", "3 apples"],
        ),
        ("[bench]\nname = 'desk'\n", ["--can-bench ./desk.toml: on which bus?", "[bus] channel"]),
    ],
)
def test_a_broken_bench_file(pytester: pytest.Pytester, text: str, hints: list[str]) -> None:
    """All errors at once, each with file and path; exit status 4."""
    (pytester.path / "desk.toml").write_text(text, "utf-8")
    run = judge(pytester, BODY, "--can-bench=./desk.toml")
    assert run.status == 4
    for hint in hints:
        assert hint in run.text
    assert_readable(run)
    assert not run.reports.exists()


def test_a_file_in_place_of_the_reports_folder(pytester: pytest.Pytester) -> None:
    """A reports folder that cannot be made is a usage error with the remedy."""
    (pytester.path / "reports").write_text("I am a file", "utf-8")
    run = judge(pytester, BODY)
    assert run.status == 4
    assert "choose another place with --can-reports DIR" in run.text
    assert_readable(run)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("options", "hints"),
    [
        (["--can-iface=can77"], ["can77"]),
        (["--can-interface=pcam", "--can-iface=x"], ["no interface type 'pcam'", "pcan"]),
        (
            ["--can-interface=pcan", "--can-iface=PCAN_USBBUS1"],
            ["python-can cannot open PCAN_USBBUS1 (pcan)", "driver"],
        ),
    ],
)
def test_a_missing_interface(
    pytester: pytest.Pytester, options: list[str], hints: list[str]
) -> None:
    """Exit status 11; the cause is told once for the bench and in one line for each test."""
    run = judge(pytester, BODY, *options)
    assert run.status == 11
    for hint in hints:
        assert hint in run.text
    assert run.outcomes == {"test_one": "error", "test_two": "error"}
    assert run.text.count("BENCH BROKEN: ") == 1
    assert run.section("ERRORS").count("BenchError: the bench is broken: ") == 2
    assert len(run.section("ERRORS").splitlines()) <= 6
    assert_readable(run)


def test_a_profile_that_the_model_cannot_be(pytester: pytest.Pytester) -> None:
    """Where the model's own reader refuses a profile, the remedy is the device itself."""
    text = PROFILE.replace("[factory]", "[factory]\nlanguage = 1", 1)
    (pytester.path / "device.toml").write_text(text, "utf-8")
    run = judge(pytester, BODY, "--can-profile=./device.toml")
    assert run.status == 4
    assert_readable(run)
