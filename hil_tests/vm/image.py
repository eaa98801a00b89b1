"""Reads a Linux boot image for x86: its release, and the kernel proper without its decompressor.

The offsets come from the kernel's Documentation/arch/x86/boot.rst, boot protocol 2.08. QEMU
starts an uncompressed kernel directly (through its PVH note); that spares the guest the
unpacking, which takes five seconds of an emulated processor.
"""

from __future__ import annotations

import lzma
import struct
import zlib
from pathlib import Path

from hil_tests.vm.errors import Unavailable

_SETUP_SECTORS_AT = 0x1F1
_MAGIC_AT = 0x202
_MAGIC = b"HdrS"
_VERSION_POINTER_AT = 0x20E
_PAYLOAD_AT = 0x248
_SECTOR = 512

_XZ = b"\xfd7zXZ"
_GZIP = b"\x1f\x8b"
_ELF = b"\x7fELF"
# The window size for zlib that makes it expect a gzip header.
_GZIP_WRAPPER = 31


def release(path: Path) -> str:
    """Returns the release of a boot image, as `uname -r` would say, e.g. "6.1.0-18-amd64".

    Raises:
        Unavailable: The file cannot be read, or is no boot image for x86.
    """
    try:
        image = path.read_bytes()
    except OSError as error:
        raise Unavailable(
            f"The kernel {path} cannot be read ({error.strerror}): give one with --kernel PATH."
        ) from error
    if image[_MAGIC_AT : _MAGIC_AT + 4] != _MAGIC:
        raise Unavailable(
            f"{path} is no bootable x86 kernel (a file like /boot/vmlinuz-RELEASE is meant)."
        )
    start = struct.unpack_from("<H", image, _VERSION_POINTER_AT)[0] + _SECTOR
    return image[start : image.index(b"\0", start)].decode().split(" ")[0]


def uncompressed(image: bytes) -> bytes | None:
    """Returns the ELF kernel inside a boot image, None where the standard library has no way."""
    offset, length = struct.unpack_from("<II", image, _PAYLOAD_AT)
    # Zero stands for four sectors, a convention of the oldest boot loaders.
    start = ((image[_SETUP_SECTORS_AT] or 4) + 1) * _SECTOR + offset
    # The payload may end with its uncompressed length: decompressor objects leave such a rest
    # alone.
    kernel = _unpacked(image[start : start + length])
    return kernel if kernel is not None and kernel.startswith(_ELF) else None


def _unpacked(payload: bytes) -> bytes | None:
    try:
        if payload.startswith(_XZ):
            return lzma.LZMADecompressor().decompress(payload)
        if payload.startswith(_GZIP):
            return zlib.decompressobj(_GZIP_WRAPPER).decompress(payload)
    except (lzma.LZMAError, zlib.error):
        return None
    return None
