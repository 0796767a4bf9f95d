"""Experiments made to do harm: absurd numbers, paths that lead elsewhere, names that are traps."""

from __future__ import annotations

import os
import time
from pathlib import Path
from typing import Any

import pytest
from pydantic import ValidationError

from documents import InputError
from runner.check import CheckOptions, check_file
from runner.protocol import read_experiment
from runner.protocol.experiment import MOST_TRIALS, AnalysisSpec, check_observer

Study = Any  # tests/conftest.py
HUGE = ("1000000000", "1" + "0" * 40)

pytestmark = pytest.mark.filterwarnings("ignore:overflow encountered:RuntimeWarning")


def _findings(study: Study) -> list[str]:
    began_s = time.process_time()
    checked = check_file(study.experiment, CheckOptions(False, study.results, pictures=False))
    assert time.process_time() - began_s < 20
    return [str(error).removeprefix(f"{study.folder}/") for error in checked.errors]


@pytest.mark.parametrize("huge", HUGE)
@pytest.mark.parametrize(
    "block",
    [
        "{{kind: all_pairs, repeats: {}}}",
        "{{kind: rating, repeats: {}, ratings: [{{name: a, question: How good}}]}}",
        "{{kind: preference, repeats: {}, pairs: [[one, two]]}}",
        "{{kind: active_pairs, trials: {}}}",
    ],
)
def test_more_trials_than_a_life_has_are_refused_at_their_place(study: Study, block: str, huge: str) -> None:
    study.edit("small.yaml", "{kind: all_pairs, break_every: 4}", block.format(huge))
    (told,) = _findings(study)
    assert told.startswith(f"small.yaml:9:{block.replace('{{', '{').index('{}') + 5}: "), told


@pytest.mark.nightly
def test_as_many_trials_as_a_block_may_have_are_right(study: Study) -> None:
    study.edit("small.yaml", "break_every: 4", f"break_every: 4, repeats: {MOST_TRIALS // 6}")
    assert _findings(study) == []
    study.edit("small.yaml", f"repeats: {MOST_TRIALS // 6}", f"repeats: {MOST_TRIALS // 6 + 1}")
    (told,) = _findings(study)
    assert "100002 trials (a block has 100000" in told


@pytest.mark.parametrize(
    ("file", "old", "new", "place"),
    [
        ("small.yaml", "[20, 10]", "[1.0e+308, 10]", "small.yaml:6:43"),
        ("small.yaml", "[20, 10]", "[20, 1.0e-308]", "small.yaml:6:47"),
        ("small.yaml", "gap_mm: 5", "gap_mm: 1.0e+308", "small.yaml:6:60"),
        ("small.yaml", "[20, 10]", "[.nan, .inf]", "small.yaml:6:43"),
        ("small.yaml", "break_every: 4", "break_every: 4, fixation_s: 1e308", "small.yaml:9:51"),
        ("small.yaml", "break_every: 4", "break_every: 4, exposure_s: .inf", "small.yaml:9:51"),
        ("display.yaml", "pixel_pitch_mm: 0.25", "pixel_pitch_mm: 1e-308", "display.yaml:2:52"),
        ("display.yaml", "pixel_pitch_mm: 0.25", "pixel_pitch_mm: 1e-12", "small.yaml:6:42"),
        ("display.yaml", "[640, 480]", "[1000000000, 480]", "display.yaml:2:25"),
        ("small.yaml", "[20, 10]", "[1.0e+12, 10]", "small.yaml:6:42"),
        ("small.yaml", "[20, 10]", "[20, 1.0e-12]", "small.yaml:6:42"),
        ("small.yaml", "gap_mm: 5", "gap_mm: 1.0e+12", "small.yaml:6:42"),
        ("rig.yaml", "distance_mm: 700", "distance_mm: 1e308", "rig.yaml:4:14"),
        ("rig.yaml", "distance_mm: 700", "distance_mm: 1e-308", "rig.yaml:4:14"),
        ("rig.yaml", "distance_mm: 700", "distance_mm: .inf", "rig.yaml:4:14"),
    ],
)
def test_absurd_lengths_and_times_are_refused_at_their_place(
    study: Study, file: str, old: str, new: str, place: str
) -> None:
    study.edit(file, old, new)
    told = _findings(study)
    assert told[0].startswith(place), told


