"""A state machine that plays whatever may be done next: Hypothesis drives it and shrinks it.

What it did is told as a scenario, so that a failing run can be played again anywhere.
"""

from __future__ import annotations

from typing import ClassVar

from hypothesis import note
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, precondition, rule

from hil_tests.api import DeviceFailure, InconclusiveResult, KeypadBench
from hil_tests.clock import MS
from hil_tests.scenarios.families import FLIPS, LED_MAPS, REQUESTS, STRANGE_NMT, WAYS
from hil_tests.scenarios.grammar import Teller
from hil_tests.scenarios.noise import NOISE
from hil_tests.scenarios.play import conclude
from hil_tests.scenarios.player import LeftOpen, Player
from hil_tests.scenarios.scenario import Scenario

SPANS = st.sampled_from([span * MS for span in (0, 1, 12, 45, 60, 88, 112, 250, 700)])


class KeypadMachine(RuleBasedStateMachine):
    """Everything that a bench can do to a keypad, in any order; judged at the end.

    Subclass it with a bench.
    """

    bench: ClassVar[KeypadBench]
    claims: ClassVar[tuple[str, ...]] = ()

    def __init__(self) -> None:
        super().__init__()
        self.bench.begin_example()
        self._player = Player(self.bench)
        self._teller = Teller(0, powered=False)
        self._told = 0
        self._given: dict[str, int] = {}
        self._over = False

    @property
    def scenario(self) -> Scenario:
        """What was done so far."""
        return Scenario("off", tuple(self._given.items()), tuple(self._teller.steps))

    @initialize(debounce=st.sampled_from((0, 1, 2)), heartbeat_ms=st.sampled_from((20, 50, 0)))
    def commissioned(self, debounce: int, heartbeat_ms: int) -> None:
        """A device without power."""
        self._given = {"node_id": 6, "heartbeat_ms": heartbeat_ms, "debounce": debounce}
        self._player.begin(Scenario("off", tuple(self._given.items()), ()))
        self._do(0, "cycle")

    def _do(self, span_ns: int, action: str) -> None:
        self._teller.tell(span_ns, action)
        try:
            while self._told < len(self._teller.steps):
                self._told += 1
                self._player.do(self._teller.steps[self._told - 1])
        except LeftOpen:
            self._over = True
        except (DeviceFailure, InconclusiveResult) as error:
            self._player.found.append(error.verdict)
            self._over = True

    @precondition(lambda self: not self._over)
    @rule(span_ns=SPANS, action=st.sampled_from(FLIPS))
    def keys_move(self, span_ns: int, action: str) -> None:
        """Some keys are pressed or released."""
        self._do(span_ns, action)

    @precondition(lambda self: not self._over)
    @rule(span_ns=SPANS, action=st.sampled_from((*WAYS, "nmt reset-node", *STRANGE_NMT)))
    def master_commands(self, span_ns: int, action: str) -> None:
        """An NMT frame, good or bad."""
        self._do(span_ns, action)

    @precondition(lambda self: not self._over)
    @rule(span_ns=SPANS, action=st.sampled_from((*LED_MAPS, "look")))
    def lamps_change(self, span_ns: int, action: str) -> None:
        """An LED frame, or somebody looks."""
        self._do(span_ns, action)

    @precondition(lambda self: not self._over)
    @rule(span_ns=SPANS, action=st.sampled_from(NOISE))
    def others_talk(self, span_ns: int, action: str) -> None:
        """Frames that are none of its business."""
        self._do(span_ns, action)

    @precondition(lambda self: not self._over)
    @rule(span_ns=SPANS, number=st.integers(0, len(REQUESTS) - 1))
    def technician_commissions(self, span_ns: int, number: int) -> None:
        """The whole procedure, with other parameters."""
        self._do(span_ns, f"commission {number}")

    @precondition(lambda self: not self._over)
    @rule(span_ns=SPANS)
    def supply_is_cycled(self, span_ns: int) -> None:
        """Off and on."""
        self._do(span_ns, "cycle")

    def teardown(self) -> None:
        """Judge everything."""
        note(str(self.scenario))
        conclude(self.bench, self._player, self.scenario, *self.claims)
