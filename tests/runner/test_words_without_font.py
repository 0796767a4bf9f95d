"""Words in letters that DejaVu Sans has not: drawn by a study's font or an installed one, or named by `check`."""

from __future__ import annotations

import io
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from analysis.records import read_results
from documents.figures import Drawing, drawing, drawn
from documents.files import sha256_of_file
from documents.fonts import font_runs, undrawable
from runner.check import CheckOptions, CheckReport, check_file
from runner.presenter import coverage, text_area
from runner.protocol import read_experiment
from runner.scene import Text
from runner.session import simulate
from tests.tiny_font import tiny_font

Study = Any  # tests/conftest.py
Install = Callable[..., None]
pytestmark = pytest.mark.usefixtures("install_fonts")
ASKED = "哪张图更近"


def ask(study: Study, question: str, more: str = "") -> None:
    study.edit("small.yaml", "question: Which is closer?", f"question: {question}")
    study.experiment.write_text(study.experiment.read_text(encoding="utf-8") + more, encoding="utf-8")


def checked(study: Study) -> CheckReport:
    return check_file(study.experiment, CheckOptions(results=study.results, screen=False, pictures=False))


def test_check_names_the_letters_that_no_font_here_has_where_they_are_written(
    study: Study, cyclopean: Callable[..., Any]
) -> None:
    ask(study, f"Which 🙈 is {ASKED}?", "words: {pause: 休息}\n")
    asked, around = checked(study).errors
    assert f"{asked.file}" == str(study.experiment)
    assert (asked.line, around.line) == (5, len(study.experiment.read_text(encoding="utf-8").splitlines()))
    assert all(f"{letter} (U+{ord(letter):04X})" in asked.message for letter in f"🙈{ASKED}")
    assert "W (U+0057)" not in asked.message
    assert "休 (U+4F11), 息 (U+606F)" in around.message
    assert "font:" in str(asked.remedy)
    run = cyclopean("check", study.experiment, "--no-screen", "--no-pictures", expect=2)
    assert "哪 (U+54EA)" in run.stderr


@pytest.mark.parametrize("question", ["Größe ≤ 40 µm → Яблоко?", "'שלום, كيف?'", "a\u00a0b\u200b\u3000c\ufe0f?"])
def test_check_finds_nothing_in_what_can_be_drawn(study: Study, question: str) -> None:
    ask(study, question)
    report = checked(study)
    assert (report.errors, report.facts.get("fonts")) == ([], None)


@pytest.mark.parametrize("own", [True, False])
def test_a_font_of_the_study_or_of_the_machine_draws_them(study: Study, install_fonts: Install, own: bool) -> None:
    font = tiny_font(study.folder / "fonts/squares.ttf", ASKED, "Squares")
    if own:
        ask(study, f"Which is {ASKED}?", "style: {text: {font: fonts/squares.ttf}}\n")
    else:
        ask(study, f"Which is {ASKED}?")
        install_fonts(font)
    report = checked(study)
    assert report.errors == []
    assert report.facts["fonts"] == ["Squares (squares.ttf)"]
    simulate(study.experiment, study.observers, ["01"], results=study.results)
    (log,) = read_results(study.results)
    assert log.header.interface.given()["fonts"] == [
        {"name": "Squares", "file": "squares.ttf", "sha256": sha256_of_file(font)}
    ]
    assert log.header.hashes.get("font") == (sha256_of_file(font) if own else None)
    kept = [file.name for file in study.results.rglob("configuration/*/fonts/*")]
    assert kept == (["squares.ttf"] if own else [])


def test_each_letter_is_drawn_by_the_first_font_that_has_it(tmp_path: Path, install_fonts: Install) -> None:
    own, installed = tiny_font(tmp_path / "own.ttf", "aΩ"), tiny_font(tmp_path / "installed.ttf", "aΩ画像")
    install_fonts(installed)
    dejavu = font_runs("x")[0][0]
    assert font_runs("xaΩ 画", None) == [(dejavu, "xaΩ "), (installed, "画")]
    assert font_runs("xaΩ 画", own) == [(dejavu, "x"), (own, "aΩ "), (installed, "画")]
    assert font_runs("塗画", own) == [(own, "塗"), (installed, "画")]  # the box for what nothing has
    assert undrawable("x塗a画塗🙈", own) == "塗🙈"


