"""The ranking: a triangle for each stimulus, a line for each class from its worst to its best, a dot a member."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from analysis.classes.classes import Classes
from analysis.records import SessionLog
from analysis.report import scores as parts
from analysis.report.scores import MOST_LINES, draw_ranking, draws_ranking, scores_section
from analysis.report.summary import Summary, summarise
from documents.pages import Figure
from tests.analysis.report.conftest import scores_with, uses

Maker = Callable[..., SessionLog]
# Indices of items; the second class passes by one that is no member.
MEMBERS = ((0, 1), (1, 3), (2,), (4,))


@pytest.fixture
def summary(make_session: Maker) -> Summary:
    """Five stimuli at even steps, best last, in classes of our own."""
    found = summarise([make_session(f"{number:02d}", names="abcde") for number in range(6)])
    order = (4, 3, 2, 1, 0)
    items = tuple(
        replace(item, name=name, log10_score=-0.5 * row)
        for row, (item, name) in enumerate(zip(found.scores.items, "edcba", strict=True))
    )
    classes = Classes(("1",) * 5, MEMBERS, np.zeros(10), np.ones(10), 0.05, "holm", 0)
    return replace(found, scores=scores_with(found.scores, items=items, order=order, classes=classes))


def test_triangles_stand_at_scores_and_lines_join_what_does_not_differ(summary: Summary) -> None:
    svg = draw_ranking(summary, 7.6).svg
    dots = [(x, y) for paint, x, y in uses(svg) if "fill: #ffffff" in paint]
    triangles = sorted(
        (y, x) for paint, x, y in uses(svg) if "fill: #ffffff" not in paint and "stroke-width" not in paint
    )
    assert len(triangles) == 5
    assert len(dots) == sum(map(len, MEMBERS))
    at = [x for _, x in triangles]  # best at the top, so first
    steps = np.array([one - other for one, other in pairwise(at)])
    np.testing.assert_allclose(steps, steps[0], atol=1e-4)
    assert steps[0] > 0
    lines: dict[float, list[float]] = {}
    for x, y in dots:
        lines.setdefault(round(y, 2), []).append(x)
    assert min(lines) > max(y for y, _ in triangles)
    for (_, found), members in zip(sorted(lines.items()), MEMBERS, strict=True):
        np.testing.assert_allclose(sorted(found), sorted(at[4 - item] for item in members), atol=1e-4)
    words = re.findall(r"<text[^>]*>([^<]*)</text>", svg)
    assert [word for word in words if word in "abcde"] == list("edcba")
    assert [word for word in words if word.startswith("class ")] == [f"class {n}" for n in (1, 2, 3, 4)]


def figures(summary: Summary) -> list[str]:
    """Return the names of the figures of the scores."""
    return [block.name for block in scores_section(summary, {}).blocks if isinstance(block, Figure)]


@pytest.mark.usefixtures("undrawn")
def test_it_stands_in_the_section_of_scores_and_is_left_out_where_it_would_mislead(
    summary: Summary, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert figures(summary) == ["scores", "ranking"]
    without: Any = scores_with(summary.scores, classes=None)
    unscored = replace(summary.scores.items[2], log10_score=None)
    items = (*summary.scores.items[:2], unscored, *summary.scores.items[3:])
    for scores in (without, scores_with(summary.scores, items=items)):
        assert not draws_ranking(replace(summary, scores=scores))
        assert figures(replace(summary, scores=scores)) == ["scores"]
    assert len(MEMBERS) <= MOST_LINES
    monkeypatch.setattr(parts, "MOST_LINES", 3)
    assert not draws_ranking(summary)
