"""The summary of sessions, the Methods paragraph, checks that failed, and what the eyes saw."""

from __future__ import annotations

import html
import io
import json
import re
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from itertools import combinations, permutations
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rich.console import Console

from analysis.observers import Filter
from analysis.records import Change, Resumption, Seen, SessionLog, what_eyes_saw
from analysis.report import Report, describe, fixed, listed, report_blocks, wilson_interval
from analysis.report.page import render, sections_of
from analysis.report.references import REFERENCES
from analysis.report.scores import fit_words
from analysis.report.summary import summarise
from analysis.report.words import chance, counted
from documents.pages import Facts, Numbered, Paragraph, Section, print_blocks
from tests.analysis.conftest import clip_cost
from tests.answers import altered, changed, new_answer
from tests.choice import nightly
from tests.kept import known

pytestmark = pytest.mark.usefixtures("undrawn", "unreviewed")


# The summary of sessions: whose level, which intervals, which notes.

Maker = Callable[..., SessionLog]


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
    assert [note for note in summary.notes if "camp" in note] == [known(summary.smallest).camps] * (observers == 5)


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
    chosen = [replace(s, records=tuple(changed(t, kind="active_pairs") for t in s.answers)) for s in sessions]
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
        always.append(replace(session, records=tuple(trials)))
    summary = summarise(always)
    assert summary.first_share == pytest.approx(0.5)
    low, high = known(summary.first_share_interval)
    assert high - low > 0.5
    assert low < 0.25
    assert high > 0.75


# The Methods paragraph says what was done, and cites only works that it lists.

Sessions = Callable[..., list[SessionLog]]
DOCS = Path(__file__).parents[3] / "docs"


def methods(sessions: list[SessionLog], rule: Filter | None = None, **wishes: object) -> tuple[str, tuple[str, ...]]:
    """Return the paragraphs as one text, and the works."""
    return methods_of(describe(sessions, rule=rule, **wishes))  # type: ignore[arg-type]  # levels and corrections


def methods_of(report: Report) -> tuple[str, tuple[str, ...]]:
    """Return the same of a report."""
    (section,) = (one for one in sections_of(report, {}, {}) if one.key == "methods")
    text = " ".join(block.text for block in section.blocks if isinstance(block, Paragraph))
    works = next((block.items for block in section.blocks if isinstance(block, Numbered)), ())
    return text, works


@pytest.mark.nightly
def test_every_number_in_brackets_is_a_work_and_every_work_is_cited(
    described: Report, preferring: Sessions, choosing: Sessions, rating: Sessions
) -> None:
    for some in (described, *map(describe, (preferring(2), choosing(2), rating(2)))):
        text, works = methods_of(some)
        cited = [int(number) for group in re.findall(r"\[([\d, ]+)\]", text) for number in group.split(",")]
        assert list(dict.fromkeys(cited)) == list(range(1, len(works) + 1))


@pytest.mark.promise("one-place")
def test_level_correction_errors_and_draws_are_those_that_were_used(sessions: list[SessionLog]) -> None:
    text, works = methods(sessions[:5], alpha=0.01, adjust="holm")
    errors = ("clustered by observer", "degrees of freedom", "delta method")
    for words in ("level 0.01", "Holm's correction", *errors):
        assert words in text
    assert any("S. Holm" in work for work in works)
    text, works = methods(sessions[:5], alpha=0.2, adjust="bh", covariance="model")
    assert "level 0.2" in text
    assert "treats all answers as independent" in text
    assert not any("S. Holm" in work for work in works)


