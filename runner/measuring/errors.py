"""What can go wrong with measuring a display."""

from documents import InputError


class MeasuringError(InputError):
    """A measurement cannot be made or resumed as asked."""
