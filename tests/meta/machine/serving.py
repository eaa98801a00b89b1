"""A mutant served as the device: its modules, compiled as a private set beside the right ones.

Nothing is written and nothing in `sys.modules` is touched: the private modules import each
other, and from everywhere else what all import. Two things are as with a board:

- its memory is its own. A device that comes with parameters was commissioned to them by
  itself, in whatever form it stores them.
- a device whose program crashes stands still, dark and silent, until power is cut. What it
  did before was said, what it should do after must be missed by the suite.
"""

from __future__ import annotations

import ast
import builtins
from collections.abc import Mapping
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType
from typing import Any

from node_model.keypad import Parameters, Profile
from node_model.keypad.parameters import SIZE
from node_model.node import Panel
from node_model.storage import RecordStore
from node_model.world import FOREVER
from tests.meta.machine.mutating import Mutant, mutants_of
from tests.meta.machine.still import MARK, Brick, Crashes, StandsStill

PARTS = (
    "node_model.nmt",
    "node_model.heartbeat",
    "node_model.emcy",
    "node_model.debounce",
    "node_model.blink",
    "node_model.storage",
    "node_model.keypad.parameters",
    "node_model.keypad.profile",
    "node_model.keypad.commissioning",
    "node_model.keypad.lamps",
    "node_model.keypad.operation",
    "node_model.keypad.keypad",
)
"""The modules that a keypad is made of."""

BESIDE = (
    "node_model.keypad.objects",
    "node_model.sdo",
    "node_model.sdo.block",
    "node_model.sdo.channel",
    "node_model.sdo.server",
    "node_model.sdo.settings",
    "node_model.sdo.transfer",
    "node_model.service",
)
"""What the keypad shares with devices of another kind: compiled anew with it, so that both
speak of the same states, and never changed."""

PRIVATE = frozenset((*PARTS, *BESIDE))

_PREDICTION = "tells whoever watches when to look again; no part of a keypad"
_READER = "reads the description of a keypad; no part of the keypad"
_OBJECTS = "objects over SDO: tests of any device with an EDS judge them, not the keypad's"
_QUICK = "a quick way through time for the right keypad alone; held against the slow one in tests"
LEFT_OUT: Mapping[tuple[str, str], str] = {
    ("node_model.blink", "BlinkWave.change"): _PREDICTION,
    ("node_model.keypad.lamps", "Lamps.change"): _PREDICTION,
    ("node_model.keypad.keypad", "Keypad.lamp_change"): _PREDICTION,
    ("node_model.heartbeat", "HeartbeatProducer.go_on"): _QUICK,
    ("node_model.keypad.keypad", "Keypad.repeats"): _QUICK,
    ("node_model.keypad.operation", "Operation.repeats"): _QUICK,
    ("node_model.keypad.operation", "Operation.serve"): _OBJECTS,
    ("node_model.keypad.operation", "Operation.tell_objects"): _OBJECTS,
    ("node_model.keypad.operation", "Operation.forget_objects"): _OBJECTS,
    ("node_model.keypad.parameters", "Parameters"): "defaults; nobody leaves a field to them",
    ("node_model.keypad.profile", ""): _READER,
    ("node_model.keypad.profile", "_span"): _READER,
    ("node_model.keypad.profile", "Profile"): "defaults; a description names every fact",
    ("node_model.keypad.profile", "loads"): _READER,
    ("node_model.keypad.profile", "load"): _READER,
}
"""Module and function that are not changed -> why not."""

OF_OTHERS: Mapping[str, frozenset[str]] = {
    "node_model.emcy": frozenset((
        "EmergencyProducer", "NO_ERROR", "COMMUNICATION_ERROR", "ERROR_REGISTER", "ERROR_FIELD",
        "COB_ID", "INHIBIT_TIME", "BEHAVIOUR", "StateRequest", "MAY_SEND", "_no_change",
    )),
    "node_model.heartbeat": frozenset(("HeartbeatService", "PRODUCER_TIME")),
    "node_model.storage": frozenset(("LongRecordStore", "RecordStore.finish")),
}  # fmt: skip
"""What stands in these modules for devices with an object dictionary, and no keypad has."""


def _is_of_others(mutant: Mutant) -> bool:
    """Whether a mutant changes what no keypad has."""
    names = OF_OTHERS.get(mutant.module, frozenset())
    if not mutant.function:
        return mutant.was.partition(" ")[0].rstrip(":") in names
    return bool({mutant.function, mutant.function.partition(".")[0]} & names)


@cache
def source_of(module: str) -> str:
    """The source of a module of the keypad."""
    spec = find_spec(module)
    assert spec is not None
    assert spec.origin is not None
    return Path(spec.origin).read_text("utf-8")


@cache
def all_mutants() -> tuple[Mutant, ...]:
    """Every mutant of the keypad, in order."""
    return tuple(
        mutant
        for module in PARTS
        for mutant in mutants_of(source_of(module), module)
        if (module, mutant.function) not in LEFT_OUT and not _is_of_others(mutant)
    )


