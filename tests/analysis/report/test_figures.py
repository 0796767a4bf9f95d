"""The picture of the scores draws all markers of a shape at once: the same marks as one stimulus after the other."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest
from matplotlib.path import Path

from analysis.records import SessionLog
from analysis.report.figures import class_colours, draw_classes, draw_scores, runs
from analysis.report.summary import Summary, summarise
from documents.pages import INK, drawing, svg_of
from tests.analysis.report.conftest import scores_with

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


def one_by_one(summary: Summary) -> str:
    """Draw each stimulus's interval and markers by themselves, and no words."""
    items = summary.scores.items
    with drawing("scores", WIDTH_IN, 0.75 + 0.31 * len(items)) as (figure, axes):
        for row, (item, (low, high)) in enumerate(zip(items, summary.log10_interval, strict=True)):
            if item.log10_score is None:
                continue
            axes.plot([low, high], [row, row], color=INK, linewidth=1.3, solid_capstyle="butt")
            axes.plot([low, high], [row, row], "|", color=INK, markersize=7, markeredgewidth=1.3)
            colours = class_colours(item.label)
            for part, colour in enumerate(colours):
                turn = 360 / len(colours)
                wedge = Path.wedge(90 + part * turn, 90 + (part + 1) * turn) if len(colours) > 1 else "o"
                axes.scatter([item.log10_score], [row], s=95, marker=wedge, color=colour, linewidths=0)
        # A ring by itself is written in another way: the rings go together here too.
        scores = {row: item.log10_score for row, item in enumerate(items) if item.log10_score is not None}
        at, ring = list(scores.values()), {"facecolors": "none", "edgecolors": INK}
        axes.scatter(at, list(scores), s=95, marker="o", linewidths=1.1, **ring)  # type: ignore[arg-type]  # colours
        axes.set_ylim(len(items) - 0.4, -0.6)
        return svg_of(figure, "one by one")


def marks(svg: str) -> tuple[list[tuple[str, str]], np.ndarray, np.ndarray]:
    """Return outline and paint of each marker, where it stands and where bars end, in units of the outermost ticks."""
    tree = ElementTree.fromstring(svg.replace("<svg ", '<svg xmlns:xlink="http://www.w3.org/1999/xlink" ', 1))
    outlines = {
        str(one.get("id")): re.sub(r"-0(?= )", "0", " ".join(str(one.get("d")).split()))
        for one in tree.iter("path")
        if one.get("id")
    }
    found = []
    for use in tree.iter("use"):
        paint = str(use.get("style"))
        if "stroke-width: 0.8" not in paint:  # a tick
            outline = outlines[str(use.get("{http://www.w3.org/1999/xlink}href"))[1:]]
            found.append((outline, paint, float(str(use.get("x"))), float(str(use.get("y")))))
    bars = [
        [float(number) for number in re.findall(r"-?[\d.]+", str(path.get("d")))]
        for path in tree.iter("path")
        if "stroke-width: 1.3" in str(path.get("style")) and not path.get("id")
    ]
    places = np.array([one[2:] for one in found])
    low, high = places.min(axis=0), places.max(axis=0)
    order = sorted(range(len(found)), key=lambda index: (found[index][:2], tuple(places[index].round(1))))
    ends = (np.sort(np.array(bars).reshape(-1, 2, 2), axis=0) - low) / (high - low)
    return [found[index][:2] for index in order], ((places - low) / (high - low))[order], ends


def test_markers_and_intervals_are_those_drawn_one_by_one(summary: Summary) -> None:
    painted, places, bars = marks(draw_scores(summary, WIDTH_IN).svg)
    expected, expected_places, expected_bars = marks(one_by_one(summary))
    # Four stimuli have a score: two ends each, 1 + 2 + 3 + 2 parts of a disc, and a ring each.
    assert len(painted) == 4 * 2 + (1 + 2 + 3 + 2) + 4
    assert bars.shape == (4, 2, 2)
    assert painted == expected
    # The words take room beside the axes, so that widths differ; SVG holds six decimals of a point.
    np.testing.assert_allclose(places, expected_places, atol=1e-5)
    np.testing.assert_allclose(bars, expected_bars, atol=1e-5)


def test_rows_fall_into_stretches() -> None:
    assert runs([]) == []
    assert runs([3]) == [(3, 3)]
    assert runs([0, 1, 2, 4, 6, 7]) == [(0, 2), (4, 4), (6, 7)]


def test_every_stimulus_and_class_is_named_and_every_membership_has_a_dot(sessions: list[SessionLog]) -> None:
    summary = summarise(sessions)
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
