"""Kernels, modules, packages and native interfaces: what is found, chosen and said."""

from __future__ import annotations

import lzma
import os
import struct
from pathlib import Path

import pytest

from hil_tests.vm import equipment, image, kernel, modules, native, packages
from hil_tests.vm.errors import Unavailable
from tests.vm.fakes import FakeShell

RELEASE = "6.1.0-1-test"


def boot_image(payload: bytes = b"") -> bytes:
    """Returns a boot image with the header fields that are read, and a payload at sector 2."""
    image_bytes = bytearray(1024)
    image_bytes[0x1F1] = 1
    image_bytes[0x202:0x206] = b"HdrS"
    struct.pack_into("<H", image_bytes, 0x20E, 0x100)
    struct.pack_into("<II", image_bytes, 0x248, 0, len(payload))
    text = f"{RELEASE} (builder) #1\0".encode()
    image_bytes[0x300 : 0x300 + len(text)] = text
    return bytes(image_bytes) + payload


def module(depends: str) -> bytes:
    """Returns a module as far as it is read."""
    return b"\x7fELF\0license=GPL\0depends=" + depends.encode() + b"\0retpoline=Y\0"


def install(root: Path) -> Path:
    """Makes a kernel with its modules below `root` and returns the boot image."""
    folder = root / "lib/modules" / RELEASE / "kernel"
    folder.mkdir(parents=True)
    for name in modules.NEEDED:
        (folder / f"{name.replace('_', '-')}.ko").write_bytes(module(""))
    (root / "boot").mkdir()
    path = root / "boot" / f"vmlinuz-{RELEASE}"
    path.write_bytes(boot_image(lzma.compress(b"\x7fELF kernel")))
    return path


def test_the_release_is_read_from_the_image(tmp_path: Path) -> None:
    """Not from its name, which a user may have changed."""
    path = tmp_path / "renamed"
    path.write_bytes(boot_image())

    assert image.release(path) == RELEASE


@pytest.mark.parametrize(
    ("data", "said"), [(b"#!/bin/sh", "no bootable"), (None, "cannot be read")]
)
def test_what_is_no_kernel_is_refused(tmp_path: Path, data: bytes | None, said: str) -> None:
    """A wrong file and a missing one have different messages."""
    path = tmp_path / "kernel"
    if data is not None:
        path.write_bytes(data)

    with pytest.raises(Unavailable, match=said):
        image.release(path)


@pytest.mark.parametrize(
    ("payload", "unpacked"),
    [
        (lzma.compress(b"\x7fELF x") + b"size", b"\x7fELF x"),
        (lzma.compress(b"x"), None),
        (b"?", None),
    ],
)
def test_a_kernel_is_unpacked_if_it_can_be(payload: bytes, unpacked: bytes | None) -> None:
    """An unknown compression, or contents other than ELF, leave the image as it is."""
    assert image.uncompressed(boot_image(payload)) == unpacked


def test_modules_come_after_what_they_need(tmp_path: Path) -> None:
    """Dependencies are followed, through compression and either spelling of a name."""
    (tmp_path / "vcan.ko").write_bytes(module("can-dev"))
    (tmp_path / "can-dev.ko.xz").write_bytes(lzma.compress(module("can")))
    (tmp_path / "can.ko").write_bytes(module(""))

    assert [found.name for found in modules.closure(tmp_path, ("vcan",))] == [
        "can",
        "can_dev",
        "vcan",
    ]


def test_a_module_that_is_built_in_is_not_loaded(tmp_path: Path) -> None:
    """modules.builtin names it."""
    (tmp_path / "modules.builtin").write_text("kernel/fs/9p/9p.ko\n")

    assert modules.closure(tmp_path, ("9p",)) == ()


def test_a_kernel_without_vcan_is_named_with_a_remedy(tmp_path: Path) -> None:
    """The message says which module and what to do."""
    with pytest.raises(Unavailable, match=r"no module 'vcan'.*--kernel"):
        modules.closure(tmp_path, ("vcan",))


def test_the_modules_beside_a_given_kernel_are_found(tmp_path: Path) -> None:
    """An unpacked package needs no installation."""
    assert kernel.given(install(tmp_path)).modules == tmp_path / "lib/modules" / RELEASE


def test_a_fetched_kernel_is_preferred_to_the_hosts(tmp_path: Path) -> None:
    """The host's own is the second choice, and none at all is no error."""
    assert kernel.find(tmp_path / "cache", tmp_path) is None
    install(tmp_path)
    assert (found := kernel.find(tmp_path / "cache", tmp_path)) is not None
    assert found.image.parent == tmp_path / "boot"
    fetched = install(tmp_path / "cache" / "one")
    assert (found := kernel.find(tmp_path / "cache", tmp_path)) is not None
    assert found.image == fetched


def test_the_unpacked_kernel_is_kept_and_renewed(tmp_path: Path) -> None:
    """It is made once, and again when the kernel is newer."""
    given = kernel.given(install(tmp_path))
    target = kernel.unpacked(given, tmp_path / "u").image
    assert target.read_bytes() == b"\x7fELF kernel"

    given.image.write_bytes(boot_image(lzma.compress(b"\x7fELF newer")))
    later = target.stat().st_mtime + 10
    os.utime(given.image, (later, later))

    assert kernel.unpacked(given, tmp_path / "u").image.read_bytes() == b"\x7fELF newer"