class PrivateModules:
    """The keypad's modules, one of them changed.

    Args:
        mutant: the change; None = the right keypad, in the same clothes.
        seen: gets the places that the program comes by; None = nobody looks.
    """

    def __init__(self, mutant: Mutant | None = None, seen: set[str] | None = None) -> None:
        self._mutant = mutant
        self._seen = seen
        self._made: dict[str, ModuleType] = {}

    def load(self, name: str) -> ModuleType:
        """A private module, executed when it is first asked for.

        Raises:
            Exception: whatever the changed source raises on its way.
        """
        if name not in self._made:
            module = self._made[name] = ModuleType(name)
            module.__dict__["__builtins__"] = {**vars(builtins), "__import__": self._import}
            tree = self.tree(name)
            if self._mutant is not None and self._mutant.module == name:
                tree = self._mutant.applied(tree)
            if self._seen is not None:
                module.__dict__[_COMES_BY] = self._seen.add
                tree = _telling(tree, name)
            exec(compile(tree, MARK + name, "exec", dont_inherit=True), module.__dict__)  # noqa: S102
        return self._made[name]

    @staticmethod
    def tree(name: str) -> ast.Module:
        """The right source of a module, parsed."""
        return ast.parse(source_of(name))

    def _import(self, name: str, *args: Any, **kwargs: Any) -> ModuleType:
        """What `from name import ...` finds: private modules first."""
        return self.load(name) if name in PRIVATE else __import__(name, *args, **kwargs)


_COMES_BY = "comes_by"


def place_of(module: str, line: int) -> str:
    """The name of a statement that begins on that line."""
    return f"{module}:{line}"


def _telling(tree: ast.Module, module: str) -> ast.Module:
    """The same program; each statement of a function first tells that it is executed."""
    for function in ast.walk(tree):
        if isinstance(function, ast.FunctionDef):
            for node in ast.walk(function):
                for field in ("body", "orelse"):
                    block = getattr(node, field, None)
                    if isinstance(block, list):
                        setattr(node, field, [each for s in block for each in _told(s, module)])
    return ast.fix_missing_locations(tree)


def _told(statement: ast.stmt, module: str) -> tuple[ast.stmt, ...]:
    place = ast.Constant(place_of(module, statement.lineno))
    tells = ast.Expr(ast.Call(ast.Name(_COMES_BY, ast.Load()), [place], []))
    return ast.copy_location(tells, statement), statement


_FACTS = ("name", "keys", "leds", "powered", "bit_rate", "listens_to")
"""What everybody who handles a device asks for; one that lacks any of it was not made."""


class Maker:
    """Makes devices of one mutant, as the virtual bench asks for them.

    Args:
        modules: its program.
    """

    def __init__(self, modules: PrivateModules) -> None:
        self.crashes = Crashes()
        self._modules = modules
        self._type: type[Any] | None = None
        try:
            self._type = type(
                "Device",
                (StandsStill, self._part("keypad.keypad").Keypad),
                {"crashes": self.crashes},
            )
        except Exception as error:  # noqa: BLE001  a program that does not load
            self.crashes.note(error)

    def __call__(self, profile: Profile, image: bytes = b"") -> Panel:
        """A device with these facts of hardware that was commissioned to what `image` holds."""
        if self._type is None:
            return Brick(profile)
        try:
            device: Panel = self._type(self._facts(profile), self._memory(image))
            for fact in _FACTS:
                getattr(device, fact)
        except Exception as error:  # noqa: BLE001  whatever a wrong program raises
            self.crashes.note(error)
            return Brick(profile)
        return device

    def _part(self, name: str) -> Any:
        return self._modules.load(f"node_model.{name}")

    def _parameters(self, right: Parameters) -> Any:
        return self._part("keypad.parameters").Parameters(
            node_id=right.node_id,
            bit_rate_code=right.bit_rate_code,
            heartbeat_ms=right.heartbeat_ms,
            sync_time=right.sync_time,
            debounce=right.debounce,
        )

    def _facts(self, profile: Profile) -> Any:
        """The same facts as the device's own classes hold them."""
        facts = {name: getattr(profile, name) for name in Profile.__slots__}
        facts["factory"] = self._parameters(profile.factory)
        return self._part("keypad.profile").Profile(**facts)

    def _memory(self, image: bytes) -> bytes:
        """Memory with the same parameters, as the device itself stores them."""
        record = RecordStore(SIZE, image).load()
        right = Parameters.decode(record) if record else None
        if right is None:
            return b""
        try:
            store = self._part("storage").RecordStore(self._part("keypad.parameters").SIZE)
            store.save(self._parameters(right).encode(), 0)
            store.advance(FOREVER)
            return bytes(store.memory)
        except Exception as error:  # noqa: BLE001  a device that crashes while it stores
            self.crashes.note(error)
            return b""
