"""Every node, right, faulty or different, keeps the laws of a node."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from node_model.beacon import Beacon
from node_model.devices import make_device
from node_model.faults import MUTANTS, VARIANTS, link
from node_model.frame import Frame
from node_model.host.segment import Segment
from node_model.keypad import Keypad, Parameters, Profile, load
from node_model.load import Load
from node_model.node import MS, Node
from tests.node_model.driving import Host, Step, play

PROFILE = replace(load(), factory=Parameters(heartbeat_ms=20, sync_time=3))
COMMISSIONING = PROFILE.commissioning_keys
EFFECTS = (
    link.Effect,
    link.Drop,
    link.Delay,
    link.Slow,
    link.Duplicate,
    link.Reorder,
    link.Corrupt,
    link.WrongLength,
    link.AsRemote,
    link.AsExtended,
    link.WrongRate,
)


def _linked(effect: type[link.Effect]) -> Callable[[Profile], Node]:
    return lambda profile: link.PanelLink(Keypad(profile), effect())


NODES: Mapping[str, Callable[[Profile], Node]] = {
    "keypad": Keypad,
    **{name: mutant.make for name, mutant in MUTANTS.items()},
    **{name: variant.make for name, variant in VARIANTS.items()},
    **{f"link {effect.__name__}": _linked(effect) for effect in EFFECTS},
    "drive": lambda _: make_device("drive", settings={"node_id": 1, "heartbeat_ms": 20}),
    "drives that hear each other": lambda _: Segment(
        [make_device("drive", settings={"node_id": n, "heartbeat_ms": 20}) for n in (1, 2)]
    ),
    "link of a beacon": lambda _: link.Link(Beacon(9, 30 * MS, 125_000), link.Delay()),
    "beacon": lambda _: Beacon(9, 30 * MS, 125_000),
    "silent beacon": lambda _: Beacon(9, 0, 125_000),
    "load": lambda _: Load([Frame(0x111, b"\1"), Frame(0x222)], 20_000, 125_000),
    "full load": lambda _: Load([Frame(0x111, bytes(8))], 1_000_000, 20_000),
}

WAITS = (0, 1, MS, 7 * MS, 10 * MS, 35 * MS, 60 * MS, 99 * MS, 100 * MS, 101 * MS, 700 * MS)
COMMANDS = tuple(
    Frame(0, bytes(data))
    for data in (
        (1, 0),
        (1, 1),
        (1, 1),
        (2, 0),
        (128, 1),
        (129, 1),
        (130, 0),
        (1, 2),
        (1,),
        (5, 0),
    )
)
SERVICES = (
    Frame(0x4F8, bytes((5, 2, 0, 20, 1, 0))),
    Frame(0x4F8, bytes((7, 3, 1, 0, 0, 2, 0, 0))),
    Frame(0x4F8, bytes((0, 3, 0, 20, 0, 1))),
    Frame(0x4F8, bytes((16, 5, 0, 20, 0, 1))),
    Frame(0x4F8, bytes(5)),
    Frame(0x4F8, bytes((3, 1, 0, 25, 0, 0)), extended=True),
    Frame(0x4F8, remote=True, dlc=6),
    Frame(0x201, b"\xff"),
    Frame(0x201, b"\x0f\x01"),
    Frame(0x201),
    Frame(0x201, remote=True, dlc=1),
    Frame(0x202, b"\x31"),
    Frame(0x301, b"\x55"),
    Frame(0x301, b"\xaa", extended=True),
)
OTHERS = (
    Frame(0x080),
    Frame(0x601, bytes(8)),
    Frame(0x7E5, bytes(8)),
    Frame(0x702, b"\0"),
    Frame(0x181, remote=True, dlc=1),
    Frame(0x701, remote=True, dlc=1),
    Frame(0x3F8, remote=True, dlc=6),
    Frame(0, remote=True, dlc=2),
    Frame(0, b"\1\1", extended=True),
    Frame(0x7FF, bytes(8), dlc=15),
    Frame(0x456),
)
HELD = st.frozensets(st.sampled_from(("on_off", "aut", "k3", "k8")), max_size=3)
FRAMES = st.one_of(st.sampled_from(COMMANDS), st.sampled_from(SERVICES), st.sampled_from(OTHERS))
INPUTS = st.one_of(FRAMES, HELD, FRAMES, st.none(), st.sampled_from((True, False)))
STEPS = st.lists(st.builds(Step, st.sampled_from(WAITS), INPUTS), min_size=4, max_size=25)
STARTS = st.tuples(
    st.builds(Step, st.just(0), st.one_of(HELD, st.just(COMMISSIONING))),
    st.builds(Step, st.sampled_from((0, 3 * MS)), st.just(True)),
    st.builds(Step, st.sampled_from((60 * MS, 1100 * MS)), FRAMES),
)
SCRIPTS = st.builds(lambda start, rest: (*start, *rest), STARTS, STEPS)


@pytest.mark.parametrize("name", NODES)
@settings(max_examples=8)
@given(script=SCRIPTS)
def test_a_node_depends_on_its_inputs_alone_and_never_on_its_host(
    name: str, script: tuple[Step, ...]
) -> None:
    """A second instance, a late host and a fussy host get the same frames, lamps and memory.

    On the way the driver checks that `advance` before the deadline changes nothing, that
    after `advance(t)` the deadline is None or later than t, and that power-off is silent.
    """
    make = NODES[name]
    timely = play(make(PROFILE), script, Host.TIMELY)

    assert play(make(PROFILE), script, Host.TIMELY) == timely
    assert play(make(PROFILE), script, Host.LATE) == timely
    assert play(make(PROFILE), script, Host.FUSSY) == timely
