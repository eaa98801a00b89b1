"""Frame: its limits, its length on the wire, who wins arbitration, packing, text.

The lengths are held against two independent oracles: a naive bit string written from the
standard (tests/oracles/bits.py), and can-utils itself (tests/oracles/canutils.py).
"""

from __future__ import annotations

from dataclasses import FrozenInstanceError
from pathlib import Path
from random import Random

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from node_model.frame import MAX_BASE_ID, MAX_EXTENDED_ID, Frame, crc15, stuff_bits
from tests.oracles import bits, canutils


@st.composite
def frames(draw: st.DrawFn) -> Frame:
    """Every frame that there can be: both formats, remote, each data length code."""
    extended = draw(st.booleans())
    can_id = draw(st.integers(0, MAX_EXTENDED_ID if extended else MAX_BASE_ID))
    if draw(st.booleans()):
        return Frame(can_id, remote=True, extended=extended, dlc=draw(st.integers(0, 15)))
    data = draw(st.binary(max_size=8))
    dlc = draw(st.integers(8, 15)) if len(data) == 8 else len(data)
    return Frame(can_id, data, extended=extended, dlc=dlc)


def random_frame(random: Random) -> Frame:
    """A random frame of any kind; cheaper than Hypothesis where many are wanted."""
    extended = random.random() < 0.5
    can_id = random.randint(0, MAX_EXTENDED_ID if extended else MAX_BASE_ID)
    if random.random() < 0.2:
        return Frame(can_id, remote=True, extended=extended, dlc=random.randint(0, 15))
    if random.random() < 0.5:
        return Frame(can_id, random.randbytes(random.randint(0, 8)), extended=extended)
    body = bytes(random.choice(b"\x00\xff\x0f\xf8\x07") for _ in range(random.randint(0, 8)))
    return Frame(can_id, body, extended=extended)


# Limits, from both sides


@pytest.mark.parametrize(
    ("can_id", "extended"),
    [(0, False), (0x7FF, False), (0, True), (0x800, True), (0x1FFF_FFFF, True)],
)
def test_an_identifier_of_its_format_is_taken(can_id: int, *, extended: bool) -> None:
    """The first and the last identifier of both formats make frames."""
    assert Frame(can_id, extended=extended).can_id == can_id


@pytest.mark.parametrize(
    ("can_id", "extended", "text"),
    [
        (-1, False, "identifier -0x1 does not fit a base frame"),
        (0x800, False, "identifier 0x800 does not fit a base frame"),
        (-1, True, "identifier -0x1 does not fit an extended frame"),
        (0x2000_0000, True, "identifier 0x20000000 does not fit an extended frame"),
    ],
)
def test_an_identifier_beyond_its_format_is_refused(
    can_id: int, text: str, *, extended: bool
) -> None:
    """One below the first and one above the last identifier are refused, with their value."""
    with pytest.raises(ValueError, match=text):
        Frame(can_id, extended=extended)


def test_eight_data_bytes_are_taken_and_nine_refused() -> None:
    """A classical frame holds at most eight bytes."""
    assert Frame(1, bytes(8)).dlc == 8
    with pytest.raises(ValueError, match="9 data bytes"):
        Frame(1, bytes(9))


def test_a_remote_frame_carries_no_data() -> None:
    """A remote frame names its length as DLC; data in it is refused."""
    assert Frame(1, remote=True, dlc=8).data == b""
    with pytest.raises(ValueError, match="carries no data"):
        Frame(1, b"\x00", remote=True, dlc=1)


@pytest.mark.parametrize("dlc", [0, 8, 9, 15])
def test_a_remote_frame_may_ask_for_any_length(dlc: int) -> None:
    """DLC 0..15 exist in a remote frame."""
    assert Frame(1, remote=True, dlc=dlc).dlc == dlc


@pytest.mark.parametrize("dlc", [-2, 16])
@pytest.mark.parametrize("remote", [False, True])
def test_a_data_length_code_has_four_bits(dlc: int, *, remote: bool) -> None:
    """Below 0 and above 15 there is no DLC."""
    with pytest.raises(ValueError, match=f"dlc {dlc} does not go with"):
        Frame(1, b"" if remote else bytes(8), remote=remote, dlc=dlc)


