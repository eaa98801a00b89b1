"""Object dictionary: types, entries, access, guards and observers."""

from __future__ import annotations

import struct

import pytest

from node_model.od import AbortCode, Access, DataType, Entry, ObjectDictionary, SdoAbort

NUMBERS = [kind for kind in DataType if kind.is_number]


def entry(kind: DataType, value: bytes = b"", **more: object) -> Entry:
    """An rw entry 2000h:00."""
    made = Entry(0x2000, 0, "entry", kind, Access.RW, value, value)
    for name, what in more.items():
        setattr(made, name, what)
    return made


def refused(od: ObjectDictionary, data: bytes, index: int = 0x2000, sub: int = 0) -> AbortCode:
    """The code with which a write is refused."""
    before = {key: e.value for key, e in od.entries.items()}
    with pytest.raises(SdoAbort) as caught:
        od.write(index, sub, data, 1)
    assert {key: e.value for key, e in od.entries.items()} == before
    return caught.value.code


@pytest.mark.parametrize("kind", [kind for kind in NUMBERS if not kind.is_real])
def test_an_integer_is_packed_to_its_ends(kind: DataType) -> None:
    """Least and greatest value come back from their bytes; one more does not fit."""
    bits = kind.size * 8
    least, greatest = (
        (-(1 << bits - 1), (1 << bits - 1) - 1) if kind.is_signed else (0, 2**bits - 1)
    )
    for value in (least, greatest):
        data = kind.pack(value)
        assert len(data) == kind.size
        assert kind.unpack(data) == value
    for value in (least - 1, greatest + 1):
        with pytest.raises(OverflowError):
            kind.pack(value)


@pytest.mark.parametrize(("kind", "form"), [(DataType.REAL32, "<f"), (DataType.REAL64, "<d")])
def test_a_real_is_packed_as_ieee_754(kind: DataType, form: str) -> None:
    """Little-endian, 4 or 8 bytes."""
    assert kind.pack(-2.5) == struct.pack(form, -2.5)
    assert kind.unpack(struct.pack(form, 0.25)) == 0.25


def test_types_are_told_by_their_code() -> None:
    """A code gives the member; strings and domains have no size, times are no numbers."""
    assert DataType(0x16) is DataType.UNSIGNED24
    assert DataType.DOMAIN.size == DataType.VISIBLE_STRING.size == 0
    assert DataType.TIME_OF_DAY.size == 6
    assert not DataType.TIME_OF_DAY.is_number
    with pytest.raises(ValueError, match="23"):
        DataType(0x17)


@pytest.mark.parametrize(
    ("word", "readable", "writable"),
    [
        ("ro", True, False),
        ("const", True, False),
        ("wo", False, True),
        ("rw", True, True),
        ("rwr", True, True),
        ("rww", True, True),
    ],
)
def test_access_types_say_what_sdo_may_do(word: str, readable: bool, writable: bool) -> None:
    """Words of CiA 306; rwr and rww differ for PDO alone."""
    assert (Access(word).readable, Access(word).writable) == (readable, writable)


def test_what_the_device_does_is_unchecked() -> None:
    """It reads and sets entries, numbers among them; nobody is told."""
    od = ObjectDictionary([entry(DataType.UNSIGNED16, b"\1\0"), Entry(
        0x2001, 1, "real", DataType.REAL32, Access.RO, bytes(4))])  # fmt: skip
    od.observe(0x2000, lambda *_: pytest.fail("told"))
    assert 0x2000 in od
    assert 0x2002 not in od
    assert od.has(0x2001, 1)
    assert not od.has(0x2001)
    od.put_number(0x2000, 0, 0x1234)
    assert od.get(0x2000) == b"\x34\x12"
    assert od.number(0x2000) == 0x1234
    assert od.number(0x3000, default=7) == 7
    od.put(0x2001, 1, struct.pack("<f", 3.75))
    assert od.number(0x2001, 1) == 3


def test_what_is_not_there_cannot_be_accessed() -> None:
    """No object and no sub-index are different codes."""
    od = ObjectDictionary([entry(DataType.UNSIGNED8, b"\0")])
    for index, sub, code in (
        (0x2001, 0, AbortCode.NO_OBJECT),
        (0x2000, 1, AbortCode.NO_SUB_INDEX),
    ):
        assert refused(od, b"\0", index, sub) is code
        with pytest.raises(SdoAbort, match=f"{code:08X}h"):
            od.read(index, sub)


def test_access_is_kept() -> None:
    """A read-only entry is not written, a write-only one not read."""
    od = ObjectDictionary([
        Entry(0x2000, 0, "ro", DataType.UNSIGNED8, Access.RO, b"\1"),
        Entry(0x2001, 0, "wo", DataType.UNSIGNED8, Access.WO, b"\1"),
    ])  # fmt: skip
    assert refused(od, b"\0") is AbortCode.READ_ONLY
    assert od.read(0x2000, 0) == b"\1"
    od.write(0x2001, 0, b"\2", 1)
    with pytest.raises(SdoAbort) as caught:
        od.read(0x2001, 0)
    assert caught.value.code is AbortCode.WRITE_ONLY