@pytest.mark.parametrize("distance", ["1e12", "1e-12", "1000000000"])
def test_absurd_distances_are_warned_of(study: Study, distance: str) -> None:
    study.edit("rig.yaml", "distance_mm: 700", f"distance_mm: {distance}")
    checked = check_file(study.experiment, CheckOptions(False, study.results, pictures=False))
    assert not checked.errors
    assert "a picture covers" in str(checked.warnings[0])


def test_rigs_and_recipes_may_lie_elsewhere_and_pictures_may_not(study: Study) -> None:
    shared = study.folder / "shared"
    shared.mkdir()
    for name in ("rig.yaml", "display.yaml", "recipe.yaml", "one.exr", "two.exr", "three.exr", "four.exr"):
        (study.folder / name).rename(shared / name)
    inner = study.folder / "experiments"
    inner.mkdir()
    study.experiment.rename(inner / "small.yaml")
    (inner / "small.yaml").write_text(
        (inner / "small.yaml")
        .read_text()
        .replace("rig.yaml", "../shared/rig.yaml")
        .replace("recipe", "../shared/recipe")
    )
    assert read_experiment(inner / "small.yaml").stimulus_names == ("one", "two", "three", "four")
    for path in ("../one.exr", "/etc/passwd", "a/../../one.exr", "..\\\\one.exr", "C:/one.exr", ""):
        text = (shared / "recipe.yaml").read_text()
        (shared / "bad.yaml").write_text(text.replace("file: one.exr", f'file: "{path}"'))
        with pytest.raises(InputError, match="in the recipe's own folder or below it"):
            read_experiment_with(inner, "../shared/bad.yaml")


def read_experiment_with(folder: Path, recipe: str) -> None:
    """Read the experiment in ``folder`` with another recipe."""
    text = (folder / "small.yaml").read_text()
    (folder / "other.yaml").write_text(text.replace("../shared/recipe.yaml", recipe))
    read_experiment(folder / "other.yaml")


@pytest.mark.parametrize("path", ["/dev/zero", "/dev/stdin", ".", "..", "/etc", "none/../../rig.yaml", "pipe"])
@pytest.mark.parametrize("key", ["rig", "stimuli"])
def test_what_is_no_file_is_not_read(study: Study, path: str, key: str) -> None:
    os.mkfifo(study.folder / "pipe")  # reading it would wait for ever
    name = {"rig": "rig.yaml", "stimuli": "recipe.yaml"}[key]
    study.edit("small.yaml", f"{key}: {name}", f"{key}: {path}")
    assert any("there is no such file" in told for told in _findings(study))


@pytest.mark.parametrize("name", ["../../up", "a/b", "A", "", "é", "a b", "..", "con\\u0000", "x" * 65])
def test_an_experiment_s_name_cannot_lead_elsewhere(study: Study, name: str) -> None:
    study.edit("small.yaml", "name: small", f'name: "{name}"')
    assert _findings(study)[0].startswith("small.yaml:2:")


@pytest.mark.parametrize(
    "observer", ["..", "../02", "/etc", "a\x00", "01/../02", "~", "C:", "\u202e10", "１", "0" * 65]
)
def test_an_observer_s_id_cannot_lead_elsewhere(observer: str) -> None:
    with pytest.raises(InputError, match="is no BIDS label") as caught:
        check_observer(observer)
    assert str(caught.value).isprintable()


def test_a_margin_is_a_difference() -> None:
    for margin in ("0.5jnd", "55:45", "0.2nats"):
        assert AnalysisSpec(margin=margin).model_dump(exclude_none=True)["margin"] == margin
    assert "margin" not in AnalysisSpec().model_dump(exclude_none=True)
    for margin in ("small", "0jnd", "45:55", "0.2sd"):
        with pytest.raises(ValidationError, match="such as 55:45"):
            AnalysisSpec(margin=margin)
