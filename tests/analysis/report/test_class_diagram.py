"""The classes as bars: what is drawn is what the classes hold."""

from __future__ import annotations

import re
from collections.abc import Callable

from analysis.records.session_record import SessionLog
from analysis.report import summarise
from analysis.report.class_diagram import classes_svg, runs

Maker = Callable[..., SessionLog]


def test_rows_fall_into_stretches() -> None:
    assert runs([]) == []
    assert runs([3]) == [(3, 3)]
    assert runs([0, 1, 2, 4, 6, 7]) == [(0, 2), (4, 4), (6, 7)]


def test_every_stimulus_and_class_is_named_and_every_membership_has_a_dot(sessions: list[SessionLog]) -> None:
    summary = summarise(sessions)
    assert summary.scores.classes is not None
    svg = classes_svg(summary, 7.6)
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
    assert "%</text>" not in classes_svg(summary, 4.2)
