"""What services have in common does nothing but keep the NMT state."""

from __future__ import annotations

from node_model.frame import Frame
from node_model.nmt import NmtState
from node_model.node import NOTHING
from node_model.service import QuietService, Service


def test_a_quiet_service_hears_and_sends_nothing() -> None:
    """Each verb of the contract is there."""
    quiet: Service = QuietService()
    assert quiet.listens_to() == frozenset()
    assert quiet.start(0) == NOTHING
    assert quiet.receive(Frame(0x80), 1) == NOTHING
    assert quiet.advance(2) == NOTHING
    assert quiet.deadline() is None


def test_a_quiet_service_knows_its_state() -> None:
    """Pre-operational after the start, then what it is told; initialising without supply."""
    quiet = QuietService()
    assert not quiet.running
    quiet.start(0)
    assert (quiet.state, quiet.running) == (NmtState.PRE_OPERATIONAL, True)
    assert quiet.enter(NmtState.STOPPED, 1) == NOTHING
    assert (quiet.state, quiet.running) == (NmtState.STOPPED, True)
    quiet.stop()
    assert (quiet.state, quiet.running) == (NmtState.INITIALISING, False)
