"""Matchers: which frames a test is waiting for, with words for the failure message."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

from hil_tests.judge.cobs import ECHO, EMCY, ERROR_CONTROL, KEYS, SHOWN, State
from node_model.frame import Frame


@dataclass(frozen=True, slots=True)
class Matcher:
    """A test on frames of other stations than the tester.

    Args:
        text: what is looked for, e.g. "boot-up of node 5".
        accepts: whether a frame is it.
    """

    text: str
    accepts: Callable[[Frame], bool]

    def __str__(self) -> str:
        return self.text


def _plain(frame: Frame, can_id: int) -> bool:
    return frame.can_id == can_id and not frame.extended and not frame.remote


def cob(can_id: int, text: str = "") -> Matcher:
    """Any base data frame with that identifier."""
    return Matcher(text or f"a frame {can_id:03X}h", lambda frame: _plain(frame, can_id))


def anything() -> Matcher:
    """Any frame at all."""
    return Matcher("any frame", lambda _: True)


def any_of(can_ids: frozenset[int], text: str) -> Matcher:
    """Any frame with one of these base identifiers, data or remote."""
    return Matcher(text, lambda frame: frame.can_id in can_ids and not frame.extended)


def exactly(can_id: int, data: bytes, text: str = "") -> Matcher:
    """A base data frame with that identifier and exactly those bytes."""
    shown = text or f"{can_id:03X}h with {data.hex(' ').upper()}"
    return Matcher(shown, lambda frame: _plain(frame, can_id) and frame.data == data)


@cache  # each start waits for one
def boot_up(node_id: int) -> Matcher:
    """Boot-up: one byte 00h on 700h + id (CiA 301, 7.2.8.3.3)."""
    return exactly(ERROR_CONTROL + node_id, b"\x00", f"boot-up of node {node_id}")


@cache
def of_a_start(node_id: int) -> Matcher:
    """Any frame by which a node that starts can be told, however badly it is formed."""
    can_ids = {ERROR_CONTROL + node_id, EMCY + node_id}
    return Matcher(f"a frame of node {node_id}", lambda frame: frame.can_id in can_ids)


def heartbeat(node_id: int, state: State | None = None) -> Matcher:
    """A heartbeat, of any state or of the one given; a boot-up is none."""
    can_id = ERROR_CONTROL + node_id
    if state is None:
        return Matcher(
            f"heartbeat of node {node_id}",
            lambda frame: _plain(frame, can_id) and frame.data != b"\x00",
        )
    return exactly(can_id, bytes((state.value,)), f"heartbeat of node {node_id} showing {state}")


def emcy(node_id: int, code_class: int | None = None, code: int | None = None) -> Matcher:
    """An EMCY of eight bytes; `code_class` = high byte of its error code, `code` = all of it."""
    can_id = EMCY + node_id

    def accepts(frame: Frame) -> bool:
        if not _plain(frame, can_id) or len(frame.data) != 8:
            return False
        found = frame.data[0] | frame.data[1] << 8
        return (code_class is None or found >> 8 == code_class) and (code is None or found == code)

    kind = f" {code_class:02X}xxh" if code_class is not None else ""
    kind = f" {code:04X}h" if code is not None else kind
    return Matcher(f"EMCY{kind} of node {node_id}", accepts)


@cache
def key_frame(node_id: int, mask: int | None = None, size: int = 1) -> Matcher:
    """A key frame, of any content or with exactly these keys."""
    if mask is None:
        return cob(KEYS + node_id, f"key frame of node {node_id}")
    data = mask.to_bytes(size, "little")
    return exactly(KEYS + node_id, data, f"key frame of node {node_id} with {data.hex()}h")


def echo(parameters: bytes | None = None) -> Matcher:
    """An echo 3F8h; with these six bytes in front, where given."""
    if parameters is None:
        return cob(ECHO, "echo 3F8h")
    return Matcher(
        f"echo 3F8h with {parameters.hex(' ').upper()}",
        lambda frame: _plain(frame, ECHO) and frame.data[: len(parameters)] == parameters,
    )


def shown_state(frame: Frame) -> State | None:
    """The state that a heartbeat shows; None where it shows none."""
    return SHOWN.get(frame.data[0]) if len(frame.data) == 1 else None
