"""Questionnaires and practice in an experiment file: what is wrong is told with its place, however deep."""

from __future__ import annotations

from typing import Any

import pytest

from documents import InputError
from runner.blocks.practice import Practice
from runner.blocks.questionnaire import Questionnaire
from runner.protocol import read_experiment

Study = Any  # tests/conftest.py
HEAD = """\
schema_version: 1
name: small
rig: rig.yaml
stimuli: recipe.yaml
question: Which is closer?
layout: {arrangement: vertical, size_mm: [20, 10], gap_mm: 5}
blocks:
"""
PRACTICE = HEAD + "  - {kind: practice, trials: 3, feedback: choice, block: {kind: all_pairs, break_every: 2}}\n"
QUESTIONS = """\
  - kind: questionnaire
    questions:
      - {name: age, kind: number, question: "How old are you?", unit: years, lowest: 16, highest: 99, whole: true}
      - {name: hand, kind: choice, question: "Which hand do you write with?", options: [Left, Right]}
      - {name: remarks, kind: text, question: "Anything else?", required: false}
"""


def test_both_kinds_are_read_and_made(study: Study) -> None:
    study.experiment.write_text(PRACTICE + QUESTIONS.replace("highest: 99, whole", "highest: 99.5, whole"))
    experiment = read_experiment(study.experiment)
    practice, questions = experiment.blocks("01")
    assert isinstance(practice.entry, Practice)
    assert isinstance(questions.entry, Questionnaire)
    assert (practice.trials, questions.trials) == (3, 3)
    assert experiment.places_px


PAIRS = "{kind: all_pairs, break_every: 2}"
TESTS = "{kind: screening, on_fail: stop, tests: [{test: near_acuity}]}"


@pytest.mark.parametrize(
    ("old", "new", "line", "column", "path"),
    [
        ("break_every: 2", "brake_every: 2", 8, 76, "0 block brake_every"),
        ("break_every: 2", "break_every: 0", 8, 89, "0 block break_every"),
        ("kind: all_pairs", "kind: all_pears", 8, 65, "0 block"),
        ("trials: 3", "trails: 3", 8, 22, "0 trails"),
        ("feedback: choice", "feedback: chioce", 8, 43, "0 feedback"),
        (PAIRS, "{kind: all_pairs, stimuli: [one, tow]}", 8, 91, "0 block stimuli 1"),
        (PAIRS, "{kind: break}", 8, 65, "0 block kind"),
        (PAIRS, TESTS, 8, 85, "0 block on_fail"),
        (", feedback", ", until: {correct: 0.8, of: 9}, feedback", 8, 59, "0 until of"),
        ("whole: true", "hole: true", 11, 103, "1 questions 0 hole"),
        ("kind: number", "kind: numbr", 11, 27, "1 questions 0"),
        ("lowest: 16", "lowest: 160", 11, 86, "1 questions 0 lowest"),
        ("lowest: 16", "lowest: 1e-30", 11, 86, "1 questions 0 lowest"),
        ("lowest: 16", "lowest: 1e308", 11, 86, "1 questions 0 lowest"),
        ("name: hand", "name: age", 12, 16, "1 questions 1 name"),
        ("[Left, Right]", "[Left, Left]", 12, 95, "1 questions 1 options 1"),
        ("[Left, Right]", "[Left]", 12, 88, "1 questions 1 options"),
        ("[Left, Right]", "[a, b, c, d, e, f, g, h, i, j]", 12, 88, "1 questions 1 options"),
        ("required: false", "required: false, max_length: 0", 13, 94, "1 questions 2 max_length"),
    ],
)
def test_faults_are_placed_however_deep(study: Study, old: str, new: str, line: int, column: int, path: str) -> None:
    assert old in PRACTICE + QUESTIONS
    study.experiment.write_text((PRACTICE + QUESTIONS).replace(old, new))
    with pytest.raises(InputError) as caught:
        read_experiment(study.experiment)
    found = {(one.line, one.column, " ".join(map(str, one.path[1:]))) for one in caught.value.findings}
    assert (line, column, path) in found
