"""The virtual machine's hardware, as a QEMU command line."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from hil_tests.vm.guest import CONTROL, HOST_TAG, PORTS, results_tag

# The guest runs one trusted command on an emulated processor: mitigations and randomised addresses only cost time
# (a sixth of the boot). A panic ends the machine at once (-1), which -no-reboot turns into QEMU's exit.
_KERNEL_ARGUMENTS = "console=ttyS0 quiet loglevel=4 panic=-1 mitigations=off nokaslr audit=0 apparmor=0"


@dataclass(frozen=True, slots=True)
class Machine:
    """One machine to run.

    Attributes:
        qemu: The emulator.
        kernel: Boot image or uncompressed kernel.
        shift: An instruction takes 2**shift ns of guest time. 0 is the fastest processor: latencies measured in guest
            time are the smallest; 1 and 2 make the model and the tester look slower.
        memory: As QEMU's -m, e.g. "1G".
        results: Folders of the host that the guest may write to.
        folder: Where this run's files are: initial files, outputs, console.
    """

    qemu: str
    kernel: Path
    shift: int
    memory: str
    results: tuple[Path, ...]
    folder: Path

    def initrd(self) -> Path:
        """Returns where the initial files belong."""
        return self.folder / "initrd"

    def console(self) -> Path:
        """Returns the file that the kernel's messages are written to."""
        return self.folder / "console"

    def port(self, name: str) -> Path:
        """Returns the file that the host's end of a serial port writes to (`control` reads QEMU's standard input instead)."""
        return self.folder / name

    def command_line(self) -> list[str]:
        """Returns the command that runs the machine until the guest powers off."""
        return [
            self.qemu, "-nodefaults", "-no-user-config", "-no-reboot", "-display", "none",
            *self._processor(), *self._boot(), *self._ports(), *self._shares(),
        ]  # fmt: skip

    def _processor(self) -> list[str]:
        # Counted instructions are the guest's clock, and sleep=off skips the time in which it idles; -rtc makes the
        # date follow. Both work without KVM alone, with one processor. q35 and `max` so that any host's programs run.
        icount = f"shift={self.shift},sleep=off"
        return [
            "-machine", "q35", "-accel", "tcg", "-cpu", "max", "-smp", "1", "-m", self.memory,
            "-icount", icount, "-rtc", "clock=vm",
        ]  # fmt: skip

    def _boot(self) -> list[str]:
        return [
            "-kernel", str(self.kernel), "-initrd", str(self.initrd()), "-append", _KERNEL_ARGUMENTS,
            "-chardev", f"file,id=console,path={_escaped(self.console())}", "-serial", "chardev:console",
        ]  # fmt: skip

    def _ports(self) -> list[str]:
        # Without ioeventfd the emulator handles a write at once, in the processor's thread, not later in another one.
        # There the guest's clock does not run on meanwhile.
        line = ["-device", "virtio-serial-pci,ioeventfd=off"]
        for name in PORTS:
            backend = "stdio,signal=off" if name == CONTROL else f"file,path={_escaped(self.port(name))}"
            line += ["-chardev", f"{backend},id={name}"]
            line += ["-device", f"virtserialport,name={name},chardev={name}"]
        return line

    def _shares(self) -> list[str]:
        line = _share(HOST_TAG, Path("/"), ",readonly=on")
        for index, path in enumerate(self.results):
            line += _share(results_tag(index), path, "")
        return line


def _share(tag: str, path: Path, access: str) -> list[str]:
    # security_model=none: files appear with the owners that they have, and what the guest writes belongs to whoever
    # runs QEMU. remap keeps the file numbers of several host file systems apart.
    share = f"local,id={tag},path={_escaped(path)},security_model=none,multidevs=remap{access}"
    return ["-fsdev", share, "-device", f"virtio-9p-pci,fsdev={tag},mount_tag={tag}"]


def _escaped(path: Path) -> str:
    """Returns a path as QEMU's options want it: a comma is doubled."""
    return str(path).replace(",", ",,")
