"""The virtual machine's hardware, as a QEMU command line."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from hil_tests.vm.guest import CONTROL, HOST_TAG, PORTS, results_tag

# - mitigations, nokaslr: the guest runs one trusted command on an emulated processor; safeguards
#   would only cost time.
# - nohz=off keeps the timer tick (4 ms) while the guest idles. A process that waits for the
#   host's file system leaves the processor idle, and the clock then leaps to the next timer until
#   the answer is there: without ticks by seconds, once by two minutes, with them by 4 to 50 ms.
#   The ticks cost one to two seconds of wall time in a minute of sleep.
# - preempt=full lets a frame wake its reader at once.
# - A panic ends the machine at once (-1), which -no-reboot turns into QEMU's exit.
_KERNEL_ARGUMENTS = (
    "console=ttyS0 quiet loglevel=4 panic=-1 mitigations=off nokaslr audit=0 apparmor=0"
    " nohz=off preempt=full"
)


@dataclass(frozen=True, slots=True)
class Machine:
    """One machine to run.

    Attributes:
        qemu: The emulator.
        kernel: Boot image or uncompressed kernel.
        shift: An instruction takes 2**shift ns of guest time. 0 is the fastest processor: the
            latencies of model and tester, measured in guest time, are the smallest.
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
        """Returns the file that a serial port ends in (`control` is QEMU's standard input)."""
        return self.folder / name

    def command_line(self) -> list[str]:
        """Returns the command that runs the machine until the guest powers off."""
        return [
            self.qemu, "-nodefaults", "-no-user-config", "-no-reboot", "-display", "none",
            *self._processor(), *self._boot(), *self._ports(), *self._shares(),
        ]  # fmt: skip

    def _processor(self) -> list[str]:
        # Counted instructions are the guest's clock, and sleep=off skips the time in which it
        # idles; -rtc makes the date follow. Both work without KVM alone, with one processor. q35
        # and `max` so that any host's programs run, but for `erms`: that invites kernel and C
        # library to copy and clear memory with one instruction that the emulator works off byte
        # by byte.
        icount = f"shift={self.shift},sleep=off"
        return [
            "-machine", "q35", "-accel", "tcg", "-cpu", "max,-erms", "-smp", "1",
            "-m", self.memory, "-icount", icount, "-rtc", "clock=vm",
        ]  # fmt: skip

    def _boot(self) -> list[str]:
        return [
            "-kernel", str(self.kernel), "-initrd", str(self.initrd()),
            "-append", _KERNEL_ARGUMENTS,
            "-chardev", f"file,id=console,path={_escaped(self.console())}",
            "-serial", "chardev:console",
        ]  # fmt: skip

    def _ports(self) -> list[str]:
        # Without ioeventfd the emulator handles a write at once, in the processor's thread, not
        # later in another one. There the guest's clock does not run on meanwhile.
        line = ["-device", "virtio-serial-pci,ioeventfd=off"]
        for name in PORTS:
            file = f"file,path={_escaped(self.port(name))}"
            backend = "stdio,signal=off" if name == CONTROL else file
            line += ["-chardev", f"{backend},id={name}"]
            line += ["-device", f"virtserialport,name={name},chardev={name}"]
        return line

    def _shares(self) -> list[str]:
        line = _share(HOST_TAG, Path("/"), ",readonly=on")
        for index, path in enumerate(self.results):
            line += _share(results_tag(index), path, "")
        return line


def _share(tag: str, path: Path, access: str) -> list[str]:
    # security_model=none: files appear with the owners that they have, and what the guest writes
    # belongs to whoever runs QEMU. remap keeps the file numbers of several host file systems
    # apart.
    share = f"local,id={tag},path={_escaped(path)},security_model=none,multidevs=remap{access}"
    return ["-fsdev", share, "-device", f"virtio-9p-pci,fsdev={tag},mount_tag={tag}"]


def _escaped(path: Path) -> str:
    """Returns a path as QEMU's options want it: a comma is doubled."""
    return str(path).replace(",", ",,")
