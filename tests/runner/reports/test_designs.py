"""How often each observer meets each pair, from experiment files."""

from __future__ import annotations

from typing import Any

import pytest

from documents import InputError
from runner.protocol import read_experiment
from runner.reports import PairDesign, pair_design

Study = Any  # tests/conftest.py
SCENES = {"lobby": ("l1", "l2", "l3"), "garden": ("g1", "g2", "g3", "g4")}


def design_of(study: Study, *blocks: str) -> PairDesign:
    """Return the design of an experiment with these blocks."""
    head, _ = study.experiment.read_text().split("blocks:\n")
    study.experiment.write_text(head + "blocks:\n" + "".join(f"  - {block}\n" for block in blocks))
    return pair_design(read_experiment(study.experiment))


def test_blocks_and_repeats_add_up(study: Study) -> None:
    found = design_of(
        study,
        "{kind: instructions, text: Look.}",
        "{kind: all_pairs, stimuli: [three, one], repeats: 2}",
        "{kind: all_pairs, stimuli: [one, two, three], ties: no_difference}",
        "{kind: practice, trials: 2, block: {kind: all_pairs}}",
    )
    assert found.items == ("one", "two", "three")
    assert found.times.tolist() == [1, 3, 1]  # one-two, one-three, two-three
    assert found.ties


def test_observers_meet_every_pair_as_often_as_the_session_asks(study: Study) -> None:
    found = design_of(study, "{kind: all_pairs, repeats: 3}")
    (block,) = read_experiment(study.experiment).blocks("01")
    assert found.times.sum() == block.trials
    assert found.items == ("one", "two", "three", "four")
    assert not found.ties


def test_experiments_without_a_fixed_design_are_refused(study: Study) -> None:
    with pytest.raises(InputError, match="no block compares all pairs"):
        design_of(study, "{kind: instructions, text: Look.}")


@pytest.fixture
def scenes(study: Study) -> Study:
    """Seven pictures of two scenes, compared within them, each pair twice; and scores."""
    rows = [f"  - {{name: {n}, file: one.exr, factors: {{scene: {s}}}}}" for s, names in SCENES.items() for n in names]
    recipe = study.folder / "recipe.yaml"
    recipe.write_text("schema_version: 1\nkind: pictures\nstimuli:\n" + "\n".join(rows) + "\n")
    head, _ = study.experiment.read_text().split("blocks:\n")
    study.experiment.write_text(head + "blocks:\n  - {kind: all_pairs, within: scene, repeats: 2}\n")
    scores = {"l1": 9, "l2": 3, "l3": 1, "g1": 4, "g2": 3, "g3": 2.9, "g4": 1}
    stimuli = "".join(f"  {name}: {{score: {score}}}\n" for name, score in scores.items())
    study.observers.write_text(f"schema_version: 1\nkind: bradley_terry\nstimuli:\n{stimuli}")
    return study


def test_pairs_within_scenes_are_sets_named_by_their_scene(scenes: Study) -> None:
    design = pair_design(read_experiment(scenes.experiment))
    assert design.groups == (("lobby", (0, 1, 2)), ("garden", (3, 4, 5, 6)))
    assert design.times[design.pairs_within((3, 4, 5, 6))].tolist() == [2] * 6
    assert design.times.sum() == 2 * (3 + 6)
    assert (design.times[design.pairs_within((2, 3))] == 0).all()


def test_blocks_of_stimuli_of_their_own_are_sets_too(study: Study) -> None:
    design = design_of(study, *(f"{{kind: all_pairs, stimuli: {names}}}" for names in ("[one, four]", "[two, three]")))
    assert design.groups == (("group 1", (0, 3)), ("group 2", (1, 2)))
