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


def _findings(study: Study, text: str) -> list[str]:
    study.experiment.write_text(text)
    with pytest.raises(InputError) as caught:
        read_experiment(study.experiment)
    return [str(finding).replace(str(study.folder), "") for finding in caught.value.findings]


def test_both_kinds_are_read_and_made(study: Study) -> None:
    study.experiment.write_text(PRACTICE + QUESTIONS)
    experiment = read_experiment(study.experiment)
    practice, questions = experiment.blocks("01")
    assert isinstance(practice, Practice)
    assert isinstance(questions, Questionnaire)
    assert (practice.trials, questions.trials) == (3, 3)
    assert experiment.places_px


@pytest.mark.parametrize(
    ("old", "new", "at", "words"),
    [
        ("break_every: 2", "brake_every: 2", "brake_every", "unknown key 'blocks.1.block.brake_every'"),
        ("break_every: 2", "break_every: 0", "0}}", "'blocks.1.block.break_every' is 0"),
        ("kind: all_pairs", "kind: all_pears", "all_pears", "'blocks.1.block.kind' is 'all_pears'"),
        ("trials: 3", "trails: 3", "trails", "unknown key 'blocks.1.trails'"),
        ("feedback: choice", "feedback: chioce", "chioce", "'blocks.1.feedback' is 'chioce'"),
        ("{kind: all_pairs, break_every: 2}", "{kind: all_pairs, stimuli: [one, tow]}", "tow", "no stimulus 'tow'"),
        ("{kind: all_pairs, break_every: 2}", "{kind: break}", "break}", "'break' has no trials to practise"),
        (
            "{kind: all_pairs, break_every: 2}",
            "{kind: screening, on_fail: stop, tests: [{test: near_acuity}]}",
            "stop",
            "a practice cannot end the session",
        ),
        (", feedback", ", until: {correct: 0.8, of: 9}, feedback", "9}", "until looks at 9 answers, of 3"),
    ],
)
def test_faults_inside_a_practised_block_are_placed(study: Study, old: str, new: str, at: str, words: str) -> None:
    assert old in PRACTICE
    text = PRACTICE.replace(old, new)
    findings = [finding for finding in _findings(study, text) if words in finding]
    column = text.splitlines()[7].index(at) + 1
    assert len(findings) == 1, findings
    assert f"small.yaml:8:{column}:" in findings[0], findings


@pytest.mark.parametrize(
    ("old", "new", "line", "words"),
    [
        ("whole: true", "hole: true", 10, "unknown key 'blocks.1.questions.1.hole'"),
        ("kind: number", "kind: numbr", 10, "'blocks.1.questions.1.kind' is 'numbr'"),
        ("lowest: 16", "lowest: 160", 10, "lowest is 160 and highest 99"),
        ("lowest: 16", "lowest: 1e-30", 10, "lowest has more digits than can be typed"),
        ("lowest: 16", "lowest: 1e308", 10, "'blocks.1.questions.1.lowest'"),
        ("highest: 99, whole", "highest: 16.5, whole", 10, ""),
        ("name: hand", "name: age", 11, "two questions are named 'age'"),
        ("[Left, Right]", "[Left, Left]", 11, "the option 'Left' stands twice"),
        ("[Left, Right]", "[Left]", 11, "'blocks.1.questions.2.options' holds 1 entry"),
        ("[Left, Right]", "[a, b, c, d, e, f, g, h, i, j]", 11, "10 options are more than there are digits"),
        ("required: false", "required: false, max_length: 0", 12, "'blocks.1.questions.3.max_length' is 0"),
    ],
)
def test_faults_of_questions_are_placed(study: Study, old: str, new: str, line: int, words: str) -> None:
    assert old in QUESTIONS
    text = HEAD + QUESTIONS.replace(old, new)
    if not words:
        study.experiment.write_text(text)
        read_experiment(study.experiment)
        return
    findings = [finding for finding in _findings(study, text) if words in finding]
    assert len(findings) == 1, findings
    assert f"small.yaml:{line}:" in findings[0], findings


def test_practice_in_practice_is_refused_however_deep(study: Study) -> None:
    inner = "{kind: all_pairs}"
    for _ in range(40):
        inner = f"{{kind: practice, trials: 2, block: {inner}}}"
    findings = _findings(study, f"{HEAD}  - {inner}\n")
    assert all("'practice' has no trials to practise" in finding for finding in findings)
