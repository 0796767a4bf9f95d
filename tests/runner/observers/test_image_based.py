"""Observers who judge by pictures: distances against a plain loop, and a session in which the nearer picture wins."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import colour
import numpy as np
import pytest
from numpy.typing import NDArray

from analysis.records import read_session, session_files
from devices.display import EyeModels, read_display
from documents import InputError
from runner.check import check_file
from runner.errors import SessionError
from runner.observers import read_observer
from runner.observers.observer_file import read_scored_observer
from runner.observers.simulated import mean_delta_e_00
from stimuli.pictures import StereoImage, write_exr
from tests.invoked import printed_json

Study = Any  # tests/conftest.py
GREY = np.array([0.95, 1, 1.09], dtype=np.float32)
ASUS = Path(__file__).parents[3] / "configs/displays/asus_vg248qe.yaml"


def _models() -> EyeModels:
    return next(iter(read_display(ASUS).modes.values()))


def _lab(xyz_cd_m2: NDArray[Any], white_XYZ_cd_m2: NDArray[Any]) -> NDArray[Any]:
    """Return Lab by colour-science, which takes Y of the white as 1."""
    relative = xyz_cd_m2.astype(np.float64) / white_XYZ_cd_m2[1]
    return np.asarray(colour.XYZ_to_Lab(relative, colour.XYZ_to_xy(white_XYZ_cd_m2)))


def _picture(seed: int, *, flat: bool = False, size: tuple[int, int] = (5, 7)) -> StereoImage:
    rng = np.random.default_rng(seed)
    left, right = (rng.uniform(1, 20, (*size, 3)).astype(np.float32) for _ in range(2))
    return StereoImage.flat(left) if flat else StereoImage(left, right)


def test_the_distance_is_the_mean_over_both_eyes_pixels() -> None:
    models = _models()
    pictures = {"a": _picture(1), "b": _picture(2), "c": _picture(3, flat=True)}
    found = mean_delta_e_00(pictures.__getitem__, pictures, "a", models)
    assert found["a"] == 0
    for name in ("b", "c"):
        apart = []
        for eye, model in (("left", models.left), ("right", models.right)):
            white = model.white_XYZ_cd_m2
            one, other = (_lab(np.asarray(getattr(pictures[which], eye)), white) for which in (name, "a"))
            apart.append(np.mean(colour.delta_E(one, other, method="CIE 2000")))
        assert found[name] == pytest.approx(np.mean(apart), abs=1e-6)


def test_pictures_of_another_size_are_refused() -> None:
    pictures = {"a": _picture(1), "b": _picture(2, size=(5, 8))}
    with pytest.raises(SessionError, match="'b' is of 8 x 5 px, 'a' of 7 x 5 px"):
        mean_delta_e_00(pictures.__getitem__, pictures, "a", _models())


def _run(study: Study, observer: str) -> None:
    words = ("--observer", observer, "--simulate", study.observers, "--results", study.results)
    assert printed_json("run", study.experiment, *words)["ending"] == "completed"


def test_the_nearer_picture_wins_as_often_as_stated(study: Study) -> None:
    """Four greys of one colour, each further from the reference; slope 1 in log odds per ΔE00."""
    light = {"one": 10.0, "two": 10.5, "three": 11.5, "four": 14.0}
    for name, luminance in light.items():
        grey = np.full((40, 80, 3), luminance, dtype=np.float32) * GREY
        write_exr(study.folder / f"{name}.exr", StereoImage.flat(grey))
    study.observers.write_text("schema_version: 1\nkind: image_based\nslope_per_delta_e_00: 1\nreference: one\n")
    study.edit("small.yaml", "break_every: 4", "repeats: 60")
    _run(study, "01")
    (file,) = session_files(study.results)
    trials = [trial for trial in read_session(file).trials if trial.kind == "all_pairs"]
    white = read_display(study.folder / "display.yaml").modes["side-by-side"].left.white_XYZ_cd_m2
    lab = {name: _lab(np.float32(light[name]) * GREY, white) for name in light}
    far = {name: float(np.mean(colour.delta_E(lab[name], lab["one"], method="CIE 2000"))) for name in light}
    for nearer, further in (("one", "two"), ("two", "three"), ("one", "three"), ("three", "four")):
        met = [t for t in trials if {t.details()["first"], t.details()["second"]} == {nearer, further}]
        wins = sum(t.details()["chosen"] == nearer for t in met)
        p = 1 / (1 + math.exp(far[nearer] - far[further]))
        assert p > 0.55
        assert abs(wins - 60 * p) <= 4 * math.sqrt(60 * p * (1 - p))


# Files of simulated observers: every kind is read, and every fault is told with its place.


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
