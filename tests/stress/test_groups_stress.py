"""Scores within groups: four million answers within their time and memory, and the test of agreement at its level."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from analysis.comparisons import Comparisons
from analysis.scaling import score_groups
from tests.stress.answered import answered
from tests.stress.how_many import how_many
from tests.stress.memory import command_alone

pytestmark = pytest.mark.stress

OBSERVERS, GROUPS, ITEMS, EACH = 1000, 20, 200, 200


@pytest.mark.parametrize("shared", [True, False][: how_many(1, 2)])
def test_four_million_answers_in_twenty_groups(tmp_path: Path, *, shared: bool) -> None:
    """1000 observers of 20 groups of 200 items, with the same items in all groups or others in each."""
    random = np.random.default_rng(1)
    theta = np.linspace(-2, 2, ITEMS)
    table = tmp_path / "table.csv"
    with table.open("w", encoding="utf-8") as stream:
        stream.write("winner,loser,scene,observer\n")
        for group in range(GROUPS):
            one = random.integers(ITEMS, size=EACH * OBSERVERS)
            other = (one + random.integers(1, ITEMS, size=len(one))) % ITEMS
            wins = random.random(len(one)) < 1 / (1 + np.exp(theta[other] - theta[one]))
            person = np.repeat(np.arange(OBSERVERS), EACH)
            lines = zip(np.where(wins, one, other).tolist(), np.where(wins, other, one).tolist(), person, strict=True)
            name = "" if shared else f"{group}-"
            stream.write("".join(f"{name}{i},{name}{j},scene {group},{who}\n" for i, j, who in lines))
    said, seconds, megabytes = command_alone("scores", table, "--json")
    assert megabytes <= 2000
    assert seconds <= 60
    values = json.loads(said)
    assert len(values["groups"]) == GROUPS
    for group in [*values["groups"], *([values["pooled"]] if shared else [])]:
        items = {int(item["name"].split("-")[-1]): item for item in group["items"]}
        off = [(items[number]["theta"] - theta[number]) / items[number]["se"] for number in range(ITEMS)]
        assert 0.8 < float(np.std(off)) < 1.2
    if shared:
        assert values["agreement"]["p"] > 0.001
    else:
        assert values["pooled"] is None


def study(random: np.random.Generator, observers: int, within_sd: float, share: float, groups: int) -> Comparisons:
    """Observers whose strengths differ within each group, each of whom compares a ``share`` of the pairs."""
    one, other = np.triu_indices(5, 1)
    theta = random.normal(0, within_sd, (observers, groups, 5))
    wins = random.random((observers, groups, len(one))) < 1 / (1 + np.exp(theta[..., other] - theta[..., one]))
    observer, group, pair = np.nonzero(random.random(wins.shape) < share)
    won = wins[observer, group, pair]
    winner, loser = np.where(won, one[pair], other[pair]), np.where(won, other[pair], one[pair])
    scenes = tuple(f"scene {number}" for number in range(groups))
    return answered(tuple("abcde"), winner, loser, observers, observer=observer, group=group, groups=scenes)


@pytest.mark.parametrize(("observers", "groups", "share"), [(5, 4, 1.0), (8, 12, 1.0), (30, 2, 0.5)])
@pytest.mark.parametrize("within_sd", [1.5, 0.0][: how_many(1, 2)])
def test_the_test_of_agreement_keeps_its_level(observers: int, groups: int, share: float, within_sd: float) -> None:
    """Of 400 studies without a difference, more than 32 false alarms at 0.05 happen once in 150."""
    random = np.random.default_rng([observers, groups, int(10 * within_sd)])
    false = 0
    for _ in range(400):
        agreement = score_groups(study(random, observers, within_sd, share, groups), covariance="model").agreement
        false += agreement is not None and agreement.p is not None and agreement.p <= 0.05
    print(f"{observers} observers, {groups} groups, sd {within_sd:g}: {false / 400:.3f}")
    assert false <= 32
