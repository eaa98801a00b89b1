"""What errors that come and go make a device tell: a pure function of the timeline of errors.

Each error is told once, with the register that then holds; the end of the last one is told
with code 0000h. That one of several has gone may be told, with the bits that are left. The
history holds the errors, newest first. (CiA 301 4.2.0, 7.2.7.1, 7.5.2.2, 7.5.2.4)
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

from node_model.frame import Frame

NO_ERROR = 0x0000


class Error(Protocol):
    """An error that a device can have."""

    @property
    def code(self) -> int:
        """Emergency error code."""

    @property
    def register(self) -> int:
        """Everything that it sets in 1001h."""

    @property
    def manufacturer(self) -> bytes:
        """Byte 3 to 7 of its emergency message."""


@dataclass(frozen=True, slots=True)
class Message:
    """An emergency message that is expected.

    Args:
        code: emergency error code.
        register: content of 1001h; None = not looked at.
        manufacturer: the maker's bytes; None = not looked at.
        needed: False = it may also stay away.
    """

    code: int
    register: int | None
    manufacturer: bytes | None = None
    needed: bool = True

    def fits(self, frame: Frame) -> bool:
        """Whether a frame of eight bytes is this message."""
        data = frame.data
        return (
            len(data) == 8
            and int.from_bytes(data[:2], "little") == self.code
            and self.register in {None, data[2]}
            and self.manufacturer in {None, data[3:]}
        )

    def __str__(self) -> str:
        register = "" if self.register is None else f", register {self.register:02X}h"
        return f"emergency {self.code:04X}h{register}"


def register_of(errors: Mapping[str, Error], active: Collection[str]) -> int:
    """Content of 1001h while these errors exist."""
    register = 0
    for name in active:
        register |= errors[name].register
    return register


def told(
    errors: Mapping[str, Error], before: frozenset[str], after: frozenset[str]
) -> list[Message]:
    """What is told when the errors `before` become those of `after`, all at once."""
    came, gone = after - before, before - after
    register = register_of(errors, after)
    alone = register if len(came) == 1 and not gone else None
    messages = [
        Message(errors[name].code, alone, errors[name].manufacturer)
        for name in errors
        if name in came
    ]
    if gone and not after:
        messages.append(Message(NO_ERROR, register))
        # Where several go at once, each may be told with what was left of them.
        messages += [Message(NO_ERROR, None, needed=False)] * (len(gone) - 1)
    elif gone:
        messages += [Message(NO_ERROR, register, needed=False)] * len(gone)
    return messages


def unexplained(messages: Sequence[Message], frames: Sequence[Frame]) -> list[str]:
    """What is missing, and what nobody expects; each message explains one frame."""
    left, strange = list(messages), []
    for frame in frames:
        found = next((each for each in left if each.fits(frame)), None)
        if found is None:
            strange.append(f"{frame} was not expected")
        else:
            left.remove(found)
    return [f"{each} is missing" for each in left if each.needed] + strange


def history(errors: Mapping[str, Error], timeline: Sequence[frozenset[str]]) -> list[set[int]]:
    """The codes in 1003h after a timeline of errors, newest first.

    Errors that came at once may stand in any order: each place holds the codes that it may be.
    """
    found: list[set[int]] = []
    before: frozenset[str] = frozenset()
    for after in timeline:
        came = {errors[name].code for name in after - before}
        found[:0] = [came] * len(after - before)
        before = after
    return found
