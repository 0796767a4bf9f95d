"""One counted as one."""

from __future__ import annotations

import pytest

from documents.text.counting import counted


@pytest.mark.parametrize(
    ("count", "told"),
    [(0, "0 answers are"), (1, "1 answer is"), (1.0, "1 answer is"), (2, "2 answers are"), (1.5, "1.5 answers are")],
)
def test_one_is_one(count: float, told: str) -> None:
    assert counted(count, "answer is", "answers are") == told


def test_large_counts_are_whole() -> None:
    assert counted(36_152_320, "pixel", "pixels") == "36152320 pixels"
