"""Words for people: counts, nearest spellings."""

from __future__ import annotations

import pytest

from documents.text import counted, did_you_mean, nearest


@pytest.mark.parametrize(
    ("count", "told"),
    [(0, "0 answers are"), (1, "1 answer is"), (1.0, "1 answer is"), (2, "2 answers are"), (1.5, "1.5 answers are")],
)
def test_one_is_one(count: float, told: str) -> None:
    assert counted(count, "answer is", "answers are") == told


def test_large_counts_are_whole() -> None:
    assert counted(36_152_320, "pixel", "pixels") == "36152320 pixels"


def test_the_nearest_spelling_is_named_else_what_there_is() -> None:
    known = ("gamma", "gain")
    assert did_you_mean("gama", known) == "did you mean 'gamma'?"
    assert did_you_mean("x", known) == "expected one of: gamma, gain"
    assert did_you_mean("x", known, "see the manual") == "see the manual"
    assert did_you_mean("x", known, "") == ""
    assert nearest("gama", known, cutoff=0.99) is None


def test_a_very_long_word_takes_no_time() -> None:
    assert nearest("g" * 1_000_000, ("gamma",) * 100) is None