@pytest.mark.parametrize("kind", [kind for kind in DataType if kind.size])
def test_a_value_has_the_length_of_its_type(kind: DataType) -> None:
    """A byte more or less is refused."""
    od = ObjectDictionary([entry(kind, bytes(kind.size))])
    assert refused(od, bytes(kind.size + 1)) is AbortCode.TOO_LONG
    assert refused(od, bytes(kind.size - 1)) is AbortCode.TOO_SHORT
    od.write(0x2000, 0, bytes(kind.size), 1)


@pytest.mark.parametrize("most", [0, 3])
def test_a_string_has_up_to_its_most_bytes(most: int) -> None:
    """Without a limit of its own it takes any number, none too."""
    od = ObjectDictionary([entry(DataType.VISIBLE_STRING, b"ab", most=most)])
    od.write(0x2000, 0, b"abc", 1)
    if most:
        assert refused(od, b"abcd") is AbortCode.TOO_LONG
    else:
        od.write(0x2000, 0, b"abcd" * 1000, 1)
    od.write(0x2000, 0, b"", 1)


@pytest.mark.parametrize(
    ("low", "high", "value", "code"),
    [
        (-2, 5, -3, AbortCode.TOO_LOW),
        (-2, 5, 6, AbortCode.TOO_HIGH),
        (None, 5, 6, AbortCode.TOO_HIGH),
        (-2, None, -3, AbortCode.TOO_LOW),
        (-2, 5, -2, None),
        (-2, 5, 5, None),
        (None, 5, -128, None),
        (-2, None, 127, None),
    ],
)
def test_limits_are_kept(
    low: int | None, high: int | None, value: int, code: AbortCode | None
) -> None:
    """Each limit from both sides, and one without the other."""
    od = ObjectDictionary([entry(DataType.INTEGER8, b"\0", low=low, high=high)])
    data = DataType.INTEGER8.pack(value)
    if code:
        assert refused(od, data) is code
    else:
        od.write(0x2000, 0, data, 1)
        assert od.number(0x2000) == value


def test_a_boolean_is_0_or_1() -> None:
    """Its type has limits of its own."""
    od = ObjectDictionary([entry(DataType.BOOLEAN, b"\0")])
    od.write(0x2000, 0, b"\1", 1)
    assert refused(od, b"\2") is AbortCode.TOO_HIGH


def test_what_is_no_number_is_within_no_limits() -> None:
    """NaN is refused where there are limits."""
    nan = struct.pack("<f", float("nan"))
    od = ObjectDictionary([entry(DataType.REAL32, bytes(4), high=2.0)])
    assert refused(od, nan) is AbortCode.VALUE
    od = ObjectDictionary([entry(DataType.REAL32, bytes(4))])
    od.write(0x2000, 0, nan, 1)


def test_guards_refuse_before_and_observers_learn_after() -> None:
    """In the order in which they were set; after a refusal nobody is told."""
    od = ObjectDictionary([entry(DataType.UNSIGNED8, b"\0")])
    said: list[object] = []

    def guard(sub: int, data: bytes) -> None:
        said.append((sub, data, od.get(0x2000)))
        if data == b"\7":
            raise SdoAbort(AbortCode.LOCAL_CONTROL)

    od.guard(0x2000, guard)
    od.observe(0x2000, lambda sub, now: said.append((sub, now)))
    od.observe(0x2000, lambda *_: said.append(od.get(0x2000)))
    od.write(0x2000, 0, b"\1", 33)
    assert said == [(0, b"\1", b"\0"), (0, 33), b"\1"]
    assert refused(od, b"\7") is AbortCode.LOCAL_CONTROL
    assert len(said) == 4


def test_a_witness_learns_last_of_every_write_and_whether_it_changes_anything() -> None:
    """It is told of each index after its observers; of no refused write, and of no `put`."""
    other = Entry(0x2001, 0, "other", DataType.UNSIGNED8, Access.RO, b"\0")
    od = ObjectDictionary([entry(DataType.UNSIGNED8, b"\5"), other])
    said: list[object] = []
    od.witness(lambda index, differs: said.append((index, differs)))
    od.observe(0x2000, lambda *_: said.append("observer"))
    od.write(0x2000, 0, b"\6", 1)
    od.write(0x2000, 0, b"\6", 1)
    assert refused(od, b"\0", index=0x2001) is AbortCode.READ_ONLY
    od.put(0x2000, 0, b"\7")
    assert said == ["observer", (0x2000, True), "observer", (0x2000, False)]


def test_a_read_can_be_refused() -> None:
    """E.g. where there is no data yet."""
    od = ObjectDictionary([entry(DataType.UNSIGNED8, b"\0")])
    asked: list[int] = []
    od.guard_reading(0x2000, asked.append)
    assert od.read(0x2000, 0) == b"\0"
    assert asked == [0]

    def refuse(_: int) -> None:
        raise SdoAbort(AbortCode.NO_DATA)

    od.guard_reading(0x2000, refuse)
    with pytest.raises(SdoAbort) as caught:
        od.read(0x2000, 0)
    assert caught.value.code is AbortCode.NO_DATA
