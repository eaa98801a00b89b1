"""Drives whose error register, error field or error behaviour is wrong (EM-03 to EM-06)."""

from __future__ import annotations

from node_model.emcy import ERROR_FIELD, GENERIC_ERROR, EmergencyProducer
from node_model.faults.parts import Fault as Wrong
from node_model.nmt import NmtState
from node_model.node import Frames
from node_model.od import AbortCode, SdoAbort
from node_model.service import Fault


class RegisterWithoutClass(Wrong, EmergencyProducer):
    """The error register has bit 0 alone, whatever the class of the error."""

    violates = ("EM-03", "C-EM-21")

    def register(self) -> int:
        return super().register() & GENERIC_ERROR


class RegisterWithoutGenericBit(Wrong, EmergencyProducer):
    """The error register has the bit of the class and not bit 0."""

    violates = ("C-OD-02", "EM-03")

    def register(self) -> int:
        return super().register() & ~GENERIC_ERROR


class RegisterBitsShifted(Wrong, EmergencyProducer):
    """The error register has the bit below the one of the class."""

    violates = ("EM-03", "C-EM-21")

    def register(self) -> int:
        bits = super().register()
        return bits >> 1 | bits & GENERIC_ERROR


class RegisterKeepsItsBits(Wrong, EmergencyProducer):
    """A bit of the error register that was once set stays."""

    violates = ("EM-06", "C-EM-04", "C-HBC-08", "C-NG-08", "EC-02")

    kept = 0

    def register(self) -> int:
        self.kept |= super().register()
        return self.kept


class RegisterShowsTheNewestErrorAlone(Wrong, EmergencyProducer):
    """The error register has the bits of the newest error and of no other."""

    violates = ("EM-03", "EM-06")

    def register(self) -> int:
        newest = [*self.errors.values()][-1:]
        return sum(fault.register | GENERIC_ERROR for fault in newest)


class RegisterNotWritten(Wrong, EmergencyProducer):
    """Object 1001h stays 0, whatever the emergency says."""

    violates = ("EM-03", "C-EM-03")

    def _show_register(self) -> int:
        return self.register()


class FieldInOrderOfTime(Wrong, EmergencyProducer):
    """The pre-defined error field has the oldest error in front."""

    violates = ("EM-04", "C-EM-07")

    def _push(self, entry: int) -> None:
        count = self._od.number(ERROR_FIELD)
        self._od.put_number(ERROR_FIELD, min(count + 1, self._depth), entry)
        self._od.put_number(ERROR_FIELD, 0, min(count + 1, self._depth))


class FieldHasNewestOnly(Wrong, EmergencyProducer):
    """The pre-defined error field holds one error; the one before is overwritten."""

    violates = ("EM-04", "C-EM-07")

    def _push(self, entry: int) -> None:
        self._od.put_number(ERROR_FIELD, 1, entry)
        self._od.put_number(ERROR_FIELD, 0, 1)


class FieldIsNotCounted(Wrong, EmergencyProducer):
    """The number of errors in 1003h:00 stays 0."""

    violates = ("EM-05", "C-EM-07", "EM-04")

    def _push(self, entry: int) -> None:
        super()._push(entry)
        self._od.put_number(ERROR_FIELD, 0, 0)


class FieldCountsOn(Wrong, EmergencyProducer):
    """The number of errors in 1003h:00 grows past the entries that there are."""

    violates = ("EM-05", "C-EM-07")

    def _push(self, entry: int) -> None:
        count = self._od.number(ERROR_FIELD)
        super()._push(entry)
        self._od.put_number(ERROR_FIELD, 0, (count + 1) & 0xFF)


class FieldHoldsEndsOfErrors(Wrong, EmergencyProducer):
    """The end of an error is written into the pre-defined error field, too."""

    violates = ("EM-04", "C-EM-07")

    def heal(self, cause: str, now: int) -> Frames:
        if cause in self.errors:
            self._push(0)
        return super().heal(cause, now)


