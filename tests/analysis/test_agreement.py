"""Agreement with published scores, on the thesis's own table."""

import pytest

from analysis.agreement import agreement, expected_classes
from analysis.comparisons import Answer, Comparisons, from_answers
from analysis.scores import score

# V. Medina (2016), Table 4.4.
TABLE = {
    "8": (0.0296, "5"),
    "2": (0.0432, "4"),
    "7": (0.0543, "3+4"),
    "1": (0.0718, "3"),
    "5": (0.0740, "3"),
    "9": (0.0751, "3"),
    "3": (0.0762, "3"),
    "10": (0.1149, "2"),
    "4": (0.2036, "1"),
    "6": (0.2574, "1"),
}


def test_thirty_observers_give_the_thesis_s_classes_on_average() -> None:
    published = {name: label for name, (_, label) in TABLE.items()}
    assert expected_classes(TABLE, 30, 0.045, "none") == published
    assert expected_classes(TABLE, 30, 0.05, "none") != published


def _counts(names: list[str]) -> Comparisons:
    share = {(i, j): TABLE[i][0] / (TABLE[i][0] + TABLE[j][0]) for i in names for j in names if i != j}
    return from_answers([Answer(i, j, count=30 * p) for (i, j), p in share.items()], names)


def test_expected_counts_agree_wholly() -> None:
    found = agreement(score(_counts(list(TABLE)), alpha=0.045, adjust="none"), TABLE)
    assert found is not None
    assert found.correlation == pytest.approx(1.0, abs=1e-9)
    assert (found.pairs_alike, found.pairs) == (45, 45)


def test_swapped_publications_do_not_agree() -> None:
    scores = score(_counts(list(TABLE)), alpha=0.045, adjust="none")
    swapped = dict(zip(TABLE, reversed(TABLE.values()), strict=True))
    found = agreement(scores, swapped)
    assert found is not None
    assert found.correlation < 0
    assert found.pairs_alike < 45


def test_an_item_that_was_not_published_gives_no_agreement() -> None:
    scores = score(_counts(list(TABLE)), alpha=0.045, adjust="none")
    assert agreement(scores, {"8": TABLE["8"]}) is None
