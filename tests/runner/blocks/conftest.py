"""A block played to its end by the real engine, and what holds for every block that is played."""

from __future__ import annotations

import json
import random
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import pytest

from analysis.kinds import Trial
from runner.blocks import Block
from runner.observers import plain_key
from runner.ports import Ask, Compare, KeyPress
from runner.session import Resumed, Session
from tests.runner.every_kind import Stage

Press = Callable[[Ask], str]
Play = Callable[..., Stage]


@dataclass
class Presser:
    """Presses what ``press`` says, half a second after each onset."""

    press: Press
    played: Stage

    def respond(self, ask: Ask, onset_s: float) -> KeyPress:
        self.played.asks.append(ask)
        return KeyPress(self.press(ask), onset_s + 0.5)


@pytest.fixture
def play() -> Play:
    """Play a block: ``play(block, press, logged)``; without ``press`` by the plain observer."""

    def played(block: Block, press: Press = plain_key, logged: Sequence[Trial] = ()) -> Stage:
        result = Stage()
        Session(
            (block,), result, Presser(press, result), result, Resumed(logged), utc=lambda: "2026-01-01T00:00:00Z"
        ).run()
        return result

    return played


def at_random(seed: int) -> Press:
    """Return an observer who answers comparisons at random, by keys and clicks, and gets on plainly otherwise."""
    rng = random.Random(seed)

    def press(ask: Ask) -> str:
        if isinstance(ask.task, Compare):
            return rng.choice([*ask.keys, *(f"click {meaning}" for meaning in ask.targets)])
        return plain_key(ask)

    return press


def _said(trial: Trial) -> object:
    """Return what a record says, but for how long scenes stood."""
    return trial.place, trial.kind, trial.events, trial.response_time_s, {**trial.details(), "timed": None}


@pytest.fixture
def promised(play: Play) -> Callable[..., Stage]:
    """Play a block, check what every block promises, and return what became of it.

    Played again it is the same; it ends with its last record; its records are plain; with any part of its log the rest
    is asked and shown as it was.
    """

    def check(block: Block, kind: str, press: Callable[[], Press] = lambda: at_random(1)) -> Stage:
        whole, again = play(block, press()), play(block, press())
        assert (again.shown, again.trials) == (whole.shown, whole.trials)
        assert len(whole.trials) == block.trials
        assert {trial.kind for trial in whole.trials} == {kind}
        assert whole.shown_at_record[-1] == len(whole.shown), "a scene was shown after the last record"
        for trial in whole.trials:
            assert json.loads(json.dumps(trial.details(), allow_nan=False)) == trial.details()
            assert 0 < trial.response_time_s <= sum(seconds for _, seconds in trial.events)
        for answered in range(0, len(whole.trials) + 1, 1 + len(whole.trials) // 12):
            pressed = iter([key for trial in whole.trials[answered:] for key, _ in trial.events])
            rest = play(block, lambda ask, pressed=pressed: next(pressed), logged=whole.trials[:answered])
            assert [_said(trial) for trial in rest.trials] == [_said(trial) for trial in whole.trials[answered:]]
            before = whole.shown_at_record[answered - 1] if answered else 0
            assert len(rest.shown) <= len(whole.shown) - before  # what the log holds is not shown again
            assert rest.shown == whole.shown[len(whole.shown) - len(rest.shown) :]
        return whole

    return check