@pytest.mark.parametrize(("size", "dlc"), [(0, 0), (7, 7), (8, 8), (8, 9), (8, 15)])
def test_a_data_length_code_that_fits_the_data_is_taken(size: int, dlc: int) -> None:
    """DLC 8..15 all mean eight bytes; below, DLC and size are equal."""
    assert Frame(1, bytes(size), dlc=dlc).dlc == dlc


@pytest.mark.parametrize(("size", "dlc"), [(0, 1), (7, 6), (7, 8), (7, 9), (8, 7)])
def test_a_data_length_code_that_does_not_fit_the_data_is_refused(size: int, dlc: int) -> None:
    """A DLC one off the size of the data is refused, with both numbers."""
    with pytest.raises(ValueError, match=f"dlc {dlc} does not go with {size} data bytes"):
        Frame(1, bytes(size), dlc=dlc)


# A value


def test_a_frame_never_changes() -> None:
    """Assigning to a field raises."""
    frame = Frame(0x705, b"\x05")
    with pytest.raises(FrozenInstanceError):
        frame.can_id = 0x706  # type: ignore[misc]


@given(frames())
def test_equal_fields_make_equal_frames(frame: Frame) -> None:
    """A copy is equal and has the same hash, whether its length was asked for or not."""
    copy = Frame(frame.can_id, frame.data, frame.remote, frame.extended, frame.dlc)
    assert frame.bits > 0
    assert copy == frame
    assert hash(copy) == hash(frame)


def test_frames_that_differ_in_one_field_differ() -> None:
    """Format, kind, identifier, data and DLC all tell two frames apart."""
    variations = [
        Frame(0x705),
        Frame(0x706),
        Frame(0x705, b"\x00"),
        Frame(0x705, extended=True),
        Frame(0x705, remote=True),
        Frame(0x705, remote=True, dlc=1),
        Frame(0x705, bytes(8)),
        Frame(0x705, bytes(8), dlc=9),
    ]
    assert len(set(variations)) == len(variations)


@given(frames())
def test_head_and_data_are_the_whole_frame(frame: Frame) -> None:
    """Unpacking what was packed gives the same frame."""
    assert Frame.unpack(frame.head, frame.data) == frame


@given(frames(), frames())
def test_different_frames_pack_differently(one: Frame, other: Frame) -> None:
    """Two frames have the same head and data only if they are equal."""
    assert (one == other) == ((one.head, one.data) == (other.head, other.data))


@pytest.mark.parametrize(
    ("frame", "text"),
    [
        (Frame(0x705, b"\x05"), "705#05"),
        (Frame(0), "000#"),
        (Frame(0x181, bytes.fromhex("00a1ff")), "181#00A1FF"),
        (Frame(0x705, remote=True), "705#R0"),
        (Frame(0x705, remote=True, dlc=1), "705#R1"),
        (Frame(0x705, b"\x7f", extended=True), "00000705#7F"),
        (Frame(0x1, bytes(8), dlc=8), "001#0000000000000000"),
        (Frame(0x1, bytes(8), dlc=9), "001#0000000000000000_9"),
        (Frame(0x1, bytes(8), dlc=15), "001#0000000000000000_F"),
    ],
)
def test_a_frame_reads_as_candump_writes_it(frame: Frame, text: str) -> None:
    """The text of a frame is can-utils' compact notation."""
    assert str(frame) == text


# Length on the wire


def test_crc15_has_the_catalogue_check_value() -> None:
    """CRC-15/CAN of "123456789" is 059Eh (catalogue of parametrised CRC algorithms)."""
    assert crc15(int.from_bytes(b"123456789", "big"), 72) == 0x059E


@given(st.text("01", max_size=70))
@example("")
def test_crc15_of_any_number_of_bits_is_crcchecks(text: str) -> None:
    """For any number of bits the check sequence is the one of the package crccheck."""
    assert f"{crc15(int(text or '0', 2), len(text)):015b}" == bits.check_sequence(text)


@given(st.text("01", max_size=120))
@example("")
@example("00000111100001111")
@example("1111100000")
def test_stuffing_any_bits_adds_as_many_as_by_hand(text: str) -> None:
    """Stuff bits counted by table equal those inserted one by one, and count themselves."""
    assert stuff_bits(int(text or "0", 2), len(text)) == len(bits.stuffed(text)) - len(text)


