"""What reviewers ask, on the page and in JSON."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import pytest

from analysis.errors import ResultsError
from analysis.records import SessionLog
from analysis.report.reviewers import review_of, reviewers_section
from analysis.report.summary import summarise
from documents.pages import Facts
from tests.answers import altered
from tests.kept import known

Maker = Callable[..., SessionLog]


def with_margin(sessions: list[SessionLog], margin: str) -> list[SessionLog]:
    own = sessions[0].header.analysis.given() | {"margin": margin}
    return [replace(session, header=altered(session.header, analysis=own)) for session in sessions]


def test_a_sentence_and_folded_tables_for_each(sessions: list[SessionLog]) -> None:
    summary = summarise(with_margin(sessions[:5], "0.5jnd"))
    review = review_of(summary)
    assert set(review) == {"pairs", "equivalence", "transitivity", "residuals", "model_comparison", "multiverse"}
    section = known(reviewers_section([("", summary, review)]))
    facts = section.blocks[0]
    assert isinstance(facts, Facts)
    assert [term for term, _ in facts.rows] == [
        "Equivalence",
        "Transitivity",
        "Badly fitted pairs",
        "Other models",
        "Other analyses",
    ]
    tables = {table.name: table for table in section.tables()}
    assert {"pairs", "residuals", "models", "other_analyses_choices"} <= set(tables)
    assert all(table.folded for table in tables.values())
    assert len(tables["pairs"].rows) == len(tables["residuals"].rows) == 15
    for table in tables.values():
        assert {len(row) for row in table.rows} == {len(table.columns)}


def test_without_a_margin_there_is_no_equivalence_and_one_observer_has_less(make_session: Maker) -> None:
    review = review_of(summarise([make_session()]))
    assert "equivalence" not in review
    assert "model_comparison" not in review
    assert review_of(summarise([make_session(names=("a", "b"), answers=[("a", "b"), ("b", "a")])])).keys() >= {"pairs"}


def test_a_margin_that_is_none(make_session: Maker) -> None:
    sessions = [make_session(names=("a", "b"), answers=[("a", "b"), ("b", "a")])]
    with pytest.raises(ResultsError, match="the margin is 'small'"):
        review_of(summarise(with_margin(sessions, "small")))
    assert reviewers_section([]) is None
