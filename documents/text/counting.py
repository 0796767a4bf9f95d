"""One counted as one."""

from __future__ import annotations


def counted(count: float, one: str, many: str) -> str:
    """Return "1 answer is" of 1 and "2 answers are" of any other ``count``, where told "answer is", "answers are"."""
    return f"{count:.12g} {one if count == 1 else many}"
