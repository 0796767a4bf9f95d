"""What can go wrong between a scene and the screen."""

from documents import InputError, WorkError


class PresentationError(InputError):
    """Something was asked of the screen that it, or this machine, cannot show as asked."""


class GraphicsError(WorkError):
    """The graphics driver failed at something that it should have been able to do."""
