"""What can be wrong with results."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

from documents import InputError


class ResultsError(InputError):
    """Results are missing, damaged, or do not belong together."""


@contextmanager
def naming(where: str) -> Iterator[None]:
    """Begin the messages of what goes wrong with ``where``, such as the group that was scored."""
    try:
        yield
    except ResultsError as error:
        findings = [replace(finding, message=f"{where}: {finding.message}") for finding in error.findings]
        raise ResultsError(findings) from None
