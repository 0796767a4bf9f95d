"""Fits of published tables of paired comparisons against the coefficients that were printed with them.

The counts are facts, typed from the sources named; the R package BradleyTerry2 lists them too.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pytest

from analysis.comparisons import Answer, Comparisons, from_answers
from analysis.scaling import fit_model, score
from runner.reports.demo import agreement, expected_classes

# Kousgaard 1984, eight sound fields heard with a flute: 111 against 110, 101, ... 000, then 110 against 101 and so on,
# each as preferred/neither/other preferred. The digits say which of direct sound, reflection and reverberation were on.
FIELDS = ("111", "110", "101", "100", "011", "010", "001", "000")
FLUTE = (
    "1/1/3 0/1/4 0/1/4 2/2/1 3/1/1 5/0/0 5/0/0 3/0/2 1/2/2 2/1/2 2/1/2 4/1/0 3/1/1 3/0/2 "
    "2/0/3 3/0/2 3/2/0 3/1/1 1/0/4 1/1/3 5/0/0 4/0/1 2/0/3 4/1/0 1/2/2 5/0/0 4/1/0 2/2/1"
)
# His Table 3: half of Davidson's strengths, for 000, 001, ... 111.
TABLE_3 = np.array([-0.581, -1.039, 0.347, 0.205, 0.276, 0.347, 0.311, 0.135])

# Agresti 2002, Section 10.6: the American League, 1987. Home team: wins at home/away wins against each of the others.
TEAMS = ("Milwaukee", "Detroit", "Toronto", "New York", "Boston", "Cleveland", "Baltimore")
BASEBALL = {
    "Milwaukee": "4/3 4/2 4/3 6/1 4/2 6/0",
    "Detroit": "3/3 4/2 4/3 6/0 6/1 4/3",
    "Toronto": "2/5 4/3 2/4 4/3 4/2 6/0",
    "New York": "3/3 5/1 2/5 4/3 4/2 6/1",
    "Boston": "5/1 2/5 3/3 4/2 5/2 6/0",
    "Cleveland": "2/5 3/3 3/4 4/3 4/2 2/4",
    "Baltimore": "2/5 1/5 1/6 2/4 1/6 3/4",
}


def flutes() -> Comparisons:
    pairs = [(one, other) for place, one in enumerate(FIELDS) for other in FIELDS[place + 1 :]]
    answers = []
    for (one, other), counts in zip(pairs, FLUTE.split(), strict=True):
        won, tied, lost = map(float, counts.split("/"))
        answers += [Answer(one, other, won), Answer(other, one, lost), Answer(one, other, tied, tie=True)]
    return from_answers([answer for answer in answers if answer.count], sorted(FIELDS))


def baseball() -> Comparisons:
    answers = []
    for home, row in BASEBALL.items():
        away = [team for team in TEAMS if team != home]
        for guest, counts in zip(away, row.split(), strict=True):
            at_home, abroad = map(float, counts.split("/"))
            answers += [Answer(home, guest, at_home, first=home), Answer(guest, home, abroad, first=home)]
    return from_answers([answer for answer in answers if answer.count], TEAMS)


def test_flutes_have_the_strengths_that_kousgaard_printed() -> None:
    fitted = fit_model(flutes(), "davidson")
    assert fitted.converged
    assert fitted.theta / 2 == pytest.approx(TABLE_3, abs=5.1e-4)


def test_baseball_has_the_strengths_and_the_deviance_that_agresti_printed() -> None:
    fitted = fit_model(baseball(), covariance="model")
    relative = fitted.theta - fitted.theta[-1]
    assert relative == pytest.approx([1.581, 1.436, 1.294, 1.248, 1.108, 0.684, 0], abs=5.1e-4)
    assert fitted.deviance == pytest.approx(15.737, abs=5.1e-4)
    assert fitted.df == 15


def test_baseball_has_the_home_advantage_that_agresti_printed() -> None:
    home = fit_model(baseball(), order_effect=True, covariance="model").parameters[0]
    assert home.estimate == pytest.approx(0.302, abs=5.1e-4)
    assert home.se == pytest.approx(0.131, abs=5.1e-4)


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