@pytest.mark.parametrize(
    ("text", "added"),
    [
        ("0000", 0),
        ("00000", 1),
        ("000000000", 1),
        ("0000000000", 2),
        ("00000111", 1),
        ("000001111", 2),
        ("1111", 0),
        ("11111", 1),
    ],
)
def test_a_stuff_bit_follows_five_equal_bits(text: str, added: int) -> None:
    """Four equal bits need none, five need one, and the stuff bit begins the next run."""
    assert stuff_bits(int(text, 2), len(text)) == added


@given(frames())
def test_a_frame_is_as_long_as_written_bit_by_bit(frame: Frame) -> None:
    """The length equals that of the frame written as a string of bits."""
    assert frame.bits == len(bits.on_the_wire(frame))


def test_asking_again_for_the_length_gives_the_same() -> None:
    """The length is kept after it was asked for; a second answer equals the first."""
    frame = Frame(0x705, b"\x05")
    assert [frame.bits, frame.bits] == [56, 56]


@pytest.mark.slow
def test_lengths_of_20000_random_frames_are_those_of_the_bit_strings() -> None:
    """No frame of a large random sample is longer or shorter than its bit string."""
    random = Random(11898)
    sample = [random_frame(random) for _ in range(20_000)]
    assert [str(f) for f in sample if f.bits != len(bits.on_the_wire(f))] == []


@pytest.mark.slow
@pytest.mark.skipif(bool(canutils.missing()), reason=f"not installed: {canutils.missing()}")
def test_lengths_of_random_frames_are_those_of_can_utils(tmp_path: Path) -> None:
    """An unmodified canbusload counts the same bits (a million: benchmarks/frame_lengths.py)."""
    sample = list(canutils.random_frames(50_000, seed=301))
    theirs = canutils.lengths(sample, canutils.build(tmp_path))
    differing = [(str(f), f.bits, t) for f, t in zip(sample, theirs, strict=True) if f.bits != t]
    assert differing == []


@pytest.mark.parametrize(
    ("extended", "size", "shortest", "longest"),
    [(False, 0, 44, 52), (False, 8, 108, 132), (True, 0, 64, 76), (True, 8, 128, 157)],
)
def test_lengths_stay_within_the_bounds_of_the_format(
    size: int, shortest: int, longest: int, *, extended: bool
) -> None:
    """44 or 64 bits and 8 a byte, plus at most one stuff bit in four stuffable bits."""
    random = Random(size)
    top = MAX_EXTENDED_ID if extended else MAX_BASE_ID
    lengths = {
        Frame(random.randint(0, top), random.randbytes(size), extended=extended).bits
        for _ in range(2_000)
    }
    assert shortest <= min(lengths)
    assert max(lengths) <= longest


def test_a_frame_without_five_equal_bits_has_no_stuff_bit() -> None:
    """Some base frame of eight bytes is exactly 108 bits long: the bound is reached."""
    frame = Frame(0x2AA, b"\x55" * 8)
    assert min(Frame(i, b"\x55" * 8).bits for i in range(0x800)) == 108
    assert frame.bits == len(bits.on_the_wire(frame))


# Arbitration


@given(frames(), frames())
@example(Frame(0x123), Frame(0x123, remote=True))
@example(Frame(0x123, remote=True), Frame(0x123 << 18, extended=True))
@example(Frame(0x123), Frame(0x123 << 18, extended=True))
@example(Frame(0x124), Frame(0x123 << 18 | 0x3FFFF, extended=True))
@example(Frame(5, extended=True), Frame(5, remote=True, extended=True))
def test_lower_order_wins_the_bus(one: Frame, other: Frame) -> None:
    """Comparing `order` decides as withdrawing bit by bit does."""
    assert (one.order < other.order) == bits.wins(one, other)
    assert (other.order < one.order) == bits.wins(other, one)


@given(frames(), st.binary(max_size=8))
def test_order_does_not_look_at_data(frame: Frame, data: bytes) -> None:
    """Two data frames of one identifier and format have the same order: a collision."""
    one = Frame(frame.can_id, extended=frame.extended)
    assert Frame(frame.can_id, data, extended=frame.extended).order == one.order
