"""What a PDO carries: layout, dummies, direction, length, and the five steps to change it."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from node_model.node import MS
from node_model.od import AbortCode, DataType, ObjectDictionary
from node_model.pdo import Direction, Mapping
from node_model.pdo.mapping import Field, mapping_of
from tests.node_model.pdo.axis import ACTUAL, OFF, Axis, mapped, objects
from tests.node_model.services import entry, passing, refused, write


def mapping(*values: int, direction: Direction = Direction.TRANSMIT) -> Mapping:
    """A mapping of the axis."""
    od = ObjectDictionary([*objects(), *mapped(0x1A00, *values)])
    return mapping_of(od, 0x1A00, len(values), direction)


def test_the_first_entry_has_the_lowest_bytes() -> None:
    """Little-endian, a 24-bit object between two others: literal bytes."""
    layout = mapping(0x60410010, 0x20000218, 0x20000508)
    values = [b"\x34\x12", b"\x03\x02\x01", b"\xff"]
    for field, value in zip(layout.fields, values, strict=True):
        assert field.entry is not None
        field.entry.value = value
    assert layout.size == 6
    assert layout.pack() == bytes.fromhex("3412 030201 FF")


def test_a_boolean_takes_one_bit_or_a_byte() -> None:
    """What follows begins at the next bit; the last byte is filled with zeros."""
    layout = mapping(0x20000101, 0x20000218)
    for field, value in zip(layout.fields, [b"\x01", b"\xff\xff\x7f"], strict=True):
        assert field.entry is not None
        field.entry.value = value
    assert layout.pack() == bytes.fromhex("FFFFFF00")
    assert mapping(0x20000108).size == 1


def test_dummies_skip_bits_of_an_rpdo() -> None:
    """0005h is an UNSIGNED8, 0006h an UNSIGNED16, 0001h a BOOLEAN."""
    layout = mapping(0x00050008, 0x60400010, 0x00060010, direction=Direction.RECEIVE)
    ((found, value),) = layout.unpack(bytes.fromhex("AA 3412 BBBB"))
    assert (found.index, value) == (0x6040, b"\x34\x12")
    assert layout.keys == {(0x6040, 0)}
    assert mapping(0x00010001, direction=Direction.RECEIVE).size == 1


def test_packing_a_dummy_gives_zeros() -> None:
    """No TPDO has one; a mapping by itself can."""
    assert Mapping((Field(8, None),)).pack() == b"\0"


def test_longer_data_are_cut() -> None:
    """The first bytes count."""
    layout = mapping(0x60400010, direction=Direction.RECEIVE)
    ((_, value),) = layout.unpack(bytes.fromhex("3412 FFFF"))
    assert value == b"\x34\x12"


@given(
    values=st.lists(
        st.sampled_from(
            [DataType.BOOLEAN, DataType.INTEGER8, DataType.UNSIGNED16, DataType.UNSIGNED24]
        ).flatmap(
            lambda kind: st.tuples(
                st.just(kind),
                st.booleans().map(int)
                if kind is DataType.BOOLEAN
                else st.binary(min_size=kind.size, max_size=kind.size).map(kind.unpack),
            )
        ),
        max_size=2,
    )
)
def test_what_was_packed_is_unpacked(values: list[tuple[DataType, int]]) -> None:
    """Any row of objects, bits and bytes mixed."""
    entries = [entry(0x2000 + n, 0, kind, value) for n, (kind, value) in enumerate(values)]
    widths = [1 if e.data_type is DataType.BOOLEAN else 8 * e.data_type.size for e in entries]
    layout = Mapping(tuple(Field(w, e) for w, e in zip(widths, entries, strict=True)))
    assert layout.unpack(layout.pack()) == [(each, each.value) for each in entries]


# What may be mapped


@pytest.mark.parametrize(
    ("value", "code"),
    [
        (0x99990010, AbortCode.NO_OBJECT),
        (0x60400110, AbortCode.NO_SUB_INDEX),
        (0x20000608, AbortCode.NOT_MAPPABLE),
        (0x20000408, AbortCode.NOT_MAPPABLE),
        (0x60640010, AbortCode.NOT_MAPPABLE),
        (0x20000720, AbortCode.NOT_MAPPABLE),
        (0x00050008, AbortCode.NOT_MAPPABLE),
        (0x60400010, AbortCode.NOT_MAPPABLE),
    ],
)
def test_a_tpdo_refuses_what_it_cannot_carry(value: int, code: AbortCode) -> None:
    """Absent, not for PDOs, write-only, half an object, a text, a dummy, an rww object."""
    axis = Axis()
    assert refused(axis.od, 0x1A02, 1, value) is code


@pytest.mark.parametrize(
    "value", [0x60410010, 0x20000508, 0x20000108, 0x20000101, 0x20000218, 0x20000808]
)
def test_a_tpdo_carries_what_can_be_read(value: int) -> None:
    """ro, const, rw, and rwr."""
    write(Axis().od, 0x1A02, 1, value)


@pytest.mark.parametrize(
    ("value", "code"),
    [
        (0x60410010, AbortCode.NOT_MAPPABLE),
        (0x20000508, AbortCode.NOT_MAPPABLE),
        (0x20000808, AbortCode.NOT_MAPPABLE),
        (0x00050010, AbortCode.NOT_MAPPABLE),
        (0x00050108, AbortCode.NOT_MAPPABLE),
        (0x00080020, AbortCode.NO_OBJECT),
    ],
)
def test_an_rpdo_refuses_what_it_cannot_bring(value: int, code: AbortCode) -> None:
    """ro, const, rwr, a dummy of the wrong length or sub-index, REAL32, which is no dummy."""
    assert refused(Axis().od, 0x1601, 1, value) is code


@pytest.mark.parametrize("value", [0x60400010, 0x20000408, 0x20000218, 0x00070020, 0])
def test_an_rpdo_brings_what_can_be_written(value: int) -> None:
    """rww, wo, rw, a dummy; and 0, which is no entry."""
    write(Axis().od, 0x1601, 1, value)


def test_a_count_that_takes_in_no_entry_or_too_much_is_refused() -> None:
    """0602 0000h for an empty entry, 0604 0042h for more than 64 bits or too many entries."""
    axis = Axis()
    write(axis.od, 0x1A02, 1, 0x20000340)
    assert refused(axis.od, 0x1A02, 0, 2) is AbortCode.NO_OBJECT
    write(axis.od, 0x1A02, 2, 0x20000101)
    assert refused(axis.od, 0x1A02, 0, 2) is AbortCode.PDO_LENGTH
    assert refused(axis.od, 0x1A02, 0, 5) is AbortCode.PDO_LENGTH
    assert refused(axis.od, 0x1A02, 0, 254) is AbortCode.PDO_LENGTH
    write(axis.od, 0x1A02, 0, 1)


def test_objects_that_describe_no_mapping_carry_nothing() -> None:
    """A PDO whose default mapping is wrong does not live."""
    axis = Axis()
    axis.od.put_number(0x1A02, 0, 1)
    axis.od.put_number(0x1A02, 1, 0x99990010)
    write(axis.od, 0x1802, 1, 0x385)
    assert passing(axis.pdos, 0) == []


# The five steps


def test_the_five_steps_change_a_mapping() -> None:
    """Off, no entries, entries, their number, on: the PDO then carries the new ones."""
    axis = Axis()
    write(axis.od, 0x1800, 1, OFF | 0x185, 1)
    write(axis.od, 0x1A00, 0, 0, 2)
    write(axis.od, 0x1A00, 1, 0x60640020, 3)
    write(axis.od, 0x1A00, 2, 0x20000218, 4)
    write(axis.od, 0x1A00, 3, 0x20000108, 5)
    write(axis.od, 0x1A00, 0, 3, 6)
    assert axis.pdos.deadline() is None
    axis.od.put_number(ACTUAL, 0, -2)
    write(axis.od, 0x1800, 1, 0x185, 8)
    assert passing(axis.pdos, MS) == [(8, "185#FEFFFFFF00000000")]


@pytest.mark.parametrize(("sub", "value"), [(0, 0), (0, 2), (1, 0x60410010), (1, 0)])
def test_a_valid_pdo_keeps_its_mapping(sub: int, value: int) -> None:
    """0601 0000h, whatever is written."""
    axis = Axis()
    for index in (0x1600, 0x1A00):
        assert refused(axis.od, index, sub, value) is AbortCode.ACCESS


def test_an_entry_is_written_while_there_are_none() -> None:
    """0601 0000h while the number of entries is not 0, also where the PDO is off."""
    axis = Axis()
    write(axis.od, 0x1800, 1, OFF | 0x185)
    assert refused(axis.od, 0x1A00, 1, 0x60640020) is AbortCode.ACCESS


def test_after_a_refused_step_the_old_mapping_can_be_used_again() -> None:
    """The entries are as they were."""
    axis = Axis()
    write(axis.od, 0x1800, 1, OFF | 0x185)
    write(axis.od, 0x1A00, 0, 0)
    refused(axis.od, 0x1A00, 1, 0x99990010)
    refused(axis.od, 0x1A00, 0, 3)
    write(axis.od, 0x1A00, 0, 2)
    write(axis.od, 0x1800, 1, 0x185, 9)
    assert passing(axis.pdos, MS) == [(9, "185#000000000000")]


# Communication parameters


@pytest.mark.parametrize("index", [0x1400, 0x1800])
def test_the_identifier_changes_only_while_the_pdo_is_off(index: int) -> None:
    """0609 0030h; so are restricted and 29-bit identifiers."""
    axis = Axis()
    assert refused(axis.od, index, 1, 0x199) is AbortCode.VALUE
    assert refused(axis.od, index, 1, 0x601) is AbortCode.VALUE
    assert refused(axis.od, index, 1, 1 << 29 | axis.od.number(index, 1)) is AbortCode.VALUE
    write(axis.od, index, 1, OFF)
    assert refused(axis.od, index, 1, 0) is AbortCode.VALUE
    write(axis.od, index, 1, 0x199)


@pytest.mark.parametrize("kind", [241, 251])
@pytest.mark.parametrize("index", [0x1400, 0x1800])
def test_reserved_transmission_types_are_refused(index: int, kind: int) -> None:
    """0609 0030h; their neighbours 240 and 254 are right."""
    axis = Axis()
    assert refused(axis.od, index, 2, kind) is AbortCode.VALUE
    write(axis.od, index, 2, 240)
    write(axis.od, index, 2, 254)


@pytest.mark.parametrize("kind", [252, 253])
def test_only_a_tpdo_can_be_asked_for(kind: int) -> None:
    """252 and 253 have no meaning for an RPDO."""
    axis = Axis()
    assert refused(axis.od, 0x1400, 2, kind) is AbortCode.VALUE
    write(axis.od, 0x1800, 2, kind)


@pytest.mark.parametrize(("sub", "value"), [(3, 100), (6, 2)])
def test_inhibit_time_and_start_value_change_only_while_the_pdo_is_off(
    sub: int, value: int
) -> None:
    """0609 0030h; the value that is there may be written again."""
    axis = Axis()
    assert refused(axis.od, 0x1800, sub, value) is AbortCode.VALUE
    write(axis.od, 0x1800, sub, 0)
    write(axis.od, 0x1800, 1, OFF | 0x185)
    write(axis.od, 0x1800, sub, value)


def test_a_start_value_above_240_is_refused() -> None:
    """0609 0030h, also while the PDO is off."""
    axis = Axis()
    assert refused(axis.od, 0x1802, 6, 241) is AbortCode.VALUE
    write(axis.od, 0x1802, 6, 240)


def test_sub_index_4_does_not_exist() -> None:
    """It is reserved: 0609 0011h."""
    axis = Axis()
    assert not axis.od.has(0x1800, 4)
