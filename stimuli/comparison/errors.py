"""What can be wrong with pictures that are to be compared."""

from documents import InputError


class PictureError(InputError):
    """Pictures cannot be compared, or regions are none of theirs."""