def test_display_question_and_observers_are_told(make_session: Maker) -> None:
    display = {
        "file": "screen.yaml",
        "mode": "quad-buffered",
        "characterised_as": "quad-buffered",
        "source": "a spectroradiometer",
        "panel": {"resolution_px": [1920, 1080], "refresh_hz": 120.0, "pixel_pitch_mm": 0.25, "bits": 8},
        "white_XYZ_cd_m2": {"left": [10.0, 11.0, 12.0], "right": [10.0, 11.0, 12.0]},
        "ambient_XYZ_cd_m2": {"left": [0.2, 0.25, 0.2], "right": [0.2, 0.25, 0.2]},
        "distance_mm": 700.0,
        "glasses": "shutter",
        "crosstalk_cancelled": True,
        "monitor_settings": {
            "measured": {"brightness_percent": 35.0},
            "used": {"gains_percent.red": 96.0, "local_dimming": False},
        },
    }
    timing = {"swap_intervals": {"median_ms": 8.33, "p99_ms": 8.4, "longest_ms": 16.7, "missed": 1, "frames": 120}}
    presentation = {"renderer": "a card", "timing": {**timing, "verification": "verified with a photodiode"}}
    sessions = [
        make_session(f"{number:02d}", display=display, presentation=presentation, simulated=number == 1)
        for number in range(1, 4)
    ]
    text, _ = methods(sessions, Filter(without=("02",), with_simulated=True))
    for words in (
        "2 observers took part in 2 sessions; 1 of them were simulated",
        "Left out: 02 (by hand).",
        "screen.yaml (1920 × 1080 pixels, 0.25 mm pitch, 120 Hz, 8 bits)",
        "stereo mode quad-buffered, through shutter glasses.",
        "The viewing distance was 700 mm.",
        "(a spectroradiometer), with a white of 11 cd/m² at the eye.",
        "The room's light on the screen had 0.25 cd/m², part of the white.",
        "Crosstalk between the eyes was cancelled.",
        "The monitor was set to gains red 96 %, local dimming off. When it was measured it was set to brightness 35 %.",
        "median 8.33 ms, longest 16.70 ms; 2 of 242 refreshes passed without a new frame",
        "verified with a photodiode",
        "Which image is closer to the reference plate?",
        "15 comparisons (median), each pair once",
        "seed 7",
        "cyclopean 0.1.0",
    ):
        assert words in text


def test_what_the_experiment_set_of_its_screens_is_stated(sessions: list[SessionLog]) -> None:
    sessions = sessions[:1]
    assert "The screens" not in methods(sessions)[0]
    style = {"background": {"share_of_white": 0.2, "xy": [0.31, 0.33]}, "text": {"height_arcmin": 24}}
    interface = {"language": "de", "style": style}
    text, _ = methods([replace(log, header=altered(log.header, interface=interface)) for log in sessions])
    assert "The screens were in German." in text
    assert "20 % of the display's white" in text
    assert "letters of 24 minutes of arc" in text


def test_a_penalised_fit_and_a_learnt_prior_are_told(make_session: Maker) -> None:
    text, works = methods([make_session(names="abc", answers=[("a", "b"), ("a", "c"), ("b", "c"), ("c", "b")])])
    assert "Firth's penalised likelihood" in text
    assert any("D. Firth" in work for work in works)
    plain = make_session()
    chosen = replace(plain, records=tuple(changed(trial, kind="active_pairs") for trial in plain.answers))
    text, _ = methods([chosen])
    assert "estimated from the answers" in text
    assert "quantiles of that posterior" in text


def test_works_are_worded_as_in_the_documentation() -> None:
    lines = (DOCS / "references.md").read_text(encoding="utf-8").splitlines()
    for key, work in REFERENCES.items():
        assert f"| {key} | {work} |" in [line.replace("*", "") for line in lines]


def test_the_record_names_hashes_and_versions(described: Report) -> None:
    (section,) = (one for one in sections_of(described, {}, {}) if one.key == "methods")
    record = dict(next(block for block in section.blocks if isinstance(block, Facts)).rows)
    assert record["SHA-256 of the experiment"] == "ab" * 32
    assert record["Software"] == "cyclopean 0.1.0"


@pytest.mark.parametrize(
    ("value", "digits", "words"),
    [(None, 2, "–"), (float("nan"), 2, "–"), (-0.001, 2, "0.00"), (-1.5, 1, "−1.5"), (float("-inf"), 1, "−∞")],
)
def test_numbers_as_words(value: float | None, digits: int, words: str) -> None:
    assert fixed(value, digits) == words


def test_words() -> None:
    assert [counted(1, "answer"), counted(2000, "answer"), counted(2.5, "choice"), counted(1234567, "trial")] == [
        "1 answer",
        "2,000 answers",
        "2.5 choices",
        "1,234,567 trials",
    ]
    assert [listed([]), listed(["a"]), listed(["a", "b"]), listed(["a", "b", "c"])] == [
        "",
        "a",
        "a and b",
        "a, b and c",
    ]
    assert [chance(0.0004), chance(0.5), chance(None)] == ["< 0.001", "0.500", "–"]


