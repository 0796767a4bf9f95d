"""What can be wrong with results."""

from documents import InputError


class ResultsError(InputError):
    """Results are missing, damaged, or do not belong together."""
