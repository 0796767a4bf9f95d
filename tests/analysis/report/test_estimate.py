"""Which scores, ranks, agreement and conclusions the report shows, and what reviewers ask."""

from __future__ import annotations

import csv
import io
import json
import re
from collections.abc import Callable, Mapping
from dataclasses import replace
from itertools import combinations, pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rich.console import Console
from scipy import stats

from analysis.classes import Conclusion, classify
from analysis.classes.classes import Classes
from analysis.comparisons import from_sessions
from analysis.errors import ResultsError
from analysis.observers.concordance import Concordance
from analysis.records import SessionLog
from analysis.report import Report, describe, report_blocks, write_report
from analysis.report import scores as parts
from analysis.report.agreement import agreement_words, series_agreement
from analysis.report.page import sections_of
from analysis.report.reviewers import review_of, reviewers_section
from analysis.report.scores import MOST_LINES, draw_ranking, draws_ranking, scores_section
from analysis.report.summary import Summary, summarise
from analysis.scaling import CovarianceKind, fit_model, learnt_posterior
from analysis.series.agreement import Coefficient, SeriesAgreement, fleiss_kappa, intraclass, with_jackknife
from documents import counted_work
from documents.pages import Facts, Figure, Paragraph, ShownAs, Table, csv_text, print_blocks
from tests.analysis.report.conftest import scores_with, uses
from tests.answers import altered, changed
from tests.choice import nightly
from tests.kept import known

# Which scores, intervals and standard errors the report shows, held against the rooms that they come from.

Maker = Callable[..., SessionLog]


def many(make_session: Maker, count: int, **header: object) -> list[SessionLog]:
    return [make_session(f"{number:02d}", **header) for number in range(1, count + 1)]


@pytest.mark.parametrize(("observers", "expected"), [(1, "model"), (2, "shrinkage"), *nightly((30, "shrinkage"))])
def test_two_observers_are_enough_for_errors_clustered_by_observer(
    make_session: Maker, observers: int, expected: str
) -> None:
    names = "abc"
    answers = [pair for one, other in combinations(names, 2) for pair in ((one, other), (other, one), (one, other))]
    sessions = [make_session(f"{number:02d}", names=names, answers=answers) for number in range(observers)]
    found = summarise(sessions, covariance="auto").estimate
    assert (found.method, found.covariance) == ("ml", expected)


@pytest.mark.parametrize(
    ("count", "covariance", "classed"),
    nightly((30, "shrinkage", True), (31, "shrinkage", False), (201, "scaled", False)),
)
def test_many_stimuli_have_no_shrinkage_and_their_draws_are_not_classed(
    make_session: Maker, count: int, covariance: str, classed: bool
) -> None:
    names = [f"{number:03d}" for number in range(count)]
    ring = [(one, other) for one, other in zip(names, names[1:] + names[:1], strict=True)]
    answers = ring + [(other, one) for one, other in ring]
    sessions = [make_session(f"{number:02d}", names=names, answers=answers) for number in range(10)]
    found = summarise(sessions).estimate
    assert (found.covariance, found.stability is not None) == (covariance, classed)


def test_classes_by_the_sandwich_are_those_of_its_covariance_and_students_law(make_session: Maker) -> None:
    sessions = many(make_session, 20)
    summary = summarise(sessions, 0.05, "holm", "sandwich")
    comparisons = from_sessions(sessions)
    fitted = fit_model(comparisons, covariance="sandwich")
    classes = classify(fitted.theta, fitted.covariance, alpha=0.05, adjust="holm", df=19)
    place = {name: index for index, name in enumerate(comparisons.items)}
    for item in summary.scores.items:
        assert item.label == classes.labels[place[item.name]]
        assert item.se == pytest.approx(fitted.se[place[item.name]], rel=1e-9)
    by_model = summarise(sessions, 0.05, "holm", "model")
    assert [item.se for item in by_model.scores.items] != [item.se for item in summary.scores.items]
    assert [item.score for item in by_model.scores.items] == [item.score for item in summary.scores.items]


def test_the_experiment_chooses_the_errors_and_the_reader_may_overrule_it(make_session: Maker) -> None:
    sessions = many(make_session, 12, analysis={"alpha": 0.05, "adjust": "holm", "covariance": "model"})
    assert summarise(sessions).estimate.covariance == "model"
    assert summarise(sessions, covariance="sandwich").estimate.covariance == "sandwich"


