"""The bench of a device with an object dictionary (CiA 301): a drive, or any other.

It is brought to where a test starts by power or an NMT reset; what was changed over SDO is
gone then. What was stored on purpose is the test's to put back.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import lru_cache
from typing import TYPE_CHECKING

import attrs

from hil_tests.bench.bench import Bench
from hil_tests.bench.facilities import Faults
from hil_tests.bench.stage import Stage
from hil_tests.bench.terms import expected_of
from hil_tests.config import Cia301Parameters, Cia301Profile, Setup
from hil_tests.config.parameters import CIA301_NODE_IDS
from hil_tests.judge.causal import Seen
from hil_tests.judge.cobs import Nmt, State
from hil_tests.judge.expected import Expected, Family
from hil_tests.judge.settings import Role, role_of
from hil_tests.judge.verdict import NotRun

if TYPE_CHECKING:
    from hil_tests.eds import Sheet

UNSIGNED32 = 7
_EXTENDED = 1 << 29
_IDENTIFIER = 0x7FF


def spoken(sheet: Sheet, node_id: int) -> Iterator[tuple[int, Role]]:
    """The identifiers that a data sheet gives a device with that node id, and for what."""
    for one in sheet:
        if one.data_type != UNSIGNED32 or one.default is None:
            continue
        value = int(one.default.at(node_id))
        role = role_of(one.index, one.sub, value)
        if role is not None and value & _IDENTIFIER and not value & _EXTENDED:
            yield value & _IDENTIFIER, role


@lru_cache(maxsize=len(CIA301_NODE_IDS))
def _spoken_by(eds: str, node_id: int) -> tuple[tuple[int, Role], ...]:
    """The same of the device under test: a bench asks for it as often as it is opened."""
    from hil_tests.eds import sheet_of_device  # noqa: PLC0415 - where a device has one

    return tuple(spoken(sheet_of_device(eds), node_id))


class Cia301Bench(Bench):
    """Everything that a test of a device with an object dictionary can do and see."""

    profile: Cia301Profile
    home: Cia301Parameters
    parameters: Cia301Parameters

    def __init__(self, stage: Stage, profile: Cia301Profile, parameters: Cia301Parameters) -> None:
        super().__init__(stage, profile, parameters)
        self.faults = Faults(self, stage.faults, profile.faults) if stage.faults else None

    def expected(self, parameters: Setup | None) -> Expected:
        """See `BenchCore`."""
        return expected_of(
            self.profile,
            parameters,
            exclusive=self.stage.exclusive,
            fades=self.stage.fades,
            family=Family.CIA301,
            speaks=self._speaks(parameters.node_id) if parameters else (),
        )

    def _speaks(self, node_id: int) -> tuple[tuple[int, Role], ...]:
        """The identifiers of its data sheet: more than four PDOs, further SDO servers."""
        if self.profile.eds is None:
            return ()
        return _spoken_by(self.profile.eds, node_id)

    # Where tests start from.

    def fresh(self, prefer: Mapping[str, int] | None = None, **needed: int) -> Cia301Parameters:
        """The device without power (where the bench has Power), without an error, as it was.

        Args:
            prefer: settings that make the test quicker; used where they cost nothing.
            needed: settings without which the test makes no sense, e.g. `node_id=127`.

        Returns:
            What the device is set to now.

        Raises:
            NotRun: the bench cannot bring the device there; the text says why.
        """
        wanted = {**(prefer or {}), **needed} if self.stage.virtual else needed
        target = attrs.evolve(self.home, **wanted)
        left_at = self.now()
        if self.stage.renew(target):
            self._reset_facilities()
            self.renewed(target, off=True, until=left_at)
            return target
        if target != self.home:
            asked = ", ".join(f"{name} {value}" for name, value in needed.items())
            raise NotRun(f"the test needs {asked}; only a virtual device is made so")
        if self.faults and self.faults.active:
            self.faults.heal()
        if self.power:
            self.power.off()
        self.renewed(target, off=self.power is not None)
        return target

    def _reset_facilities(self) -> None:
        super()._reset_facilities()
        if self.faults:
            self.faults.forget()

    def go_home(self) -> None:
        """Without errors, and reset, so that what was changed over SDO is gone."""
        if not self.stage.virtual:
            self.start()

    def entered(self, command: Seen) -> Seen:
        """Where its heartbeat shows it, the device is operational once "start" has acted."""
        if self.watch.expected.heartbeat_ns:
            self.expect_state(State.OPERATIONAL, after=command, requirement="C-NMT-04")
        else:
            self.wait(self.profile.limits.command_ns)
        return command

    def enter(self, command: Nmt) -> Seen:
        """An NMT command that moves the device, and the time that it has to act."""
        sent = self.nmt(command)
        self.wait(self.profile.limits.command_ns)
        return sent
