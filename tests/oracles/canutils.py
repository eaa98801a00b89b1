"""Frame lengths as can-utils computes them, frame by frame, on any machine.

`canbusload -e` prints the exact length of the frames that it read from a CAN socket in the
last second. A small library, preloaded into the unmodified program, stands in for that socket
and for the second (see canbusload_shim.c), so that it prints each frame by itself and needs
no CAN in the kernel.

What can-utils (seen with 2020.11) counts otherwise, and how the comparison minds it:

- it adds the intermission of 3 bits;
- it counts data bytes in a remote frame, which has none: only remote frames of DLC 0 compare;
- it knows no DLC above 8.
"""

from __future__ import annotations

import os
import re
import shutil
import struct
import subprocess
from collections.abc import Iterator, Sequence
from pathlib import Path
from random import Random

from node_model.frame import INTERMISSION_BITS, MAX_BASE_ID, MAX_EXTENDED_ID, Frame

_SHIM = Path(__file__).with_name("canbusload_shim.c")
_LINE = re.compile(rb"^ \S+ +1 +(\d+) +\d+ +\d+%$", re.MULTILINE)


def missing() -> list[str]:
    """The programs that this oracle needs and the machine lacks."""
    return [name for name in ("canbusload", "gcc") if not shutil.which(name)]


def build(folder: Path) -> Path:
    """Compiles the stand-in for the socket into `folder`."""
    library = folder / "canbusload_shim.so"
    command = ["gcc", "-O2", "-shared", "-fPIC", "-o", str(library), str(_SHIM)]
    subprocess.run(command, check=True)
    return library


def packed(frame: Frame) -> bytes:
    """The frame as the kernel's `struct can_frame`."""
    ident = frame.can_id | frame.extended << 31 | frame.remote << 30
    return struct.pack("=IB3x8s", ident, frame.dlc, frame.data)


def lengths(frames: Sequence[Frame], library: Path) -> list[int]:
    """Bits of each frame on the wire, without intermission, by canbusload.

    Raises:
        ValueError: it did not print one length a frame.
    """
    done = subprocess.run(
        ["canbusload", "-e", "any@1000000"],
        input=b"".join(map(packed, frames)),
        stdout=subprocess.PIPE,
        check=True,
        env={**os.environ, "LD_PRELOAD": str(library)},
    )
    found = [int(bits) - INTERMISSION_BITS for bits in _LINE.findall(done.stdout)]
    if len(found) != len(frames):
        raise ValueError(f"canbusload printed {len(found)} lengths for {len(frames)} frames")
    return found


def random_frames(count: int, seed: int) -> Iterator[Frame]:
    """Random frames that can-utils can count: data of 0..8 bytes, remote of DLC 0.

    Half of the data repeats one of 00h, FFh, 0Fh, F8h, 07h: what stuffing is about.
    """
    random = Random(seed)
    for _ in range(count):
        extended = random.random() < 0.5
        ident = random.randint(0, MAX_EXTENDED_ID if extended else MAX_BASE_ID)
        size = random.randint(0, 8)
        if random.random() < 0.05:
            yield Frame(ident, remote=True, extended=extended)
        elif random.random() < 0.5:
            yield Frame(ident, random.randbytes(size), extended=extended)
        else:
            body = bytes(random.choice(b"\x00\xff\x0f\xf8\x07") for _ in range(size))
            yield Frame(ident, body, extended=extended)