@pytest.mark.parametrize("covariance", ["shrinkage", *nightly("model", "scaled", "sandwich")])
def test_intervals_follow_by_the_delta_method(make_session: Maker, covariance: CovarianceKind) -> None:
    """The gradient by finite differences, the degrees of freedom of each log score by a contrast written out."""
    sessions = many(make_session, 15)
    summary = summarise(sessions, covariance=covariance)
    fitted, order = summary.scores.fit, list(summary.scores.order)
    step = 1e-6 * np.eye(len(order))

    def log10(theta: np.ndarray) -> np.ndarray:
        return np.asarray((theta - np.log(np.exp(theta).sum())) / np.log(10))

    gradient = np.array([(log10(fitted.theta + up) - log10(fitted.theta - up)) / 2e-6 for up in step]).T
    error = np.sqrt(np.diag(gradient @ fitted.covariance @ gradient.T))
    free = fitted.freedom(gradient * np.log(10))
    quantile = stats.norm.ppf(0.975) if free is None else stats.t.ppf(0.975, free)
    assert summary.log10_interval[:, 0] == pytest.approx((log10(fitted.theta) - quantile * error)[order], abs=1e-6)
    upper = np.minimum(log10(fitted.theta) + quantile * error, 0)
    assert summary.log10_interval[:, 1] == pytest.approx(upper[order], abs=1e-6)


def test_one_observer_has_the_models_intervals_and_no_stability(make_session: Maker) -> None:
    names = "abc"
    answers = [pair for one, other in combinations(names, 2) for pair in ((one, other), (other, one), (one, other))]
    found = summarise([make_session(names=names, answers=answers)], covariance="sandwich").estimate
    assert (found.covariance, found.stability) == ("model", None)


def test_pairs_chosen_by_the_answers_are_scored_under_the_learnt_prior(make_session: Maker) -> None:
    plain = make_session()
    chosen = replace(plain, records=tuple(changed(trial, kind="active_pairs") for trial in plain.answers))
    summary = summarise([chosen])
    expected = learnt_posterior(from_sessions([chosen]).wins)
    order = list(summary.scores.order)
    assert summary.estimate.method == "learnt_prior"
    assert summary.estimate.prior_sd == expected.prior_sd
    centred = expected.theta - expected.theta.mean()
    assert [item.theta for item in summary.scores.items] == pytest.approx(centred[order].tolist())
    scores = [item.score or 0.0 for item in summary.scores.items]
    assert np.diff(scores).max() <= 1e-12  # equal scores stand in the order of their names, whatever their last bit
    assert sum(scores) == pytest.approx(1)
    assert any("chosen by the answers" in note for note in summary.notes)
    assert np.isfinite(summary.log10_interval).all()


def test_intervals_under_the_learnt_prior_are_as_wide_as_observers_differ(make_session: Maker) -> None:
    """Three of six observers always choose the other way; one observer alone has the posterior's own."""
    one, other = (("a", "b"), ("b", "c"), ("a", "c")), (("b", "a"), ("c", "b"), ("c", "a"))
    sessions = [
        make_session(observer=f"{number:02d}", names=("a", "b", "c"), answers=4 * (one if number % 2 else other))
        for number in range(6)
    ]
    chosen = [
        replace(each, records=tuple(changed(trial, kind="active_pairs") for trial in each.answers)) for each in sessions
    ]
    scaled, model = (summarise(chosen, covariance=kind).estimate for kind in ("auto", "model"))
    assert (scaled.covariance, model.covariance) == ("scaled", "model")
    assert scaled.scores.fit.theta.tolist() == model.scores.fit.theta.tolist()
    factor = scaled.scores.fit.covariance / model.scores.fit.covariance
    assert factor.min() == pytest.approx(factor.max())
    assert factor.min() > 2
    wide, narrow = (np.diff(each.log10_interval, axis=1) for each in (scaled, model))
    assert (wide > 1.2 * narrow).all()
    alone = summarise(chosen[:1]).estimate
    assert (alone.covariance, alone.scores.fit.clustered) == ("model", None)


def test_stability_uses_the_same_standard_errors_as_the_classes(make_session: Maker) -> None:
    wishes: tuple[CovarianceKind, ...] = ("scaled", "sandwich")
    for wish in wishes:
        found = summarise(many(make_session, 6), covariance=wish).estimate
        assert known(found.stability).covariance == found.covariance == wish


# The ranking: a triangle for each stimulus, a line for each class from its worst to its best, a dot a member.

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


# Coefficients that mean nothing are explained, and the test of agreement is a sentence.

AGREEMENT = Concordance(0.147, -0.034, 30, 60, 40, 100, None, None, 0.001)
# Eight observers' ratings of five series, drawn without any agreement: ICC(3,k) is −5.8, ICC(2,k) of the second has no
# lower limit.
UNRELATED, UNLIMITED = (np.random.default_rng(seed).normal(size=(8, 5)) for seed in (8, 17))


