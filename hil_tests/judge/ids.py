"""Which requirement says what must hold at all times: one row for each family of devices.

What the monitors look for is the same for every CANopen device; who demands it is not.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Ids:
    """Ids of requirements.

    Args:
        boot_up: a start leads to a boot-up.
        boot_late: it comes in time.
        boot_first: nothing is sent before it.
        boot_again: it does not come without a reset.
        reset: a commanded reset leads to a boot-up.
        reset_late: it comes in time.
        reset_first: nothing is sent between such a reset and its boot-up.
        beat: the cadence of the heartbeat.
        beat_first: the span from boot-up to the first beat.
        beat_off: a period of 0 means none.
        beat_form: a beat shows an NMT state.
        self_start: nothing but a command leads to operational.
        state: the state shown is one that a command led to.
        shown_late: a change of state shows in the next beat.
        reaction: a communication error leads where 1029h says; "" = there is no such object.
        obeyed: a command leads to its state.
        beat_stopped: the heartbeat goes on in stopped.
        reset_node: the command of that name is followed by a boot-up.
        reset_communication: so is this one.
    """

    boot_up: str
    boot_late: str
    boot_first: str
    boot_again: str
    reset: str
    reset_late: str
    reset_first: str
    beat: str
    beat_first: str
    beat_off: str
    beat_form: str
    self_start: str
    state: str
    shown_late: str
    reaction: str
    obeyed: str
    beat_stopped: str
    reset_node: str
    reset_communication: str


KEYPAD = Ids(
    boot_up="NMT-02",
    boot_late="NMT-02",
    boot_first="NMT-02",
    boot_again="NMT-02",
    reset="NMT-06",
    reset_late="NMT-06",
    reset_first="NMT-06",
    beat="HB-01",
    beat_first="HB-06",
    beat_off="HB-05",
    beat_form="HB-02",
    self_start="NMT-03",
    state="NMT-07",
    shown_late="HB-03",
    reaction="",
    obeyed="NMT-04",
    beat_stopped="HB-01",
    reset_node="NMT-06",
    reset_communication="NMT-06",
)

CIA301 = Ids(
    boot_up="C-NMT-01",
    boot_late="C-NMT-20",
    boot_first="C-NMT-02",
    boot_again="C-NMT-13",
    reset="C-NMT-13",
    reset_late="C-NMT-20",
    reset_first="C-NMT-02",
    beat="C-HB-04",
    beat_first="C-HB-13",
    beat_off="C-HB-06",
    beat_form="C-HB-02",
    self_start="C-NMT-19",
    state="C-NMT-04",
    shown_late="C-NMT-21",
    reaction="C-EM-22",
    obeyed="C-NMT-04",
    beat_stopped="C-HB-07",
    reset_node="C-NMT-11",
    reset_communication="C-NMT-12",
)
