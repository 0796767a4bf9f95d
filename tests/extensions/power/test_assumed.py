"""Which scores are assumed of an experiment's stimuli."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from documents import InputError
from extensions.power.assumed import assume
from tests.runner.reports.test_designs import design_of

Study = Any  # tests/conftest.py


def test_classes_of_a_file_count_only_where_every_stimulus_has_one(study: Study) -> None:
    design = design_of(study, "{kind: all_pairs}")
    scores = ["one: {score: 1, perceptual_class: '2'}", "two: {score: 1.1, perceptual_class: '2'}"]
    scores += ["three: {score: 8, perceptual_class: '1'}", "four: {score: 8, perceptual_class: '1+2'}"]
    head = "schema_version: 1\nkind: bradley_terry\nlapse_rate: 0.1\nstimuli:\n"
    study.observers.write_text(head + "".join(f"  {line}\n" for line in scores))
    found = assume(design, scores=study.observers, simulate=None, spread_nats=None)
    assert found.differs.tolist() == [False, True, False, True, False, False]
    assert found.lapse_rate == 0
    np.testing.assert_allclose(np.exp(found.theta - found.theta[0]), [1, 1.1, 8, 8])
    study.edit("observers.yaml", "perceptual_class: '1+2'", "perceptual_class: ''")
    found = assume(design, scores=None, simulate=study.observers, spread_nats=None)
    assert found.differs.tolist() == [True, True, True, True, True, False]
    assert found.lapse_rate == 0.1


@pytest.mark.parametrize(
    ("text", "finding"),
    [
        ("winner,loser", "this is no JSON"),
        ("[]", "no list of items"),
        ('{"items": [{"name": "one", "score": null}]}', "'one' has no score"),
        ('{"items": [{"name": "one", "score": 1}]}', "no score is assumed for two, three, four"),
        (
            json.dumps({"items": [{"name": n, "score": -1} for n in ("one", "two", "three", "four")]}),
            "score of one is -1",
        ),
    ],
)
def test_printed_scores_that_do_not_fit_are_refused(study: Study, tmp_path: Path, text: str, finding: str) -> None:
    design = design_of(study, "{kind: all_pairs}")
    file = tmp_path / "printed.json"
    file.write_text(text)
    with pytest.raises(InputError, match=finding):
        assume(design, scores=file, simulate=None, spread_nats=None)
