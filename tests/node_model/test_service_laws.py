"""Whatever comes, a row of services raises nothing and keeps the laws of a node."""

from __future__ import annotations

import contextlib

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from node_model.emcy import EmergencyProducer
from node_model.frame import Frame
from node_model.guarding import NodeGuarding
from node_model.heartbeat import HeartbeatService
from node_model.heartbeat_consumer import HeartbeatConsumer
from node_model.nmt import NmtState
from node_model.node import MS, NOTHING, US, Frames
from node_model.nonvolatile import NonVolatile
from node_model.od import ObjectDictionary, SdoAbort
from node_model.pdo import PdoService
from node_model.service import Service
from node_model.sync import SyncService
from node_model.time_of_day import TimeOfDay
from tests.node_model.pdo.axis import mapped, parameters
from tests.node_model.pdo.axis import objects as axis_objects
from tests.node_model.services import u8, u16, u32

NODE = 5
STATES = [NmtState.PRE_OPERATIONAL, NmtState.OPERATIONAL, NmtState.STOPPED]
SETTINGS = [
    (index, sub)
    for index, subs in {
        0x1003: (0,), 0x1005: (0,), 0x1006: (0,), 0x1007: (0,), 0x100C: (0,), 0x100D: (0,),
        0x1010: (1,), 0x1012: (0,), 0x1014: (0,), 0x1015: (0,), 0x1016: (1, 2), 0x1017: (0,),
        0x1019: (0,), 0x1029: (1,), 0x1400: (1, 2, 3, 5, 6), 0x1600: (0, 1, 2),
        0x1800: (1, 2, 3, 5, 6), 0x1A00: (0, 1, 2), 0x6040: (0,), 0x2000: (1, 2, 3),
    }.items()
    for sub in subs
]  # fmt: skip
TELLING = [0, 1, 2, 5, 50, 240, 241, 255, 0x80, 0x4000_0080, 0x185, 0x205, 0x8000_0185, 0x1_0005]
TELLING += [0x3_0064, 0x6040_0010, 0x6041_0010, 0x2000_0101, 0x6576_6173, 0xFFFF_FFFF]
IDENTIFIERS = [0x080, 0x100, 0x185, 0x205, 0x701, 0x703, 0x705]

FRAMES = st.builds(Frame, st.sampled_from(IDENTIFIERS), st.binary(max_size=8)) | st.builds(
    lambda can_id, dlc: Frame(can_id, remote=True, dlc=dlc),
    st.sampled_from(IDENTIFIERS),
    st.integers(0, 15),
)
WRITES = st.tuples(st.sampled_from(SETTINGS), st.sampled_from(TELLING))
STEPS = st.lists(
    st.tuples(st.integers(0, 20_000), FRAMES | WRITES | st.sampled_from(STATES)), max_size=40
)


def dictionary() -> ObjectDictionary:
    """Every object that a service owns."""
    return ObjectDictionary(
        [
            u8(0x1001),
            u8(0x1003),
            *(u32(0x1003, sub) for sub in range(1, 5)),
            *(u32(index) for index in (0x1006, 0x1007)),
            *(u16(index) for index in (0x100C, 0x1015, 0x1017)),
            *(u8(index) for index in (0x100D, 0x1019)),
            u32(0x1005, 0, 0x80),
            u32(0x1012, 0, 0x8000_0100),
            u32(0x1014, 0, 0x80 + NODE),
            *(u32(index, 1, 1) for index in (0x1010, 0x1011)),
            *(u32(0x1016, sub) for sub in (1, 2)),
            u8(0x1029, 1),
            *axis_objects(),
            *parameters(0x1400, 0x205, 1),
            *mapped(0x1600, 0x60400010, 0x607A0020),
            *parameters(0x1800, 0x185, 1),
            *mapped(0x1A00, 0x60410010, 0x60640020),
        ]
    )


def row(od: ObjectDictionary) -> list[Service]:
    """The services of a device, wired as a device wires them."""
    emcy = EmergencyProducer(od, NODE)
    sync = SyncService(od, emcy)
    return [
        emcy,
        HeartbeatService(od, NODE),
        NodeGuarding(od, NODE, emcy),
        HeartbeatConsumer(od, emcy),
        TimeOfDay(od, 10 * MS),
        sync,
        PdoService(od, emcy, sync, turnaround_ns=50 * US),
        NonVolatile(od),
    ]


def act(od: ObjectDictionary, services: list[Service], what: object, now: int) -> list[Frames]:
    """One step: a frame, a client's write, or a change of state."""
    if isinstance(what, Frame):
        return [
            service.receive(what, now)
            for service in services
            if what.can_id in service.listens_to()
        ]
    if isinstance(what, NmtState):
        return [service.enter(what, now) for service in services]
    assert isinstance(what, tuple)
    (index, sub), value = what
    size = od.find(index, sub).data_type.size
    with contextlib.suppress(SdoAbort):
        od.write(index, sub, (value & (1 << 8 * size) - 1).to_bytes(size, "little"), now)
    return []


def spend(services: list[Service], until: int, most: int = 400) -> None:
    """Call each service at its deadlines; SYNC in a cycle of microseconds is cut short."""
    for service in services:
        for _ in range(most):
            due = service.deadline()
            if due is None or due > until:
                break
            assert service.advance(due - 1) == NOTHING, "earlier than the deadline"
            service.advance(due)
            after = service.deadline()
            assert after is None or after > due
        else:
            service.advance(until)


@pytest.mark.slow
@settings(max_examples=120, deadline=None)
@given(steps=STEPS)
def test_any_life_of_a_row_of_services_keeps_the_laws(
    steps: list[tuple[int, object]],
) -> None:
    """Frames, writes and states in any order: no exception, no early frame, no stuck deadline."""
    od = dictionary()
    services = row(od)
    now = 0
    for service in services:
        service.start(now)
    for gap_us, what in steps:
        now += gap_us * US
        spend(services, now)
        act(od, services, what, now)
    spend(services, now + 50 * MS)
    for service in services:
        service.stop()
        assert service.deadline() is None
        assert service.advance(now + 1000 * MS) == NOTHING