# Checks that failed are on the page, in JSON and in the terminal, each with its reason and what to do.


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
        sessions.append(replace(session, records=tuple(trials)))
    outcome = {"passed": False, "threshold": 400.0, "estimate": 380.0, "pass_mark": 60.0, "unit": "arcsec"}
    test = new_answer(0, 0, "screening", (), 1.0, "2026-01-01T00:00:00Z", {"test": "stereo_acuity", "outcome": outcome})
    sessions[2] = replace(sessions[2], records=(test, *sessions[2].answers))
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


# What the eyes saw, from logs of all ages: what they do not say is not recorded, and nothing false is said.

ANAGLYPH = {"mode": "anaglyph-red-cyan"}


@pytest.fixture
def make_small(make_session: Maker) -> Maker:
    """As elsewhere, with two stimuli and two answers: what is said of screens does not depend on them."""
    return partial(make_session, names="ab", answers=[("a", "b"), ("b", "a")])


def _text(report: Report, key: str) -> str:
    (section,) = (section for section in sections_of(report, {}, _pictures(report)) if section.key == key)
    return _words(section)


def _words(section: Section) -> str:
    words = [block.text for block in section.blocks if isinstance(block, Paragraph)]
    for block in section.blocks:
        if isinstance(block, Facts) and not block.folded:
            words += [f"{term}: {value}" for term, value in block.rows]
    return "\n".join(words)


def _pictures(report: Report) -> dict[str, dict[str, bytes]]:
    import io

    from PIL import Image

    out = io.BytesIO()
    Image.new("RGB", (4, 3)).save(out, "PNG")
    return {one.name: {"left": out.getvalue(), "right": out.getvalue()} for one in report.header.stimuli}


def _stimuli(session: SessionLog, **more: Any) -> tuple[dict[str, Any], ...]:
    return tuple({**one.given(), **more} for one in session.header.stimuli)


def test_an_old_log_of_an_anaglyph_says_that_the_cost_of_filters_is_not_recorded(make_small: Maker) -> None:
    measured = {"source": "measured 2015", "characterised_as": "anaglyph-red-cyan"}
    white = {"white_XYZ_cd_m2": {eye: [95.0, 100.0, 108.0] for eye in ("left", "right")}}
    report = describe([make_small(display={**ANAGLYPH, **measured, **white})])
    (seen,) = what_eyes_saw(report.sessions)
    assert seen.has_filters
    assert (seen.filters, seen.filters_are, seen.white_cd_m2, seen.surround_cd_m2) == (None, None, None, None)
    assert any("anaglyph" in note and "not recorded" in note for note in report.notes)
    assert "Surround: Not recorded." in _text(report, "seen")
    assert "Size: Not recorded." in _text(report, "seen")
    assert "As the display showed" not in _text(report, "stimuli")
    assert "at the eye" not in _text(report, "methods")


def test_an_old_log_of_another_mode_keeps_its_caption(make_small: Maker) -> None:
    report = describe([make_small()])
    assert "As the display showed them to each eye" in _text(report, "stimuli")
    assert "filter" not in _text(report, "seen")
    assert not any("filter" in note for note in report.notes)


def test_a_log_without_a_mode_is_said_to_have_none(make_small: Maker) -> None:
    assert "Stereo mode: Not recorded." in _text(describe([make_small(display={})]), "seen")


@pytest.mark.parametrize(
    ("mode", "pixels"),
    [("row-interleaved", "every second row"), *nightly(("side-by-side-half", "the mean of every two columns"))],
)
def test_half_of_the_pixels_is_said_where_an_eye_has_no_more(make_small: Maker, mode: str, pixels: str) -> None:
    report = describe([make_small(display={"mode": mode})])
    for key in ("stimuli", "seen", "methods"):
        assert f"{pixels} of its view" in _text(report, key)
    assert "As the display showed" not in _text(report, "stimuli")


def test_two_modes_are_told_apart(make_small: Maker) -> None:
    stimuli = _stimuli(make_small(), clipping={"left": _filtered(3.0), "right": _filtered(5.0)})
    people = [
        make_small("01"),
        make_small("02", display=ANAGLYPH, stimuli=stimuli),
        make_small("03"),
    ]
    report = describe(people)
    assert [(seen.mode, count) for seen, count in what_eyes_saw(people).items()] == [
        ("side-by-side", 2),
        ("anaglyph-red-cyan", 1),
    ]
    assert "in some of the sessions" in _text(report, "stimuli")
    assert "In 2 sessions:" in _text(report, "methods")
    assert "ΔE₀₀ of 4.000" in " ".join(report.notes)


