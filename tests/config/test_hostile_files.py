"""Files that are no files, no text, no TOML, or meant to hurt: a clear line, never a traceback."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import attrs
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from hil_tests.config import load_bench, load_profile
from hil_tests.config.bench import bench_from
from hil_tests.config.document import MAX_BYTES, MAX_LINE, parse_document
from hil_tests.config.profile import profile_from
from hil_tests.config.reading import structure
from hil_tests.config.report import Problem, near_miss, refuse, show
from hil_tests.errors import ConfigError

READERS: list[Callable[[str], object]] = [load_profile, load_bench]
KEYS = [
    *("bench", "bus", "device", "control", "power", "keys", "leds", "bitrate", "factory"),
    *("limits", "shortest_heartbeat", "name", "kind", "bits", "commissioning", "frame_bytes"),
    *("driver", "on", "off", "timeout", "address", "parameters", "node_id", "125k", "scan"),
]
WORDS = ["keypad", "control", "command", "operator", "5 %", "5 ms", "tcp:a:1", "a", ""]


class Broken:
    """A rule with a slip."""

    def read(self, value: object) -> int:
        """Break."""
        raise LookupError(f"slip at {value}")


@attrs.frozen
class Shape:
    """One value with that rule."""

    x: Annotated[int, Broken()]


def said(reader: Callable[[str], object], path: object) -> str:
    """What a reader answers to a file that it must refuse."""
    with pytest.raises(ConfigError) as caught:
        reader(str(path))
    return str(caught.value)


def complaint(read: Callable[..., object], *arguments: object) -> list[str]:
    """The lines of the refusal, none where all is well."""
    try:
        read(*arguments)
    except ConfigError as error:
        return str(error).split("\n")
    return []


@pytest.mark.parametrize("reader", READERS)
def test_a_missing_file_names_its_neighbour(
    tmp_path: Path, reader: Callable[[str], object]
) -> None:
    """A slip in the name is the usual reason."""
    (tmp_path / "bench.toml").touch()
    found = said(reader, tmp_path / "bensh.toml")
    assert found.endswith(f"no such file; did you mean {tmp_path / 'bench.toml'}?")


@pytest.mark.parametrize("reader", READERS)
def test_a_missing_folder_is_said(tmp_path: Path, reader: Callable[[str], object]) -> None:
    """There are no neighbours to look at."""
    assert "cannot be listed" in said(reader, tmp_path / "no" / "bench.toml")


@pytest.mark.parametrize("reader", READERS)
def test_a_directory_and_a_pipe_are_no_files(
    tmp_path: Path, reader: Callable[[str], object]
) -> None:
    """Opening the pipe would wait for a writer for ever."""
    pipe = tmp_path / "pipe.toml"
    os.mkfifo(pipe)
    assert "is a directory; name the TOML file in it" in said(reader, tmp_path)
    assert "is a device, pipe or socket" in said(reader, pipe)


@pytest.mark.parametrize("reader", READERS)
@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b'[bus]\nchannel = "\xff"\n', "line 2: byte 0xff is no UTF-8; save it as UTF-8"),
        (b"[bus]\nx = \n", "line 2, column 5: no TOML: Invalid value"),
        (b"[bus]\nx = 1\nx = 2\n", "line 3, column 6: no TOML: Cannot overwrite a value"),
        (b"[bus]\nx = 1\nx = 2", "line 3, at the end: no TOML: Cannot overwrite a value"),
        (b"[bus]\n[bus]\n", "line 2, column 5: no TOML: Cannot declare ('bus',) twice"),
        (b"\0", "line 1, column 1: no TOML"),
        (b"x = " + b"9" * 900 + b"e", "no TOML"),
        (b"x = [\n" + b"[\n" * 9000, "nested too deeply"),
        (b"x" * (MAX_LINE + 1), f"line 1: longer than {MAX_LINE} characters"),
        (b"#\n" * MAX_BYTES, "larger than 64 KiB; is it the right file?"),
    ],
)
def test_what_is_no_toml_is_told_with_its_line(
    tmp_path: Path, reader: Callable[[str], object], data: bytes, words: str
) -> None:
    """Syntax, encoding, size and depth."""
    path = tmp_path / "x.toml"
    path.write_bytes(data)
    assert words in said(reader, path)


def test_sizes_up_to_the_limits_are_read(tmp_path: Path) -> None:
    """The last byte and the last column that are allowed."""
    path = tmp_path / "x.toml"
    path.write_bytes(b"#" * MAX_LINE + b"\n" * (MAX_BYTES - MAX_LINE))
    assert load_bench(str(path)).name == "x"


def test_a_file_from_a_windows_editor_is_read(tmp_path: Path) -> None:
    """Byte order mark and CR LF."""
    path = tmp_path / "x.toml"
    path.write_bytes(b'\xef\xbb\xbf[bench]\r\nname = "desk"\r\n')
    assert load_bench(str(path)).name == "desk"


def test_a_number_too_long_to_print_is_named_by_its_kind() -> None:
    """Once str() of a hexadecimal number of 4,900 digits raised ValueError in the message."""
    digits = "f" * 900
    assert show(int(digits * 10, 16)) == "a very long int"
    assert show(int(digits, 16)).count("...") == 1


def test_what_is_shown_is_short_and_harmless() -> None:
    """Control codes never reach the terminal."""
    assert show("\x1b[31m") == "'\\x1b[31m'"
    assert len(show("x" * 999)) <= 66
    assert len(show([["x" * 99] * 99] * 99)) <= 66
    assert show(value=True) == "true"
    with pytest.raises(ConfigError, match=r"^'a\\nb': 'x y'\.k: no$"):
        refuse("a\nb", [Problem(("x y", "k"), "no")])


def test_a_near_miss_or_the_list() -> None:
    """Names of a thousand characters are not compared."""
    assert near_miss("SCAN", ["scan", "led"]) == "did you mean scan?"
    assert near_miss("zzz", ["scan", "led"]) == "known: led, scan"
    assert near_miss("scan" * 999, ["scan"]) == "known: scan"
    assert near_miss("x", []) == "none are known here"
    assert near_miss("zz", [f"n{n:02}" for n in range(17)]).endswith("n15, ...")


def test_known_names_out_of_the_file_are_shown_with_care() -> None:
    """Once the list of a file's own key names went to the terminal as it stood."""
    assert near_miss("on_off", ["\x1b[2J", "k" * 900]).startswith("known: '\\x1b[2J', 'kkk")
    assert len(near_miss("on_off", ["k" * 900])) < 80
    assert near_miss("a\nb", ["a\nb "]) == "did you mean 'a\\nb '?"


