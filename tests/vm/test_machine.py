"""The command line of the machine, and the scripts and the archive that it boots."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import pytest

from hil_tests.bench.drivers.neighbour import EXACT_TIME
from hil_tests.vm import guest
from hil_tests.vm.initramfs import archive, character_device, directory, regular
from hil_tests.vm.machine import Machine
from hil_tests.vm.modules import Module


def machine(shift: int = 0, results: tuple[Path, ...] = ()) -> list[str]:
    """Returns the command line of a machine in /run/x."""
    return Machine("qemu", Path("/k"), shift, "1G", results, Path("/run/x")).command_line()


def job(**changes: object) -> guest.Job:
    """Returns a job with some parts replaced."""
    parts: dict[str, object] = {
        "command": ("pytest", "-k", "a b"),
        "cwd": Path("/srv/me/my bench"),
        "environment": {"LANG": "C", "QUOTED": "it's", "BASH_FUNC_x%%": "() { :; }"},
        "channels": ("vcan0",),
        "results": (),
    }
    return guest.Job(**{**parts, **changes})  # type: ignore[arg-type]


@pytest.mark.parametrize("shift", [0, 2])
def test_the_clock_follows_counted_instructions(shift: int) -> None:
    """Idle time is skipped, and neither KVM nor a second processor spoils the count."""
    line = machine(shift)

    assert line[line.index("-icount") + 1] == f"shift={shift},sleep=off"
    assert line[line.index("-accel") + 1] == "tcg"
    assert line[line.index("-smp") + 1] == "1"
    assert "-enable-kvm" not in line


def test_memory_is_not_copied_byte_by_byte() -> None:
    """The processor has all that the emulator offers, except what it is slow at."""
    line = machine()

    assert line[line.index("-cpu") + 1].split(",") == ["max", "-erms"]


def test_the_host_is_shared_read_only_and_results_are_not() -> None:
    """Only what was named can be written to; a comma in a path is doubled for QEMU."""
    shares = [word for word in machine(results=(Path("/a,b"),)) if word.startswith("local,")]

    assert "readonly=on" in shares[0]
    assert "readonly" not in shares[1]
    assert "path=/a,,b," in shares[1]


def test_the_job_keeps_folder_arguments_and_environment() -> None:
    """Spaces and quotes survive; what no shell can export is left out; no bytecode is written."""
    script = guest.job_script(job())

    assert "cd '/srv/me/my bench' || exit 126" in script
    assert "exec pytest -k 'a b'" in script
    assert "export QUOTED='it'\"'\"'s'" in script
    assert "BASH_FUNC" not in script
    assert "export PYTHONDONTWRITEBYTECODE=1" in script
    assert f"export {EXACT_TIME}=1" in script


@pytest.mark.parametrize("results", [(), (Path("/r/one two"), Path("/s"))])
def test_the_scripts_are_valid_shell(results: tuple[Path, ...]) -> None:
    """A shell that only reads them (-n) finds no fault."""
    asked = job(channels=("vcan0", "vcan1"), results=results)
    for script in (guest.init_script(asked, ["can"]), guest.copy_script(asked)):
        subprocess.run(["sh", "-n"], input=script, text=True, check=True)


@pytest.fixture(name="guest_files")
def _guest_files(tmp_path: Path) -> Path:
    """The folders of a guest that `copy` works on, with a run in them."""
    for name in ("run", "results0", "writes/upper/r/7/traces"):
        (tmp_path / name).mkdir(parents=True)
    (tmp_path / "writes/upper/r/7/results.json").write_text("{")
    (tmp_path / "writes/upper/r/7/traces/t.pcapng").write_text("frames")
    (tmp_path / "writes/upper/r/latest").symlink_to("7")
    return tmp_path


def copy(files: Path, *extent: str) -> None:
    """Runs the script that brings results out, with the guest's folders in another place."""
    script = guest.copy_script(job(results=(Path("/r"),)))
    for name in ("/run/", "/writes/", "/results0"):
        script = script.replace(name, f"{files}{name}")
    subprocess.run(["sh", "-s", *extent], input=script, text=True, check=True)


def brought_out(files: Path) -> dict[str, str]:
    """Files of the results folder, and where its links lead."""
    folder = files / "results0"
    found = [path for path in folder.rglob("*") if path.is_symlink() or path.is_file()]
    return {
        f"{path.relative_to(folder)}": path.readlink().name
        if path.is_symlink()
        else path.read_text()
        for path in found
    }


