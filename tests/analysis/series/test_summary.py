"""Everything together: scores by hand, tables, figures, and what changes nothing."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from typing import Any

import pytest

from analysis.errors import ResultsError
from analysis.records import SessionLog
from analysis.report import rating_figure, score_figure
from analysis.report.series import series_sections
from analysis.series import SeriesSummary, gather, summarise_series
from analysis.series.picture_scores import picture_scores, weight_of
from documents.pages import Figure
from tests.answers import altered, changed
from tests.kept import known

Maker = Callable[..., SessionLog]


def test_scores_are_choices_weighted_by_similarity(fifteen: list[SessionLog]) -> None:
    choices = gather(fifteen)
    records = [trial.details() for session in fifteen for trial in session.trials]
    for one in picture_scores(choices, pooled=False, weight=weight_of(choices)):
        mine = [record for record in records if record["series"] == one.series]
        won = [record["ratings"]["similarity"] for record in mine if record["chosen"] == one.stimulus]
        assert (one.chosen, one.of) == (len(won), 15)
        assert one.score is not None
        assert one.score.value == pytest.approx(sum(won) / 15)
        assert one.weighted_share == pytest.approx(sum(won) / sum(r["ratings"]["similarity"] for r in mine))
        assert one.share.value == len(won) / 15
        assert (one.score.low is None) == (not won)
    for one in picture_scores(choices, pooled=True, weight=weight_of(choices)):
        mine = [record for record in records if f"-{one.kind}" in record["series"]]
        won = [r["ratings"]["similarity"] for r in mine if r["chosen"].endswith(f"-{one.level:g}")]
        assert one.score is not None
        assert one.score.value == pytest.approx(sum(won) / 75)


def test_shares_sum_to_one(summary: SeriesSummary) -> None:
    for kind in ("base", "brighter", "grey"):
        mine = [one for one in summary.levels if one.kind == kind]
        assert sum(one.chosen for one in mine) == 75
        assert sum(one.weighted_share or 0 for one in mine) == pytest.approx(1)
        assert all(one.level < other.level for one, other in pairwise(mine))


def test_mean_ratings_are_those_of_the_records(fifteen: list[SessionLog], summary: SeriesSummary) -> None:
    records = [trial.details() for session in fifteen for trial in session.trials]
    for cell in summary.ratings["difficulty"]:
        mine = [
            record["ratings"]["difficulty"]
            for record in records
            if cell.paint in (None, record["series"].split("-")[0])
            and cell.kind in (None, record["series"].split("-")[1])
        ]
        assert cell.mean.value == pytest.approx(sum(mine) / len(mine))
        assert cell.mean.answers == len(mine)
    times = {(cell.kind, cell.paint): cell.mean.value for cell in summary.response_times_s}
    assert times[None, None] == pytest.approx(sum(sum(record["dwell_s"]) for record in records) / 225)
    lengths = {(cell.kind, cell.paint): cell.mean.value for cell in summary.path_lengths}
    assert lengths[None, None] == pytest.approx(sum(len(record["path"]) for record in records) / 225)


def test_the_summary_is_json_that_says_what_was_done(summary: SeriesSummary) -> None:
    written = json.loads(json.dumps(summary.to_json(), allow_nan=False))
    assert len(written["levels"]) == 18
    assert len(written["pictures"]) == 90
    assert written["kind_tests"]["similarity"]["conditions"] == ["base", "brighter", "grey"]
    assert written["paint_tests"]["similarity"]["df"] == 4
    assert len(written["steps"]) == 3
    assert written["agreement"]["choices"][0]["name"] == "Fleiss' κ"
    # The base series was rated higher by one point on a scale that otherwise is even.
    assert written["kind_tests"]["similarity"]["pairs"][0]["p_holm"] < 0.01
    assert summary.sentence.startswith("15 observers, 225 choices")


@pytest.mark.nightly
def test_the_order_of_sessions_and_trials_and_observers_names_change_no_digit(make_choices: Maker) -> None:
    fifteen = [make_choices(f"{number:02d}", paints=("GM1", "HI"), kinds=("base", "grey")) for number in range(4)]
    plain = summarise_series(fifteen).to_json()
    turned = [replace(one, answers=one.answers[::-1]) for one in fifteen[::-1]]
    assert summarise_series(turned).to_json() == plain
    renamed = [
        replace(one, header=altered(one.header, observer=f"x{99 - number}")) for number, one in enumerate(fifteen)
    ]
    other = summarise_series(renamed).to_json()
    for key in ("levels", "pictures", "ratings", "kind_tests", "choice_tests", "level_tests", "neighbours"):
        assert _alike(other[key], plain[key]), key


def _alike(one: Any, other: Any) -> bool:
    """Say whether two values are the same but for rounding."""
    if isinstance(one, dict):
        return one.keys() == other.keys() and all(_alike(one[key], other[key]) for key in one)
    if isinstance(one, list):
        return len(one) == len(other) and all(_alike(a, b) for a, b in zip(one, other, strict=True))
    return bool(one == pytest.approx(other, rel=1e-9) if isinstance(one, float) else one == other)


def test_one_observer_is_described_and_not_tested(make_choices: Maker) -> None:
    summary = summarise_series([make_choices("01")])
    assert summary.kind_tests == {}
    assert summary.choice_tests == ()
    assert all(cell.mean.low is None for cell in summary.ratings["similarity"])
    assert any("With one observer" in note for note in summary.notes)
    json.dumps(summary.to_json(), allow_nan=False)


def test_two_series_of_two_pictures_by_two_observers(make_choices: Maker) -> None:
    sessions = []
    for session in (make_choices("01", paints=("GM1",)), make_choices("02", paints=("GM1",))):
        trials = []
        for trial in session.answers:
            names = trial.details()["stimuli"][:2]
            data = {**trial.details(), "stimuli": names, "chosen": names[1], "chosen_index": 1}
            trials.append(changed(trial, data={**data, "path": [[0, 1.0], [1, 1.0]], "dwell_s": [1.0, 1.0]}))
        sessions.append(replace(session, answers=tuple(trials)))
    summary = summarise_series(sessions)
    assert all("fewer than three" in step.reason for step in summary.steps)
    assert [one.chosen for one in summary.levels] == [0, 2] * 3
    json.dumps(summary.to_json(), allow_nan=False)


def test_without_ratings_there_are_shares_and_a_note(make_choices: Maker) -> None:
    summary = summarise_series([make_choices(f"{n:02d}", rate=lambda *_: {}, paints=("GM1", "HI")) for n in range(4)])
    assert all(one.score is None for one in summary.levels)
    assert summary.weight is None
    assert any(note.startswith("There are no scores") for note in summary.notes)
    captions = [
        block.caption for part in series_sections(summary) for block in part.blocks if isinstance(block, Figure)
    ]
    assert captions
    assert "similarity" not in " ".join(captions)
    assert summary.ratings == {}
    assert score_figure(summary).unit == "share of choices"
    with pytest.raises(ResultsError, match="'similarity'"):
        rating_figure(summary, "similarity")


def test_unfinished_sessions_are_counted_and_left_out_where_they_must_be(make_choices: Maker) -> None:
    whole = [make_choices(f"{number:02d}", paints=("GM1", "HI")) for number in range(5)]
    torn = replace(whole[3], answers=whole[3].answers[:2], complete=False)
    summary = summarise_series([*whole[:3], torn, whole[4]])
    assert len(summary.choices.choices) == 4 * 6 + 2
    assert summary.agreement.observers == 4
    assert summary.kind_tests["similarity"].observers == 4
    assert any(note.startswith("1 of 5 observers did not choose") for note in summary.notes)


def test_figures_have_the_thesis_s_shape_and_their_tables(summary: SeriesSummary) -> None:
    scores = score_figure(summary)
    assert scores.columns == ("exposure (s)", "base", "brighter", "grey")
    assert [row[0] for row in scores.rows] == ["1.3", "1.6", "2", "2.5", "3", "4"]
    ratings = rating_figure(summary, "similarity")
    assert ratings.columns == ("paint", "base", "brighter", "grey")
    assert [row[0] for row in ratings.rows] == ["GM1", "GM2", "HI", "BC", "BR"]
    first = known(ratings.estimates[0][0])
    assert ratings.rows[0][1] == f"{first.value:.2f} ({first.low:.2f} to {first.high:.2f})"
    for figure in (scores, ratings):
        for width_in in (7.6,):
            svg = figure.svg(width_in)
            assert svg.startswith("<svg viewBox=")
            assert svg.count("<svg") == 1
            text = re.findall(r"<text[^>]*>([^<]*)</text>", svg)
            for word in (*figure.bars, *figure.groups):
                assert word in text
            assert figure.svg(width_in) == svg