def test_a_number_that_python_does_not_convert_is_told() -> None:
    """An interpreter can be set to fewer digits than a line holds."""
    before = sys.get_int_max_str_digits()
    sys.set_int_max_str_digits(640)
    try:
        (line,) = complaint(parse_document, "x = " + "9" * 900, "x.toml")
    finally:
        sys.set_int_max_str_digits(before)
    assert line.startswith("x.toml: no TOML: Exceeds the limit (640 digits)")


def test_a_rule_that_breaks_is_an_error_of_the_file() -> None:
    """A slip in a rule must not become a traceback for the user either."""
    assert structure({"x": 3}, Shape) == [Problem(("x",), "cannot be used: slip at 3", 3)]


def test_importing_the_plugins_errors_does_not_import_attrs() -> None:
    """Both are paid for when a file is read, not by every pytest run."""
    code = "import sys, hil_tests.errors, hil_tests.requirements; print('attr' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"


scalars = st.one_of(
    st.booleans(),
    st.integers(),
    st.floats(),
    st.dates(),
    st.times(),
    st.text(max_size=20),
    st.sampled_from(WORDS),
)
names = st.one_of(st.sampled_from(KEYS), st.text(max_size=10))
values = st.recursive(
    scalars,
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(names, inner, max_size=6),
    max_leaves=8,
)
tables = st.dictionaries(names, values, max_size=5)


@pytest.mark.slow
@given(st.dictionaries(names, tables | values, max_size=6))
def test_any_document_is_read_or_refused(document: dict[str, Any]) -> None:
    """Whatever TOML can hold: an answer, or a ConfigError whose every line names the file."""
    for read in (profile_from, bench_from):
        answer = complaint(read, document, "x.toml")
        assert all(line.startswith("x.toml: ") for line in answer)


@given(
    st.text(
        alphabet=st.sampled_from("[]{}=\"'.,#\n\r\t -+_ex0123456789abkT:Z\\u\x00é"), max_size=80
    )
)
@example("a = 0x" + "f" * 900)
@example("a = 2020-13-01")
def test_any_text_is_parsed_or_refused(text: str) -> None:
    """Whatever an editor can hold."""
    assert all(line.startswith("x.toml: ") for line in complaint(parse_document, text, "x.toml"))


@given(data=st.binary(max_size=200))
def test_any_bytes_are_read_or_refused(
    data: bytes, tmp_path_factory: pytest.TempPathFactory
) -> None:
    """Whatever a disk can hold."""
    path = tmp_path_factory.getbasetemp() / "bytes.toml"
    path.write_bytes(data)
    for reader in READERS:
        assert all(line.startswith(f"{path}: ") for line in complaint(reader, str(path)))