class FieldCodeSwapped(Wrong, EmergencyProducer):
    """An entry of 1003h has the error code with its bytes exchanged."""

    violates = ("EM-04", "C-EM-08")

    def field_entry(self, fault: Fault, register: int) -> int:
        entry = super().field_entry(fault, register)
        return entry & ~0xFFFF | (entry & 0xFF) << 8 | entry >> 8 & 0xFF


class FieldCannotBeCleared(Wrong, EmergencyProducer):
    """Writing 0 to 1003h:00 is refused."""

    violates = ("EM-05", "C-EM-09")

    def _guard_field(self, sub: int, data: bytes) -> None:
        raise SdoAbort(AbortCode.VALUE)


class FieldTakesAnyNumber(Wrong, EmergencyProducer):
    """A number of errors can be written to 1003h:00."""

    violates = ("EM-05", "C-EM-10")

    def _guard_field(self, sub: int, data: bytes) -> None:
        pass


class FieldClearsOnAnyNumber(Wrong, EmergencyProducer):
    """A number other than 0 is refused at 1003h:00, and clears the list all the same."""

    violates = ("EM-05", "C-EM-10", "C-OD-13")

    def _guard_field(self, sub: int, data: bytes) -> None:
        self._od.put_number(ERROR_FIELD, 0, 0)
        super()._guard_field(sub, data)


class ClearingTheFieldHeals(Wrong, EmergencyProducer):
    """Clearing 1003h clears the error register, too."""

    violates = ("C-EM-12",)

    def _guard_field(self, sub: int, data: bytes) -> None:
        super()._guard_field(sub, data)
        self.errors.clear()
        self._show_register()


class EmptyFieldReadsZero(Wrong, EmergencyProducer):
    """Entry 1 of an empty error field can be read, as 0."""

    violates = ("C-EM-11", "EM-05")

    def _guard_field_reading(self, sub: int) -> None:
        pass


class NoReactionToLostGuarding(Wrong, EmergencyProducer):
    """A communication error does not change the NMT state, whatever 1029h says."""

    violates = ("C-EM-22", "EC-02", "EC-04", "C-NG-06", "C-HBC-03")

    def reaction(self) -> NmtState | None:
        return None


class ReactionIsAlwaysStopped(Wrong, EmergencyProducer):
    """A communication error leads to stopped, whatever 1029h says."""

    violates = ("C-EM-22", "EC-02", "EC-04", "C-NG-06", "C-HBC-03")

    def reaction(self) -> NmtState | None:
        return NmtState.STOPPED


class ReactionIsNeverStopped(Wrong, EmergencyProducer):
    """With 1029h:01 = 2 a communication error leads to pre-operational."""

    violates = ("C-EM-22",)

    def reaction(self) -> NmtState | None:
        found = super().reaction()
        return NmtState.PRE_OPERATIONAL if found is NmtState.STOPPED else found


class EveryErrorChangesTheState(Wrong, EmergencyProducer):
    """Each error, not only one of communication, causes the reaction of 1029h."""

    violates = ("C-EM-23",)

    def _react(self, fault: Fault, now: int) -> None:
        target = self.reaction()
        if target is not None:
            self._change(target, now)


FAULTS: tuple[type[Wrong], ...] = (
    RegisterWithoutClass,
    RegisterWithoutGenericBit,
    RegisterBitsShifted,
    RegisterKeepsItsBits,
    RegisterShowsTheNewestErrorAlone,
    RegisterNotWritten,
    FieldInOrderOfTime,
    FieldHasNewestOnly,
    FieldIsNotCounted,
    FieldCountsOn,
    FieldHoldsEndsOfErrors,
    FieldCodeSwapped,
    FieldCannotBeCleared,
    FieldTakesAnyNumber,
    FieldClearsOnAnyNumber,
    ClearingTheFieldHeals,
    EmptyFieldReadsZero,
    NoReactionToLostGuarding,
    ReactionIsAlwaysStopped,
    ReactionIsNeverStopped,
    EveryErrorChangesTheState,
)
