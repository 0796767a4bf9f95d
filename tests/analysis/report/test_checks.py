"""Checks that failed are on the page, in JSON and in the terminal, each with its reason and what to do."""

from __future__ import annotations

import html
import io
from collections.abc import Callable
from dataclasses import replace
from itertools import combinations

import pytest
from rich.console import Console

from analysis.records import SessionLog
from analysis.report import Report, describe, report_blocks
from analysis.report.page import render
from documents.pages import print_blocks
from tests.answers import changed, new_answer

Maker = Callable[..., SessionLog]
pytestmark = pytest.mark.usefixtures("undrawn", "unreviewed")


def printed(report: Report) -> str:
    out = io.StringIO()
    print_blocks(report_blocks(report), Console(file=out, width=10_000))
    return out.getvalue()


def test_a_sound_study_fails_nothing(make_session: Maker) -> None:
    answers = [*combinations("abcd", 2)]
    report = describe([make_session(f"{number:02d}", names="abcd", answers=answers) for number in range(1, 6)])
    assert report.failed == ()
    assert "Check failed" not in printed(report)
    assert 'class="failed"' not in render(report)


SCENE = {"what": "pair", "frames": 3, "asked_ms": 50.0, "shown_ms": 50.0}


def test_each_failure_has_a_reason_and_a_remedy_everywhere(make_session: Maker) -> None:
    """Circular preferences, always the first position, a vision test that was not passed, frames that were missed."""
    circle = [("a", "b"), ("b", "c"), ("c", "d"), ("d", "a"), ("a", "c"), ("b", "d")] * 4
    sessions = []
    for number in range(1, 9):
        session = make_session(f"{number:02d}", names="abcd", answers=circle)
        trials = [
            changed(
                trial,
                data={
                    **trial.details(),
                    "first": trial.details()["chosen"],
                    "second": trial.details()["rejected"],
                    "answer": "first",
                },
            )
            for trial in session.trials
        ]
        trials[0] = changed(
            trials[0], data={**trials[0].details(), "timed": [{**SCENE, "missed_frames": missed} for missed in (2, 0)]}
        )
        sessions.append(replace(session, answers=tuple(trials)))
    outcome = {"passed": False, "threshold": 400.0, "estimate": 380.0, "pass_mark": 60.0, "unit": "arcsec"}
    test = new_answer(0, 0, "screening", (), 1.0, "2026-01-01T00:00:00Z", {"test": "stereo_acuity", "outcome": outcome})
    sessions[2] = replace(sessions[2], answers=(test, *sessions[2].answers))
    report = describe(sessions)
    failed = {check.check: check for check in report.failed}
    assert "single scale (p" in failed["One scale fits all answers"].reason
    assert failed["No position is preferred"].reason.startswith("100.0 %")
    vision = failed["Vision test stereo acuity"]
    assert vision.reason.startswith("Not passed by 03 (passed 400 arcsec, pass mark 60 arcsec)")
    assert "--passed stereo_acuity" in vision.remedy
    assert failed["Timed scenes"].reason.startswith("8 of 16 timed scenes missed 16")
    text, page = printed(report), html.unescape(render(report))
    for check in report.failed:
        assert f"Check failed: {check.check}. {check.reason} {check.remedy}\n" in text
        assert check.remedy in page
    assert [check["check"] for check in report.to_json()["failed_checks"]] == list(failed)


def test_observers_with_the_same_flag_are_named_together(make_session: Maker) -> None:
    names = "abcdef"
    fair = [make_session(f"{number:02d}", names=names, answers=[*combinations(names, 2)]) for number in range(1, 7)]
    turned = [
        make_session(code, names=names, answers=[(b, a) for a, b in combinations(names, 2)]) for code in ("x", "y")
    ]
    failed = {check.check: check for check in describe(fair + turned).failed}
    assert "Answers unlike the others." in failed["Observers x and y"].reason
    assert "--without" in failed["Observers x and y"].remedy
