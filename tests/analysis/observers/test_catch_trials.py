"""Who missed the obvious, and which place was preferred where there was nothing to prefer."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from analysis.observers.responses import IdenticalPairs, catch_results
from analysis.records import SessionLog
from analysis.report.summary import summarise
from tests.answers import changed, new_answer

Maker = Callable[..., SessionLog]
ANSWERS = [("a", "b"), ("b", "a"), ("a", "b")]


def _with(session: SessionLog, *data: dict[str, object]) -> SessionLog:
    pair = {"first": "a", "second": "b"}
    trials = [new_answer(2, n, "all_pairs", (), 1.0, data={**pair, **one}) for n, one in enumerate(data)]
    return replace(session, answers=(*session.answers, *trials))


def _sessions(make_session: Maker) -> list[SessionLog]:
    def obvious(*right: bool) -> list[dict[str, object]]:
        return [{"catch": "obvious", "correct": correct, "answer": "first"} for correct in right]

    def identical(*answers: str) -> list[dict[str, object]]:
        return [{"catch": "identical", "answer": answer} for answer in answers]

    return [
        _with(make_session("01", names="ab", answers=ANSWERS), *obvious(True, True), *identical("first", "second")),
        _with(make_session("02", names="ab", answers=ANSWERS), *obvious(False, True), *identical("first", "not_sure")),
        _with(make_session("03", names="ab", answers=ANSWERS), {"answer": "no_difference"}),
    ]


def test_they_are_counted_by_observer(make_session: Maker) -> None:
    results = catch_results(_sessions(make_session))
    assert results.obvious == 4
    assert results.missed == {"02": (1, 2)}
    assert results.identical == IdenticalPairs(4, 2, 1)


def test_the_last_attempt_counts(make_session: Maker) -> None:
    session = _sessions(make_session)[1]
    wrong = next(trial for trial in session.answers if trial.details().get("correct") is False)
    again = changed(wrong, attempt=1, data={**wrong.details(), "correct": True})
    assert catch_results([replace(session, answers=(*session.answers, again))]).missed == {}


def test_the_report_says_so(make_session: Maker) -> None:
    summary = summarise(_sessions(make_session))
    notes = " ".join(summary.notes)
    assert "1 of 10 answers prefers neither" in notes
    assert "02 (1 of 2)" in notes
    assert "Of 4 pairs of a stimulus with itself" in notes
    told = summary.to_json()
    assert told["ties"] == 1
    assert told["catch"]["missed"] == {"02": [1, 2]}
    assert summary.trials == 9


def test_without_them_nothing_is_said(make_session: Maker) -> None:
    summary = summarise([make_session("01", names="ab", answers=ANSWERS)])
    assert not [note for note in summary.notes if "atch" in note or "neither" in note or "itself" in note]


def test_practice_does_not_count(make_session: Maker) -> None:
    session = _sessions(make_session)[1]
    practised = replace(session, answers=tuple(changed(trial, kind="practice") for trial in session.answers))
    results = catch_results([practised])
    assert (results.obvious, results.missed, results.identical.trials) == (0, {}, 0)
