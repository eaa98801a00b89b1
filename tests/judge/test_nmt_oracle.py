"""The oracle of NMT sequences: every way to be explained, and every way not to be."""

from __future__ import annotations

import pytest

from hil_tests.clock import MS, Interval, S
from hil_tests.judge.causal import Seen
from hil_tests.judge.cobs import Nmt, nmt_frame
from hil_tests.judge.nmt_oracle import Limits, Story, breaches
from node_model.frame import Frame

LIMITS = Limits(command_ns=50 * MS, boot_up_ns=1 * S)
START, STOP, PRE, RESET = Nmt.START, Nmt.STOP, Nmt.PRE_OPERATIONAL, Nmt.RESET_NODE


def told(command: int, at_ms: int, to: int = 5) -> Seen:
    """A command of ours that ended then."""
    frame, at = nmt_frame(command, to), at_ms * MS
    return Seen(frame, at, Interval(at, at), own=True, index=0)


def sent(can_id: int, data: bytes, at_ms: int, doubt_ms: int = 0) -> Seen:
    """A frame of another station, asked for up to `doubt_ms` earlier."""
    at = at_ms * MS
    return Seen(Frame(can_id, data), at, Interval(at - doubt_ms * MS, at), own=False, index=0)


def beat(state: int, at_ms: int, doubt_ms: int = 0) -> Seen:
    """A heartbeat, or with 0 a boot-up."""
    return sent(0x705, bytes((state,)), at_ms, doubt_ms)


def blamed(*frames: Seen, until_ms: int = 0) -> list[str]:
    """The requirements that the oracle blames."""
    until = until_ms * MS or max((seen.at for seen in frames), default=0)
    return [breach.requirement for breach in breaches(Story(5, frames, until), LIMITS)]


def test_the_story_begins_pre_operational() -> None:
    """Before the first command only 7Fh is explained."""
    assert blamed() == []
    assert blamed(beat(0x7F, 10)) == []
    assert blamed(beat(0x05, 10)) == ["NMT-07"]
    assert blamed(beat(0x04, 10)) == ["NMT-07"]


def test_both_states_are_explained_until_the_limit() -> None:
    """A command may act at once or at its limit, not later."""
    for instant in (100, 150):
        assert blamed(told(START, 100), beat(0x7F, instant)) == []
        assert blamed(told(START, 100), beat(0x05, instant)) == []
    assert blamed(told(START, 100), beat(0x7F, 151)) == ["NMT-07"]
    assert blamed(told(START, 100), beat(0x05, 151)) == []


def test_doubt_is_on_the_side_of_the_node() -> None:
    """A beat that may have been asked for in time is explained."""
    assert blamed(told(START, 100), beat(0x7F, 152, doubt_ms=2)) == []
    assert blamed(told(START, 100), beat(0x7F, 152, doubt_ms=1)) == ["NMT-07"]


def test_a_command_after_the_request_explains_nothing() -> None:
    """A beat asked for before the command ended cannot show what it commands."""
    late = Seen(Frame(0x705, b"\x05"), 103 * MS, Interval(98 * MS, 99 * MS), own=False, index=0)
    assert blamed(told(START, 100), late) == ["NMT-07"]
    early = late._replace(frame=Frame(0x705, b"\x7f"))
    assert blamed(told(START, 100), early) == []


def test_the_last_of_a_burst_decides() -> None:
    """Each may show until the limit of the last; then it alone."""
    burst = [told(START, 100), told(STOP, 101), told(PRE, 102)]
    for state in (0x05, 0x04, 0x7F):
        assert blamed(*burst, beat(state, 140)) == []
    assert blamed(*burst, beat(0x05, 152)) == ["NMT-07"]
    assert blamed(*burst, beat(0x04, 153)) == ["NMT-07"]
    assert blamed(*burst, beat(0x7F, 153)) == []


@pytest.mark.parametrize("frame", [told(START, 100, to=6), told(0x03, 100)])
def test_what_is_no_command_explains_nothing(frame: Seen) -> None:
    """Other nodes and unknown commands."""
    assert blamed(frame, beat(0x05, 200)) == ["NMT-07"]


