"""What pictures are judged against: nothing, a real thing, or a picture; and what observers read about it."""

from __future__ import annotations

import hashlib
from typing import Any

import pytest

from documents import InputError
from runner.blocks import Draft
from runner.observers import walk
from runner.protocol import Experiment, read_experiment
from runner.scene import Text

Study = Any  # tests/conftest.py
BEST = "{kind: best_of_series, series: {one: [one, two], two: [three, four]}}"


def words_on(design: Experiment) -> str:
    """Return every word that an observer reads."""
    scenes = [step.scene for block in design.blocks("01") for step in walk(block) if not isinstance(step, Draft)]
    return "\n".join(item.words for scene in scenes for item in scene.items if isinstance(item, Text))


def written(study: Study, reference: str | None) -> Experiment:
    """Return the study with a series, and ``reference`` in its layout, left out if None."""
    study.edit("small.yaml", "{kind: all_pairs, break_every: 4}", BEST)
    if reference is not None:
        study.edit("small.yaml", "gap_mm: 5}", f"gap_mm: 5, reference: {reference}}}")
    return read_experiment(study.experiment)


@pytest.mark.parametrize("reference", [None, "none"])
def test_without_a_reference_no_word_speaks_of_one(study: Study, reference: str | None) -> None:
    design = written(study, reference)
    assert design.stimuli.reference is None
    assert design.spec.layout.reference == "none"
    words = words_on(design).lower()
    assert "how good is the image that you chose?" in words
    assert "reference" not in words
    assert "plate" not in words
    (_, block) = design.example_blocks
    assert [*block.scale_ends] == ["quality", "difficulty"]


@pytest.mark.parametrize("reference", ["physical", "four"])
def test_with_one_the_choice_is_rated_against_it(study: Study, reference: str) -> None:
    study.edit(
        "small.yaml",
        "layout: {arrangement: vertical, size_mm: [20, 10]",
        "layout: {arrangement: vertical, size_mm: [8, 8]",
    )
    words = words_on(written(study, reference))
    assert "that you chose to the reference?" in words


def test_scales_that_are_written_stay(study: Study) -> None:
    study.edit(
        "small.yaml",
        "{kind: all_pairs, break_every: 4}",
        BEST[:-1] + ", ratings: [{name: similarity, question: How alike are they}]}",
    )
    assert "How alike are they" in words_on(read_experiment(study.experiment))


def test_an_unknown_reference_names_what_can_be_written(study: Study) -> None:
    with pytest.raises(InputError, match=r"'nona' .*did you mean 'none'"):
        written(study, "nona")


def test_a_digest_of_before_stays_what_it_was(study: Study) -> None:
    """Sessions recorded before ``none`` existed: a file that wrote ``physical``, or left it out and meant that."""
    left_out = read_experiment(study.experiment)
    study.edit("small.yaml", "gap_mm: 5}", "gap_mm: 5, reference: physical}")
    says_so = read_experiment(study.experiment)
    dump: dict[str, Any] = says_so.spec.model_dump(mode="json")
    assert dump["layout"]["reference"] == "physical"
    assert says_so.digest == hashlib.sha256(says_so.spec.model_dump_json().encode()).hexdigest()
    assert left_out.digest == says_so.digest
    study.edit("small.yaml", "reference: physical", "reference: none")
    assert read_experiment(study.experiment).digest != says_so.digest
