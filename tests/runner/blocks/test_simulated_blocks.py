"""Simulated observers in the blocks themselves: each kind is finished, and what they were given comes back."""

from __future__ import annotations

import math
import random
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from runner.blocks import ActivePairs, Block
from runner.blocks.all_pairs import AllPairs
from runner.blocks.best_of_series import BestOfSeries
from runner.blocks.layout import PairLayout, SingleLayout
from runner.blocks.practice import Practice
from runner.blocks.preference import Preference, Versions
from runner.blocks.questionnaire import Choice, Questionnaire
from runner.blocks.rating import Rating
from runner.blocks.scale import Scale
from runner.blocks.series import Series
from runner.observers import BradleyTerryObserver
from runner.observers.behaviour import BehaviourSpec, TiesSpec
from runner.ports import Ask

Play = Callable[..., Any]  # conftest.py
NAMES = ("a", "b", "c", "d")
SCORES = {"a": 1.0, "b": 2.0, "c": 3.0, "d": 6.0}
ONE = SingleLayout((0, -60), (400, 300), (0, -250), 800, 90)
TWO = PairLayout("vertical", (0, -60), (0, 60), (100, 80), (0, -140), 400)
SCALES = (Scale("quality", "How good?", 1, 5), Scale("similarity", "How similar?", 0, 100, confirm=False))
PAIRS = AllPairs(NAMES, "Which?", TWO, "s", "o", break_every=3)
BEST = BestOfSeries((Series("one", NAMES),), "Which?", ONE, "s")
BLOCKS: dict[str, Block] = {
    "pairs": PAIRS,
    "pairs with ties": replace(PAIRS, ties="both"),
    "pairs in sequence": replace(PAIRS, layout=ONE, exposure_s=0.5),
    "active pairs": ActivePairs(NAMES, "Which?", TWO, "s", 9, 2, ties="not_sure"),
    "preference": Preference((Versions("a", "b"), Versions("c", "d")), "Which?", ONE, "s", "o"),
    "series": BEST,
    "series round and round": replace(BEST, wrap=True, see_all=False),
    "ratings": Rating(NAMES, SCALES, ONE, "s", repeats=2),
    "practice": Practice(PAIRS, 4),
    "questionnaire": Questionnaire((Choice("sex", "What?", ("x", "y")),)),
}


def _press(seed: int, **behaviour: Any) -> Callable[[Ask], str]:
    observer = BradleyTerryObserver(SCORES, random.Random(seed), 2.0, BehaviourSpec(**behaviour))
    return lambda ask: observer.respond(ask, 0.0).key


@pytest.mark.parametrize("block", BLOCKS.values(), ids=BLOCKS)
@pytest.mark.parametrize("lapse_rate", [0.0, 0.5, 1.0])
def test_every_kind_is_finished(play: Play, block: Block, lapse_rate: float) -> None:
    played = play(block, _press(1, lapse_rate=lapse_rate, ties=TiesSpec(width=1), rating_noise=0.3))
    scored = [trial for trial in played.trials if trial.kind not in ("instructions", "break")]
    assert len(scored) >= block.trials > 0


def test_the_best_of_a_series_is_chosen_by_luces_law(play: Play) -> None:
    press = _press(2, rating_noise=0.0)
    chosen: Counter[str] = Counter()
    rated = {}
    for turn in range(240):
        (trial,) = play(replace(BEST, seed=str(turn)), press).trials
        chosen[trial.data["chosen"]] += 1
        rated[trial.data["chosen"]] = trial.data["ratings"]
        assert {index for index, _ in trial.data["path"]} == {0, 1, 2, 3}
    for name, score in SCORES.items():
        share = score / 12
        assert abs(chosen[name] - 240 * share) <= 4 * math.sqrt(240 * share * (1 - share))
    places = {name: math.log(score) / math.log(6) for name, score in SCORES.items()}
    assert {name: ratings["similarity"] for name, ratings in rated.items()} == {
        name: round(1 + 9 * place) for name, place in places.items()
    }
    odds = np.array(list(SCORES.values())) / 12
    entropy = float(-(odds * np.log(odds)).sum() / np.log(4))
    assert {ratings["difficulty"] for ratings in rated.values()} == {round(1 + 9 * entropy)}


def test_a_series_that_goes_round_is_seen_whole_too(play: Play) -> None:
    press = _press(3)
    for turn in range(40):
        (trial,) = play(replace(BEST, wrap=True, see_all=False, seed=str(turn)), press).trials
        assert {index for index, _ in trial.data["path"]} == {0, 1, 2, 3}
