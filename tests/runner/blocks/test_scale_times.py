"""The time that a rating takes, where presses move the marker and where they do not."""

from __future__ import annotations

from dataclasses import dataclass, field

from runner import Scene
from runner.observers import Person
from runner.ports import KeyPress
from runner.session import Session
from tests.runner.every_kind import Stage, met, setting


@dataclass
class Sitting(Stage):
    """A screen that does not draw again what it shows, and a person at it."""

    presses: list[tuple[str, float]] = field(default_factory=list)
    now_s: float = 100.0
    onset_s: float = 0.0

    def show(self, scene: Scene) -> float:
        if [scene] != self.shown[-1:]:
            self.onset_s = self.now_s
        self.shown.append(scene)
        return self.onset_s

    def press(self) -> KeyPress:
        key, wait_s = self.presses.pop(0)
        self.now_s += wait_s
        return KeyPress(key, self.now_s)


def test_a_rating_takes_from_the_first_screen_to_the_press_that_accepts_it() -> None:
    """At the end of the scale an arrow moves nothing, nor does a number that stands already."""
    presses = [("0", 1.0), ("right", 2.0), ("right", 0.5), ("0", 0.25), ("enter", 1.5)]
    sitting = Sitting(presses=list(presses))
    block = met("rating", setting("a"), ratings=[{"name": "quality", "question": "How good?"}])
    Session([block], sitting, Person(sitting.press, clock=lambda: sitting.now_s), sitting).run()
    (trial,) = sitting.trials
    assert trial.details()["ratings"] == {"quality": 10}
    assert trial.details()["rating_times_s"] == {"quality": sum(wait_s for _, wait_s in presses)}
    assert trial.response_time_s == 5.25
