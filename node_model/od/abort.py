"""SDO abort codes (CiA 301 4.2.0, 7.2.4.3.17), and the exception that carries one."""

from __future__ import annotations

from enum import IntEnum


class AbortCode(IntEnum):
    """Why an SDO transfer ends early."""

    TOGGLE = 0x0503_0000
    TIME_OUT = 0x0504_0000
    COMMAND = 0x0504_0001
    BLOCK_SIZE = 0x0504_0002
    SEQUENCE = 0x0504_0003
    CRC = 0x0504_0004
    MEMORY = 0x0504_0005
    ACCESS = 0x0601_0000
    WRITE_ONLY = 0x0601_0001
    READ_ONLY = 0x0601_0002
    NO_OBJECT = 0x0602_0000
    NOT_MAPPABLE = 0x0604_0041
    PDO_LENGTH = 0x0604_0042
    INCOMPATIBLE = 0x0604_0043
    INTERNAL = 0x0604_0047
    HARDWARE = 0x0606_0000
    LENGTH = 0x0607_0010
    TOO_LONG = 0x0607_0012
    TOO_SHORT = 0x0607_0013
    NO_SUB_INDEX = 0x0609_0011
    VALUE = 0x0609_0030
    TOO_HIGH = 0x0609_0031
    TOO_LOW = 0x0609_0032
    MAXIMUM_BELOW_MINIMUM = 0x0609_0036
    NO_RESOURCE = 0x060A_0023
    GENERAL = 0x0800_0000
    CANNOT_STORE = 0x0800_0020
    LOCAL_CONTROL = 0x0800_0021
    DEVICE_STATE = 0x0800_0022
    NO_DICTIONARY = 0x0800_0023
    NO_DATA = 0x0800_0024


class SdoAbort(Exception):
    """An access that the device refuses, with the code for the client."""

    def __init__(self, code: AbortCode) -> None:
        super().__init__(f"{code:08X}h {code.name}")
        self.code = code
