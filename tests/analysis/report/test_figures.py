"""The pictures of the scores and the classes: every mark where it belongs, every name."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from analysis.records import SessionLog
from analysis.report import Report
from analysis.report.figures import draw_classes, draw_scores, runs
from analysis.report.summary import Summary, summarise
from documents.figures import class_colours
from tests.analysis.report.conftest import scores_with, uses
from tests.kept import known

Maker = Callable[..., SessionLog]
WIDTH_IN = 7.6
LABELS = ("1", "1+2", "2+3+4", None, "4+12")


@pytest.fixture
def summary(make_session: Maker) -> Summary:
    """Five stimuli in one, two, three and no classes; no score for the fourth."""
    found = summarise([make_session(f"{number:02d}", names="abcde") for number in range(12)])
    items = [replace(item, label=label) for item, label in zip(found.scores.items, LABELS, strict=True)]
    items[3] = replace(items[3], log10_score=None)
    return replace(found, scores=scores_with(found.scores, items=tuple(items)))


def test_each_score_has_its_interval_a_ring_and_a_part_of_its_marker_for_each_class(summary: Summary) -> None:
    rows: dict[float, list[tuple[str, float]]] = {}
    for paint, x, y in uses(draw_scores(summary, WIDTH_IN).svg):
        if "stroke-width: 0.8" not in paint:  # a tick
            rows.setdefault(y, []).append((paint, x))
    scored = [one for one in zip(summary.scores.items, summary.log10_interval, strict=True) if one[0].log10_score]
    values, places = [], []
    for (_, marks), (item, (low, high)) in zip(sorted(rows.items()), scored, strict=True):
        assert sorted(paint for paint, _ in marks if "stroke" not in paint) == sorted(
            f"fill: {colour}" for colour in class_colours(item.label)
        )
        ends = sorted(x for paint, x in marks if "stroke-width: 1.3" in paint)
        (centre,) = {x for paint, x in marks if "stroke-width: 1.3" not in paint}
        assert sum("fill: none" in paint for paint, _ in marks) == 1
        values += [low, item.log10_score, high]
        places += [ends[0], centre, ends[1]]
    slope, start = np.polyfit(values, places, 1)
    np.testing.assert_allclose(places, slope * np.array(values) + start, atol=1e-3)


def test_rows_fall_into_stretches() -> None:
    assert runs([]) == []
    assert runs([3]) == [(3, 3)]
    assert runs([0, 1, 2, 4, 6, 7]) == [(0, 2), (4, 4), (6, 7)]


def test_every_stimulus_and_class_is_named_and_every_membership_has_a_dot(described: Report) -> None:
    summary = known(described.pairs)
    assert summary.scores.classes is not None
    svg = draw_classes(summary, 7.6).svg
    words = re.findall(r"<text[^>]*>([^<]*)</text>", svg)
    for item in summary.scores.items:
        assert item.name in words
    members = summary.scores.classes.members
    assert [str(number + 1) for number in range(len(members))] == [word for word in words if word.isdigit()]
    assert svg.count("fill: #ffffff; stroke: #23282d") == sum(len(group) for group in members)
    shares = [word for word in words if word.endswith("%")]
    assert len(shares) == len(summary.scores.items) - 1


def test_without_draws_there_are_no_shares(make_session: Maker) -> None:
    summary = summarise([make_session(names="ab", answers=[("a", "b"), ("b", "a")])])
    assert "%</text>" not in draw_classes(summary, 4.2).svg
