"""Coefficients that mean nothing are explained, and the test of agreement is a sentence."""

from __future__ import annotations

import csv
import io
import json
from dataclasses import replace

import numpy as np
import pytest

from analysis.observers.concordance import Concordance
from analysis.report.agreement import agreement_words, series_agreement
from analysis.series.agreement import Coefficient, SeriesAgreement, fleiss_kappa, intraclass, with_jackknife
from documents.pages import Paragraph, Shown, Table, csv_text

AGREEMENT = Concordance(0.147, -0.034, 30, 60, 40, 100, None, None, 0.001)
# Eight observers' ratings of five series, drawn without any agreement: ICC(3,k) is −5.8, ICC(2,k) of the second has no
# lower limit.
UNRELATED, UNLIMITED = (np.random.default_rng(seed).normal(size=(8, 5)) for seed in (8, 17))


def shown(coefficients: tuple[Coefficient, ...]) -> tuple[dict[str, tuple[str, str]], list[str], str]:
    """Return value and interval of each coefficient as the page shows them, the sentences, and the CSV."""
    table, *words = series_agreement(SeriesAgreement(8, 5, {"similarity": coefficients}, ()))
    assert isinstance(table, Table)
    cells = {
        str(row[1]): tuple(cell.text if isinstance(cell, Shown) else str(cell) for cell in row[2:4])
        for row in table.rows
    }
    return cells, [block.text for block in words if isinstance(block, Paragraph)], csv_text(table)  # type: ignore[return-value]  # two cells


def test_an_intraclass_correlation_below_zero_is_explained_and_not_printed() -> None:
    found = intraclass(UNRELATED)
    worst = found[3]
    assert worst.value is not None
    assert worst.value < -5
    cells, words, numbers = shown(found)
    assert all(value == "≤ 0" for value, _ in cells.values())
    assert all(interval.startswith("≤ 0 to 0.") for _, interval in cells.values())
    assert words[0].startswith("(1) No agreement: ")
    # The data file has the estimate in full, and the number of the sentence.
    rows = list(csv.DictReader(io.StringIO(numbers)))
    assert float(rows[3]["value"]) == worst.value
    assert float(rows[3]["value_low"]) == worst.low
    assert rows[3]["note"] == "(1)"
    assert "-" not in json.dumps(words)


@pytest.mark.parametrize(
    ("ratings", "why"),
    [
        (np.ones((1, 5)), "at least two observers"),
        (np.ones((5, 1)), "at least two series"),
        (np.array([[1.0, 2, 3], [3, 2, 1]]), "are all equal"),
    ],
)
def test_what_is_not_defined_says_why(ratings: np.ndarray, why: str) -> None:
    cells, words, _ = shown(intraclass(ratings))
    assert all(value == "not defined" for value, _ in cells.values())
    assert why in words[0]


def test_agreement_below_chance_keeps_its_number_and_says_what_it_means() -> None:
    def kappa(rows: np.ndarray) -> float | None:
        return fleiss_kappa((rows.T[:, :, None] == np.arange(2)).sum(axis=1).astype(float))

    opposed = with_jackknife("κ", kappa, np.array([[0.0, 1, 0, 1], [1, 0, 1, 0]]))
    alike = with_jackknife("κ", kappa, np.zeros((4, 4)))
    assert opposed.value == -1.0
    assert "agree less often than by chance" in opposed.reason
    assert alike.value is None
    assert "all choices are the same" in alike.reason
    assert shown((opposed,))[0]["κ"][0] == "-1.0"


def test_sound_coefficients_need_no_note() -> None:
    good = intraclass(np.add.outer(np.arange(4.0), 5 * np.arange(6.0)) + UNRELATED[:4, :1] * 0.1)
    table, *words = series_agreement(SeriesAgreement(4, 6, {"similarity": good}, ()))
    assert isinstance(table, Table)
    assert [column.key for column in table.columns][-1] == "p"
    assert len(words) == 1


def test_the_test_of_agreement_is_a_sentence() -> None:
    assert "agree more" in agreement_words(AGREEMENT)
    assert "(p = 0.001). Kendall's u = 0.147" in agreement_words(AGREEMENT)
    none = agreement_words(replace(AGREEMENT, u=-0.02, strangers_p=0.64))
    assert none.startswith("It was not shown")
    assert "They disagree more often than they agree." in none
    assert "u = −0.020" in none
    assert "p =" not in agreement_words(replace(AGREEMENT, strangers_p=None))
