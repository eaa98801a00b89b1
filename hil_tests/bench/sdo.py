"""The SDO client of a bench: transfers on its bus, judged as they go.

Every answer must come in time (C-SD-20) and be what the protocol allows; each fault is
blamed on the rule that it breaks. A transfer that a test only passes through is blamed on
C-OD-04: what the device lists it can read and write.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING

from hil_tests.bench.judging import LOOK_ON_NS
from hil_tests.clients import sdo_frames
from hil_tests.clients.accepted import Accepted, show_code
from hil_tests.clients.sdo import (
    FRAME_BYTES,
    UNKNOWN_COMMAND,
    Abort,
    Breach,
    Download,
    Requests,
    Transfer,
    Upload,
    show,
)
from hil_tests.clients.values import number
from hil_tests.clock import MS, exactly, show_span
from hil_tests.judge import matchers
from hil_tests.judge.causal import Seen
from hil_tests.judge.cobs import NMT, SDO_ANSWER, SDO_REQUEST, Nmt, State
from hil_tests.judge.verdict import DeviceFailure, InconclusiveResult, Limits, Outcome
from node_model.frame import Frame

if TYPE_CHECKING:
    from hil_tests.bench.judging import JudgingBench

Place = tuple[int, int]
"""Index and sub-index."""

ACCESS = "C-OD-04"
NO_ANSWER = "C-SD-01"
IN_TIME = "C-SD-20"
OPERATIONAL = "C-NMT-15"

ANSWER_NS = 50 * MS
"""Request to answer, where no profile says otherwise."""


class Sdo:
    """Reads and writes the device's object dictionary.

    Args:
        bench: that carries the frames.
        within_ns: an answer comes within this.
        request_id: identifier of requests; None = the default server's, 600h + node id.
        answer_id: of answers; None = 580h + node id.
    """

    def __init__(
        self,
        bench: JudgingBench,
        within_ns: int = ANSWER_NS,
        request_id: int | None = None,
        answer_id: int | None = None,
    ) -> None:
        self.bench = self._bench = bench
        self._within_ns = within_ns
        self._in_time = Limits(at_most_ns=within_ns)
        self._request_id = request_id
        self._answer_id = answer_id

    @property
    def request_id(self) -> int:
        """Identifier under which the server hears us."""
        return self._request_id or SDO_REQUEST + self._bench.node_id

    @property
    def answer_id(self) -> int:
        """Identifier under which the server answers."""
        return self._answer_id or SDO_ANSWER + self._bench.node_id

    # What tests want to know and change.

    def read(self, index: int, sub: int = 0, *, requirement: str = ACCESS) -> bytes:
        """The bytes of an object that must be readable.

        Raises:
            DeviceFailure: it was refused, or not answered as CiA 301 asks.
        """
        return self._done(Upload(index, sub), "read", requirement)

    def number(self, index: int, sub: int = 0, *, requirement: str = ACCESS) -> int:
        """An unsigned integer that must be readable."""
        return number(self.read(index, sub, requirement=requirement))

    def write(self, index: int, sub: int, data: bytes, *, requirement: str = ACCESS) -> None:
        """Give an object bytes that it must take.

        Raises:
            DeviceFailure: it was refused, or not answered as CiA 301 asks.
        """
        self._done(Download(index, sub, data), "write", requirement)

    def try_read(self, index: int, sub: int = 0) -> bytes | Abort:
        """What a read leads to, whichever it is."""
        return self.run(Upload(index, sub))

    def try_write(self, index: int, sub: int, data: bytes) -> bytes | Abort:
        """What a write leads to: nothing (no bytes), or an abort."""
        return self.run(Download(index, sub, data))

    def expect_abort(
        self, outcome: bytes | Abort, accepted: Accepted, what: str, *, requirement: str = ""
    ) -> None:
        """A transfer must have been refused, with a code of a set.

        Args:
            outcome: of `try_read`, `try_write` or `run`.
            accepted: codes that a conforming server may give; one that is not the first is
                written down as this device's way.
            what: was asked for, e.g. "write to 1000h:00".
            requirement: id, where it is not the first one of the test.
        """
        told = f"{what} is refused with {accepted}"
        if not isinstance(outcome, Abort):
            self._bench.fail(f"{told}; it was done", requirement=requirement)
        code = outcome.code
        text = f"{told}; the code is {show_code(code)}"
        self._bench.check(code in accepted, text, requirement=requirement)
        if code != accepted.preferred:
            note = (
                f"{what} is refused with {show_code(code)}; others say {accepted.preferred:08X}h"
            )
            self._bench.characteristic(requirement, note)

    @contextmanager
    def kept(self, *objects: Place) -> Iterator[None]:
        """What is done inside may change these objects: afterwards they are what they were.

        Written back and read back; also after a failure, as far as the device lets us.
        """
        before = {place: self.read(*place) for place in objects}
        try:
            yield
        except BaseException:
            with suppress(DeviceFailure, InconclusiveResult):
                self._bench.nmt(Nmt.PRE_OPERATIONAL)
                self.put_back(before)
            raise
        self.put_back(before)

    def put_back(self, before: dict[Place, bytes]) -> None:
        """Write objects, the last first, and see that they have these values."""
        for (index, sub), data in reversed(before.items()):
            if self.read(index, sub) != data:
                self.write(index, sub, data)
        for (index, sub), data in before.items():
            found = self.read(index, sub)
            text = f"{index:04X}h:{sub:02X} is put back to {show(data)}; it is {show(found)}"
            self._bench.check(found == data, text, requirement=ACCESS)

    def serves(self, requirement: str, index: int = 0x1000, sub: int = 0) -> bytes:
        """A read works as if nothing had been before; whatever is wrong breaks this rule."""
        transfer = Upload(index, sub)
        try:
            outcome = self._carry(transfer, requirement)
        except Breach as breach:
            self.abort(index, sub)
            self._bench.fail(str(breach), requirement=requirement)
        return self._served(outcome, f"read of {transfer.name}", requirement)

    def _done(self, transfer: Transfer, verb: str, requirement: str) -> bytes:
        outcome = self.run(transfer, requirement)
        return self._served(outcome, f"{verb} of {transfer.name}", requirement)

    def _served(self, outcome: bytes | Abort, what: str, requirement: str) -> bytes:
        text = f"{what} is served"
        if isinstance(outcome, Abort):
            text += f"; it was refused with {show_code(outcome.code)}"
            self._bench.fail(text, requirement=requirement)
        self._bench.check(True, text, requirement=requirement)
        return outcome

    # Transfers and single frames.

    def run(self, transfer: Transfer, requirement: str = NO_ANSWER) -> bytes | Abort:
        """Carry a transfer out.

        Args:
            transfer: see `clients.sdo` and `clients.sdo_block`.
            requirement: which says that there must be an answer.

        Returns:
            What was read (no bytes after a write), or the server's abort.

        Raises:
            DeviceFailure: an answer is missing, late, or breaks the protocol.
        """
        try:
            return self._carry(transfer, requirement)
        except Breach as breach:
            self.abort(transfer.index, transfer.sub)
            self._bench.fail(str(breach), requirement=breach.requirement)

    def _carry(self, transfer: Transfer, requirement: str) -> bytes | Abort:
        last = self._send_all(transfer.begin())
        while transfer.result is None:
            answer = self._answer(last, requirement)
            requests = transfer.answer(answer.frame.data)
            last = self._send_all(requests) if requests else answer
        return transfer.result

    def _send_all(self, requests: Requests) -> Seen:
        sent = [self._bench.send(Frame(self.request_id, data)) for data in requests]
        return sent[-1]

    def _answer(self, request: Seen, requirement: str) -> Seen:
        """The next answer; missing is a fault of `requirement`, late one of C-SD-20."""
        bench, within = self._bench, self._within_ns
        answer = self._first(request, within + LOOK_ON_NS)
        if answer is None:
            matcher = matchers.cob(self.answer_id, "an SDO answer")
            rule = OPERATIONAL if self._never_served_in_operational() else requirement
            return bench.expect(matcher, after=request, within=within, requirement=rule)
        # Segments of a block follow each other: what counts is the end of the one before.
        measured, limits = bench.when(answer).since(exactly(request.at)), self._in_time
        if limits.check(measured) is not Outcome.PASS:
            text = f"SDO answer {answer.frame} after {request.frame}"
            ended = exactly(request.at)
            bench.measure_between(ended, answer, limits, text, requirement=IN_TIME, since=request)
        return answer

    def _never_served_in_operational(self) -> bool:
        """It is operational, and has answered nothing since it was sent there (C-NMT-15)."""
        bench, now = self._bench, self._bench.now()
        if bench.watch.timeline.sure(exactly(now)) is not State.OPERATIONAL:
            return False
        for seen in reversed(list(bench.frames_seen())):
            if seen.own and seen.frame.can_id == NMT:
                return True
            if not seen.own and seen.frame.can_id == self.answer_id:
                return False
        return False

    def _first(self, after: Seen, patience_ns: int) -> Seen | None:
        matcher = matchers.cob(self.answer_id, "an SDO answer")
        return self._bench.first(matcher, after, after.when.latest + patience_ns)

    def ask(self, data: bytes, requirement: str = NO_ANSWER) -> bytes:
        """Send one request, right or wrong, that must be answered; the answer's bytes."""
        answer = self._answer(self.post(data), requirement).frame
        size = len(answer.data)
        text = f"an SDO answer has 8 bytes; {answer} has {size}"
        self._bench.check(size == FRAME_BYTES, text, requirement=NO_ANSWER)
        return answer.data

    def offer(self, data: bytes) -> bytes | None:
        """Send one request that may be answered; the answer's bytes, or None."""
        answer = self._first(self.post(data), self._within_ns)
        return answer.frame.data if answer else None

    def post(self, data: bytes) -> Seen:
        """Send one request and do not wait for an answer."""
        return self._bench.send(Frame(self.request_id, data))

    def silence(self, data: bytes, *, requirement: str = "") -> None:
        """Send one request that must not be answered.

        A server has no other reason to send, so one that answers at once is no doubtful case.
        """
        sent = self.post(data)
        answer = self._first(sent, self._within_ns + LOOK_ON_NS)
        told = answer.frame if answer else "nothing"
        text = f"{sent.frame} is not answered; {told} came"
        self._bench.check(answer is None, text, requirement=requirement, since=sent)

    def abort(self, index: int, sub: int, code: int = UNKNOWN_COMMAND) -> Seen:
        """End a transfer from our side; a server does not answer that."""
        return self.post(sdo_frames.abort(index, sub, code))

    def repeat(
        self, make: Callable[[int], Transfer], count: int, requirement: str = NO_ANSWER
    ) -> list[bytes | Abort]:
        """Many transfers, one after the other, with one verdict for all of them.

        Args:
            make: the transfer of each turn.
            count: of turns.
            requirement: which says that there must be an answer.
        """
        began_at = self._bench.now()
        outcomes = [self.run(make(turn), requirement) for turn in range(count)]
        took = show_span(self._bench.now() - began_at)
        self._bench.check(True, f"{count} SDO transfers were answered in {took}")
        return outcomes
