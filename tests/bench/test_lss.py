"""The LSS master of a bench: what it sends, what an answer means, who is to blame."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import pytest

from hil_tests.bench.lss import Lss
from hil_tests.clients import lss as services
from hil_tests.clients.lss import Identity
from hil_tests.clock import MS
from node_model.frame import Frame
from tests.bench.answering import SOON, AnsweringPort, Says, Script, bench_with, blamed, in_turn

IDENTITY = Identity(0x7E57, 0x402, 0x10000, 0x8000_0001)


def master(script: Script) -> tuple[Lss, AnsweringPort]:
    """A master, and the bus below it."""
    bench, port = bench_with(script)
    return Lss(bench), port


def test_switching_all_nodes_waits_for_nobody() -> None:
    """There is no answer, and no time passes that a silence would take."""
    client, port = master(in_turn())
    client.configure()
    client.leave()
    assert [str(frame) for frame in port.sent] == ["7E5#0401000000000000", "7E5#0400000000000000"]
    assert port.at < 5 * MS


def test_a_selection_is_answered_after_its_fourth_number() -> None:
    """44h, to the last of four requests."""
    client, port = master(in_turn("", "", "", "7E4#4400000000000000"))
    client.select(IDENTITY)
    assert [frame.data[0] for frame in port.sent] == [0x40, 0x41, 0x42, 0x43]
    client, _ = master(in_turn())
    assert blamed(lambda: client.select(IDENTITY)).requirement == "C-LS-02"


def test_an_answer_to_an_earlier_request_is_none_to_the_last() -> None:
    """What comes before the last request was sent is not taken for its answer."""
    client, _ = master(in_turn("7E4#4400000000000000", after_ns=0))
    assert client.ask(*services.select(IDENTITY)) is None


def test_inquiries_give_numbers() -> None:
    """Four bytes of an identity, one of a node id."""
    client, port = master(in_turn("7E4#5A577E0000FFFFFF", "7E4#5E05FFFFFFFFFFFF"))
    assert client.inquire(0) == 0x7E57
    assert client.inquire(4) == 5
    assert [frame.data[0] for frame in port.sent] == [0x5A, 0x5E]


CODES: dict[str, tuple[Callable[[Lss], int], str, str]] = {
    "node id": (lambda client: client.set_node_id(9), "1109", "C-LS-03"),
    "bit timing": (lambda client: client.set_bit_timing(3), "130003", "C-LS-04"),
    "store": (lambda client: client.store(), "17", "C-LS-06"),
}


@pytest.mark.parametrize("name", CODES)
@pytest.mark.parametrize("code", [0, 1])
def test_settings_give_their_error_code(name: str, code: int) -> None:
    """The byte after the command."""
    act, sent, _ = CODES[name]
    client, port = master(in_turn(f"7E4#{sent[:2]}{code:02X}000000000000"))
    assert act(client) == code
    assert port.sent[0].data.hex().upper() == sent.ljust(16, "0")


@pytest.mark.parametrize("name", CODES)
@pytest.mark.parametrize("answer", ["", "7E4#4400000000000000"], ids=["none", "another"])
def test_a_setting_without_its_answer_is_held_against_its_rule(name: str, answer: str) -> None:
    """Silence, or the answer of another service; the text shows it."""
    act, _, requirement = CODES[name]
    client, _ = master(in_turn(answer))
    verdict = blamed(lambda: act(client))
    assert verdict.requirement == requirement
    assert verdict.text.endswith("44 00 00 00 00 00 00 00" if answer else "nothing")


@pytest.mark.parametrize(("after_ms", "heard"), [(49, True), (52, False)])
def test_an_answer_counts_within_its_time(after_ms: int, heard: bool) -> None:
    """50 ms; what comes later is silence."""
    client, _ = master(in_turn("7E4#5000000000000000", after_ns=after_ms * MS))
    assert (client.ask(services.identify_unconfigured()) is not None) == heard


def test_an_answer_of_another_length_breaks_the_form() -> None:
    """C-LS-01, whichever service it was."""
    client, _ = master(in_turn("7E4#5A577E00"))
    verdict = blamed(lambda: client.inquire(0))
    assert verdict.requirement == "C-LS-01"
    assert "8 bytes" in verdict.text


def test_silence_is_broken_by_any_answer() -> None:
    """Held against the rule that asks for it."""
    client, _ = master(in_turn("", "7E4#4F00000000000000"))
    client.silence(services.identify_unconfigured(), requirement="C-LS-09")
    verdict = blamed(
        lambda: client.silence(services.identify_unconfigured(), requirement="C-LS-09")
    )
    assert verdict.requirement == "C-LS-09"
    assert verdict.text.endswith("4F 00 00 00 00 00 00 00 came")


class Unconfigured:
    """A node without a node id that takes part in a fast scan.

    Args:
        identity: of the node.
    """

    def __init__(self, identity: Identity) -> None:
        self._numbers = identity.numbers
        self._part = 0

    def __call__(self, frame: Frame) -> Sequence[Says]:
        """It answers where all bits that are asked for are its own."""
        bit, part, following = frame.data[5:8]
        number = int.from_bytes(frame.data[1:5], "little")
        if bit == 0x80:
            self._part = 0
            return self._yes()
        if part != self._part or (number ^ self._numbers[part]) >> bit:
            return []
        if not bit:
            self._part = following
        return self._yes()

    def _yes(self) -> Sequence[Says]:
        return [(SOON, "7E4#4F00000000000000")]


@pytest.mark.slow
def test_a_fast_scan_finds_a_node_without_a_node_id() -> None:
    """Its whole identity, bit by bit."""
    client, _ = master(Unconfigured(IDENTITY))
    assert client.fast_scan() == IDENTITY


@pytest.mark.parametrize("answer", ["", "7E4#5000000000000000"], ids=["silence", "another"])
def test_a_fast_scan_finds_nobody_where_nobody_answers_it(answer: str) -> None:
    """After one request; an answer of another service counts for nothing."""
    client, port = master(in_turn(answer))
    assert client.fast_scan() is None
    assert len(port.sent) == 1
