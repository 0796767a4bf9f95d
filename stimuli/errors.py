"""What can be wrong with a picture or a recipe."""

from documents import InputError


class StimulusError(InputError):
    """A picture or a recipe is missing, unreadable, or holds what must not reach an eye."""
