"""The LSS master of a bench: services of CiA 305 on its bus, judged as they go.

What a service answers is left to the test; that an answer has eight bytes is C-LS-01.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from hil_tests.clients import lss
from hil_tests.clients.lss import FastScan, Identity
from hil_tests.clients.values import number
from hil_tests.clock import MS
from hil_tests.judge import matchers
from node_model.frame import Frame

if TYPE_CHECKING:
    from hil_tests.bench.judging import JudgingBench
    from hil_tests.judge.causal import Seen

FORM = "C-LS-01"


class Lss:
    """Finds and configures nodes by their identity.

    Args:
        bench: that carries the frames.
        within_ns: an answer comes within this; silence is an answer, too, in LSS.
    """

    def __init__(self, bench: JudgingBench, within_ns: int = 50 * MS) -> None:
        self._bench = bench
        self._within_ns = within_ns
        self._matcher = matchers.cob(lss.ANSWER_ID, "an LSS answer")

    def ask(self, *requests: Frame) -> bytes | None:
        """Send requests; the first answer to the last of them, or None."""
        sent = [self._bench.send(frame) for frame in requests][-1]
        until = sent.when.latest + self._within_ns
        answer = self._bench.first(self._matcher, sent, until)
        return None if answer is None else self._formed(answer)

    def _formed(self, answer: Seen) -> bytes:
        data = answer.frame.data
        text = f"an LSS answer has 8 bytes; it was {answer.frame}"
        self._bench.check(len(data) == 8, text, requirement=FORM, since=answer)
        return data

    def tell(self, frame: Frame) -> Seen:
        """Send a request that is never answered."""
        return self._bench.send(frame)

    def expect(self, command: int, *requests: Frame, requirement: str = "") -> bytes:
        """Send requests; the answer must carry this command specifier.

        Returns:
            The seven bytes after it.
        """
        answer = self.ask(*requests)
        told = answer.hex(" ").upper() if answer else "nothing"
        text = f"{requests[-1]} is answered with {command:02X}h; the answer was {told}"
        self._bench.check(
            answer is not None and answer[0] == command, text, requirement=requirement
        )
        assert answer is not None
        return answer[1:]

    def silence(self, *requests: Frame, requirement: str = "") -> None:
        """Send requests of which the last must not be answered."""
        answer = self.ask(*requests)
        text = f"{requests[-1]} is not answered"
        told = f"{text}; {answer.hex(' ').upper()} came" if answer else text
        self._bench.check(answer is None, told, requirement=requirement)

    # Services.

    def configure(self) -> Seen:
        """Every node on the bus to configuration."""
        return self.tell(lss.switch_global(lss.CONFIGURATION))

    def leave(self) -> Seen:
        """Every node back to waiting."""
        return self.tell(lss.switch_global(lss.WAITING))

    def select(self, identity: Identity, requirement: str = "C-LS-02") -> None:
        """The node with this identity to configuration; it must answer."""
        self.expect(lss.SELECTED, *lss.select(identity), requirement=requirement)

    def inquire(self, part: int, requirement: str = "C-LS-07") -> int:
        """Part 0 to 3 of the identity, or 4: the node id."""
        size = 1 if part == 4 else 4
        rest = self.expect(0x5A + part, lss.inquire(part), requirement=requirement)
        return number(rest[:size])

    def set_node_id(self, node_id: int, requirement: str = "C-LS-03") -> int:
        """Give a node id; the error code, 0 = done."""
        return self.expect(lss.NODE_ID, lss.set_node_id(node_id), requirement=requirement)[0]

    def set_bit_timing(self, index: int, table: int = 0, requirement: str = "C-LS-04") -> int:
        """Set a bit timing; the error code, 0 = done."""
        frame = lss.set_bit_timing(index, table)
        return self.expect(lss.BIT_TIMING, frame, requirement=requirement)[0]

    def store(self, requirement: str = "C-LS-06") -> int:
        """Store the configuration; the error code, 0 = done."""
        return self.expect(lss.STORE, lss.store(), requirement=requirement)[0]

    def fast_scan(self) -> Identity | None:
        """Find one node without a node id; it is in configuration then."""
        scan = FastScan()
        while not scan.over:
            answer = self.ask(scan.ask())
            scan.heard(answer is not None and answer[0] == lss.IDENTIFIED)
        return scan.found
