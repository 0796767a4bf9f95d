"""What can be wrong with a device description."""

from documents import InputError


class DeviceError(InputError):
    """A display, rig or camera file asks for something it does not hold."""


class MeasuringError(DeviceError):
    """A measurement cannot be made, read or resumed as asked."""
