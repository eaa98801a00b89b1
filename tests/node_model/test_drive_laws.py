"""Every drive, right, faulty or different, and every device of an EDS keeps the laws of a node."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from node_model import devices
from node_model.devices import make_device
from node_model.faults import DRIVE_MUTANTS, DRIVE_VARIANTS
from node_model.frame import Frame
from node_model.node import MS, US, Panel
from node_model.sheets import shipped
from tests.node_model.drive_frames import errors, lss, nmt, read
from tests.node_model.drive_scripts import drive_scripts
from tests.node_model.driving import Host, Step, play

BLUEPRINT = devices.read("drive")
IMAGE = BLUEPRINT.memory({"heartbeat_ms": 20})

DEVICES: Mapping[str, Callable[[], Panel]] = {
    "drive": lambda: BLUEPRINT.make(IMAGE),
    "drive without node id": lambda: BLUEPRINT.make(BLUEPRINT.memory({"node_id": 255})),
    "generic": lambda: make_device("generic", eds=shipped("drive.eds")),
    **{
        name: lambda model=model: model.make(BLUEPRINT.facts, IMAGE)  # type: ignore[misc]
        for name, model in {**DRIVE_MUTANTS, **DRIVE_VARIANTS}.items()
    },
}

POOL = sorted(
    {step.what for _, steps in drive_scripts() for step in steps if isinstance(step.what, Frame)},
    key=lambda frame: (frame.can_id, frame.remote, frame.extended, frame.data),
)
"""Every frame of every script."""

WAITS = (0, 1, 300 * US, MS, 7 * MS, 20 * MS, 35 * MS, 101 * MS)
BYTES = st.binary(max_size=8)
FRAMES = st.one_of(
    st.sampled_from(POOL),
    st.builds(Frame, st.sampled_from((0x605, 0x605, 0x7E5, 0x205, 0x305, 0x080)), BYTES),
)
ERRORS = st.sampled_from(
    (errors(), errors("encoder"), errors("overcurrent"), errors("encoder", "vendor"))
)
INPUTS = st.one_of(FRAMES, FRAMES, FRAMES, ERRORS, st.none(), st.booleans())
STEPS = st.lists(st.builds(Step, st.sampled_from(WAITS), INPUTS), min_size=6, max_size=20)
START = (Step(0, True), Step(60 * MS, Frame(0, b"\1\5")))

RESTART = (
    Step(200 * MS, False),
    Step(0, True),
    Step(60 * MS, nmt(0x81, 0)),
    Step(60 * MS, None),
)
WITHOUT_NODE_ID = frozenset((0, 0x7E5))
"""What a drive without a node id listens to: NMT and LSS."""


@pytest.mark.parametrize("name", DEVICES)
@settings(max_examples=3, deadline=None)
@given(steps=STEPS)
def test_a_device_depends_on_its_inputs_alone_and_never_on_its_host(
    name: str, steps: list[Step]
) -> None:
    """A second instance, a late host and a fussy host get the same frames and memory.

    On the way the driver checks that `advance` before the deadline changes nothing, that
    after `advance(t)` the deadline is None or later than t, and that power-off is silent.
    """
    make, script = DEVICES[name], (*START, *steps)
    timely = play(make(), script, Host.TIMELY)

    assert play(make(), script, Host.TIMELY) == timely
    assert play(make(), script, Host.LATE) == timely
    assert play(make(), script, Host.FUSSY) == timely


@settings(max_examples=60, deadline=None)
@given(steps=st.lists(st.builds(Step, st.sampled_from(WAITS), FRAMES), max_size=60))
def test_whatever_comes_a_drive_obeys_and_answers_afterwards(steps: list[Step]) -> None:
    """Any bytes to SDO, LSS, PDOs and SYNC; then a reset is obeyed and an SDO request answered.

    The frames may have given it another node id, or none: then LSS is answered.
    """
    device = BLUEPRINT.make(IMAGE)
    script = (*START, *steps, *RESTART)
    boot_ups = [frame for frame in play(device, script)[-1].before if frame.data == b"\0"]
    now = sum(step.wait_ns for step in script)
    if device.listens_to == WITHOUT_NODE_ID:
        assert not boot_ups
        assert device.receive(lss(0x4C), now) == (Frame(0x7E4, b"\x50".ljust(8, b"\0")),)
        return
    (boot_up,) = boot_ups
    node_id = boot_up.can_id - 0x700
    answer = Frame(0x580 + node_id, b"\x43\x00\x10\x00\x92\x01\x02\x00")
    assert tuple(device.receive(Frame(0x600 + node_id, read(0x1000).data), now)) == (answer,)
