"""The time that a rating takes, where presses move the marker and where they do not."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from analysis.records import Mark, Note, PooledBatch, Trial
from runner.blocks.layout import SingleLayout
from runner.blocks.rating import Rating
from runner.blocks.scale import Scale
from runner.observers import Person
from runner.ports import Holding, KeyPress
from runner.presenter import Scene
from runner.session import Session

LAYOUT = SingleLayout((0, 0), (100, 80), (0, -140), 400, 60)


@dataclass
class Sitting:
    """A screen that does not draw again what it shows, a person at it, and what is recorded."""

    presses: list[tuple[str, float]]
    now_s: float = 100.0
    onset_s: float = 0.0
    shown: Scene | None = None
    trials: list[Trial] = field(default_factory=list)

    def show(self, scene: Scene) -> float:
        if scene != self.shown:
            self.shown, self.onset_s = scene, self.now_s
        return self.onset_s

    def prefetch(self, scene: Scene) -> None:
        pass

    def hold(self, scene: Scene, seconds: float) -> Holding:
        raise AssertionError

    def press(self) -> KeyPress:
        key, wait_s = self.presses.pop(0)
        self.now_s += wait_s
        return KeyPress(key, self.now_s)

    def append(self, trial: Trial) -> None:
        self.trials.append(trial)

    def note(self, note: Note) -> None:
        raise AssertionError

    def mark(self, mark: Mark) -> None:
        raise AssertionError

    def pool(self, batch: PooledBatch) -> None:
        pass

    def answers(self) -> Sequence[Trial]:
        return self.trials

    def end(self, facts: Mapping[str, Any]) -> None:
        pass


def test_a_rating_takes_from_the_first_screen_to_the_press_that_accepts_it() -> None:
    """At the end of the scale an arrow moves nothing, nor does a number that stands already."""
    presses = [("0", 1.0), ("right", 2.0), ("right", 0.5), ("0", 0.25), ("enter", 1.5)]
    sitting = Sitting(list(presses))
    block = Rating(("a",), (Scale("quality", "How good?"),), LAYOUT, "seed")
    Session([block], sitting, Person(sitting.press, clock=lambda: sitting.now_s), sitting).run()
    (trial,) = sitting.trials
    assert trial.data["ratings"] == {"quality": 10}
    assert trial.data["rating_times_s"] == {"quality": sum(wait_s for _, wait_s in presses)}
    assert trial.response_time_s == 5.25
