"""`nodeproof vcan -- COMMAND`: its options, and the choice between this kernel and a machine."""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from hil_tests.vm import bytecode, equipment, guest, kernel, modules, native
from hil_tests.vm.errors import Unavailable
from hil_tests.vm.launcher import Launcher
from hil_tests.vm.machine import Machine
from hil_tests.vm.shell import HostShell, Shell, cache_folder
from hil_tests.vm.tail import Tail

# The project's status for "bench or bus unavailable".
UNAVAILABLE = 11

_DESCRIPTION = """Runs COMMAND where a SocketCAN interface exists: on this kernel if possible, else
in a virtual machine that boots on this very file system. In the machine time is virtual: waiting
costs next to nothing, and timing does not suffer from a busy host. What COMMAND writes there is
lost, except in the folders given with --results. Exit status: COMMAND's; 11 where no SocketCAN is
to be had, 124 when the time was over."""


@dataclass(frozen=True, slots=True)
class Host:
    """What a run needs to know of this machine.

    Attributes:
        shell: Its programs.
        probe: Its kernel's CAN interfaces.
        cache: Where fetched kernels are.
    """

    shell: Shell
    probe: native.Probe
    cache: Path


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the options of `nodeproof vcan` to a parser."""
    parser.description = _DESCRIPTION
    parser.usage = "%(prog)s [OPTION]... -- COMMAND [ARGUMENT]..."
    parser.add_argument("command", nargs=argparse.REMAINDER, help="what to run, after --")
    _add_choices(parser)
    _add_machine(parser)


def _add_choices(parser: argparse.ArgumentParser) -> None:
    where = parser.add_mutually_exclusive_group()
    where.add_argument("--vm", action="store_true", help="use the machine in any case")
    where.add_argument("--native", action="store_true", help="never use the machine")
    where.add_argument("--check", action="store_true", help="only say what would be used, and why")
    parser.add_argument("--setup", action="store_true", help="fetch what the machine lacks")
    parser.add_argument(
        "--channel",
        action="append",
        metavar="NAME",
        help="CAN interface to have (default vcan0; may be repeated)",
    )
    parser.add_argument("--quiet", action="store_true", help="print no progress")


def _add_machine(parser: argparse.ArgumentParser) -> None:
    machine = parser.add_argument_group("the virtual machine")
    machine.add_argument(
        "--results", action="append", type=Path, default=[], metavar="DIR",
        help="folder that COMMAND may write to for good; made if missing (may be repeated)",
    )  # fmt: skip
    machine.add_argument(
        "--compile", action="append", type=Path, default=[], metavar="DIR",
        help="compile the Python files in DIR first (importing them uncompiled is slow in there);"
        " if COMMAND is pytest, it collects its tests here first, to the same end",
    )  # fmt: skip
    machine.add_argument(
        "--timeout", type=float, metavar="SECONDS", help="end the machine after that"
    )
    machine.add_argument("--memory", default="1G", metavar="SIZE", help="its memory (default 1G)")
    machine.add_argument(
        "--shift", type=int, choices=range(11), default=0, metavar="N",
        help="an instruction takes 2^N ns of its time (default 0: the fastest processor)",
    )  # fmt: skip
    machine.add_argument(
        "--kernel", type=Path, metavar="PATH", help="a file like /boot/vmlinuz-RELEASE"
    )


def run(options: argparse.Namespace) -> int:
    """Does what the options say and returns the exit status: the command's, or 11."""
    try:
        return _run(options, Host(HostShell(), native.Probe(), cache_folder(os.environ)))
    except Unavailable as unavailable:
        _say(str(unavailable))
        return UNAVAILABLE


def _run(options: argparse.Namespace, host: Host) -> int:
    if options.check:
        sys.stdout.write(availability(host, _channels(options), options.kernel) + "\n")
        return 0
    if options.setup:
        _set_up(options, host)
    command = command_of(options)
    if not command:
        if options.setup:
            return 0
        raise Unavailable(
            "There is no command to run. Write it after two dashes:"
            " nodeproof vcan -- pytest --can-iface vcan0"
        )
    if is_native(options, host):
        return _natively(command)
    return _in_machine(options, host, command)


