"""What can go wrong with the bench, as opposed to with the device.

A `BenchError` is never held against the device: it becomes an ERROR of ours and exit
status 11. Each message names the thing, its value, and the next step for the user.
"""

from __future__ import annotations


class BenchError(Exception):
    """The bench, its bus or one of its drivers is unavailable or misbehaves."""


class BusUnavailable(BenchError):
    """The CAN interface is missing, down, or held by another run."""


class NotAcknowledged(BenchError):
    """A frame of ours did not get onto the bus: nobody acknowledges, or the bus is full."""


class FrameNotCarried(BenchError):
    """An adapter of this type has no way to send such a frame, e.g. one with a DLC above 8."""


class ControlError(BenchError):
    """The control peer closed, stalled, lied or refused."""


class OperatorAbsent(BenchError):
    """A question to the operator was not answered (time-out, cancel or end of input)."""


class ConfigError(Exception):
    """A profile, bench file or option is wrong.

    The text holds *all* errors found, one a line, each with file, path and remedy.
    """
