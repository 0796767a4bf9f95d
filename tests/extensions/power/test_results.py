"""How many observers a study needs, in words, on the page, and as a table."""

from __future__ import annotations

import csv
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from markupsafe import escape

from analysis.errors import ResultsError
from documents.pages import page_html
from extensions.power import Needed, assumed_notes, observers_needed, simulate_power, write_csv, write_page
from extensions.power.page import page_of
from extensions.power.results import Power
from extensions.power.tables import COLUMNS
from tests.kept import known
from tests.pages import Page, policy_of
from tests.plans import plan_of

# The answer in words, from chances that are given.

PAIRS = [("item 0", "item 1"), ("item 0", "item 2"), ("item 1", "item 2")]


@pytest.fixture(scope="module")
def results_found() -> Power:
    """Three items at 10, 20 and 30 observers with chances made up."""
    simulated = simulate_power(plan_of(1, 0, -1), [10, 20, 30], replicates=50)
    chances = np.array([[0.5, 0.9, 0.3], [0.81, 0.99, 0.5], [0.9, 1.0, 0.7]])
    return replace(simulated, separates=chances, separates_error=np.full((3, 3), 0.01))


def test_the_fewest_observers_that_are_enough_for_every_pair_named(results_found: Power) -> None:
    answer = observers_needed(results_found, [PAIRS[0], ("item 2", "item 0")])
    assert answer.observers == 20
    assert answer.by_pair.tolist() == [20, 10, 0]
    assert "the hardest, item 0 and item 1" in answer.sentence
    assert "in 81 % of the studies (± 1.0 %)" in answer.sentence
    assert "20 or 30" in known(answer.doubt)


def test_one_pair_is_named_in_the_answer(results_found: Power) -> None:
    answer = observers_needed(results_found, [PAIRS[1]])
    assert answer.sentence.startswith("10 observers, the fewest tried")
    assert answer.doubt is None


def test_too_few_are_called_too_few(results_found: Power) -> None:
    answer = observers_needed(results_found)
    assert answer.observers is None
    assert answer.to_json()["pairs"][2] == {"items": ["item 1", "item 2"], "observers": None}
    assert "are too few" in answer.sentence
    assert "2 of 3 reach it" in answer.sentence


def test_a_number_that_larger_ones_fall_behind_is_not_enough(results_found: Power) -> None:
    luck = replace(results_found, separates=np.array([[0.85, 1, 1], [0.79, 1, 1], [0.9, 1, 1]]))
    assert observers_needed(luck).observers == 30


@pytest.mark.parametrize(
    ("pairs", "target", "finding"),
    [
        ([("item 0", "itm 1")], 0.8, "no item 'itm 1'.*did you mean 'item 1'"),
        ([("item 0", "item 0")], 0.8, "'item 0' is paired with itself"),
        ([], 1.0, "the power is 1"),
    ],
)
def test_wrong_questions_are_refused(
    results_found: Power, pairs: list[tuple[str, str]], target: float, finding: str
) -> None:
    with pytest.raises(ResultsError, match=finding):
        observers_needed(results_found, pairs, target)


def test_equal_items_need_a_pair_named() -> None:
    alike = simulate_power(plan_of(0, 0), [5], replicates=20)
    with pytest.raises(ResultsError, match="no two items should differ"):
        observers_needed(alike)
    assert observers_needed(alike, [PAIRS[0]]).observers is None


# The page and the table of numbers: whole, escaped, and what was simulated.

NASTY = '<script>alert("1")</script>'


@pytest.fixture(scope="module")
def answer() -> Needed:
    """Three items, one with a name that would be dangerous."""
    plan = replace(plan_of(1, 0, -1), items=(NASTY, "$x_1$ & co", "=1+1"))
    return observers_needed(simulate_power(plan, [5, 10, 20], replicates=60))


def test_the_page_stands_alone_and_holds_every_number(answer: Needed) -> None:
    page = page_html(page_of(answer, NASTY, ["A note with <b>."]))
    seen = Page(page)
    links = [
        value or "" for _, own in seen.tags for name, value in own.items() if name in ("src", "href", "xlink:href")
    ]
    assert policy_of(page)
    assert [tag for tag, _ in seen.tags].count("svg") == 3
    assert not {"script", "b"} & seen.names
    assert all(link.startswith(("#", "data:")) for link in links)
    assert not re.search(r"nan|inf\b|None", re.sub(r"<svg.*?</svg>", "", page, flags=re.DOTALL))
    assert str(escape(answer.sentence)) in page
    for chance, error in zip(answer.power.alike, answer.power.alike_error, strict=True):
        assert f"{100 * chance:.1f} ± {100 * error:.1f} %" in page
    for facts in ("60, seed 2016", "level 0.05, Holm", "95 %, estimate ± quantile × standard error"):
        assert facts in page


@pytest.mark.usefixtures("undrawn")
def test_the_page_is_written_whole(answer: Needed, tmp_path: Path) -> None:
    page = tmp_path / "new" / "power.html"
    write_page(answer, page, "small")
    assert page.read_text(encoding="utf-8") == page_html(page_of(answer, "small"))
    assert list(page.parent.iterdir()) == [page]


def test_the_table_holds_every_number_in_full(answer: Needed, tmp_path: Path) -> None:
    file = tmp_path / "power.csv"
    write_csv(answer, file)
    with file.open(encoding="utf-8", newline="") as opened:
        rows = list(csv.DictReader(opened))
    assert tuple(rows[0]) == COLUMNS
    assert len(rows) == 3 * (2 + 3 + 3)
    (row,) = [row for row in rows if (row["observers"], row["item"], row["other"]) == ("10", NASTY, "=1+1")]
    assert float(row["value"]) == answer.power.separates[1, 1]
    assert float(row["standard_error"]) == answer.power.separates_error[1, 1]


def test_observers_who_differ_call_for_errors_by_observer() -> None:
    assert assumed_notes(plan_of(0, 1, covariance="model")) == []
    assert "--covariance auto" in assumed_notes(plan_of(0, 1, observer_sd=0.5, covariance="model"))[0]
    assert assumed_notes(plan_of(0, 1, observer_sd=0.5)) == []