def availability(host: Host, channels: Sequence[str], kernel_given: Path | None = None) -> str:
    """Returns in one line what would be used: this kernel, a machine, or nothing and why."""
    obstacle = native.obstacle(channels, host.shell, host.probe)
    if obstacle is None:
        return f"native: {', '.join(channels)} on this kernel"
    try:
        found = equipment.gather(host.shell, host.cache, kernel_given)
    except Unavailable as unavailable:
        return f"nothing: {obstacle}. {unavailable}"
    return f"virtual machine with kernel {found.kernel.release}: {obstacle}"


def _channels(options: argparse.Namespace) -> list[str]:
    return options.channel or ["vcan0"]


def command_of(options: argparse.Namespace) -> list[str]:
    """Returns the command without the dashes before it."""
    given: list[str] = options.command
    return given[1:] if given[:1] == ["--"] else given


def _note(options: argparse.Namespace, text: str) -> None:
    if not options.quiet:
        _say(text)


def _say(text: str) -> None:
    sys.stderr.write(f"nodeproof vcan: {text}\n")
    sys.stderr.flush()


def _set_up(options: argparse.Namespace, host: Host) -> None:
    _note(options, f"fetching what is missing into {host.cache}")
    left = equipment.set_up(host.shell, host.cache)
    if left:
        raise Unavailable(f"One thing is left that needs root. Run: {'; '.join(left)}")
    found = equipment.gather(host.shell, host.cache, options.kernel)
    _note(options, f"the virtual machine has all it needs (kernel {found.kernel.release})")


def is_native(options: argparse.Namespace, host: Host) -> bool:
    """Whether to run on this kernel; makes the channels if so, and says why not otherwise."""
    if options.vm:
        return False
    channels = _channels(options)
    why = native.obstacle(channels, host.shell, host.probe)
    if why is None:
        try:
            native.make(channels, host.shell, host.probe)
        except Unavailable as unavailable:
            why = f"this kernel cannot make {', '.join(channels)}: {unavailable}"
    if why is not None and options.native:
        raise Unavailable(f"--native was asked for, but {why}. Without it a machine is used.")
    here = f"using {', '.join(channels)} of this kernel"
    _note(options, here if why is None else f"using a virtual machine: {why}")
    return why is None


def _natively(command: list[str]) -> int:
    sys.stdout.flush()
    try:
        # The same process goes on as the command, so signals and exit status need no care.
        os.execvp(command[0], command)
    except OSError as error:
        raise Unavailable(f"{command[0]!r} cannot be run: {error.strerror}.") from error


def _in_machine(options: argparse.Namespace, host: Host, command: Sequence[str]) -> int:
    found = equipment.gather(host.shell, host.cache, options.kernel)
    booted = kernel.unpacked(found.kernel, host.cache / "unpacked")
    results = tuple(_made(path) for path in options.results)
    bytecode.compile_all(options.compile, command, os.environ)
    with _run_folder() as folder:
        machine = Machine(
            found.qemu, booted.image, options.shift, options.memory, results, Path(folder)
        )
        job = guest.Job(
            tuple(command), Path.cwd(), dict(os.environ), tuple(_channels(options)), results
        )
        loaded = modules.closure(booted.modules)
        machine.initrd().write_bytes(guest.initial_files(job, found.busybox.read_bytes(), loaded))
        _note(options, f"booting kernel {booted.release}, which takes some ten seconds")
        say = partial(_note, options)
        return Launcher(machine, _tails(machine), say, options.timeout).run()


def _run_folder() -> tempfile.TemporaryDirectory[str]:
    """Returns a new folder, so that machines at the same time do not meet."""
    return tempfile.TemporaryDirectory(prefix="nodeproof-vcan-", ignore_cleanup_errors=True)


def _tails(machine: Machine) -> tuple[Tail, Tail]:
    return (
        Tail(machine.port("stdout"), sys.stdout.buffer),
        Tail(machine.port("stderr"), sys.stderr.buffer),
    )


def _made(path: Path) -> Path:
    """Returns a results folder, absolute and existing."""
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise Unavailable(
            f"The results folder {path} cannot be made: {error.strerror}. Choose another."
        ) from error
    return path.resolve()