def shown(coefficients: tuple[Coefficient, ...]) -> tuple[dict[str, tuple[str, str]], list[str], str]:
    """Return value and interval of each coefficient as the page shows them, the sentences, and the CSV."""
    table, *words = series_agreement(SeriesAgreement(8, 5, {"similarity": coefficients}, ()))
    assert isinstance(table, Table)
    cells = {
        str(row[1]): tuple(cell.text if isinstance(cell, ShownAs) else str(cell) for cell in row[2:4])
        for row in table.rows
    }
    return cells, [block.text for block in words if isinstance(block, Paragraph)], csv_text(table)  # type: ignore[return-value]  # two cells


def test_an_intraclass_correlation_below_zero_is_explained_and_not_printed() -> None:
    found = intraclass(UNRELATED)
    worst = found[3]
    assert known(worst.value) < -5
    cells, words, numbers = shown(found)
    assert all(value == "≤ 0" for value, _ in cells.values())
    assert all(interval.startswith("≤ 0 to 0.") for _, interval in cells.values())
    assert words[0].startswith("(1) No agreement: ")
    # The data file has the estimate in full, and the number of the sentence.
    rows = list(csv.DictReader(io.StringIO(numbers)))
    assert float(rows[3]["value"]) == known(worst.value)
    assert float(rows[3]["value_low"]) == worst.low
    assert rows[3]["note"] == "(1)"
    assert "-" not in json.dumps(words)


@pytest.mark.parametrize(
    ("ratings", "why"),
    [
        (np.ones((1, 5)), "at least two observers"),
        (np.ones((5, 1)), "at least two series"),
        (np.array([[1.0, 2, 3], [3, 2, 1]]), "are all equal"),
    ],
)
def test_what_is_not_defined_says_why(ratings: np.ndarray, why: str) -> None:
    cells, words, _ = shown(intraclass(ratings))
    assert all(value == "not defined" for value, _ in cells.values())
    assert why in words[0]


def test_agreement_below_chance_keeps_its_number_and_says_what_it_means() -> None:
    def kappa(rows: np.ndarray) -> float | None:
        return fleiss_kappa((rows.T[:, :, None] == np.arange(2)).sum(axis=1).astype(float))

    opposed = with_jackknife("κ", kappa, np.array([[0.0, 1, 0, 1], [1, 0, 1, 0]]))
    alike = with_jackknife("κ", kappa, np.zeros((4, 4)))
    assert opposed.value == -1.0
    assert "agree less often than by chance" in opposed.reason
    assert alike.value is None
    assert "all choices are the same" in alike.reason
    assert shown((opposed,))[0]["κ"][0] == "-1.0"


def test_sound_coefficients_need_no_note() -> None:
    good = intraclass(np.add.outer(np.arange(4.0), 5 * np.arange(6.0)) + UNRELATED[:4, :1] * 0.1)
    table, *words = series_agreement(SeriesAgreement(4, 6, {"similarity": good}, ()))
    assert isinstance(table, Table)
    assert [column.key for column in table.columns][-1] == "p"
    assert len(words) == 1


def test_the_test_of_agreement_is_a_sentence() -> None:
    assert "agree more" in agreement_words(AGREEMENT)
    assert "(p = 0.001). Kendall's u = 0.147" in agreement_words(AGREEMENT)
    none = agreement_words(replace(AGREEMENT, u=-0.02, strangers_p=0.64))
    assert none.startswith("It was not shown")
    assert "They disagree more often than they agree." in none
    assert "u = −0.020" in none
    assert "p =" not in agreement_words(replace(AGREEMENT, strangers_p=None))


# One line a question on the page, in JSON, in the terminal and in Methods: estimate, interval, verdict, robustness.

Sessions = Callable[..., list[SessionLog]]
VIEWS = tuple(f"{image}-{view}" for image in "AB" for view in ("stereo", "flat"))


@pytest.fixture(scope="module")
def described(make_session: Maker) -> tuple[Report, Mapping[str, int]]:
    """Six observers who prefer stereo in every comparison but a few, of stimuli with two factors."""
    answers = [(a, b) if "stereo" in a or "flat" in b else (b, a) for a in VIEWS for b in VIEWS if a < b]
    sessions = [make_session(f"{number}", names=VIEWS, answers=[*answers, *answers[:-1]]) for number in range(6)]
    odd = [make_session(f"odd{number}", names=VIEWS, answers=[(b, a) for a, b in answers]) for number in range(3)]
    factors = {name: dict(zip(("image", "view"), name.split("-"), strict=True)) for name in VIEWS}
    named = [
        replace(log, header=altered(log.header, stimuli=tuple({"name": n, "factors": factors[n]} for n in VIEWS)))
        for log in (*sessions, *odd)
    ]
    with counted_work() as work:
        return describe(named), work


