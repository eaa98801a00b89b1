"""Drives whose emergencies are wrong (EM-01, EM-06 to EM-08)."""

from __future__ import annotations

from node_model.drive import Drive
from node_model.emcy import EMCY_BASE, EmergencyProducer, emcy_frame
from node_model.faults.parts import Fault as Wrong
from node_model.frame import Frame
from node_model.nmt import NmtState
from node_model.node import MS, US, Frames
from node_model.service import Fault


class EmergencyCodeHighByteFirst(Wrong, EmergencyProducer):
    """The error code of an emergency is sent with its high byte first."""

    violates = ("EM-01", "C-EM-01")

    def _tell(self, data: bytes, now: int) -> None:
        super()._tell(data[1::-1] + data[2:], now)


class EmergencyOfSevenBytes(Wrong, EmergencyProducer):
    """An emergency has seven bytes."""

    violates = ("EM-01", "C-EM-01", "C-RB-02")

    def _tell(self, data: bytes, now: int) -> None:
        super()._tell(data[:7], now)


class EmergencySentTwice(Wrong, EmergencyProducer):
    """Each emergency is sent twice."""

    violates = ("EM-01", "C-EM-02")

    def _tell(self, data: bytes, now: int) -> None:
        super()._tell(data, now)
        super()._tell(data, now)


class EmergencyWithoutRegister(Wrong, EmergencyProducer):
    """Byte 2 of an emergency is 0 whatever the error register is."""

    violates = ("EM-01", "C-EM-03", "C-EM-21")

    def _tell(self, data: bytes, now: int) -> None:
        super()._tell(data[:2] + b"\0" + data[3:], now)


class EmergencyWithoutMakersBytes(Wrong, EmergencyProducer):
    """The five bytes of the maker are lost on the way into the emergency."""

    violates = ("EM-01",)

    def _tell(self, data: bytes, now: int) -> None:
        super()._tell(data[:3] + bytes(5), now)


class EmergencyOfTheNextNode(Wrong, EmergencyProducer):
    """Emergencies are sent with the identifier of the next node."""

    violates = ("EM-01", "C-EM-01", "C-RB-01")

    def can_id(self) -> int:
        return super().can_id() + 1


class EmergencyIdentifierIsFixed(Wrong, EmergencyProducer):
    """What 1014h says of the identifier does not matter."""

    violates = ("EM-07", "C-EM-01")

    def can_id(self) -> int:
        return EMCY_BASE + self.node_id


class EmergencyForARefusedRequest(Wrong, Drive):
    """An SDO request that is refused causes an emergency."""

    violates = ("EM-02",)

    def receive(self, frame: Frame, now: int) -> Frames:
        said = super().receive(frame, now)
        if any(each.can_id == 0x580 + self.node_id and each.data[0] == 0x80 for each in said):
            return (*said, emcy_frame(self.node_id, 0x6300, 0x01))
        return said


class EmergencyBeforeBootUp(Wrong, Drive):
    """An error that is there at power-on is told before the boot-up."""

    violates = ("C-NMT-02", "C-EM-24")

    def boot(self, now: int) -> Frames:
        return tuple(reversed(super().boot(now)))


class EndOfErrorIsSilent(Wrong, EmergencyProducer):
    """When the last error goes nothing is sent."""

    violates = ("EM-06", "C-EM-04", "C-HBC-08", "C-NG-08", "EC-02")

    def tells_end(self, register: int) -> bool:
        return False


class OneHealedErrorEndsAll(Wrong, EmergencyProducer):
    """When one of several errors goes all of them count as gone."""

    violates = ("EM-06", "C-EM-04")

    def heal(self, cause: str, now: int) -> Frames:
        for other in [*self.errors] if cause in self.errors else []:
            if other != cause:
                del self.errors[other]
        return super().heal(cause, now)


class EndOfErrorKeepsTheCode(Wrong, EmergencyProducer):
    """The end of the last error is told with the code FF00h instead of 0000h."""

    violates = ("EM-06", "C-EM-04", "C-HBC-08", "C-NG-08", "EC-02")

    def _tell(self, data: bytes, now: int) -> None:
        super()._tell(data if any(data[:2]) else b"\x00\xff" + data[2:], now)


class ResetTellsTheEndOfErrors(Wrong, EmergencyProducer):
    """A reset with an error sends an emergency 0000h after the boot-up."""

    violates = ("C-EM-06",)

    ended = False

    def stop(self) -> None:
        self.ended = bool(self.errors)
        super().stop()

    def start(self, now: int) -> Frames:
        ended = self.ended
        said = super().start(now)
        return (*said, emcy_frame(self.node_id, 0, 0)) if ended else said


