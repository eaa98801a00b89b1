"""What runs in the guest: the first process, and the job that is the user's command.

The first process is a script for busybox. It loads the modules, lays a writable memory overlay
over the host's read-only file system, makes the CAN interfaces, runs the job in that tree and
powers off. It speaks to the launcher through four virtio serial ports: the job's two outputs,
`status` (lines "ready", "exit N" or "failed WHY") and `control`, which brings the names of
signals for the job and the word COPY. Serial ports, because QEMU serves them while the guest's
processor waits: the guest's clock does not run on, as it does during a 9p request.
"""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from hil_tests.vm.initramfs import archive, character_device, directory, regular
from hil_tests.vm.modules import Module

CONTROL = "control"
PORTS = ("stdout", "stderr", "status", CONTROL)
# Asks on the control port for the results so far; whatever else comes there is the name of a
# signal.
COPY = "COPY"
HOST_TAG = "host"

PART = ".copying-"
"""What the folder in a results folder begins with that holds files which are not yet whole."""

EXACT_TIME = "NODEPROOF_EXACT_TIME"
"""Tells a program that its clock counts instructions, so that nothing outside makes it late."""

_JOB = "/run/nodeproof-job"
_JOB_ID = "/run/nodeproof-job-id"
_FOLDERS = ("bin", "dev", "proc", "sys", "run", "host", "writes", "root", "modules")


@dataclass(frozen=True, slots=True)
class Job:
    """What to run in the guest.

    Attributes:
        command: The program and its arguments.
        cwd: Folder to run it in.
        environment: Its whole environment.
        channels: CAN interfaces that it will find up.
        results: Folders of the host that it may write to.
    """

    command: tuple[str, ...]
    cwd: Path
    environment: Mapping[str, str]
    channels: tuple[str, ...]
    results: tuple[Path, ...]


def results_tag(index: int) -> str:
    """Returns the 9p tag of the results folder with that index."""
    return f"results{index}"


def initial_files(job: Job, busybox: bytes, modules: Sequence[Module]) -> bytes:
    """Returns the initial RAM file system that boots and runs the job."""
    return archive(
        [
            *map(directory, _FOLDERS),
            character_device("dev/console", 5, 1),
            character_device("dev/null", 1, 3),
            regular("bin/busybox", busybox, executable=True),
            *(regular(f"modules/{module.name}.ko", module.data) for module in modules),
            regular("job", job_script(job).encode()),
            regular("bin/copy-out", copy_script(job).encode(), executable=True),
            regular(
                "init",
                init_script(job, [module.name for module in modules]).encode(),
                executable=True,
            ),
        ]
    )


def job_script(job: Job) -> str:
    """Returns what the host's /bin/sh runs in the guest: environment, folder, command."""
    environment = {**job.environment, "PYTHONDONTWRITEBYTECODE": "1", EXACT_TIME: "1"}
    # The overlay forgets bytecode at power-off, so writing it would only cost time. Names that no
    # shell can export (functions exported by bash) are of no use here.
    exports = [
        f"export {name}={shlex.quote(value)}"
        for name, value in environment.items()
        if _is_name(name)
    ]
    cwd = f"cd {shlex.quote(str(job.cwd))} || exit 126"
    return "\n".join([f"echo $$ >{_JOB_ID}", *exports, cwd, f"exec {shlex.join(job.command)}", ""])


def copy_script(job: Job) -> str:
    """Returns the script that brings out what the job wrote to its results folders.

    With the argument `fresh` it takes what changed since the last time, without it everything
    after that.
    """
    folders = [
        f"copy {shlex.quote(f'/writes/upper{path}')} /results{index}"
        for index, path in enumerate(job.results)
    ]
    return _COPY.format(part=PART, folders="\n    ".join(folders))


def _is_name(name: str) -> bool:
    return name.isascii() and name.isidentifier()


def init_script(job: Job, modules: Sequence[str]) -> str:
    """Returns the script of the guest's first process."""
    return _INIT.format(
        modules=" ".join(modules),
        host=HOST_TAG,
        job=_JOB,
        job_id=_JOB_ID,
        copy=COPY,
        results="\n".join(_mount(index) for index in range(len(job.results))),
        channels="\n".join(_channel(name) for name in job.channels),
    )


def _mount(index: int) -> str:
    place = f"/results{index}"
    mount = f"mkdir {place} && mount -t 9p -o $P9 {results_tag(index)} {place}"
    return f"{mount} || fail results folder {index} could not be mounted"


def _channel(name: str) -> str:
    quoted = shlex.quote(name)
    return (
        f"ip link add dev {quoted} type vcan && ip link set {quoted} up "
        f"|| fail {shlex.quote(f'the interface {name} could not be made')}"
    )


