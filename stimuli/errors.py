"""What can be wrong with a picture or a recipe."""

from __future__ import annotations

from pathlib import Path

from documents import Finding, InputError


class StimulusError(InputError):
    """A picture or a recipe is missing, unreadable, or holds what must not reach an eye."""

    @classmethod
    def of(cls, message: str, remedy: str) -> StimulusError:
        """Return the error of one finding that no file causes."""
        return cls(Finding(message, remedy=remedy))

    @classmethod
    def at(cls, path: Path, message: str, remedy: str) -> StimulusError:
        """Return the error of one finding about the file at ``path``."""
        return cls(Finding(message, str(path), remedy=remedy))