@pytest.mark.skipif(shutil.which("cpio") is None, reason="no cpio program")
@pytest.mark.parametrize("extent", [("fresh",), ()])
def test_results_are_brought_out(extent: tuple[str, ...], guest_files: Path) -> None:
    """Again and again: what has changed and what has gone since shows in the end."""
    copy(guest_files, *extent)
    run = {"7/results.json": "{", "7/traces/t.pcapng": "frames", "latest": "7"}
    assert brought_out(guest_files) == run
    (guest_files / "writes/upper/r/7/results.json").write_text("{}")
    (guest_files / "writes/upper/r/7/traces/t.pcapng").unlink()
    os.utime(guest_files / "writes/upper/r/7/results.json", (1 << 32, 1 << 32))
    copy(guest_files, *extent)
    gone = {} if not extent else {"7/traces/t.pcapng": "frames"}
    assert brought_out(guest_files) == {"7/results.json": "{}", "latest": "7", **gone}
    assert not (guest_files / "run" / "copying").exists()


@pytest.mark.skipif(shutil.which("cpio") is None, reason="no cpio program")
def test_a_result_is_replaced_as_a_whole(guest_files: Path) -> None:
    """Who reads the one before while it is copied reads that one to its end."""
    copy(guest_files)
    with (guest_files / "results0/7/results.json").open() as before:
        (guest_files / "writes/upper/r/7/results.json").write_text("[]")
        copy(guest_files)
        assert before.read() == "{"
    assert brought_out(guest_files)["7/results.json"] == "[]"


@pytest.mark.skipif(shutil.which("cpio") is None, reason="no cpio program")
def test_what_is_as_it_was_brought_out_stays_as_it_is(guest_files: Path) -> None:
    """At the end a file with an old time comes out as well; no other is copied once more."""
    upper, results = guest_files / "writes/upper/r/7", guest_files / "results0/7"
    os.utime(upper / "traces/t.pcapng", (10, 10))
    copy(guest_files, "fresh")
    first = (results / "traces/t.pcapng").stat().st_ino
    (upper / "moved").write_text("here")
    os.utime(upper / "moved", (20, 20))

    copy(guest_files)

    assert (results / "moved").read_text() == "here"
    assert (results / "traces/t.pcapng").stat().st_ino == first


@pytest.mark.skipif(shutil.which("cpio") is None, reason="no cpio program")
def test_a_file_that_changed_in_the_second_of_a_copy_is_copied_again(guest_files: Path) -> None:
    """Neither its time, nor its size, nor its place on the disk tells."""
    changed = guest_files / "writes/upper/r/7/results.json"
    copy(guest_files, "fresh")
    at = (guest_files / "run/copied").stat().st_mtime_ns + 1_000_000_000
    changed.write_text("}")
    os.utime(changed, ns=(at, at))

    copy(guest_files, "fresh")

    assert brought_out(guest_files)["7/results.json"] == "}"


def test_every_channel_is_made() -> None:
    """Each --channel gets its line."""
    script = guest.init_script(job(channels=("vcan0", "can7")), [])

    assert "ip link add dev vcan0 type vcan" in script
    assert "ip link set can7 up" in script


def test_initial_files_hold_modules_job_and_first_process() -> None:
    """All that the guest needs before it sees the host is in the archive."""
    files = guest.initial_files(job(), b"BUSYBOX", [Module("can_raw", b"ELF")])

    for name in (
        b"bin/busybox\0",
        b"modules/can_raw.ko\0",
        b"job\0",
        b"init\0",
        b"bin/copy-out\0",
    ):
        assert name in files


@pytest.mark.skipif(shutil.which("cpio") is None, reason="no cpio program to compare with")
def test_the_archive_is_read_by_cpio() -> None:
    """An independent reader finds the same names and contents."""
    entries = [directory("d"), regular("d/file", b"hello"), character_device("null", 1, 3)]

    read = subprocess.run(
        ["cpio", "-it", "--quiet"], input=archive(entries), capture_output=True, check=True
    )

    assert read.stdout.split() == [b"d", b"d/file", b"null"]


def test_the_archive_is_aligned_and_ended() -> None:
    """Every record starts at a multiple of four bytes, and the last one is the trailer."""
    packed = archive([regular("a", b"12345")])

    assert len(packed) % 4 == 0
    assert packed.startswith(b"070701")
    assert packed.rstrip(b"\0").endswith(b"TRAILER!!!")
