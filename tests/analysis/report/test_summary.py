"""The summary of sessions: whose level, which intervals, which notes."""

from __future__ import annotations

import io
import json
from collections.abc import Callable
from dataclasses import replace
from itertools import combinations, permutations

import numpy as np
import pytest
from rich.console import Console

from analysis.records import SessionLog
from analysis.report import describe, report_blocks
from analysis.report.page import render
from analysis.report.scores import fit_words
from analysis.report.summary import summarise, wilson_interval
from documents.pages import print_blocks
from tests.answers import changed
from tests.choice import nightly
from tests.kept import known

Maker = Callable[..., SessionLog]
pytestmark = pytest.mark.usefixtures("undrawn", "unreviewed")


def test_level_and_correction_come_from_the_experiment_unless_asked(sessions: list[SessionLog]) -> None:
    sessions = sessions[:2]
    assert (summarise(sessions).alpha, summarise(sessions).adjust) == (0.045, "none")
    asked = summarise(sessions, 0.01, "holm")
    assert (asked.alpha, asked.adjust) == (0.01, "holm")


def test_settings_beside_have_classes_of_their_own_and_do_not_lead(make_session: Maker) -> None:
    other = {"alpha": 0.2, "adjust": "none", "covariance": "model"}
    logs = [make_session(f"{number:02d}", analysis={"beside": other}) for number in range(6)]
    report = describe(logs)
    assert report.pairs is not None
    beside = known(report.pairs.beside)
    assert beside.classes is not None
    assert (report.pairs.alpha, report.pairs.adjust, report.pairs.estimate.covariance) == (0.05, "holm", "shrinkage")
    assert (beside.classes.alpha, beside.classes.adjust, beside.fit.covariance_kind) == (0.2, "none", "model")
    assert [item["class"] for item in report.to_json()["beside"]["items"]] == [item.label for item in beside.items]
    assert "Class by the settings beside" in render(report)
    out = io.StringIO()
    print_blocks(report_blocks(report), Console(file=out, width=200))
    assert "level 0.2" in out.getvalue()
    plain = describe([make_session("01", analysis={})])
    assert plain.to_json()["beside"] is None
    assert "Class by the settings beside" not in render(plain)


@pytest.mark.parametrize(
    "wishes", [{"beside": {"alpha": "small"}}, {"alpha": "small"}, {"alpha": True}, {"adjust": "tukey"}]
)
def test_a_header_with_unknown_wishes_is_refused(make_session: Maker, wishes: dict[str, object]) -> None:
    with pytest.raises(ValueError, match="'analysis"):
        make_session(analysis=wishes)


def test_two_equal_items_have_the_interval_of_a_share(make_session: Maker) -> None:
    """log score_1 = log p, whose error is (1 − p) times that of the logit; at p = ½ with n answers, 1/√n."""
    summary = summarise([make_session(names="ab", answers=[("a", "b"), ("b", "a")] * 50)])
    half_width = 1.959963984540054 / np.sqrt(100) / np.log(10)
    expected = np.log10(0.5) + half_width * np.array([-1, 1])
    assert summary.log10_interval == pytest.approx(np.tile(expected, (2, 1)), abs=1e-12)


def test_wilson_interval_against_a_published_value() -> None:
    """Newcombe 1998, Table I: 81 of 263 gives 0.2553 to 0.3662 by Wilson's method."""
    low, high = wilson_interval(81 / 263, 263)
    assert (round(low, 4), round(high, 4)) == (0.2553, 0.3662)


def test_notes_name_simulation_missing_answers_and_changes(make_session: Maker) -> None:
    sessions = [make_session(f"{number:02d}", simulated=True) for number in range(3)]
    sessions += [make_session("90", simulated=True, complete=False, hashes={"experiment": "other"})]
    notes = " ".join(summarise(sessions).notes)
    for word in ("simulated", "not completed", "The experiment changed"):
        assert word in notes
    mixed = [make_session(f"{number:02d}", simulated=number == 1) for number in range(3)]
    assert "1 of 3 sessions is simulated" in summarise(mixed).notes[0]


@pytest.mark.parametrize(("observers", "pairs", "camps"), [(3, 8, 4), *nightly((6, 3, None))])
def test_a_design_that_finds_nothing_is_in_notes_methods_page_and_json(
    make_session: Maker, observers: int, pairs: int, camps: int | None
) -> None:
    """Six items, half of the pairs by each of three observers, or a fifth by each of six."""
    every = list(combinations("abcdef", 2))
    some = [[every[(pairs * number + place) % 15] for place in range(pairs)] for number in range(observers)]
    sessions = [make_session(f"{n:02d}", names="abcdef", answers=own, analysis={}) for n, own in enumerate(some)]
    report = describe(sessions)
    found = report.to_json()["smallest_difference"]
    assert (found["observers"], found["nats"], found["percent_of_choices"]) == (observers, None, None)
    assert found["found_of_most"] < 0.3
    assert found["one_camp_in"] == camps
    assert len(found["warnings"]) == 1 + bool(camps)
    assert set(found["warnings"]) <= set(report.notes)
    page = render(report)
    assert "no difference between two stimuli" in page
    assert ("two camps" in page) == bool(camps)


