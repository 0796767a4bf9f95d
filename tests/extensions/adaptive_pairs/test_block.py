"""Active pairs as a block: replayed from anywhere, recorded like all pairs, and with known scores coming back."""

from __future__ import annotations

import random
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from analysis.comparisons import from_sessions
from analysis.records import SessionLog, new_header
from analysis.scaling import fit
from documents import InputError
from runner.blocks import Stimuli
from runner.observers import BradleyTerryObserver
from runner.ports import Compare
from runner.protocol import read_experiment
from runner.reports import pair_design
from runner.scene import Text
from tests.runner.every_kind import entry, met, setting

Play = Callable[..., Any]
Study = Any  # tests/conftest.py
NAMES = tuple(f"p{number:02d}" for number in range(12))
PLACE = setting(NAMES)
BLOCK = met("active_pairs", PLACE, trials=40)
TIMES = {"fixation_s": 0.5, "exposure_s": 1.0, "blank_s": 0.2, "break_every": 7}
BLOCKS = {
    "plain": BLOCK,
    "timed": met("active_pairs", PLACE, trials=40, gain="entropy", batch=2, **TIMES),
    "ties": met("active_pairs", PLACE, trials=40, ties="both"),
    "two": met("active_pairs", setting("ab"), trials=15),
}


@pytest.mark.parametrize("name", BLOCKS)
def test_it_keeps_what_every_block_promises(play: Play, promised: Play, name: str) -> None:
    block = BLOCKS[name]
    whole = promised(block, "active_pairs")  # a batch of six is left at each of its places
    for ask in whole.asks:
        if isinstance(ask.task, Compare):
            assert ask.keys == block.keys
            assert set(ask.targets) == set(ask.keys.values())
            assert (name == "timed") != (ask.scene.stimuli == (ask.task.first, ask.task.second))
    crosses = sum(isinstance(item, Text) and item.words == "+" for scene in whole.shown for item in scene.items)
    assert crosses == (block.trials if name == "timed" else 0)
    for trial in whole.trials:
        data = trial.details()
        assert data["first_position"] == "top"
        if data["answer"] in ("first", "second"):
            other = "second" if data["answer"] == "first" else "first"
            assert (data["chosen"], data["rejected"]) == (data[data["answer"]], data[other])
        else:
            assert "chosen" not in data
    assert len(play(block).trials) == block.trials


def test_the_next_pair_of_a_batch_is_made_ready(play: Play) -> None:
    whole = play(BLOCK)
    shown = [ask.scene for ask in whole.asks]
    batches = [trial.details()["batch"] for trial in whole.trials]
    wanted = [shown[n + 1] for n in range(39) if batches[n] == batches[n + 1]]
    assert whole.prefetched == wanted
    assert sorted(batches) == batches


@pytest.mark.promise("one-engine")
def test_known_scores_come_back_through_the_analysis(play: Play) -> None:
    """Twelve stimuli, 600 answers by the law, counted by the same analysis as all pairs."""
    scores = {name: float(np.exp(0.3 * number)) for number, name in enumerate(NAMES)}
    observer = BradleyTerryObserver(scores, random.Random(4))
    block = met("active_pairs", PLACE, trials=600)
    whole = play(block, lambda ask: observer.respond(ask, 0.0).key)
    stimuli = tuple({"name": name} for name in NAMES)
    header = new_header("e", "01", "s", "2026-01-01T00:00:00+00:00", simulated=True, stimuli=stimuli)
    log = SessionLog(Path("s"), header, tuple(whole.trials), True)
    comparisons = from_sessions([log])
    assert comparisons.items == NAMES
    assert comparisons.wins.sum() == 600
    fitted = fit(comparisons.wins)
    truth = 0.3 * (np.arange(12) - 5.5)
    errors = (fitted.theta - truth) / np.sqrt(np.diag(fitted.covariance))
    assert np.abs(errors).max() < 4
    assert np.corrcoef(fitted.theta, truth)[0, 1] > 0.95


def _faults(count: int, **keys: object) -> list[str]:
    spec = entry("active_pairs", **keys)
    return [fault.message for fault in spec.faults(Stimuli({f"p{n}": {} for n in range(count)}))]


def test_wrong_numbers_are_faults() -> None:
    assert _faults(30, trials=100) == []
    assert _faults(30, trials_per_stimulus=2) == []
    assert _faults(30, trials=28) == ["28 trials cannot link 30 stimuli"]
    assert _faults(30, trials=100, batch=16) == ["a batch of 16 pairs cannot hold each of 30 stimuli once at most"]
    assert _faults(30, trials=100, stimuli=["p1", "q"]) == ["the recipe makes no stimulus 'q'"]
    for wrong in ({}, {"trials": 9, "trials_per_stimulus": 3}, {"trials": 9, "gain": "luck"}, {"trials": 0}):
        with pytest.raises(ValidationError):
            _faults(5, **wrong)


def test_it_has_no_fixed_design(study: Study) -> None:
    study.edit("small.yaml", "  - {kind: all_pairs, break_every: 4}\n", "  - {kind: active_pairs, trials: 12}\n")
    with pytest.raises(InputError, match="'active_pairs' chooses pairs by the answers"):
        pair_design(read_experiment(study.experiment))