def test_no_eye_saw_what_simulated_observers_answered(make_small: Maker) -> None:
    simulated = describe([make_small(simulated=True)])
    for key in ("seen", "methods"):
        assert "no eye saw anything" in _text(simulated, key)
    assert "would have shown" in _text(simulated, "stimuli")
    person = describe([make_small()])
    assert "no eye" not in _text(person, "seen") + _text(person, "methods")


def test_a_nominal_display_is_one_of_its_standard_whatever_glasses_take(make_small: Maker) -> None:
    display = {"mode": "row-interleaved", "nominal": {"kind": "srgb", "words": "sRGB"}, "glasses": "polarised"}
    report = describe([make_small(display=display)])
    assert "nominal, not measured (sRGB)" in _text(report, "seen")
    assert "polarised glasses take" in _text(report, "seen")


@pytest.mark.parametrize("measured_in", ["side-by-side", "row-interleaved"])
def test_methods_say_where_a_display_was_measured_in_another_mode(make_small: Maker, measured_in: str) -> None:
    display = {"mode": "row-interleaved", "characterised_as": measured_in, "source": "measured"}
    said = "not characterised in the mode" in _text(describe([make_small(display=display)]), "methods")
    assert said is (measured_in == "side-by-side")


def test_what_changed_when_a_session_was_resumed_is_said(make_small: Maker) -> None:
    stop = Resumption(utc="2026-01-02T05:00:00Z", accepted_changes={"rig": Change(before="a", now="b")})
    whole = make_small("01")
    resumed = replace(whole, records=(*whole.records, stop))
    report = describe([resumed, make_small("02")])
    assert [(seen.changed, count) for seen, count in what_eyes_saw(report.sessions).items()] == [(("rig",), 1), ((), 1)]
    assert "The rig changed" in _text(report, "seen")
    assert any("rig changed" in note for note in report.notes)
    assert not any("changed" in note for note in describe([make_small("02")]).notes)


def test_a_display_without_stereo_has_no_crosstalk(make_small: Maker) -> None:
    flat = describe([make_small(display={"mode": "flat", "crosstalk_cancelled": False})])
    assert "Crosstalk" not in _text(flat, "methods")
    stereo = describe([make_small(display={"mode": "side-by-side", "crosstalk_cancelled": False})])
    assert "Crosstalk" in _text(stereo, "methods")


def test_light_that_evenness_and_cancelling_crosstalk_take_is_said(make_small: Maker) -> None:
    stimuli = _stimuli(make_small(), clipping={"left": clip_cost(1.0), "crosstalk": {"lift_share": 0.05}})
    even = describe([make_small(display={"mode": "side-by-side", "gain_map_delivers": 0.83}, stimuli=stimuli)])
    for key in ("seen", "methods"):
        assert "83.0 % of their luminance" in _text(even, key)
        assert "lifted by 5.00 % of white" in _text(even, key)
    as_asked = describe([make_small(display={"mode": "side-by-side", "gain_map_delivers": 1.0})])
    assert "luminance," not in _text(as_asked, "seen")


def test_costs_that_one_session_did_not_come_to_are_taken_from_another(make_small: Maker) -> None:
    whole = make_small("01")
    stopped = make_small("02", stimuli=_stimuli(whole, clipping=None))
    (seen,) = what_eyes_saw([stopped, whole])
    assert seen == Seen.of(whole)
    assert known(seen.clipping).largest == 25.0
    assert Seen.of(stopped).clipping is None


def test_sizes_are_those_of_the_smallest_and_the_largest_picture(make_small: Maker) -> None:
    stimuli = _stimuli(make_small(), size_px=[400, 300], resampled="resample (area)")
    stimuli[0].update(size_px=[200, 150], resampled=None)
    panel = {"mode": "flat", "panel": {"pixel_pitch_mm": 0.25}, "distance_mm": 600.0}
    values = Seen.of(make_small(display=panel, stimuli=stimuli)).to_json()
    assert (values["smallest_width_px"], values["largest_height_px"]) == (200, 300)
    assert values["largest_width_deg"] == pytest.approx(9.53, abs=0.005)
    assert values["resampled"] == "none, resample (area)"


def _filtered(cost: float) -> dict[str, float]:
    return {**clip_cost(1.0), "projection_delta_e_00_mean": cost, "projection_delta_e_00_max": 10 * cost}
