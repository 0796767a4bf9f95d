"""What can go wrong with an instrument, by what can be done about it."""

from __future__ import annotations

from devices.errors import DeviceError


class InstrumentError(DeviceError):
    """An instrument did not do as asked."""


class RangeError(InstrumentError):
    """This patch is too bright, too dark or too unsteady to be read; others may be read."""


class GarbledError(InstrumentError):
    """What came is no answer; asking again may help."""


class TimedOutError(GarbledError):
    """No answer came in time; asking again may help."""


class LostError(InstrumentError):
    """The instrument is gone, or will not work: nothing can be read any more."""
