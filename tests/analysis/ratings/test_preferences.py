"""How often stereo was chosen, by observer."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from analysis.ratings.preferences import preferences
from analysis.records import SessionLog
from analysis.report.summary import summarise
from tests.answers import changed, new_answer, refusal

Maker = Callable[..., SessionLog]
ANSWERS = [("a", "b"), ("b", "a"), ("a", "b")]


def _session(make_session: Maker, observer: str, *views: str) -> SessionLog:
    session = make_session(observer, names="ab", answers=ANSWERS)
    trials = [new_answer(3, n, "preference", (), 1.0, data={"chosen_view": view}) for n, view in enumerate(views)]
    return replace(session, answers=(*session.answers, *trials))


def test_they_are_counted_by_observer(make_session: Maker) -> None:
    sessions = [
        _session(make_session, "01", "stereo", "stereo", "flat"),
        _session(make_session, "02", "flat"),
        _session(make_session, "03", "stereo", "flat"),
        _session(make_session, "04"),
    ]
    counted = preferences(sessions)
    assert counted.by_observer == {"01": (2, 1), "02": (0, 1), "03": (1, 1)}
    assert (counted.stereo, counted.flat) == (3, 3)
    assert (counted.observers_for_stereo, counted.observers_for_flat) == (1, 1)
    summary = summarise(sessions)
    assert summary.to_json()["preferences"]["observers"]["01"] == {"stereo": 2, "flat": 1}
    said = "Of 6 preferences between stereo and flat, 3 are for stereo; of 3 observers, 1 chose stereo more often"
    assert any(note.startswith(said) for note in summary.notes)
    assert summary.trials == 12


def test_the_last_attempt_counts(make_session: Maker) -> None:
    session = _session(make_session, "01", "flat")
    again = changed(session.answers[-1], attempt=1, data={**session.answers[-1].details(), "chosen_view": "stereo"})
    assert preferences([replace(session, answers=(*session.answers, again))]).by_observer == {"01": (1, 0)}


def test_a_damaged_answer_is_refused(make_session: Maker, tmp_path: Path) -> None:
    session = _session(make_session, "01", "flat")
    assert "'chosen_view'" in str(refusal(replace(session, answers=session.answers[-1:]), tmp_path, chosen_view="both"))