def test_a_reset_is_answered_by_boot_up() -> None:
    """Boot-up, then pre-operational whatever was before."""
    story = [told(START, 100), told(RESET, 300), beat(0x00, 310)]
    assert blamed(*story, beat(0x7F, 400)) == []
    assert blamed(*story, beat(0x05, 400)) == ["NMT-07"]
    assert blamed(*story, beat(0x05, 320)) == ["NMT-07"]


def test_boot_up_without_a_reset() -> None:
    """Nothing explains it; one reset explains one."""
    assert blamed(beat(0x00, 10)) == ["NMT-02"]
    assert blamed(told(RESET, 100), beat(0x00, 110), beat(0x00, 120)) == ["NMT-02"]


def test_boot_up_in_time() -> None:
    """At its limit and just past it, come or not."""
    assert blamed(told(RESET, 100), beat(0x00, 1100)) == []
    assert blamed(told(RESET, 100), beat(0x00, 1101)) == ["NMT-06"]
    assert blamed(told(RESET, 100), until_ms=1100) == []
    assert blamed(told(RESET, 100), until_ms=1101) == ["NMT-06"]


def test_a_second_reset_extends_the_wait() -> None:
    """It may start the initialisation anew, and be answered by one boot-up or two."""
    story = [told(RESET, 100), told(RESET, 600), beat(0x00, 1500)]
    assert blamed(*story) == []
    assert blamed(*story, beat(0x00, 1510)) == []


def test_a_kept_reset_may_make_later_commands_unheard() -> None:
    """Once: reset, reset, boot-up, start, boot-up, and the start obeyed after all."""
    story = [told(RESET, 0), told(RESET, 15), beat(0x00, 50), told(START, 65), beat(0x00, 66)]
    assert blamed(*story, beat(0x05, 200)) == []
    assert blamed(*story, beat(0x7F, 200)) == []
    assert blamed(*story, beat(0x04, 200)) == ["NMT-07"]


def test_a_reset_is_not_kept_for_ever() -> None:
    """A limit of a command and one of a boot-up later it explains nothing any more."""
    story = [told(RESET, 0), told(RESET, 15), beat(0x00, 50)]
    assert blamed(*story, beat(0x00, 1065)) == []
    assert blamed(*story, beat(0x00, 1066)) == ["NMT-02"]
    assert blamed(*story, told(START, 1065), beat(0x7F, 1200)) == []
    assert blamed(*story, told(START, 1066), beat(0x7F, 1200)) == ["NMT-07"]


def test_no_beat_between_reset_and_boot_up() -> None:
    """Once the reset must have acted, a beat is not explained."""
    assert blamed(told(RESET, 100), beat(0x7F, 150)) == []
    assert blamed(told(RESET, 100), beat(0x7F, 151)) == ["NMT-07"]


def test_a_command_during_initialisation_may_be_lost_or_kept() -> None:
    """After boot-up the node is pre-operational, or where that command leads."""
    story = [told(STOP, 10), told(RESET, 100), told(START, 120), beat(0x00, 500)]
    assert blamed(*story, beat(0x7F, 600)) == []
    assert blamed(*story, beat(0x05, 600)) == []
    assert blamed(*story, beat(0x04, 600)) == ["NMT-07"]


def test_a_command_after_boot_up_is_heard() -> None:
    """What may be lost and what must be heard are told apart by boot-up."""
    story = [told(RESET, 100), beat(0x00, 500), told(START, 501)]
    assert blamed(*story, beat(0x05, 600)) == []
    assert blamed(*story, beat(0x7F, 600)) == ["NMT-07"]


def test_key_frames_mean_operational() -> None:
    """A key frame is explained where operational is."""
    keys = sent(0x185, b"\x00", 120)
    assert blamed(told(START, 100), keys) == []
    assert blamed(keys) == ["NMT-07"]


@pytest.mark.parametrize("data", [b"", b"\x85", b"\x05\x00", b"\x00\x00"])
def test_bytes_that_are_no_state(data: bytes) -> None:
    """A beat is one byte: 04h, 05h or 7Fh."""
    assert blamed(told(START, 100), sent(0x705, data, 200)) == ["HB-02"]


def test_frames_of_others_are_none_of_its_business() -> None:
    """Other identifiers, and the tester's own frames that are no commands."""
    own = Seen(Frame(0x705, b"\x05"), 10 * MS, Interval(10 * MS, 10 * MS), own=True, index=0)
    assert blamed(sent(0x706, b"\x05", 10), sent(0x085, bytes(8), 20), own) == []