class EmergencyInStopped(Wrong, EmergencyProducer):
    """Emergencies are sent in stopped, too."""

    violates = ("EM-08", "C-EM-17", "C-NMT-16")

    def may_send(self) -> bool:
        return True


class EmergencyInhibitIsIgnored(Wrong, EmergencyProducer):
    """Two emergencies follow each other at once, whatever 1015h says."""

    violates = ("EM-07", "C-EM-15")

    def inhibit_ns(self) -> int:
        return 0


class EmergencyInhibitTooShort(Wrong, EmergencyProducer):
    """The inhibit time of emergencies counts in steps of 10 us."""

    violates = ("EM-07", "C-EM-15")

    def inhibit_ns(self) -> int:
        return super().inhibit_ns() // (100 * US) * 10 * US


class DisabledEmergencyIsSent(Wrong, EmergencyProducer):
    """Bit 31 of 1014h does not switch emergencies off."""

    violates = ("EM-07", "C-EM-13")

    def is_valid(self) -> bool:
        return True


class WithoutEmergencyNoRegister(Wrong, EmergencyProducer):
    """With emergencies switched off errors do not show in 1001h and 1003h either."""

    violates = ("C-EM-13", "EM-03")

    def occur(self, cause: str, fault: Fault, now: int) -> Frames:
        return super().occur(cause, fault, now) if self.is_valid() else ()


class EmergencyIdentifierChangesInUse(Wrong, EmergencyProducer):
    """The identifier in 1014h can be changed while it is valid, and to a restricted one."""

    violates = ("C-EM-14", "EM-07")

    def _guard_cob_id(self, sub: int, data: bytes) -> None:
        pass


class EmergencyTooLate(Wrong, EmergencyProducer):
    """An emergency is sent 60 ms after its error."""

    violates = ("EM-01", "C-HBC-06", "C-NG-07")

    def _tell(self, data: bytes, now: int) -> None:
        super()._tell(data, now)
        self._since = now + 60 * MS


class EmergencyIdentifierShowsAReservedBit(Wrong, Drive):
    """1014h reads with bit 30 set."""

    violates = ("EM-07", "C-EDS-09")

    def boot(self, now: int) -> Frames:
        self.od.put_number(0x1014, 0, self.od.number(0x1014) | 1 << 30)
        return super().boot(now)


class EmergencyAlwaysWaits(Wrong, EmergencyProducer):
    """An emergency waits for the inhibit time though none was sent for long."""

    violates = ("EM-07",)

    def deadline(self) -> int | None:
        due = super().deadline()
        return None if due is None else max(due, self._since + self.inhibit_ns())


class EmergenciesEndWithStopped(Wrong, EmergencyProducer):
    """Once it was stopped no emergency is sent any more."""

    violates = ("EM-08", "EM-01")

    stopped = False

    def enter(self, state: NmtState, now: int) -> Frames:
        self.stopped = self.stopped or state is NmtState.STOPPED
        return super().enter(state, now)

    def may_send(self) -> bool:
        return super().may_send() and not self.stopped


class BootUpTellsNoError(Wrong, EmergencyProducer):
    """Each boot-up is followed by an emergency 0000h."""

    violates = ("EM-06", "C-EM-06")

    def start(self, now: int) -> Frames:
        return (*super().start(now), emcy_frame(self.node_id, 0, 0))


class ReactionLeavesStopped(Wrong, EmergencyProducer):
    """With 1029h:01 = 0 a communication error leads to pre-operational from stopped, too."""

    violates = ("C-EM-22", "EC-02", "EC-04")

    def reaction(self) -> NmtState | None:
        wakes = self.state is NmtState.STOPPED and not self._od.number(0x1029, 1)
        return NmtState.PRE_OPERATIONAL if wakes else super().reaction()


FAULTS: tuple[type[Wrong], ...] = (
    EmergencyCodeHighByteFirst,
    EmergencyOfSevenBytes,
    EmergencySentTwice,
    EmergencyWithoutRegister,
    EmergencyWithoutMakersBytes,
    EmergencyOfTheNextNode,
    EmergencyIdentifierIsFixed,
    EmergencyForARefusedRequest,
    EmergencyBeforeBootUp,
    EndOfErrorIsSilent,
    OneHealedErrorEndsAll,
    EndOfErrorKeepsTheCode,
    ResetTellsTheEndOfErrors,
    EmergencyInStopped,
    EmergencyInhibitIsIgnored,
    EmergencyInhibitTooShort,
    DisabledEmergencyIsSent,
    WithoutEmergencyNoRegister,
    EmergencyIdentifierChangesInUse,
    EmergencyTooLate,
    EmergencyIdentifierShowsAReservedBit,
    EmergencyAlwaysWaits,
    EmergenciesEndWithStopped,
    BootUpTellsNoError,
    ReactionLeavesStopped,
)
