"""The contract of a communication service of a CiA 301 device, and what it needs of others.

A device is an object dictionary, an NMT slave and a row of services. Each service keeps
the laws of a node (`node_model.node`): it is told the time, returns the frames to send,
and says when it wants to be called next. It reads its settings from the object
dictionary, guards the objects that it owns, and observes their changes.
"""

from __future__ import annotations

from collections.abc import Container
from dataclasses import dataclass
from typing import Protocol

from node_model.frame import Frame
from node_model.nmt import NmtState
from node_model.node import NOTHING, Frames


class Service(Protocol):
    """One communication service."""

    @property
    def alone(self) -> bool:
        """Whether its `receive` and `advance` leave the deadlines of all other services alone.

        What a client's write leads to does not count.
        """

    @property
    def set_up_by(self) -> Container[int]:
        """Indices of the objects that `listens_to` follows from."""

    @property
    def timed_by(self) -> Container[int]:
        """Indices of the objects whose being written may change `deadline`."""

    def listens_to(self) -> frozenset[int]:
        """Base identifiers of the frames it wants to receive, as it is set up now.

        Asked again after each start, and after a client wrote an object of `set_up_by`.
        """

    def start(self, now: int) -> Frames:
        """The device has initialised its communication (power-on, reset node, 82h).

        All settings are read anew. Called before the boot-up frame is queued; what is
        returned follows the boot-up. The state is pre-operational.
        """

    def enter(self, state: NmtState, now: int) -> Frames:
        """The NMT state has changed to `state`, which is not INITIALISING."""

    def receive(self, frame: Frame, now: int) -> Frames:
        """A base frame (data or remote) with an identifier of `listens_to` ended at `now`."""

    def advance(self, now: int) -> Frames:
        """Whatever is due by now, oldest first."""

    def deadline(self) -> int | None:
        """When `advance` must be called next, or None.

        Asked again after its own work, and after all that may concern it: a client's write of
        an object of `timed_by`, other services that are not `alone`, the application, the NMT
        state.
        """

    def stop(self) -> None:
        """Supply or communication is gone: nothing is due any more."""


class QuietService:
    """A service that does nothing but keep the NMT state: what services have in common.

    What a client's write or the application causes is due at that very instant: nothing is
    sent from within an observer. Whoever composes a device calls `advance` afterwards.
    """

    alone = False
    set_up_by: Container[int] = frozenset()
    timed_by: Container[int] = frozenset()
    state: NmtState = NmtState.INITIALISING

    @property
    def running(self) -> bool:
        """Between `start` and `stop`."""
        return self.state is not NmtState.INITIALISING

    def listens_to(self) -> frozenset[int]:
        """Nothing."""
        return frozenset()

    def start(self, now: int) -> Frames:  # noqa: ARG002  a verb of every service
        """Pre-operational."""
        self.state = NmtState.PRE_OPERATIONAL
        return NOTHING

    def enter(self, state: NmtState, now: int) -> Frames:  # noqa: ARG002  a verb of every service
        """Keep the state."""
        self.state = state
        return NOTHING

    def receive(self, frame: Frame, now: int) -> Frames:  # noqa: ARG002  a verb of every service
        """Ignore it."""
        return NOTHING

    def advance(self, now: int) -> Frames:  # noqa: ARG002  a verb of every service
        """Nothing is due."""
        return NOTHING

    def deadline(self) -> int | None:
        """Nothing is due."""
        return None

    def stop(self) -> None:
        """Initialising: nothing is due."""
        self.state = NmtState.INITIALISING


@dataclass(frozen=True, slots=True)
class Fault:
    """An error that a device can have (CiA 301 4.2.0, 7.2.7.1).

    Args:
        code: emergency error code, e.g. 8130h.
        register: the bits of 1001h that it sets besides bit 0 (generic).
        manufacturer: up to five bytes of the maker, for byte 3 to 7 of the EMCY.
        communication: it is a communication error, for 1029h:01.
    """

    code: int
    register: int = 0
    manufacturer: bytes = b""
    communication: bool = False


class ErrorHandler(Protocol):
    """Where services and the application report errors; the EMCY producer is one."""

    def occur(self, cause: str, fault: Fault, now: int) -> Frames:
        """`cause` now has this fault; one that it has already is not told again."""

    def heal(self, cause: str, now: int) -> Frames:
        """`cause` is gone; one that was not there is no news."""
