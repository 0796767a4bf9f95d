"""Agreement with published scores, on the thesis's own table."""

from collections.abc import Mapping

import pytest

from analysis.comparisons import Answer, Comparisons, from_answers
from analysis.scaling import score
from runner.reports.demo import agreement, expected_classes

Table = Mapping[str, tuple[float, str]]


def test_thirty_observers_give_the_thesis_s_classes_on_average(table_4_4: Table) -> None:
    published = {name: label for name, (_, label) in table_4_4.items()}
    assert expected_classes(table_4_4, 30, 0.045, "none") == published
    assert expected_classes(table_4_4, 30, 0.05, "none") != published


def _counts(table: Table) -> Comparisons:
    names = list(table)
    share = {(i, j): table[i][0] / (table[i][0] + table[j][0]) for i in names for j in names if i != j}
    return from_answers([Answer(i, j, count=30 * p) for (i, j), p in share.items()], names)


def test_expected_counts_agree_wholly(table_4_4: Table) -> None:
    found = agreement(score(_counts(table_4_4), alpha=0.045, adjust="none"), table_4_4)
    assert found is not None
    assert found.correlation == pytest.approx(1.0, abs=1e-9)
    assert (found.pairs_alike, found.pairs) == (45, 45)


def test_swapped_publications_do_not_agree(table_4_4: Table) -> None:
    scores = score(_counts(table_4_4), alpha=0.045, adjust="none")
    swapped = dict(zip(table_4_4, reversed(list(table_4_4.values())), strict=True))
    found = agreement(scores, swapped)
    assert found is not None
    assert found.correlation < 0
    assert found.pairs_alike < 45


def test_an_item_that_was_not_published_gives_no_agreement(table_4_4: Table) -> None:
    scores = score(_counts(table_4_4), alpha=0.045, adjust="none")
    assert agreement(scores, {"8": table_4_4["8"]}) is None
