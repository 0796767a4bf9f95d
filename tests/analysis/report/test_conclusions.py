"""One line a question on the page, in JSON, in the terminal and in Methods: estimate, interval, verdict, robustness."""

from __future__ import annotations

import io
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

import pytest
from rich.console import Console

from analysis.classes import Conclusion
from analysis.records import SessionLog
from analysis.report import Report, describe, report_blocks, write_report
from analysis.report.page import sections_of
from documents import counted_work
from documents.pages import print_blocks
from tests.answers import altered

Maker = Callable[..., SessionLog]
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
    assert view.low is not None
    assert view.high is not None
    assert view.low < (view.estimate or 0) < view.high
    assert view.by_observers


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


@pytest.mark.usefixtures("undrawn")
def test_main_effects_in_an_interaction_are_averages_and_it_stands_with_their_lines(report: Report) -> None:
    assert report.factors is not None
    found = replace(report.factors.interactions[0], p=0.001, p_holm=0.001, observer_p_holm=0.001)
    crossed = replace(report, factors=replace(report.factors, interactions=(found,)))
    plain = replace(report, factors=replace(report.factors, interactions=()))
    for one, cautions in ((crossed, 2), (plain, 0)):
        section = sections_of(one, {}, {})[0]
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
