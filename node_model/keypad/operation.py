"""Regular operation of the keypad: boot-up, NMT, heartbeat, key frames, LED frames."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cache
from typing import TYPE_CHECKING

from node_model.debounce import Debouncer
from node_model.emcy import GENERIC_ERROR, HARDWARE_ERROR, emcy_frame
from node_model.frame import Frame, data_frame
from node_model.heartbeat import HeartbeatProducer, heartbeat_frame
from node_model.keypad.lamps import Lamps
from node_model.keypad.parameters import DEBOUNCE_STEP_NS, Parameters
from node_model.keypad.profile import Profile
from node_model.nmt import NMT_COB_ID, TARGETS, NmtCommand, NmtState, command_for
from node_model.node import MS, NOTHING, Frames

if TYPE_CHECKING:
    from node_model.keypad.objects import Objects

KEY_BASE = 0x180
STEADY_BASE = 0x200
BLINK_BASE = 0x300
SDO_BASE = 0x600


@cache  # the frames of a node id never change, and a keypad is made for each scenario
def beats_of(node_id: int) -> Mapping[int, Frames]:
    """The heartbeat, as what is sent, for each state."""
    return {state: (heartbeat_frame(node_id, state),) for state in NmtState}


class Operation:
    """A keypad that runs with its stored parameters.

    Args:
        profile: facts of the hardware.
        parameters: what it was commissioned to.
        mask: the keys held now, as bits of the key frame.
        now: the instant at which initialisation is done.
    """

    heartbeat_type: Callable[[int], HeartbeatProducer] = HeartbeatProducer
    debouncer_type: Callable[[int, int], Debouncer] = Debouncer
    lamps_type: Callable[[Profile, int], Lamps] = Lamps

    def __init__(self, profile: Profile, parameters: Parameters, mask: int, now: int) -> None:
        self.profile = profile
        self.parameters = parameters
        self.node_id = parameters.node_id
        self.raw = mask
        self.state = NmtState.INITIALISING
        self.boot_at: int | None = now
        self.resets_by = NmtCommand.RESET_NODE
        self.bit_rate = 0
        self.listens_to = self.acceptance()
        self.beats = beats_of(self.node_id)
        self.beat = self.heartbeat_type(self.heartbeat_ns())
        self.keys = self.fresh_keys(mask)
        self.lamps = self.lamps_type(profile, now)
        self.objects: Objects | None = None

    # Facts that follow from the parameters.

    def acceptance(self) -> frozenset[int] | None:
        """Identifiers that the acceptance filter of the controller lets through."""
        bases = (STEADY_BASE, BLINK_BASE, SDO_BASE)
        return frozenset((NMT_COB_ID, *(base + self.node_id for base in bases)))

    def line_rate(self) -> int:
        """Bit rate in bit/s."""
        return self.parameters.bit_rate

    def heartbeat_ns(self) -> int:
        """Producer time."""
        return self.parameters.heartbeat_ms * MS

    def debounce_ns(self) -> int:
        """How long a press or a release must last."""
        return self.parameters.debounce * DEBOUNCE_STEP_NS

    def fresh_keys(self, mask: int) -> Debouncer:
        """The debouncer with which a start begins; what is held then counts at once."""
        return self.debouncer_type(self.debounce_ns(), mask)

    def reset_ns(self) -> int:
        """How long an initialisation after an NMT reset takes."""
        return 10 * MS

    # Start.

    def boot(self, now: int) -> Frames:
        """Initialisation is done: pre-operational, boot-up first, then what is to be told."""
        self.boot_at = None
        self.bit_rate = self.line_rate()
        self.state = self.state_after_boot()
        self.beat.start(now)
        return self.boot_frames(self.resets_by)

    def state_after_boot(self) -> NmtState:
        """CiA 301: pre-operational is entered by itself."""
        return NmtState.PRE_OPERATIONAL

    def boot_frames(self, cause: NmtCommand) -> Frames:
        """Boot-up, and after a full reset the EMCY "hardware"."""
        (boot_up,) = self.beats[NmtState.INITIALISING]
        if cause is NmtCommand.RESET_COMMUNICATION:
            return (boot_up,)
        return boot_up, self.emcy()

    def emcy(self) -> Frame:
        """The EMCY after a start."""
        return emcy_frame(self.node_id, HARDWARE_ERROR, GENERIC_ERROR)

    def reset(self, command: NmtCommand, now: int) -> Frames:
        """Initialise anew; volatile state is gone, stored parameters stay."""
        self.state = NmtState.INITIALISING
        self.bit_rate = 0
        self.resets_by = command
        self.boot_at = now + self.reset_ns()
        self.keys = self.fresh_keys(self.raw)
        self.lamps = self.lamps_type(self.profile, now)
        self.forget_objects()
        return NOTHING

    # Frames in.

    def receive(self, frame: Frame, now: int) -> Frames:
        """NMT commands in every state; LED frames in operational."""
        if self.boot_at is not None:
            return NOTHING
        command = self.command(frame)
        if command is not None:
            return self.obey(command, now)
        if frame.remote or frame.extended:
            return NOTHING
        if frame.can_id == STEADY_BASE + self.node_id and self.takes_leds():
            self.lamps.set_steady(frame.data)
        elif frame.can_id == BLINK_BASE + self.node_id and self.takes_leds():
            self.lamps.set_blinking(frame.data)
        elif frame.can_id == SDO_BASE + self.node_id:
            return self.serve(frame, now)
        return NOTHING

    def serve(self, frame: Frame, now: int) -> Frames:
        """An SDO request: the first one makes the objects."""
        if self.objects is None:
            from node_model.keypad.objects import Objects  # noqa: PLC0415 - few ask for them

            self.objects = Objects(self, now)
        return self.objects.serve(frame, now)

    def tell_objects(self, now: int) -> None:
        """The NMT state is another one: an SDO transfer may be over."""
        if self.objects is not None:
            self.objects.enter(self.state, now)

    def forget_objects(self) -> None:
        """What clients wrote is gone: the commissioned heartbeat time counts again."""
        if self.objects is not None:
            self.objects = None
            self.beat = self.heartbeat_type(self.heartbeat_ns())

    def command(self, frame: Frame) -> NmtCommand | None:
        """The NMT command in this frame that is meant for this node."""
        return command_for(frame, self.node_id)

    def takes_leds(self) -> bool:
        """PDOs are processed in operational only."""
        return self.state is NmtState.OPERATIONAL

    def obey(self, command: NmtCommand, now: int) -> Frames:
        """Carry out an NMT command."""
        target = self.target(command)
        if target is NmtState.INITIALISING:
            return self.reset(command, now)
        before, self.state = self.state, target
        self.tell_objects(now)
        if target is NmtState.OPERATIONAL and before is not target:
            return self.entry_frames(now)
        return NOTHING

    def target(self, command: NmtCommand) -> NmtState:
        """The state that a command leads to."""
        return TARGETS[command]

    # Keys.

    def entry_frames(self, now: int) -> Frames:  # noqa: ARG002  variants use the instant
        """On entering operational: the debounced state, once."""
        return (self.key_frame(self.keys.settled),)

    def hold(self, mask: int, now: int) -> Frames:
        """The contacts are as in `mask` from now on."""
        self.raw = mask
        if self.boot_at is not None:
            self.keys = self.fresh_keys(mask)
            return NOTHING
        self.keys.edge(mask, now)
        return self.settle(now)

    def settle(self, now: int) -> Frames:
        """Report the keys whose debounced state changed by now."""
        changed = self.keys.advance(now)
        if changed and self.reports(changed):
            return (self.key_frame(self.keys.settled),)
        return NOTHING

    def reports(self, changed: int) -> bool:
        """Whether that change is worth a frame now."""
        if self.state is not NmtState.OPERATIONAL:
            return False
        return self.profile.releases_reported or bool(changed & self.keys.settled)

    def key_frame(self, mask: int) -> Frame:
        """The key frame, first byte lowest."""
        data = mask.to_bytes(self.profile.key_bytes, "little")
        return data_frame(KEY_BASE + self.node_id, data)

    # Time.

    def advance(self, now: int) -> Frames:
        """Everything that is due, oldest first."""
        due = self.deadline()
        if due is None or due > now:
            return NOTHING
        frames = self.fire(due)
        # A host in time spares itself a look: `fire` leaves nothing due at its instant.
        while due < now and (due := self.deadline()) is not None and due <= now:
            frames = (*frames, *self.fire(due))
        return frames

    def fire(self, now: int) -> Frames:
        """What is due at this very instant."""
        if self.boot_at is not None:
            return self.boot(now)
        settles_at, beats_at = self.keys.due_at, self.beat.due_at
        frames = NOTHING if settles_at is None or settles_at > now else self.settle(now)
        if beats_at is None or beats_at > now:
            return frames
        self.beat.beat()
        beats = self.beat_frames()
        return (*frames, *beats) if frames else beats

    def beat_frames(self) -> Frames:
        """The heartbeat that shows the present state."""
        return self.beats[self.state]

    def deadline(self) -> int | None:
        """Boot-up, next heartbeat, or next key to settle."""
        if self.boot_at is not None:
            return self.boot_at
        settles_at, beats_at = self.keys.due_at, self.beat.due_at
        if settles_at is None:
            return beats_at
        return settles_at if beats_at is None or settles_at < beats_at else beats_at

    def repeats(self, frame: Frame, until: int, gap_ns: int, most: int) -> Sequence[int]:
        """Heartbeats, up to the next key to settle; see `Repeating`.

        One that is made differently, in whatever, is asked each time.
        """
        beat, settles_at = self.beat, self.keys.due_at
        if (
            type(self) is not Operation
            or type(beat) is not HeartbeatProducer
            or self.boot_at is not None
            or beat.period_ns <= gap_ns
            or frame is not self.beats[self.state][0]
        ):
            return ()
        return beat.go_on(until if settles_at is None else min(until, settles_at - 1), most)