def test_the_newest_kernel_package_is_found() -> None:
    """As `apt-cache depends` prints it."""
    shell = FakeShell(
        {"apt-get": "/a", "dpkg": "/d"},
        {
            (
                "apt-cache",
                "depends",
                "linux-image-amd64",
            ): "x\n  Depends: linux-image-6.1.0-9-amd64\n"
        },
    )

    assert packages.kernel_package(shell) == "linux-image-6.1.0-9-amd64"


@pytest.mark.parametrize(
    ("programs", "said"),
    [({}, "no apt-get and dpkg"), ({"apt-get": "/a", "dpkg": "/d"}, "apt-get update")],
)
def test_where_no_kernel_can_be_fetched_a_way_is_shown(
    programs: dict[str, str], said: str
) -> None:
    """A system without apt and one with empty lists need different remedies."""
    with pytest.raises(Unavailable, match=said):
        packages.kernel_package(FakeShell(programs))


def test_a_package_is_unpacked_beside_and_renamed(tmp_path: Path) -> None:
    """The folder appears complete, and a second time nothing is fetched."""

    def act(command: tuple[str, ...], cwd: Path | None) -> None:
        if command[:2] == ("apt-get", "download"):
            assert cwd is not None
            (cwd / "busybox.deb").touch()
        if command[0] == "dpkg":
            (Path(command[-1]) / "bin").mkdir(parents=True)
            (Path(command[-1]) / "bin/busybox").touch()

    shell = FakeShell({"apt-get": "/a", "dpkg": "/d"}, act=act)

    assert packages.fetch_busybox(shell, tmp_path / "bb") == tmp_path / "bb/bin/busybox"
    fetched = len(shell.ran)
    packages.fetch_busybox(shell, tmp_path / "bb")
    assert len(shell.ran) == fetched
    assert [path.name for path in tmp_path.iterdir()] == ["bb"]


def test_missing_parts_are_named_together(tmp_path: Path) -> None:
    """One message for all, with the command that mends it."""
    with pytest.raises(Unavailable, match=r"qemu-system-x86_64.*busybox.*--setup"):
        equipment.gather(FakeShell(), tmp_path, None)


def test_without_root_the_command_for_qemu_is_shown(tmp_path: Path) -> None:
    """Everything else is fetched, QEMU is left to the user."""
    (tmp_path / "busybox/bin").mkdir(parents=True)
    (tmp_path / "busybox/bin/busybox").write_bytes(b"\x7fELF static")
    install(tmp_path / "kernels/one")

    left = equipment.set_up(FakeShell(), tmp_path)

    assert left == ["sudo apt-get install -y --no-install-recommends qemu-system-x86"]


def test_a_dynamic_busybox_will_not_do(tmp_path: Path) -> None:
    """In the first process there is no library to load it with."""
    busybox = tmp_path / "busybox"
    busybox.write_bytes(b"\x7fELF ... /lib64/ld-linux-x86-64.so.2\0")
    shell = FakeShell({"busybox": str(busybox), "qemu-system-x86_64": "/q"})

    with pytest.raises(Unavailable, match="static busybox"):
        equipment.gather(shell, tmp_path / "cache", install(tmp_path))


@pytest.mark.parametrize(
    ("has_can", "up", "root", "said"),
    [
        (False, False, True, "no SocketCAN"),
        (True, True, False, None),
        (True, False, True, None),
        (True, False, False, "sudo ip link add dev vcan0 type vcan"),
    ],
)
def test_why_this_kernel_will_not_do(
    has_can: bool, up: bool, root: bool, said: str | None
) -> None:
    """Up is enough; down needs root; without SocketCAN nothing helps."""
    shell = FakeShell({"ip": "/sbin/ip"}, root=root)

    why = native.obstacle(["vcan0"], shell, native.Probe(lambda: has_can, lambda _: up))

    assert (why is None) if said is None else (why is not None and said in why)


def test_a_missing_interface_is_made_and_a_present_one_left_alone() -> None:
    """The kernel has the last word: a failure to bring it up is reported."""
    up = ("ip", "link", "set", "vcan1", "up")
    shell = FakeShell(answers={up: ""}, root=True)
    native.make(["vcan0", "vcan1"], shell, native.Probe(is_up=lambda name: name == "vcan0"))
    assert up in shell.ran
    assert not [command for command in shell.ran if "vcan0" in command]

    with pytest.raises(Unavailable, match="ip link set vcan1 up"):
        native.make(["vcan1"], FakeShell(root=True), native.Probe(is_up=lambda _: False))


@pytest.mark.parametrize(
    ("kind", "flags", "up"), [("280", "0xc1", True), ("280", "0xc0", False), ("1", "0x1", False)]
)
def test_only_a_can_interface_that_is_up_counts(
    tmp_path: Path, kind: str, flags: str, up: bool
) -> None:
    """An Ethernet interface of that name, or one that is down, does not."""
    (tmp_path / "vcan0").mkdir()
    (tmp_path / "vcan0/type").write_text(f"{kind}\n")
    (tmp_path / "vcan0/flags").write_text(f"{flags}\n")

    assert native.is_up("vcan0", tmp_path) is up
    assert not native.is_up("vcan9", tmp_path)