def test_letters_of_two_fonts_stand_on_one_line_as_wide_as_both(tmp_path: Path) -> None:
    own = tiny_font(tmp_path / "own.ttf", ASKED)
    latin, both = coverage("HH", 100, 5000), coverage(f"HH{ASKED}", 100, 5000, own)
    assert latin is not None
    assert both is not None
    assert both.shape[1] - latin.shape[1] == pytest.approx(100 * len(ASKED), abs=2)
    lowest = [np.flatnonzero(part.max(axis=1) > 127).max() for part in (both[:, :100], both[:, -100:])]
    assert abs(lowest[0] - lowest[1]) <= 1
    # Squares of 0.9 by 0.7 of the type's size.
    assert both[:, latin.shape[1] :].sum() / 255 == pytest.approx(len(ASKED) * 90 * 70, rel=0.05)
    wide, narrow = (text_area(Text(ASKED, height_px=100, font=font)) for font in (own, None))
    assert wide is not None
    assert narrow is not None
    assert wide.right - wide.left == pytest.approx(500, abs=2)
    assert narrow.right - narrow.left < 400  # boxes of DejaVu Sans


def test_a_capital_letter_of_another_font_is_as_high_as_asked(study: Study) -> None:
    tiny_font(study.folder / "squares.ttf", "H")
    ask(study, "H", "style: {text: {height_arcmin: 24, font: squares.ttf}}\n")
    style = read_experiment(study.experiment).style
    drawn_as = coverage("H", style.px(24), 5000, style.font)
    assert drawn_as is not None
    height_px = (drawn_as.max(axis=1) > 127).sum()
    assert height_px == pytest.approx(2 * 700 * np.tan(np.radians(0.2)) / 0.25, abs=1)


@pytest.mark.parametrize("what", ["missing", "no font", "a folder"])
def test_a_font_that_is_none_is_named_at_its_place(study: Study, what: str) -> None:
    if what == "no font":
        (study.folder / "letters.ttf").write_text("letters")
    elif what == "a folder":
        (study.folder / "letters.ttf").mkdir()
    ask(study, "Which?", "style:\n  text:\n    font: letters.ttf\n")
    (error,) = checked(study).errors
    lines = study.experiment.read_text().splitlines()
    assert (error.file, error.line) == (str(study.experiment), lines.index("    font: letters.ttf") + 1)
    assert "font" in error.message


def test_an_experiment_without_a_font_has_the_digest_that_it_always_had(study: Study) -> None:
    ask(study, "Which?", "style: {text: {height_arcmin: 22}}\n")
    assert '"text":{"luminance_cd_m2":null,"share_of_white":null,"xy":null,"height_arcmin":22.0}' in (
        read_experiment(study.experiment).spec.model_dump_json()
    )


def names_drawn(names: str) -> Drawing:
    """Return a figure with ``names`` in a label, a tick and a legend."""
    with drawing("names", 4.0, 3.0) as (figure, axes):
        axes.plot([0, 1], [0, 1], label=names)
        axes.set_xticks([0, 1], [names, "plate"])
        axes.set_xlabel(names, fontweight="bold")
        axes.legend()
        return drawn(figure, "Names")


def test_names_in_figures_are_drawn_by_installed_fonts(
    tmp_path: Path, install_fonts: Install, caplog: pytest.LogCaptureFixture
) -> None:
    from pypdf import PdfReader

    assert "Squares" not in names_drawn(f"plate {ASKED}").svg
    install_fonts(tiny_font(tmp_path / "squares.ttf", ASKED, "Squares"))
    finished = names_drawn(f"plate {ASKED}")
    assert PdfReader(io.BytesIO(finished.pdf())).pages[0].extract_text().count(ASKED) == 3
    assert finished.svg.count("Squares") == finished.svg.count("'DejaVu Sans', 'Squares'") == 3
    assert "Squares" not in names_drawn("plate").svg
    assert not caplog.messages