@pytest.fixture(scope="module")
def report(described: tuple[Report, Mapping[str, int]]) -> Report:
    return described[0]


def test_every_question_has_a_verdict_by_one_p_and_how_robust_it_is(report: Report) -> None:
    found = {one.question: one for one in report.conclusions}
    assert len(found) == len(report.conclusions)
    assert all(
        one.verdict == ("distinguished" if (one.p or 0) <= 0.05 else "not distinguished") for one in found.values()
    )
    assert all(one.stands is not None and one.others.endswith("analyses") for one in found.values())
    best, second = (item.name for item in report.pairs.scores.items[:2]) if report.pairs else ("", "")
    first = report.conclusions[0]
    assert (first.question, first.unit) == (f"{best} over {second}", "JND")
    assert len([one for one in found.values() if one.unit == "JND"]) == len(VIEWS) - 1
    view = next(one for question, one in found.items() if "'view'" in question and one.unit == "nats")
    assert known(view.low) < (view.estimate or 0) < known(view.high)
    assert view.by_observers


@pytest.mark.extensions
def test_analyses_without_an_observer_compute_no_intervals(described: tuple[Report, Mapping[str, int]]) -> None:
    # Of six pairs, of three neighbours, and of two effects in two ways; nine analyses without an observer had 36 more.
    assert described[1]["profile_intervals"] == 6 + 3 + 4


@pytest.mark.usefixtures("undrawn")
def test_page_terminal_json_and_methods_say_the_same(report: Report, tmp_path: Path) -> None:
    headline = report.conclusions[0].sentence
    assert report.headline.endswith(headline)
    assert [line["question"] for line in report.to_json()["conclusions"]] == [
        one.question for one in report.conclusions
    ]
    out = io.StringIO()
    print_blocks(report_blocks(report), Console(file=out, width=300))
    assert "Stands in" in out.getvalue().partition(headline)[2]
    page = write_report(report.sessions, tmp_path / "page.html", csv_folder=tmp_path)
    assert headline in (tmp_path / "page.html").read_text(encoding="utf-8").replace("&#39;", "'")
    lines = (tmp_path / "conclusions.csv").read_text(encoding="utf-8").splitlines()
    assert lines[0].startswith("question,estimate,unit,interval_low,interval_high,verdict,p,")
    assert len(lines) == 1 + min(8, len(page.conclusions))
    methods = " ".join(str(item["answer"]) for item in page.methods.to_json()["items"])
    assert "not distinguished" in methods


def test_kinds_of_series_and_views_have_lines_too(choosing: Sessions, preferring: Sessions) -> None:
    series = describe(choosing()).conclusions
    assert {one.unit for one in series} == {"places", "points"}
    assert all(one.stands is not None for one in series)
    (views,) = describe(preferring(chance=1.0)).conclusions
    assert (views.question, views.verdict, views.stands) == ("stereo over flat", "distinguished", 1.0)
    (open_,) = describe(preferring(chance=0.5)).conclusions
    assert open_.verdict == "not distinguished"


@pytest.mark.extensions
@pytest.mark.usefixtures("undrawn")
def test_main_effects_in_an_interaction_are_averages_and_it_stands_with_their_lines(report: Report) -> None:
    (part,) = report.scale_parts
    found = replace(part.result.interactions[0], p=0.001, p_holm=0.001, observer_p_holm=0.001)
    for interactions, cautions in (((found,), 2), ((), 0)):
        own = replace(part, cautions=replace(part.result, interactions=interactions).cautions)
        section = sections_of(replace(report, scale_parts=(own,)), {}, {})[0]
        assert section.key == "conclusions"
        assert sum("is an average over" in getattr(block, "text", "") for block in section.blocks) == cautions


def test_equivalent_within_a_margin(make_session: Maker) -> None:
    answers = [("a", "b"), ("b", "a")] * 40
    sessions = [make_session(f"{number}", names=("a", "b"), answers=answers) for number in range(6)]
    named = [replace(log, header=altered(log.header, analysis={"margin": "1jnd"})) for log in sessions]
    (one,) = describe(named).conclusions
    assert isinstance(one, Conclusion)
    assert one.verdict in ("equivalent", "not distinguished")
    apart = [
        replace(log, header=altered(log.header, analysis={"margin": "1jnd", "covariance": "model"})) for log in sessions
    ]
    (one,) = describe(apart).conclusions
    assert (one.verdict, one.margin, one.stands) == ("equivalent", "1jnd", None)


# What reviewers ask, on the page and in JSON.


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
