"""A block played to its end by the real engine on a screen and a sheet of paper that remember."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import pytest

from analysis.records import Mark, Note, PooledBatch, Trial
from runner.blocks import Block
from runner.observers.simulated import plain_key
from runner.ports import Ask, Holding, KeyPress
from runner.presenter import Scene
from runner.session import Session

Press = Callable[[Ask], str]
Play = Callable[..., "Played"]


@dataclass
class Played:
    """What became of a block: everything in order (``asks`` also as list), and its records."""

    trials: list[Trial] = field(default_factory=list)
    shown: list[Scene] = field(default_factory=list)
    asks: list[Ask] = field(default_factory=list)
    prefetched: list[Scene] = field(default_factory=list)
    shown_at_record: list[int] = field(default_factory=list)

    def show(self, scene: Scene) -> float:
        self.shown.append(scene)
        return float(len(self.shown))

    def prefetch(self, scene: Scene) -> None:
        self.prefetched.append(scene)

    def hold(self, scene: Scene, seconds: float) -> Holding:
        return Holding(self.show(scene), round(10 * seconds), 0.1)

    def append(self, trial: Trial) -> None:
        self.trials.append(trial)
        self.shown_at_record.append(len(self.shown))

    def note(self, note: Note) -> None:
        raise NotImplementedError

    def mark(self, mark: Mark) -> None:
        raise NotImplementedError

    def pool(self, batch: PooledBatch) -> None:
        pass

    def answers(self) -> Sequence[Trial]:
        return self.trials

    def end(self, facts: Mapping[str, Any]) -> None:
        pass


@dataclass
class Presser:
    """Presses what ``press`` says, half a second after each onset."""

    press: Press
    played: Played

    def respond(self, ask: Ask, onset_s: float) -> KeyPress:
        self.played.asks.append(ask)
        return KeyPress(self.press(ask), onset_s + 0.5)


@pytest.fixture
def play() -> Play:
    """Play a block: ``play(block, press, logged)``; without ``press`` by the plain observer."""

    def played(block: Block, press: Press = plain_key, logged: Sequence[Trial] = ()) -> Played:
        result = Played()
        Session((block,), result, Presser(press, result), result, logged=logged, utc=lambda: "2026").run()
        return result

    return played
