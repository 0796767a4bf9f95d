"""From records to choices, and what must not be mixed or believed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from analysis.errors import ResultsError
from analysis.records import SessionLog
from analysis.series import gather
from analysis.series.choices import Factors, design
from tests.answers import changed, new_answer, refusal

Maker = Callable[..., SessionLog]


def test_every_choice_is_found_with_its_ratings_and_its_way(make_choices: Maker) -> None:
    sessions = [make_choices("02"), make_choices("01", complete=False)]
    choices = gather(sessions)
    assert choices.observers == ("01", "02")
    assert choices.scales == ("similarity", "difficulty")
    assert (choices.design.by, choices.design.across, choices.design.along) == ("series", "paint", "exposure_s")
    assert choices.design.kinds == ("base", "brighter", "grey")
    assert choices.design.paints == ("GM1", "GM2", "HI", "BC", "BR")
    assert choices.design.levels("grey") == (1.3, 1.6, 2.0, 2.5, 3.0, 4.0)
    assert (choices.counts == 1).all()
    assert choices.complete == (0, 1)
    trial = sessions[1].trials[4]
    (one,) = [
        one
        for one in choices.choices
        if one.observer == 0 and choices.design.series[one.series].name == trial.details()["series"]
    ]
    assert one.index == trial.details()["chosen_index"]
    assert one.ratings == trial.details()["ratings"]
    assert one.rating_times_s == trial.details()["rating_times_s"]
    assert one.dwell_s == tuple(trial.details()["dwell_s"])
    assert one.path_length == len(trial.details()["path"])
    assert sum(one.visits) == len(trial.details()["path"])
    assert one.response_time_s == trial.response_time_s


def test_the_last_attempt_counts_and_practice_does_not(make_choices: Maker) -> None:
    session = make_choices("01", paints=("GM1",), kinds=("base",), law=lambda *_: 2)
    other = make_choices("01", paints=("GM1",), kinds=("base",), law=lambda *_: 4)
    again = changed(other.answers[0], attempt=1)
    practice = changed(other.answers[0], kind="practice", trial=1)
    choices = gather([replace(session, answers=(*session.answers, again, practice))])
    assert [one.index for one in choices.choices] == [4]


def test_an_observer_of_two_sessions_chooses_twice(make_choices: Maker) -> None:
    choices = gather(
        [make_choices("01"), make_choices("01", seed="b", session="later", started_utc="2026-02-02T10:00:00Z")]
    )
    assert (choices.counts == 2).all()


@pytest.mark.parametrize(
    ("change", "what"),
    [
        ({"experiment": "gloss"}, "'gloss'"),
        ({"paints": ("GM1",)}, "same stimuli"),
        ({"observer": "01"}, "would count twice"),
    ],
)
def test_what_does_not_belong_together_is_refused(make_choices: Maker, change: dict[str, Any], what: str) -> None:
    with pytest.raises(ResultsError, match=what):
        gather([make_choices("01"), make_choices(**{"observer": "02", **change})])


def test_no_session_and_no_choice_are_refused(make_choices: Maker) -> None:
    with pytest.raises(ResultsError, match="no session"):
        gather([])
    with pytest.raises(ResultsError, match="no choice from a series"):
        gather([make_choices("01", paints=())])


@pytest.mark.parametrize(
    ("damage", "what"),
    [
        ({"stimuli": ["GM1-base-2"]}, "'stimuli'"),
        ({"series": 3}, "'series'"),
        ({"stimuli": ["GM1-base-2", "x"]}, "'x', which is no stimulus"),
        ({"stimuli": ["GM1-base-2"] * 6}, "a picture twice"),
        ({"chosen": "GM1-base-2", "chosen_index": 0}, "picture 0"),
        ({"chosen_index": 6}, "picture 6"),
        ({"chosen_index": True}, "'chosen_index'"),
        ({"ratings": {"similarity": float("nan")}}, "'ratings.similarity'"),
        ({"ratings": {"similarity": "8"}}, "'ratings.similarity'"),
        ({"ratings": [8]}, "'ratings'"),
        ({"rating_times_s": {"similarity": -1.0}}, "'rating_times_s.similarity'"),
        ({"path": [[7, 1.0]]}, "path"),
        ({"path": [[-1, 1.0]]}, "'path.0"),
        ({"dwell_s": [1.0, 2.0]}, "dwell_s"),
        ({"dwell_s": [1.0, 2.0, 1.0, float("nan"), 1.0, 1.0]}, "'dwell_s.3'"),
    ],
)
def test_a_damaged_record_is_refused(make_choices: Maker, tmp_path: Path, damage: dict[str, Any], what: str) -> None:
    session = make_choices("01", paints=("GM1",), kinds=("base",), law=lambda *_: 5)
    assert what in str(refusal(session, tmp_path, **damage))


def test_a_series_that_is_another_elsewhere_is_refused(make_choices: Maker) -> None:
    one = make_choices("01", paints=("GM1",), kinds=("base",), law=lambda *_: 0)
    trial = one.answers[0]
    turned: list[str] = trial.details()["stimuli"][::-1]
    data = {**trial.details(), "stimuli": turned, "chosen": turned[0], "chosen_index": 0}
    other = make_choices("02", paints=("GM1",), kinds=("base",))
    with pytest.raises(ResultsError, match="other pictures as 'GM1-base' than"):
        gather([one, replace(other, answers=(changed(trial, data=data),))])


FACTORS: dict[str, Factors] = {
    "a1": {"gloss": 1, "lamp": "sun", "n": 1},
    "a2": {"gloss": 2, "lamp": "sun", "n": 1},
    "b1": {"gloss": 4, "lamp": "sky", "n": 1},
    "b2": {"gloss": 5, "lamp": "sky", "n": 1},
}


def test_factors_are_found_without_their_usual_names() -> None:
    found = design({"a": ("a1", "a2"), "b": ("b1", "b2")}, FACTORS)
    assert (found.by, found.across, found.along) == ("lamp", None, "gloss")
    assert found.kinds == ("sun", "sky")
    assert found.series[1].levels == (4.0, 5.0)


def test_without_factors_each_series_is_a_kind_and_levels_are_places() -> None:
    found = design({"a": ("a1", "a2"), "b": ("b1", "b2")}, {name: {} for name in FACTORS})
    assert (found.by, found.across, found.along) == (None, None, None)
    assert found.kinds == ("a", "b")
    assert found.series[0].levels == (1.0, 2.0)


@pytest.mark.parametrize(
    ("wish", "what"),
    [({"along": "n"}, "'n' that rises"), ({"by": "gloss"}, "'gloss' that is the same"), ({"across": "x"}, "'x'")],
)
def test_a_factor_that_does_not_do_is_refused(wish: dict[str, str], what: str) -> None:
    with pytest.raises(ResultsError, match=what):
        design({"a": ("a1", "a2"), "b": ("b1", "b2")}, FACTORS, **wish)


def test_other_kinds_of_trials_are_passed_over(make_choices: Maker) -> None:
    session = make_choices("01")
    question = new_answer(2, 0, "questionnaire", (), 1.0, data={"text": "fine"})
    assert len(gather([replace(session, answers=(*session.answers, question))]).choices) == 15
