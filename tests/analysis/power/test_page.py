"""The page and the table of numbers: whole, escaped, and what was simulated."""

from __future__ import annotations

import csv
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from markupsafe import escape

from analysis.power import Needed, Plan, assumed_notes, observers_needed, simulate_power, write_csv, write_page
from analysis.power.page import page_of
from analysis.power.tables import COLUMNS
from documents.pages import page_html
from tests.pages import Page, policy_of

MakePlan = Callable[..., Plan]
NASTY = '<script>alert("1")</script>'


@pytest.fixture(scope="module")
def answer(plan_of: MakePlan) -> Needed:
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


def test_observers_who_differ_call_for_errors_by_observer(plan_of: MakePlan) -> None:
    assert assumed_notes(plan_of(0, 1, covariance="model")) == []
    assert "--covariance auto" in assumed_notes(plan_of(0, 1, observer_sd=0.5, covariance="model"))[0]
    assert assumed_notes(plan_of(0, 1, observer_sd=0.5)) == []
