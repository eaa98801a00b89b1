"""Frames for an SDO server: whole transfers, well-formed or nearly, of every kind."""

from __future__ import annotations

from binascii import crc_hqx
from random import Random

from benchmarks.fuzz.known import NODE, Known, number
from node_model.frame import Frame

REQUESTS = 0x600


def request(data: bytes) -> Frame:
    """A request to the default server, filled up to eight bytes."""
    return Frame(REQUESTS + NODE, data[:8].ljust(8, b"\0"))


def multiplexer(index: int, sub: int) -> bytes:
    """Index and sub-index as a request holds them."""
    return index.to_bytes(2, "little") + bytes((sub,))


def expedited(index: int, sub: int, value: int, size: int) -> Frame:
    """A download of up to four bytes."""
    data = (value & (1 << 8 * size) - 1).to_bytes(4, "little")
    return request(bytes((0x23 | 4 - size << 2,)) + multiplexer(index, sub) + data)


def anything(rng: Random, known: Known) -> list[Frame]:
    """Any bytes to the server."""
    del known
    return [Frame(REQUESTS + NODE, rng.randbytes(rng.choice((8, 8, 8, 8, 7, 4, 1, 0))))]


def commands(rng: Random, known: Known) -> list[Frame]:
    """Any command with the address of an object."""
    index, sub, _ = known.place(rng)
    data = bytes((rng.getrandbits(8),)) + multiplexer(index, sub) + rng.randbytes(4)
    return [request(data)]


def write(rng: Random, known: Known) -> list[Frame]:
    """An expedited download, mostly of the right length."""
    index, sub, size = known.place(rng)
    right = size if 1 <= size <= 4 and rng.random() < 0.9 else rng.randint(1, 4)
    return [expedited(index, sub, number(rng), right)]


def read(rng: Random, known: Known) -> list[Frame]:
    """An upload, to its end or beyond."""
    index, sub, _ = known.long(rng)
    frames = [request(b"\x40" + multiplexer(index, sub))]
    toggle = 0x60
    for _ in range(rng.choice((0, 0, 1, 2, 4, 9))):
        frames.append(request(bytes((toggle,))))
        toggle ^= 0x10
    return frames


def _value(rng: Random, size: int) -> bytes:
    length = size if size and rng.random() < 0.8 else rng.choice((0, 1, 4, 6, 7, 8, 14, 60))
    return rng.randbytes(length)


def download(rng: Random, known: Known) -> list[Frame]:
    """A download in segments."""
    index, sub, size = known.long(rng)
    value = _value(rng, size)
    told = rng.choice((len(value), len(value), len(value), 0, len(value) + 1, number(rng)))
    command = rng.choice((0x20, 0x21, 0x21, 0x21))
    head = bytes((command,)) + multiplexer(index, sub) + told.to_bytes(4, "little")
    frames = [request(head)]
    toggle = 0
    for at in range(0, max(len(value), 1), 7):
        piece = value[at : at + 7]
        last = at + 7 >= len(value)
        frames.append(request(bytes((toggle | (7 - len(piece)) << 1 | last,)) + piece))
        toggle ^= 0x10
    return frames


def block_download(rng: Random, known: Known) -> list[Frame]:
    """A download in blocks; sometimes a segment has a wrong number, or the check is wrong."""
    index, sub, size = known.long(rng)
    value = _value(rng, size) or b"\0"
    command = rng.choice((0xC6, 0xC6, 0xC2, 0xC4, 0xC0))
    head = bytes((command,)) + multiplexer(index, sub) + len(value).to_bytes(4, "little")
    frames = [request(head)]
    for count, at in enumerate(range(0, len(value), 7), 1):
        last = 0x80 if at + 7 >= len(value) else 0
        named = count if rng.random() < 0.97 else rng.getrandbits(7)
        frames.append(request(bytes((named & 0x7F | last,)) + value[at : at + 7]))
    check = crc_hqx(value, 0) if rng.random() < 0.9 else rng.getrandbits(16)
    end = 0xC1 | (-len(value) % 7) << 2
    frames.append(request(bytes((end,)) + check.to_bytes(2, "little")))
    return frames


