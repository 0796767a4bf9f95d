"""A session in German with keys of its own, on a grey ground: a real window, real key presses."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from devices.display import read_display

Person = Any  # tests/conftest.py
pytestmark = [pytest.mark.window, pytest.mark.nightly]

MORE = """\
style: {background: {luminance_cd_m2: 8}, progress: count}
keys: {up: [w], down: [s], space: [b], n: [k], s: [x]}
words: {language: de}
"""


def test_a_session_in_german_with_other_keys(person: Person) -> None:
    person.study.edit(
        "small.yaml", "{kind: all_pairs, break_every: 4}", "{kind: all_pairs, ties: no_difference, break_every: 4}"
    )
    person.study.experiment.write_text(person.study.experiment.read_text() + MORE)
    person.sit_down()
    person.until(lambda: len(np.unique(person.look()[100:300, 100:300])) > 10, "the instructions")
    page = person.look()
    model = read_display(person.study.folder / "display.yaml").models("side-by-side").left
    white = model.white_XYZ_cd_m2
    assert np.abs(page[2, 2] - 255 * model.code(8.0 * white / white[1])).max() <= 0.501
    person.press("space", "Up")  # mean nothing here
    assert np.array_equal(person.look(), page)
    person.press("b")
    person.until(lambda: np.any(person.look() != page), "the first pair")
    person.press("Up", "n")
    assert person.answers() == 0
    person.answer("w", "s", "k", "w")
    person.turn("b", "the pair after the break")
    person.answer("s")
    person.press("s")
    assert "6 answers are in" in person.leave(press="b")
    log = person.log()
    pairs = [trial for trial in log.trials if trial.kind == "all_pairs"]
    assert [trial.details()["answer"] for trial in pairs] == [
        "first",
        "second",
        "no_difference",
        "first",
        "second",
        "second",
    ]
    assert [trial.events[-1][0] for trial in pairs] == ["w", "s", "k", "w", "s", "s"]
    assert log.header.interface.language == "de"
    assert log.header.interface.keys["up"] == ["w"]
