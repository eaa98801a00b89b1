"""What is done to drives to tell them from the right one: frames in, frames out."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence

from node_model.frame import Frame
from node_model.lss import IDENTIFY_VENDOR, SELECT_VENDOR
from node_model.node import MS, US
from tests.node_model.drive_frames import (
    BEAT,
    ID,
    IDENTITY,
    LOAD,
    OFF,
    ON,
    OPERATIONAL,
    SAVE,
    SYNC,
    Script,
    errors,
    frame,
    lss,
    lss_number,
    nmt,
    read,
    remote,
    script,
    sdo,
    write,
)
from tests.node_model.driving import Step


def _network() -> Iterator[Script]:
    walk = (nmt(1), nmt(1), nmt(2), nmt(1), nmt(0x80), nmt(2), nmt(0x80))
    yield script(BEAT, *walk, wait_ns=30 * MS)
    yield script(BEAT, nmt(1, 0), nmt(2, 9), nmt(3), remote(0, 2), nmt(1, 0), wait_ns=30 * MS)
    yield script(BEAT, Frame(0, bytes((2, ID)), extended=True), frame(0, 2, ID, 0), None)
    for command in (0x81, 0x82):
        yield script(
            write(0x2011, 0, 7, 2),
            write(0x1017, 0, 40, 2),
            nmt(command),
            None,
            read(0x2011),
            read(0x1017),
            wait_ns=8 * MS,
        )
    yield script(nmt(2), read(0x1000), nmt(1), read(0x1000))
    yield script(read(0x1008), nmt(2), nmt(0x80), sdo(0x60), sdo(0x70))
    yield (Step(0, ON), Step(1300 * MS, nmt(0x82)), Step(1300 * MS, read(0x1018, 4)))


def _error_control() -> Iterator[Script]:
    for period in (0, 10, 300):
        yield (
            *script(write(0x1017, 0, period, 2), nmt(2), wait_ns=13 * MS),
            Step(700 * MS, nmt(1)),
            Step(30 * MS, None),
        )
    yield script(BEAT, write(0x1017, 0, 300, 2), write(0x1017, 0, 20, 2))
    poll = remote(0x700 + ID)
    yield script(write(0x1017, 0, 0, 2), poll, poll)
    guarded = (write(0x1017, 0, 0, 2), write(0x100C, 0, 20, 2), write(0x100D, 0, 2, 1))
    yield script(poll, *guarded, poll, poll, poll, nmt(1), poll, nmt(2), poll, remote(0x706))
    yield script(*guarded, None, wait_ns=45 * MS)
    yield script(*guarded, OPERATIONAL, poll, None, None, None, None, poll, wait_ns=18 * MS)
    yield script(*guarded[:2], write(0x100D, 0, 0, 1), poll, None, wait_ns=30 * MS)
    asleep = (write(0x1029, 1, 0, 1), *guarded, nmt(2), poll, None, poll)
    yield script(*asleep, wait_ns=45 * MS)
    yield (*script(write(0x1016, 1, 0x09_0000, 4), frame(0x709, 5)), Step(1100 * MS, None))
    yield script(*guarded, poll, nmt(0x82), None, *guarded, poll, poll, wait_ns=12 * MS)
    beat, boot_up = frame(0x709, 5), frame(0x709, 0)
    watch = (write(0x1016, 1, 0x09_0014, 4), write(0x1016, 2, 0x0A_001E, 4))
    yield script(BEAT, *watch, OPERATIONAL, beat, beat, None, None, None, beat, wait_ns=11 * MS)
    yield script(*watch, boot_up, None, None, beat, boot_up, None, None, None, wait_ns=12 * MS)
    yield script(*watch, frame(0x70A, 5), write(0x1016, 2, 0, 4), None, None, wait_ns=15 * MS)
    yield script(*watch, write(0x1016, 3, 0x09_0014, 4), watch[0], write(0x1016, 4, 9 << 24, 4))


def _emergencies() -> Iterator[Script]:
    one, two = errors("overcurrent"), errors("overcurrent", "encoder")
    looks = (read(0x1001), *(read(0x1003, sub) for sub in range(4)))
    yield script(one, two, *looks, one, read(0x1001), errors(), *looks, errors("vendor"), *looks)
    yield script(two, errors("encoder"), read(0x1001), read(0x1003, 1), nmt(0x82), None, *looks)
    many = [errors("undervoltage") if n % 2 else errors() for n in range(20)]
    yield script(*many, read(0x1003), read(0x1003, 8), write(0x1003, 0, 0, 1), *looks)
    yield script(one, write(0x1003, 0, 1, 1), *looks, write(0x1003, 0, 0, 1), *looks, errors())
    yield script(read(0x1014), nmt(2), nmt(0x80), one)
    yield script(nmt(2), one, None, nmt(0x80), errors(), nmt(1), one, wait_ns=20 * MS)
    yield script(write(0x1015, 0, 200, 2), one, two, errors("encoder"), errors())
    yield script(write(0x1014, 0, 0x8000_0085, 4), one, *looks, write(0x1014, 0, 0x99, 4), two)
    yield script(write(0x1014, 0, 0x99, 4), one, write(0x1014, 0, 0x601, 4))
    yield (Step(0, one), *script(nmt(0x82), None, None, read(0x1001), wait_ns=9 * MS))
    for behaviour in (0, 1, 2):
        yield script(
            write(0x1017, 0, 0, 2),
            write(0x1029, 1, behaviour, 1),
            write(0x100C, 0, 20, 2),
            write(0x100D, 0, 1, 1),
            OPERATIONAL,
            remote(0x705),
            None,
            read(0x1001),
            nmt(0x80),
            remote(0x705),
            None,
            remote(0x705),
            wait_ns=25 * MS,
        )
    yield script(OPERATIONAL, one, read(0x6041), read(0x1001), wait_ns=25 * MS)


def _pdos() -> Iterator[Script]:
    point = frame(0x205, 0x0F, 0, 1, 2, 0, 0)
    other = frame(0x205, 0x0F, 0, 9, 2, 0, 0)
    look = read(0x607A)
    enable = tuple(write(0x6040, 0, word, 2) for word in (6, 7, 15))
    yield script(OPERATIONAL, *enable, point, look, other, look, SYNC, look, SYNC, SYNC, look)
    yield script(OPERATIONAL, SYNC, nmt(0x80), SYNC, point, SYNC, look, nmt(2), SYNC)
    yield script(OPERATIONAL, point, SYNC, write(0x607A, 0, 0, 4), SYNC, look)
    yield script(OPERATIONAL, point, remote(0x205), SYNC, look)
    yield script(OPERATIONAL, frame(0x205, 1), read(0x1001), point, read(0x1001), remote(0x205))
    yield script(OPERATIONAL, SYNC, Frame(0x205, point.data, extended=True), SYNC, look)
    yield script(OPERATIONAL, frame(0x305, 6, 0, 1), read(0x6060), SYNC, frame(0x080, 1), SYNC)
    yield script(write(0x1019, 0, 10, 1), OPERATIONAL, SYNC, frame(0x080, 1), frame(0x080, 2))
    for window in (0, 50, 150, 2000):
        late = frame(0x305, 6, 0, 1)
        yield script(write(0x1007, 0, window, 4), OPERATIONAL, SYNC, point, late, SYNC, look)
    for window in (300, 550, 2000):
        setting = script(write(0x1007, 0, window, 4), OPERATIONAL)
        yield (*setting, Step(0, SYNC), Step(300 * US, point), Step(MS, SYNC), Step(MS, look))
    for number in (0, 1, 2, 3, 252, 253, 254, 255, 241):
        yield script(
            write(0x1800, 1, 0x8000_0185, 4),
            write(0x1800, 2, number, 1),
            write(0x1800, 1, 0x185, 4),
            OPERATIONAL,
            SYNC,
            write(0x6040, 0, 6, 2),
            SYNC,
            SYNC,
            remote(0x185),
            write(0x6040, 0, 7, 2),
            SYNC,
            SYNC,
            SYNC,
            read(0x1800, 2),
        )
        yield script(write(0x1400, 2, number, 1), OPERATIONAL, point, look, SYNC, look)
    yield script(OPERATIONAL, write(0x1400, 2, 255, 1), point, look)
    timed = (write(0x1801, 5, 30, 2), OPERATIONAL, write(0x6040, 0, 6, 2), None, remote(0x185))
    yield script(*timed, remote(0x285), write(0x6040, 0, 7, 2), wait_ns=25 * MS)
    yield script(OPERATIONAL, *(write(0x6040, 0, n % 2 * 6, 2) for n in range(9)))
    yield script(
        write(0x1800, 1, 0x8000_0185, 4),
        write(0x1800, 6, 3, 1),
        write(0x1800, 2, 2, 1),
        write(0x1800, 1, 0x185, 4),
        write(0x1019, 0, 10, 1),
        OPERATIONAL,
        *(frame(0x080, n) for n in range(1, 9)),
    )
    yield script(write(0x1A02, 1, 0x2014_0108, 4), write(0x1A02, 0, 1, 1), OPERATIONAL, SYNC)


def _parameters() -> Iterator[Script]:
    yield script(
        write(0x1800, 1, 0x186, 4),
        write(0x1800, 1, 0x8000_0185, 4),
        write(0x1800, 1, 0x601, 4),
        write(0x1800, 1, 0x2000_0185, 4),
        write(0x1800, 1, 0x185, 4),
        write(0x1801, 3, 7, 2),
        write(0x1801, 6, 7, 1),
        write(0x1A00, 0, 0, 1),
        write(0x1A02, 1, 0x1000_0020, 4),
        write(0x1A02, 1, 0x5555_0020, 4),
        write(0x1A02, 0, 1, 1),
    )
    wide = [write(0x1A02, sub, 0x2010_0940, 4) for sub in (1, 2)]
    yield script(*wide, write(0x1A02, 0, 2, 1), write(0x1A02, 0, 1, 1), wide[0])
    yield script(write(0x1012, 0, 0x601, 4), write(0x1005, 0, 0x601, 4))
    for overflow in (0, 1, 3, 10, 241):
        yield script(
            write(0x1019, 0, overflow, 1),
            write(0x1006, 0, 10_000, 4),
            write(0x1019, 0, 5, 1),
            write(0x1005, 0, 0x4000_0080, 4),
            None,
            write(0x1005, 0, 0x4000_0081, 4),
            nmt(2),
            None,
            nmt(0x80),
            None,
            write(0x1006, 0, 0, 4),
            None,
            wait_ns=23 * MS,
        )


def _objects() -> Iterator[Script]:
    yield script(
        write(0x1000, 0, 1, 4),
        read(0x1000),
        read(0x2012),
        read(0x5555),
        read(0x1000, 1),
        write(0x2011, 0, 101, 2),
        write(0x2011, 0, -101, 2),
        write(0x2011, 0, 100, 2),
        write(0x2011, 0, -100, 2),
        write(0x2011, 0, 7, 4),
        write(0x2011, 0, 7, 1),
        read(0x1017),
        *(read(0x1018, sub) for sub in range(5)),
        *(read(0x1200, sub) for sub in range(3)),
        OPERATIONAL,
        read(0x1001),
    )
    yield script(*(read(0x1000) for _ in range(120)), wait_ns=MS)


def _transfers() -> Iterator[Script]:
    note = (0x01, 0x20, 0)
    yield script(sdo(0x40, *note), sdo(0x60), sdo(0x70), sdo(0x60), sdo(0x70))
    yield script(sdo(0x40, *note), sdo(0x70), sdo(0x60), read(0x1000), sdo(0xE0), sdo(0x80))
    yield script(sdo(0x21, *note, 9), sdo(0x00, *b"1234567"), read(0x1000), sdo(0x1B, *b"89"))
    yield script(sdo(0x21, *note, 9), sdo(0x00, *b"1234567"), sdo(0x1B, *b"89"), sdo(0x40, *note))
    yield script(sdo(0x21, *note, 9), sdo(0x10, *b"1234567"), sdo(0x1B, *b"89"), sdo(0x40, *note))
    yield script(sdo(0x21, *note, 9), sdo(0x01, *b"1234567"), sdo(0x40, *note), sdo(0x60))
    yield script(sdo(0x21, *note, 7), sdo(0x00, *b"1234567"), sdo(0x1B, *b"89"), sdo(0x60))
    yield script(sdo(0x21, *note, 2), sdo(0x0B, *b"89"), sdo(0x40, *note), sdo(0x22, *note, 65))
    yield script(sdo(0x21, *note, 7), sdo(0x01, *b"1234567"), sdo(0x40, *note), sdo(0x60))
    yield script(sdo(0x21, *note, 7), sdo(0x80, *note), sdo(0x01, *b"1234567"), sdo(0x40, *note))
    yield script(sdo(0x22, 0x11, 0x20, 0, 7), Frame(0x605, sdo(0x40, 0, 0x10).data[:5]))
    yield (*script(sdo(0x40, *note)), Step(1100 * MS, None))
    long_one = [sdo(n % 2 << 4, *b"1234567") for n in range(150)]
    long_one[-1] = sdo(0x11, *b"1234567")
    look = (read(0x2000), *(sdo(0x60 | n % 2 << 4) for n in range(150)))
    yield script(sdo(0x21, 0, 0x20, 0, 0x1A, 4), *long_one, *look, wait_ns=MS)


def _blocks() -> Iterator[Script]:
    note = (0x01, 0x20, 0)
    for size in (0, 1, 2, 127, 128):
        up = (sdo(0xA4, *note, size), sdo(0xA3), None)
        yield script(*up, sdo(0xA2, 1, 2), None, sdo(0xA2, 2, 2), sdo(0xA2, 1, 2), sdo(0xA1))
    begin = (sdo(0xC6, *note, 14), sdo(1, *b"1234567"))
    yield script(*begin, sdo(0), read(0x1000))
    for number, crc in ((2, (0x58, 0xC0)), (3, (0, 0)), (2, (0, 0)), (0, (1, 1))):
        yield script(*begin, sdo(0x80 | number, *b"1234567"), sdo(0xC1, *crc), read(0x2001))


def _storing() -> Iterator[Script]:
    change = (write(0x1017, 0, 40, 2), write(0x6060, 0, 1, 1), write(0x2020, 0, 5, 4))
    looks = (read(0x1017), read(0x2020), read(0x1010, 1), read(0x1011, 1))
    for sub in (1, 2, 3):
        for signature in (SAVE, LOAD, 0x7361_7665):
            yield script(
                *change,
                write(0x1010, sub, signature, 4),
                *looks,
                nmt(0x81),
                None,
                *looks,
                write(0x1011, sub, signature, 4),
                write(0x1011, sub, LOAD, 4),
                *looks,
                nmt(0x81),
                None,
                *looks,
                wait_ns=12 * MS,
            )
    saved = script(*change, write(0x1010, 1, SAVE, 4))
    yield (*saved, Step(0, OFF), Step(0, ON), Step(60 * MS, read(0x1017)))


def _lss() -> Iterator[Script]:
    configure = lss(4, 1)
    yield script(configure, lss(4, 0), Frame(0x7E5, bytes((4, 1))), lss(0x5E))
    for wrong in range(5):
        identity = [value ^ (part == wrong) for part, value in enumerate(IDENTITY)]
        select = [lss_number(SELECT_VENDOR + n, value) for n, value in enumerate(identity)]
        yield script(*select, lss(0x5E))
    vendor, product, revision, serial = IDENTITY
    bounds = (vendor, product, revision, revision, serial, serial)
    yield script(*(lss_number(IDENTIFY_VENDOR + n, value) for n, value in enumerate(bounds)))
    for node_id in (0, 1, 9, 127, 128, 255):
        set_id = lss(0x11, node_id)
        yield script(configure, set_id, lss(0x5E), lss(0x17), nmt(0x82), None, wait_ns=20 * MS)
        stored = script(configure, set_id, lss(0x17))
        yield (*stored, Step(0, OFF), Step(0, ON), Step(60 * MS, None))
    yield script(configure, *(lss(0x13, table, n) for table in (0, 1) for n in range(10)))
    yield script(configure, *(lss(command) for command in range(0x5A, 0x60)), lss(0x15, 5))
    scan = lss(0x51, 0, 0, 0, 0, 0x80)
    steps = [lss_number(0x51, value, 0, n, (n + 1) % 4) for n, value in enumerate(IDENTITY)]
    yield script(lss(0x4C), scan, lss_number(0x51, 0, 0, 0, 0), *steps, lss(0x5E))
    lose = (configure, lss(0x11, 255), nmt(0x82), None, None)
    found = (lss(0x4C), scan, lss_number(0x51, 0, 0, 0, 0), *steps, lss(0x5E), lss(0x11, 7))
    yield script(*lose, *found, lss(4, 0), None, None, wait_ns=8 * MS)


def _edges() -> Iterator[Script]:
    for node_id in (9, 127):
        new = (lss(4, 1), lss(0x11, node_id), nmt(0x82), None, None)
        yield script(*new, Frame(0x600 + node_id, read(0x1800, 1).data), wait_ns=9 * MS)
    yield script(read(0x1018, 2), read(0x1018, 0xFF), read(0x1000, 0xFF), read(0x1800, 4))
    yield (*script(write(0x1017, 0, 1, 2)), Step(900 * MS, None))
    yield script(write(0x1015, 0, 500, 2), *(errors("vendor"), errors()) * 2, errors("encoder"))
    yield script(OPERATIONAL, nmt(0x80), nmt(1), nmt(2), nmt(0x82), wait_ns=150 * MS)
    dated = (write(0x1007, 0, 5000, 4), write(0x1020, 1, 7, 4), write(0x1010, 1, SAVE, 4))
    looks = (read(0x1007), read(0x1020, 1), write(0x1017, 0, 40, 2), read(0x1020, 1))
    yield script(*dated, None, nmt(0x81), None, *looks, wait_ns=12 * MS)
    change = (write(0x1017, 0, 40, 2), write(0x2020, 0, 5, 4), write(0x1010, 1, SAVE, 4))
    end = (Step(MS, OFF), Step(MS, ON), Step(60 * MS, read(0x1017)), Step(MS, read(0x2020)))
    yield (*script(*change, wait_ns=MS)[:-1], *end)
    yield script(lss(4, 1), lss(0x15, 20), BEAT, None, BEAT, None, wait_ns=15 * MS)
    yield (*script()[:-1], *(Step(70 * MS, power) for power in (OFF, ON) * 3))


def _basics() -> Iterator[Script]:
    early = (Step(0, ON), Step(20 * MS, frame(0x6A0, 1)), Step(9 * MS, OPERATIONAL))
    yield (*early, Step(100 * MS, read(0x1000)), Step(30 * MS, None))
    names = (read(0x1008), sdo(0x60), sdo(0x70), sdo(0x60))
    numbers = (read(0x1015), read(0x1005), read(0x1012), read(0x1402, 1), read(0x1803, 1))
    yield script(*names, *numbers, write(0x1017, 0, 0x102, 2), read(0x1017))
    for command in (0x82, 0x81):
        beat = write(0x1017, 0, 40, 2)
        yield script(beat, nmt(command), None, None, read(0x1017), wait_ns=8 * MS)
    off, on = write(0x1401, 1, 0x8000_0305, 4), write(0x1401, 1, 0x305, 4)
    count = write(0x1601, 0, 0, 1)
    dummy, speed = write(0x1601, 1, 0x0005_0008, 4), write(0x1601, 2, 0x2010_0A08, 4)
    steps = (off, count, dummy, speed, write(0x1601, 0, 2, 1), read(0x1601, 2), on)
    used = (OPERATIONAL, frame(0x305, 0x22, 0x33), read(0x2010, 10))
    yield script(*steps, write(0x1401, 2, 255, 1), *used)
    yield script(off, count, write(0x1601, 1, 0x5FFF_0008, 4), dummy, off, dummy, read(0x1601, 1))
    yield (*script(write(0x1010, 1, SAVE, 4)), Step(1100 * MS, None))
    yield script(BEAT, frame(0x7C5, 1), None, None, frame(0x7E0), None, wait_ns=9 * MS)
    yield script(BEAT, *(frame(0x6A0, 1),) * 60, None, None, None, wait_ns=MS // 10)


TOPICS: Mapping[str, Callable[[], Iterator[Script]]] = {
    "network": _network,
    "error control": _error_control,
    "emergencies": _emergencies,
    "pdos": _pdos,
    "parameters": _parameters,
    "objects": _objects,
    "transfers": _transfers,
    "blocks": _blocks,
    "storing": _storing,
    "lss": _lss,
    "edges": _edges,
    "basics": _basics,
}


def drive_scripts() -> Sequence[tuple[str, Script]]:
    """All of them, each with its topic."""
    return tuple((topic, one) for topic, make in TOPICS.items() for one in make())
