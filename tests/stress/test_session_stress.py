"""Sessions and their files pushed to the edges."""

from __future__ import annotations

import random
import time
import tracemalloc
from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from analysis.records import FILE_NAME, Header, Mark, Note, PooledBatch, Trial, read_session
from documents import InputError
from documents.yaml import parse_yaml
from runner.blocks.all_pairs import AllPairs
from runner.blocks.layout import PairLayout
from runner.blocks.orders import pair_order
from runner.observers import BradleyTerryObserver
from runner.ports import Holding
from runner.presenter import Scene
from runner.session import Session
from runner.session.folders import Recorder

pytestmark = pytest.mark.stress
LAYOUT = PairLayout("vertical", (0, -60), (0, 60), (100, 80), (0, -140), 400)
STIMULI = tuple({"name": f"s{index}"} for index in range(51))
HEADER = Header("e", "01", "s", "2026-01-01T00:00:00+00:00", 0, "Which?", True, STIMULI, {}, {}, {}, {}, {})


class _Nothing:
    trials = 0

    def show(self, scene: Scene) -> float:
        return 0.0

    def prefetch(self, scene: Scene) -> None:
        pass

    def hold(self, scene: Scene, seconds: float) -> Holding:
        return Holding(self.show(scene), 1, seconds)

    def append(self, trial: Trial) -> None:
        self.trials += 1

    def note(self, note: Note) -> None:
        pass

    def mark(self, mark: Mark) -> None:
        pass

    def pool(self, batch: PooledBatch) -> None:
        pass

    def answers(self) -> tuple[Trial, ...]:
        return ()

    def end(self, facts: Mapping[str, Any]) -> None:
        pass


def _block(stimuli: int, repeats: int) -> tuple[AllPairs, BradleyTerryObserver]:
    names = tuple(f"s{index}" for index in range(stimuli))
    scores = {name: 1.0 + index for index, name in enumerate(names)}
    return AllPairs(names, "Which?", LAYOUT, "s", "o", repeats=repeats), BradleyTerryObserver(scores, random.Random(1))


def test_a_hundred_thousand_trials_cost_under_a_millisecond_each_and_keep_nothing() -> None:
    block, observer = _block(51, 80)  # 102,000 trials
    nothing = _Nothing()
    began = time.process_time()
    Session((block,), nothing, observer, nothing).run()
    assert nothing.trials == 102_000
    assert (time.process_time() - began) / nothing.trials < 1e-3


def test_memory_does_not_grow_with_the_trials() -> None:
    """The order of trials is drawn at the start; after that, a trial leaves nothing behind."""
    block, observer = _block(41, 12)  # 9,840 trials
    nothing = _Nothing()
    sizes: list[int] = []

    def watch(trial: Trial) -> None:
        if trial.trial in (2_000, 9_000):
            sizes.append(tracemalloc.get_traced_memory()[0])

    tracemalloc.start()
    try:
        Session((block,), nothing, observer, nothing, on_trial=watch).run()
    finally:
        tracemalloc.stop()
    assert sizes[1] - sizes[0] < 100_000


def test_a_log_of_ten_thousand_answers_reads_back_and_resumes(tmp_path: Path) -> None:
    block, observer = _block(41, 12)
    with Recorder.create(tmp_path / "s", HEADER) as recorder:
        Session((block,), _Nothing(), observer, recorder).run()
    log = read_session(tmp_path / "s" / FILE_NAME)
    assert log.complete
    assert len(log.trials) == 9_840
    nothing = _Nothing()
    Session((block,), nothing, observer, nothing, logged=log.trials[:9_000]).run()
    assert nothing.trials == 840


def test_two_hundred_stimuli_are_ordered_with_balanced_sides() -> None:
    order = pair_order(200, 1, "s", "o")
    assert len(set(map(frozenset, order))) == 19_900
    first = [0] * 200
    for one, _ in order:
        first[one] += 1
    assert max(first) - min(first) <= 1
    assert all(not set(one) & set(other) for one, other in pairwise(order))


@pytest.mark.parametrize("seed", range(20))
def test_random_bytes_as_yaml_are_a_value_or_one_finding(seed: int) -> None:
    rng = random.Random(seed)
    for _ in range(500):
        text = "".join(rng.choice("ab:- []{}&*!|>'\"\n\t#0é%@`,?\u202e\x01") for _ in range(rng.randrange(60)))
        findings = 0
        try:
            parse_yaml(text, "f.yaml")
        except InputError as error:
            findings = len(error.findings)
        assert findings <= 1