# What the job writes to a results folder stays in memory and is carried out by this script: now
# and then (the launcher asks every few seconds of wall time) and at the end. So no write of the
# job is a request to the host, for which its clock would run on. Deleted files of the host are
# character devices in an overlay's upper folder; files that were brought out and have gone since
# are found by the list of all that were. Copying has a low priority, one at a time. The machine
# may be ended at any moment: what is newest goes first, and a file takes the place of the one
# before only when it is whole. Times of files are compared by the second: what changed in the very
# second of a copy is copied again. At the end a look at all files finds those that came with an
# older time (moved, or copied with it): what is as it was when it was brought out stays there.
_COPY = """#!/bin/busybox sh
extent=${{1:-all}}
mkdir /run/copying 2>/dev/null || [ "$extent" = all ] || exit 0
[ "$extent" = all ] || renice -n 10 -p $$
touch -d "@$(($(date +%s) - 1))" "/run/copied.$$"
copy() {{
    cd "$1" 2>/dev/null || return
    part="$2/{part}$$"
    list="/run/list${{2##*/}}"
    find . -type c | while read -r gone; do rm -rf "$2/$gone"; done
    mkdir -p "$part"
    touch "$list"
    find . \\( -type d -o -type f -o -type l \\) $newer -exec stat -c "%i %s %Y %n" {{}} + \\
        >"$list.$$"
    {{ [ "$newer" ] && cat "$list.$$" || sort "$list" "$list" "$list.$$" | uniq -u; }} |
        cut -d " " -f 4- | cpio -o -H newc 2>/dev/null | (cd "$part" && cpio -idmu 2>/dev/null)
    cd "$part" && find . -type d | while read -r folder; do mkdir -p "$2/$folder"; done
    find . -type l | while read -r link; do rm -f "$2/$link"; done
    find . ! -type d | while read -r whole; do mv -f "$whole" "$2/$whole"; done
    cat "$list.$$" >>"$list"
    cd "$1" && rm -rf "$part"
    [ "$newer" ] && return
    cut -d " " -f 4- "$list" | sort -u | while read -r seen; do
        [ -e "$seen" ] || [ -L "$seen" ] || rm -rf "$2/$seen"
    done
}}
every() {{
    :
    {folders}
}}
newer=
[ -e /run/copied ] && newer="-newer /run/copied"
every
[ "$extent" = all ] && [ "$newer" ] && newer= && every
mv "/run/copied.$$" /run/copied
rmdir /run/copying
"""

# Why it is as it is:
# - cache=loose keeps what was read once in the guest's memory. Each request to the host lets the
#   guest idle, and an idle guest's clock leaps to the next timer: without the cache, importing
#   pytest took minutes of guest time.
# - The outputs go through pipes, since a serial port can be opened only once and programs do
#   reopen /dev/stdout.
# - The job has a session of its own, so that a signal reaches its children too. It runs in the
#   foreground, since a shell makes background processes deaf to SIGINT.
# - `control` ends when the launcher does (its end of the port closes): then nobody waits for the
#   guest any more.
# - A child that outlives the job and holds its output open is given two seconds (of guest time)
#   to finish.
_INIT = """#!/bin/busybox sh
/bin/busybox --install -s /bin
export PATH=/bin
P9=trans=virtio,version=9p2000.L,msize=512000,access=any
mount -t proc proc /proc
mount -t sysfs sys /sys
mount -t devtmpfs dev /dev
for module in {modules}; do insmod "/modules/$module.ko"; done
for port in /sys/class/virtio-ports/*; do
    ln -s "/root/dev/${{port##*/}}" "/run/$(cat "$port/name")"
done
control() {{
    while read -r asked; do
        case $asked in
            {copy}) /bin/copy-out fresh & ;;
            *) kill "-$asked" "-$(cat /root{job_id})" ;;
        esac
    done
    /bin/copy-out
    poweroff -f
}}
fail() {{ echo "failed $*" >/run/status; poweroff -f; }}

mount -t tmpfs -o size=75% writes /writes && mkdir /writes/upper /writes/work
mount -t 9p -o "ro,$P9,cache=loose" {host} /host || echo "the host's files could not be mounted"
layers=lowerdir=/host,upperdir=/writes/upper,workdir=/writes/work
mount -t overlay -o "$layers,xino=off" overlay /root
mount --move /dev /root/dev
[ -e /run/status ] || echo "no status port"
mount -t proc proc /root/proc
mount -t sysfs sys /root/sys
mkdir -p /root/dev/shm /root/dev/pts /root/run
mount -t tmpfs shm /root/dev/shm
mount -t devpts pts /root/dev/pts
ln -sfn /proc/self/fd /root/dev/fd
for n in 0:stdin 1:stdout 2:stderr; do
    ln -sfn "/proc/self/fd/${{n%:*}}" "/root/dev/${{n#*:}}"
done
hostname nodeproof
ip link set lo up
{results}
{channels}
cp /job /root{job} || fail "the overlay cannot be written to"

mkfifo /run/out /run/err
cat /run/out >/run/stdout &
out=$!
cat /run/err >/run/stderr &
err=$!
exec 3>/run/status
echo ready >&3
control </run/control 3>&- &
setsid chroot /root /bin/sh {job} </dev/null >/run/out 2>/run/err 3>&-
code=$?
for tenth in $(seq 20); do
    kill -0 "$out" 2>/dev/null || kill -0 "$err" 2>/dev/null || break
    sleep 0.1
done
/bin/copy-out
echo "exit $code" >&3
poweroff -f
"""
