"""Parameters that survive: signatures, groups, resets, power cuts, and the date of a set-up."""

from __future__ import annotations

import pytest

from node_model.node import MS, US
from node_model.nonvolatile import NonVolatile, is_parameter
from node_model.od import AbortCode, Access, DataType, Entry, ObjectDictionary
from tests.node_model.services import entry, passing, refused, u8, u16, u32, write

SAVE, LOAD = 0x65766173, 0x64616F6C
BEAT, MAKER, APPLICATION, MAPPED = 0x1017, 0x2000, 0x6081, 0x607A


def objects() -> list[Entry]:
    """A heartbeat time, a parameter of each kind, a name, and what is not stored."""
    name = Entry(0x2001, 0, "name", DataType.VISIBLE_STRING, Access.RW, b"axis", b"axis", most=8)
    return [
        *(u32(index, sub, 1) for index in (0x1010, 0x1011) for sub in (1, 2, 3, 4, 5)),
        u8(0x1010, 0, 5, Access.CONST),
        u8(0x1011, 0, 5, Access.CONST),
        u8(0x1003, 0),
        u32(0x1020, 1),
        u32(0x1020, 2),
        u16(BEAT, 0, 1000),
        u16(MAKER, 0, 20),
        name,
        u32(APPLICATION, 0, 30),
        entry(MAPPED, 0, DataType.INTEGER32, 40, Access.RWW, pdo=True),
        Entry(0x2002, 0, "file", DataType.DOMAIN, Access.RW, b"x", b"x"),
        u8(0x2003, 0, 0, Access.WO),
    ]


class Device:
    """Stored parameters on a dictionary after power-on."""

    def __init__(self, image: bytes = b"") -> None:
        self.od = ObjectDictionary(objects())
        self.memory = NonVolatile(self.od, image)
        self.memory.restore(lambda _: True)
        self.memory.start(0)

    def set(self, *indices: int, to: int = 7) -> None:
        """A client writes those objects."""
        for index in indices:
            write(self.od, index, 0, to)

    def command(self, index: int, sub: int = 1) -> None:
        """Save or load, and all the time that it needs."""
        write(self.od, index, sub, SAVE if index == 0x1010 else LOAD, 0)
        passing(self.memory, 1000 * MS)

    def again(self) -> Device:
        """The device after a power cycle."""
        self.memory.stop()
        return Device(self.memory.image())

    def values(self) -> list[int]:
        """Heartbeat time, maker's, application's and mapped object."""
        return [self.od.number(index) for index in (BEAT, MAKER, APPLICATION, MAPPED)]


ALL = (BEAT, MAKER, APPLICATION, MAPPED)


def test_a_blank_memory_gives_the_defaults() -> None:
    """As it left the factory."""
    assert Device().values() == [1000, 20, 30, 40]


def test_unsaved_values_do_not_survive() -> None:
    """Neither a power cycle nor a reset."""
    device = Device()
    device.set(*ALL)
    assert device.again().values() == [1000, 20, 30, 40]
    device.memory.restore(lambda _: True)
    assert device.values() == [1000, 20, 30, 40]


def test_saved_values_survive_a_power_cycle_and_a_reset() -> None:
    """All but process data, which are no parameters."""
    device = Device()
    device.set(*ALL)
    device.command(0x1010)
    assert device.values() == [7, 7, 7, 7]
    assert device.again().values() == [7, 7, 7, 40]
    device.set(*ALL, to=8)
    device.memory.restore(lambda _: True)
    assert device.values() == [7, 7, 7, 40]


def test_what_is_no_parameter_does_not_survive() -> None:
    """A domain without limit, and what clients cannot read back."""
    device = Device()
    device.od.write(0x2002, 0, b"another file", 0)
    write(device.od, 0x2003, 0, 9)
    device.command(0x1010)
    again = device.again().od
    assert (again.get(0x2002), again.get(0x2003)) == (b"x", b"\0")
    kept = {each.index for each in objects() if is_parameter(each)}
    assert kept == {0x1020, BEAT, MAKER, 0x2001, APPLICATION}