@pytest.mark.parametrize("turned", [0, 2], ids=["one camp", "two camps"])
@pytest.mark.parametrize("observers", [5, 6])
def test_five_observers_are_warned_of_camps_and_six_are_not(make_session: Maker, observers: int, turned: int) -> None:
    """Also where all agree: in camps, those are the very studies that report a camp's differences as everybody's."""
    best_first = [pair for pair in combinations("abcd", 2) for _ in range(4)]
    sessions = [
        make_session(f"{n:02d}", names="abcd", answers=[pair[::-1] if n < turned else pair for pair in best_first])
        for n in range(observers)
    ]
    summary = summarise(sessions)
    assert summary.smallest is not None
    assert [note for note in summary.notes if "camp" in note] == [summary.smallest.camps] * (observers == 5)


def test_a_design_that_finds_differences_says_which_and_has_no_note(make_session: Maker) -> None:
    report = describe([make_session(f"{number:02d}", analysis={}) for number in range(20)])
    found = report.to_json()["smallest_difference"]
    assert 0.8 < found["nats"] < 1.6
    assert found["percent_of_choices"] == pytest.approx(100 / (1 + np.exp(-found["nats"])))
    assert found["jnd"] == pytest.approx(found["nats"] / np.log(3))
    assert (found["warnings"], found["one_camp_in"]) == ([], None)
    assert report.notes == ()
    out = io.StringIO()
    print_blocks(report_blocks(report), Console(file=out, width=500))
    assert found["sentence"] in out.getvalue()
    page = render(report)
    assert page.count(found["size"]) >= 3  # in its head, under Diagnostics and in Methods
    assert "two camps" not in page


def test_pairs_chosen_by_the_answers_have_no_smallest_difference(make_session: Maker) -> None:
    sessions = [make_session(f"{number:02d}", analysis={}) for number in range(5)]
    chosen = [replace(s, answers=tuple(changed(t, kind="active_pairs") for t in s.answers)) for s in sessions]
    assert summarise(chosen).smallest is None


def test_complete_sessions_of_people_need_no_note(make_session: Maker) -> None:
    answers = [pair for pair in permutations("abc", 2) for _ in range(20)]
    several = [make_session(f"{number:02d}", names="abc", answers=answers) for number in range(8)]
    assert summarise(several).notes == ()
    (alone,) = summarise(several[:1]).notes
    assert alone.startswith("There is one observer")


def test_an_item_that_always_wins_gets_a_penalised_score_and_a_note(make_session: Maker) -> None:
    summary = summarise([make_session(names="abc", answers=[("a", "b"), ("a", "c"), ("b", "c"), ("c", "b")])])
    assert summary.scores.fit.method == "firth"
    assert summary.one_scale is None
    assert fit_words(summary).startswith("Not tested")
    assert summary.scores.items[0].name == "a"
    assert any("'a': never lost" in note for note in summary.notes)


def test_items_that_share_no_scale_get_no_score(make_session: Maker) -> None:
    summary = summarise([make_session(names="abcd", answers=[("a", "b"), ("b", "a"), ("c", "d"), ("d", "c")])])
    assert all(item.score is None for item in summary.scores.items)
    assert any("no common scale" in note for note in summary.notes)
    assert summary.fit_p is None
    json.dumps(summary.to_json(), allow_nan=False)


def test_the_terminal_table_shows_published_scores_and_treats_markup_as_text(make_session: Maker) -> None:
    names = ("[red]a[/red]", "b")
    answers = [(names[0], "b")] * 3 + [("b", names[0])] * 2
    out = io.StringIO()
    report = describe([make_session(names=names, answers=answers)])
    print_blocks(report_blocks(report, {"b": (0.25, "3+4")}), Console(file=out, width=120))
    assert "[red]a[/red]" in out.getvalue()
    assert "0.2500" in out.getvalue()
    assert "3+4" in out.getvalue()


def test_the_interval_of_the_first_position_is_wide_where_observers_differ(make_session: Maker) -> None:
    """Five observers always choose the first position, five the second: ten answers count, not sixty."""
    circle = [("a", "b"), ("b", "c"), ("c", "a"), ("b", "a"), ("c", "b"), ("a", "c")]
    always = []
    for number in range(10):
        session, trials = make_session(f"{number:02d}", names="abc", answers=circle), []
        for trial in session.answers:
            chosen, rejected = trial.details()["chosen"], trial.details()["rejected"]
            first, second = (chosen, rejected) if number % 2 else (rejected, chosen)
            answer = "first" if number % 2 else "second"
            trials.append(changed(trial, data={**trial.details(), "first": first, "second": second, "answer": answer}))
        always.append(replace(session, answers=tuple(trials)))
    summary = summarise(always)
    assert summary.first_share == pytest.approx(0.5)
    assert summary.first_share_interval is not None
    low, high = summary.first_share_interval
    assert high - low > 0.5
    assert low < 0.25
    assert high > 0.75
