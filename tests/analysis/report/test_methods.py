"""The Methods paragraph says what was done, and cites only works that it lists."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from analysis.observers import Filter
from analysis.records import SessionLog
from analysis.report import Report, describe
from analysis.report.page import sections_of
from analysis.report.references import REFERENCES
from analysis.report.words import chance, counted, fixed, listed
from documents.pages import Facts, Numbered, Paragraph
from tests.answers import altered, changed

Maker = Callable[..., SessionLog]
Sessions = Callable[..., list[SessionLog]]
DOCS = Path(__file__).parents[3] / "docs"
pytestmark = pytest.mark.usefixtures("undrawn", "unreviewed")


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
    chosen = replace(plain, answers=tuple(changed(trial, kind="active_pairs") for trial in plain.answers))
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