@pytest.mark.parametrize(
    ("sub", "first", "last"),
    [(1, 0, 0xFFFF), (2, 0x1000, 0x1FFF), (3, 0x6000, 0x9FFF), (4, 0x2000, 0x5FFF)],
)
def test_a_group_has_exact_bounds(sub: int, first: int, last: int) -> None:
    """The areas of CiA 301."""
    group = Device().memory.group(sub)
    assert (group[0], group[-1]) == (first, last)


def test_texts_survive_with_their_length() -> None:
    """A shorter one and an empty one."""
    device = Device()
    for text in (b"x", b""):
        device.od.write(0x2001, 0, text, 0)
        device.command(0x1010)
        assert device.again().od.read(0x2001, 0) == text


def test_a_reset_of_the_communication_leaves_the_application_alone() -> None:
    """Only the objects concerned take their power-on values."""
    device = Device()
    device.set(*ALL)
    device.memory.restore(lambda index: 0x1000 <= index < 0x2000)
    assert device.values() == [1000, 7, 7, 7]


@pytest.mark.parametrize(
    ("sub", "kept"),
    [
        (1, [7, 7, 7]),
        (2, [7, 20, 30]),
        (3, [1000, 20, 7]),
        (4, [1000, 7, 30]),
        (5, [1000, 20, 30]),
    ],
)
def test_each_sub_index_saves_its_group(sub: int, kept: list[int]) -> None:
    """1 all, 2 communication, 3 application, 4 the maker's; 5 has no group here."""
    device = Device()
    device.set(*ALL)
    device.command(0x1010, sub)
    assert device.again().values()[:3] == kept


@pytest.mark.parametrize(
    ("sub", "kept"),
    [(1, [1000, 20, 30]), (2, [1000, 7, 7]), (3, [7, 7, 30]), (4, [7, 20, 7]), (5, [7, 7, 7])],
)
def test_each_sub_index_forgets_its_group(sub: int, kept: list[int]) -> None:
    """The values stay until the next reset."""
    device = Device()
    device.set(*ALL)
    device.command(0x1010)
    device.command(0x1011, sub)
    assert device.values()[:3] == [7, 7, 7]
    assert device.again().values()[:3] == kept


def test_saving_one_group_keeps_what_another_has_stored() -> None:
    """Also while the first is still being written."""
    device = Device()
    device.set(*ALL)
    write(device.od, 0x1010, 2, SAVE)
    write(device.od, 0x1010, 3, SAVE)
    passing(device.memory, 1000 * MS)
    assert device.again().values()[:3] == [7, 20, 7]


def test_a_default_that_is_saved_over_a_value_is_the_default_again() -> None:
    """It is not stored: a later default takes its place."""
    device = Device()
    device.set(BEAT)
    device.command(0x1010)
    device.set(BEAT, to=1000)
    device.command(0x1010)
    assert device.again().values()[0] == 1000


@pytest.mark.parametrize("index", [0x1010, 0x1011])
@pytest.mark.parametrize("value", [0, 1, LOAD, SAVE, 0x73617665])
def test_another_signature_is_refused(index: int, value: int) -> None:
    """0800 0020h, and nothing is stored; big-endian letters are another one."""
    right = SAVE if index == 0x1010 else LOAD
    if value == right:
        return
    device = Device()
    device.set(*ALL)
    assert refused(device.od, index, 1, value) is AbortCode.CANNOT_STORE
    assert device.memory.deadline() is None


def test_a_broken_memory_is_a_hardware_error() -> None:
    """0606 0000h."""
    device = Device()
    device.memory.broken = True
    assert refused(device.od, 0x1010, 1, SAVE) is AbortCode.HARDWARE
    assert refused(device.od, 0x1011, 1, LOAD) is AbortCode.HARDWARE


@pytest.mark.parametrize("index", [0x1010, 0x1011])
def test_a_client_reads_what_can_be_done(index: int) -> None:
    """Bit 0: on command, before and after a command."""
    device = Device()
    assert device.od.read(index, 1) == b"\1\0\0\0"
    device.command(index)
    assert device.od.read(index, 1) == b"\1\0\0\0"
    assert device.od.read(index, 0) == b"\5"


# Power cuts