def block_upload(rng: Random, known: Known) -> list[Frame]:
    """An upload in blocks, with confirmations that fit or not."""
    index, sub, _ = known.long(rng)
    size = rng.choice((1, 2, 4, 127, 127, 0, 128))
    head = bytes((rng.choice((0xA0, 0xA4)),)) + multiplexer(index, sub)
    frames = [request(head + bytes((size, rng.choice((0, 0, 4, 0xFF))))), request(b"\xa3")]
    for _ in range(rng.choice((0, 1, 1, 2, 3))):
        came = rng.choice((0, 1, 1, 2, size & 0x7F))
        frames.append(request(bytes((0xA2, came, rng.choice((size, 1, 127))))))
    frames.append(request(b"\xa1"))
    return frames


def abort(rng: Random, known: Known) -> list[Frame]:
    """The client gives up."""
    index, sub, _ = known.place(rng)
    return [request(b"\x80" + multiplexer(index, sub) + number(rng).to_bytes(4, "little"))]


def store(rng: Random, known: Known) -> list[Frame]:
    """Stored or restored parameters, with the right signature or nearly."""
    del known
    index, word = rng.choice(((0x1010, b"save"), (0x1011, b"load")))
    near = rng.choice((word, word, word, word[::-1], b"SAVE", word[:3] + b"\0"))
    sub = rng.choice((1, 1, 2, 3, 4, 0))
    return [request(b"\x23" + multiplexer(index, sub) + near)]


SETTINGS = (
    (0x1005, 4, (0x80, 0x80, 0x4000_0080, 0x81, 0x4000_0081)),
    (0x1006, 4, (0, 0, 1000, 5000, 20_000)),
    (0x1007, 4, (0, 0, 1000, 100, 20_000)),
    (0x1019, 1, (0, 0, 2, 10, 240, 1, 241)),
    (0x100C, 2, (0, 5, 20, 100)),
    (0x100D, 1, (0, 1, 3)),
    (0x1012, 4, (0x8000_0100, 0x100, 0x101)),
    (0x1014, 4, (0x85, 0x8000_0085, 0x86)),
    (0x1015, 2, (0, 10, 100)),
    (0x1017, 2, (0, 1, 5, 20, 50, 1000)),
)


def settings(rng: Random, known: Known) -> list[Frame]:
    """Times and identifiers of the services, as a master sets them."""
    del known
    if rng.random() < 0.2:
        value = rng.choice((0, 0x01_0032, 0x06_0005, 0x7F_0001, 0x01_0014))
        return [expedited(0x1016, rng.randint(1, 4), value, 4)]
    if rng.random() < 0.1:
        return [expedited(0x1029, 1, rng.choice((0, 1, 2)), 1)]
    index, size, values = rng.choice(SETTINGS)
    return [expedited(index, 0, rng.choice(values), size)]


def mapping(rng: Random, known: Known) -> list[Frame]:
    """A PDO set up in five steps."""
    base = rng.choice((0x1400, 0x1800))
    index = base + rng.randrange(4)
    cob_id = rng.choice((0x185, 0x205, 0x285, 0x305, 0x385, 0x1FF, 0x80, 0x605))
    kind = rng.choice((0, 1, 2, 240, 252, 253, 254, 255, 241))
    count = rng.choice((0, 1, 1, 2, 3, 8))
    frames = [
        expedited(index, 1, 0x8000_0000 | cob_id, 4),
        expedited(index, 2, kind, 1),
        expedited(index, 3, rng.choice((0, 0, 10, 100)), 2),
        expedited(index, 5, rng.choice((0, 0, 2, 20)), 2),
        expedited(index, 6, rng.choice((0, 0, 3)), 1),
        expedited(index + 0x200, 0, 0, 1),
    ]
    frames += [
        expedited(index + 0x200, sub, rng.choice(known.mapped), 4) for sub in range(1, count + 1)
    ]
    frames.append(expedited(index + 0x200, 0, count, 1))
    frames.append(expedited(index, 1, rng.choice((0, 0, 0x4000_0000)) | cob_id, 4))
    return frames
