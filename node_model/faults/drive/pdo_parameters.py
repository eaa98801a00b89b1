"""Drives that accept wrong settings of PDOs (C-PC, C-TP-06, C-TP-10, C-TP-11)."""

from __future__ import annotations

from node_model.faults.parts import Fault
from node_model.pdo.parameters import PdoParameters


class PdoIdentifierChangesInUse(Fault, PdoParameters):
    """The identifier of a PDO can be changed while it is valid."""

    violates = ("C-PC-01",)

    def is_valid(self) -> bool:
        return self.checking is False and super().is_valid()

    checking = False

    def check_cob_id(self, new: int) -> None:
        self.checking = True
        try:
            super().check_cob_id(new)
        finally:
            self.checking = False


class PdoIdentifierIsNotChecked(Fault, PdoParameters):
    """A PDO can have a restricted identifier, or one of 29 bits."""

    violates = ("C-PC-02", "C-PC-03", "C-PC-01")

    def check_cob_id(self, new: int) -> None:
        super().check_cob_id(new & 0xC000_0000 | self.can_id() or 0x181)


class PdoTypeIsNotChecked(Fault, PdoParameters):
    """A PDO can have a reserved transmission type."""

    violates = ("C-TP-06", "SYN-06")

    def check_type(self, new: int) -> None:
        pass


class PdoInhibitChangesInUse(Fault, PdoParameters):
    """The inhibit time of a PDO can be changed while it is valid."""

    violates = ("C-TP-10",)

    def check_inhibit(self, new: int) -> None:
        pass


class PdoStartValueIsNotChecked(Fault, PdoParameters):
    """The SYNC start value can be changed while the PDO is valid, and to any number."""

    violates = ("C-TP-11",)

    def check_start(self, new: int) -> None:
        pass


class PdoMappingChangesInUse(Fault, PdoParameters):
    """The number of mapped objects can be changed while the PDO is valid."""

    violates = ("C-PC-05", "C-PC-06")

    def _guard_mapping(self, sub: int, data: bytes) -> None:
        if sub:
            super()._guard_mapping(sub, data)


class PdoMappingEntryChangesInUse(Fault, PdoParameters):
    """An entry of a mapping can be written while the number of entries is not 0."""

    violates = ("C-PC-05",)

    def _guard_mapping(self, sub: int, data: bytes) -> None:
        if sub == 0:
            super()._guard_mapping(sub, data)


class PdoMappingIsNotCounted(Fault, PdoParameters):
    """More objects can be mapped than fit into a PDO."""

    violates = ("C-PC-06",)

    def check_count(self, count: int) -> None:
        pass


class PdoMapsAnything(Fault, PdoParameters):
    """An object that does not exist or cannot be mapped can be written into a mapping."""

    violates = ("C-PC-07", "C-PC-08", "C-PC-06")

    def check_entry(self, value: int) -> None:
        pass

    def check_count(self, count: int) -> None:
        pass


FAULTS: tuple[type[Fault], ...] = (
    PdoIdentifierChangesInUse,
    PdoIdentifierIsNotChecked,
    PdoTypeIsNotChecked,
    PdoInhibitChangesInUse,
    PdoStartValueIsNotChecked,
    PdoMappingChangesInUse,
    PdoMappingEntryChangesInUse,
    PdoMappingIsNotCounted,
    PdoMapsAnything,
)