def test_a_power_cut_at_any_instant_leaves_the_old_or_the_new_set() -> None:
    """Never a mixture: each of the bytes is tried."""
    first = Device()
    first.set(*ALL, to=7)
    first.command(0x1010)
    image = first.memory.image()
    seen: list[list[int]] = []
    cut_at = 0
    while not seen or seen[-1] != [8, 8, 8]:
        device = Device(image)
        device.set(*ALL, to=8)
        write(device.od, 0x1010, 1, SAVE, 0)
        passing(device.memory, cut_at)
        seen.append(device.again().values()[:3])
        cut_at += 50 * US
    assert len(seen) > 20
    assert all(values == [7, 7, 7] for values in seen[:-1])


def test_what_a_power_cut_has_lost_is_not_stored_with_the_next_group() -> None:
    """The device knows after power-on only what its memory holds."""
    device = Device()
    device.set(*ALL)
    write(device.od, 0x1010, 2, SAVE, 0)
    device.memory.stop()
    device.memory.restore(lambda _: True)
    device.set(APPLICATION)
    device.command(0x1010, 3)
    assert device.again().values()[:3] == [1000, 20, 7]


def test_a_reset_waits_for_what_is_being_stored() -> None:
    """The device finishes it before it obeys."""
    device = Device()
    device.set(*ALL)
    write(device.od, 0x1010, 1, SAVE, 0)
    device.memory.finish()
    device.memory.stop()
    device.memory.restore(lambda _: True)
    assert device.values()[:3] == [7, 7, 7]


# 1020h


def test_the_date_of_the_configuration_is_saved_with_it() -> None:
    """Day and time, as they were written."""
    device = Device()
    write(device.od, 0x1020, 1, 15_000)
    write(device.od, 0x1020, 2, 3_600_000)
    device.command(0x1010)
    again = device.again()
    assert (again.od.number(0x1020, 1), again.od.number(0x1020, 2)) == (15_000, 3_600_000)


@pytest.mark.parametrize("index", [BEAT, MAKER, APPLICATION])
def test_a_change_of_the_configuration_clears_the_date(index: int) -> None:
    """Both parts."""
    device = Device()
    write(device.od, 0x1020, 1, 15_000)
    write(device.od, 0x1020, 2, 3_600_000)
    device.set(index)
    assert (device.od.read(0x1020, 1), device.od.read(0x1020, 2)) == (bytes(4), bytes(4))


def test_what_is_no_change_keeps_the_date() -> None:
    """The value that is there written again, process data, and saving."""
    device = Device()
    write(device.od, 0x1020, 1, 15_000)
    device.set(BEAT, to=1000)
    device.set(MAPPED)
    device.command(0x1010)
    assert device.od.number(0x1020, 1) == 15_000


@pytest.mark.parametrize("sub", [1, 2, 3])
def test_going_back_to_the_defaults_clears_the_date_for_good(sub: int) -> None:
    """At once, and after the reset."""
    device = Device()
    device.set(*ALL)
    write(device.od, 0x1020, 1, 15_000)
    device.command(0x1010)
    device.command(0x1011, sub)
    assert device.od.number(0x1020, 1) == 0
    assert device.again().od.number(0x1020, 1) == 0


def test_a_device_without_these_objects_restores_its_defaults() -> None:
    """All three are optional."""
    od = ObjectDictionary([u16(BEAT, 0, 1000)])
    memory = NonVolatile(od)
    write(od, BEAT, 0, 5)
    memory.restore(lambda _: True)
    assert od.number(BEAT) == 1000


def test_a_device_without_a_date_has_none_to_clear() -> None:
    """Saved, changed, and back to the defaults: 1020h is optional."""
    od = ObjectDictionary([each for each in objects() if each.index != 0x1020])
    memory = NonVolatile(od)
    memory.restore(lambda _: True)
    memory.start(0)
    for index, signature, value in ((0x1010, SAVE, 5), (0x1011, LOAD, 1000)):
        write(od, BEAT, 0, 5)
        write(od, index, 1, signature, 0)
        passing(memory, 1000 * MS)
        memory.restore(lambda _: True)
        assert od.number(BEAT) == value
