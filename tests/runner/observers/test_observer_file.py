"""Files of simulated observers: every kind is read, and every fault is told with its place."""

from __future__ import annotations

from pathlib import Path

import pytest

from documents import InputError
from runner.check import check_file
from runner.observers import read_observer
from runner.observers.observer_file import read_scored_observer

CONFIGS = Path(__file__).parents[3] / "configs/observers"
SCORED = """\
schema_version: 1
kind: bradley_terry
position_bias: 0.3
lapse_rate: 0.05
fatigue: {over_trials: 100, lapse_rate: 0.2, noise: 1.5}
ties: {law: rao_kupper, width: 1.4}
psychometric: {acuity: {threshold: 40}}
stimuli: {a: {score: 1}, b: {score: 2}}
"""
BY_PICTURE = "schema_version: 1\nkind: image_based\nslope_per_delta_e_00: 2\nreference: a\n"


def _write(tmp_path: Path, text: str) -> Path:
    file = tmp_path / "observers.yaml"
    file.write_text(text)
    return file


@pytest.mark.parametrize("file", sorted(CONFIGS.glob("*.yaml")), ids=lambda file: file.name)
def test_shipped_observers_are_read(file: Path) -> None:
    spec = read_observer(file)
    facts = check_file(file).facts
    assert facts["kind"] == "observers"
    scores = getattr(spec, "scores", None)
    assert facts.get("stimuli") == (len(scores) if scores else None)


def test_all_of_a_file_is_taken_over(tmp_path: Path) -> None:
    spec = read_scored_observer(_write(tmp_path, SCORED), ("a", "b"))
    assert spec.scores == {"a": 1.0, "b": 2.0}
    assert spec.lapses(50) == pytest.approx(0.125)
    assert spec.ties is not None
    assert spec.ties.width == 1.4


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (SCORED.replace("lapse_rate: 0.05", "lapse_rate: 1.5"), "observers.yaml:4:13: 'lapse_rate' is 1.5"),
        (SCORED.replace("position_bias", "position_bais"), "3:1: unknown key 'position_bais' (did you mean 'position"),
        (SCORED.replace("width: 1.4", "width: 0.4"), "6:7: 'ties': the width of Rao"),
        (
            SCORED.replace("bradley_terry", "bradley_tery"),
            "2:7: 'kind' is 'bradley_tery' (did you mean",
        ),
        (SCORED.replace("score: 2", "score: 0"), "8:37: 'stimuli.b.score' is 0"),
        (SCORED.replace("b: {", "d: {"), "8:10: no score is given for b"),
        (BY_PICTURE.replace("reference: a", "reference: c"), "4:12: the recipe makes no stimulus 'c'"),
        (BY_PICTURE.replace("reference: a\n", ""), "the experiment has no reference picture"),
        (BY_PICTURE.replace(": 2", ": -2"), "3:23: 'slope_per_delta_e_00' is -2"),
    ],
)
def test_faults_are_told_with_their_place(tmp_path: Path, text: str, told: str) -> None:
    with pytest.raises(InputError) as caught:
        read_observer(_write(tmp_path, text), ("a", "b"))
    assert told in str(caught.value)


def test_scores_may_be_left_out_where_no_stimulus_needs_one(tmp_path: Path) -> None:
    text = "schema_version: 1\nkind: bradley_terry\npsychometric: {contrast: {threshold: 0.05, slope: 4}}\n"
    assert read_observer(_write(tmp_path, text)).psychometric["contrast"].threshold == 0.05
    with pytest.raises(InputError, match="no score is given for a, b"):
        read_observer(_write(tmp_path, text), ("a", "b"))


def test_the_experiments_reference_picture_is_taken_if_none_is_named(tmp_path: Path) -> None:
    file = _write(tmp_path, BY_PICTURE.replace("reference: a\n", ""))
    assert read_observer(file, ("a", "b"), "b").kind == "image_based"
    with pytest.raises(InputError, match="'kind' is 'image_based'"):
        read_scored_observer(_write(tmp_path, BY_PICTURE))
