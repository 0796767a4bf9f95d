"""Words that DejaVu Sans cannot draw in a real window: in the study's font, in both eyes' views."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from runner.presenter import coverage
from runner.protocol import read_experiment
from tests.tiny_font import tiny_font

Person = Any  # tests/conftest.py
pytestmark = [pytest.mark.window, pytest.mark.nightly]
SAID = "请看两张图"


def test_a_page_is_written_in_the_study_s_font(person: Person) -> None:
    study = person.study
    tiny_font(study.folder / "squares.ttf", SAID)
    study.edit("small.yaml", "Look at the two pictures.", SAID)
    study.experiment.write_text(study.experiment.read_text() + "style: {text: {font: squares.ttf}}\n")
    design = read_experiment(study.experiment)
    person.sit_down()
    person.until(lambda: len(np.unique(person.look())) > 10, "the page")
    page = person.look()
    text = design.style.text(SAID, height=26)
    squares = coverage(text.words, text.height_px, text.width_px, text.font)
    assert squares is not None
    for view in (page[200:255, :320], page[200:255, 320:640]):
        ink = view.max(axis=2)
        rows = np.flatnonzero((ink > ink.max() // 2).sum(axis=1) > 0.8 * len(SAID) * text.height_px)
        assert len(rows) == pytest.approx((squares > 127).any(axis=1).sum(), abs=1)
    person.turn("Escape")
    person.press("s")
    person.leave()
    assert person.log().header.interface.style.text.font == "squares.ttf"
