"""Network management as a slave sees it (CiA 301 4.2.0, 7.2.8 and 7.3.2).

The commands and their target states are a table; nothing else decides a transition.
"""

from __future__ import annotations

from enum import IntEnum

from node_model.frame import Frame

NMT_COB_ID = 0x000
ALL_NODES = 0


class NmtState(IntEnum):
    """NMT states with the value that error control frames show."""

    INITIALISING = 0x00
    STOPPED = 0x04
    OPERATIONAL = 0x05
    PRE_OPERATIONAL = 0x7F


class NmtCommand(IntEnum):
    """Command specifiers of the NMT protocol."""

    START = 0x01
    STOP = 0x02
    PRE_OPERATIONAL = 0x80
    RESET_NODE = 0x81
    RESET_COMMUNICATION = 0x82


TARGETS = {
    NmtCommand.START: NmtState.OPERATIONAL,
    NmtCommand.STOP: NmtState.STOPPED,
    NmtCommand.PRE_OPERATIONAL: NmtState.PRE_OPERATIONAL,
    NmtCommand.RESET_NODE: NmtState.INITIALISING,
    NmtCommand.RESET_COMMUNICATION: NmtState.INITIALISING,
}
"""State that a command leads to, from every state after initialisation."""

_COMMANDS = {command.value: command for command in NmtCommand}


def command_for(frame: Frame, node_id: int) -> NmtCommand | None:
    """The NMT command that this frame gives to that node, or None.

    A base data frame with COB-ID 0 and at least two bytes, addressed to the node or to
    all. Bytes past the second are ignored (stacks differ; the catalogue leaves it open).
    """
    data = frame.data
    if frame.can_id or frame.extended or frame.remote or len(data) < 2:
        return None
    if data[1] not in {node_id, ALL_NODES}:
        return None
    return _COMMANDS.get(data[0])
