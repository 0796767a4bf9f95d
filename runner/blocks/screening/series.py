"""Descending series: some presentations at each level from coarse to fine, until a level is not passed."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from analysis.observers.screening import threshold_estimate
from runner.ports import Target
from runner.presenter.scene import Item
from stimuli.pictures.stereo_image import StereoImage
from stimuli.vision_tests.random_dots import SIDES, Side


@dataclass(frozen=True, slots=True)
class Presentation:
    """A picture ``picture`` made by ``make``, and the side that is the right answer.

    ``strength`` is how plain it is to a simulated observer, above 0 and larger where it is plainer; None if there is no
    measure of it. ``details`` stand in its record.
    """

    picture: str
    make: Callable[[], StereoImage]
    correct: Side
    strength: float | None = None
    details: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Level:
    """Presentations of one level; it is passed by ``required`` right answers of them."""

    value: float
    presentations: tuple[Presentation, ...]
    required: int


@dataclass(frozen=True, slots=True)
class Series:
    """Levels from coarse to fine, smaller numbers being finer. A ``control`` tells only whether the test was meant."""

    name: str
    task: str
    levels: tuple[Level, ...]
    control: bool = False


@dataclass(frozen=True, slots=True)
class VisionTest:
    """One test: its series, one after the other, all of which must reach ``pass_mark``.

    ``words`` are read before it, ``question`` stands above each picture of ``side_px``, with ``marks`` on it and
    ``targets`` to click. ``facts`` say what the screen can show of it and stand in the record.
    """

    name: str
    unit: str
    pass_mark: float
    words: str
    question: str
    side_px: int
    series: tuple[Series, ...]
    facts: Mapping[str, Any]
    targets: Mapping[str, Target]
    marks: tuple[Item, ...] = ()
    logarithmic: bool = False

    @property
    def presentations(self) -> int:
        """How many presentations there are for someone who sees everything."""
        return sum(len(level.presentations) for series in self.series for level in series.levels)


@dataclass(slots=True)
class Answers:
    """The answers to a series so far."""

    series: Series
    strengths: list[float] = field(default_factory=list)
    right: list[bool] = field(default_factory=list)
    threshold: float | None = None
    _here: list[bool] = field(default_factory=list)

    def add(self, presentation: Presentation, *, right: bool) -> None:
        """Note an answer at the current level."""
        self._here.append(right)
        self.right.append(right)
        if presentation.strength is not None:
            self.strengths.append(presentation.strength)

    def can_pass(self, level: Level, *, if_wrong: bool = False) -> bool:
        """Return whether ``level`` can still be passed, also if the next answer is wrong."""
        wrong = self._here.count(False) + if_wrong
        return len(level.presentations) - wrong >= level.required

    def end_level(self, level: Level) -> bool:
        """Close the current level, and return whether it was passed."""
        passed = self._here.count(True) >= level.required
        if passed:
            self.threshold = level.value
        self._here = []
        return passed

    @property
    def estimate(self) -> float | None:
        """The threshold by maximum likelihood, as a strength; None if the answers leave it open."""
        if len(self.strengths) != len(self.right):
            return None
        return threshold_estimate(self.strengths, self.right, len(SIDES))


def four_targets(offset_px: float, size_px: float) -> dict[str, Target]:
    """Return a square to click at each side, its middle at ``offset_px`` from the middle of the view."""
    size = round(size_px), round(size_px)
    return {
        "up": Target((0, -round(offset_px)), size),
        "down": Target((0, round(offset_px)), size),
        "left": Target((-round(offset_px), 0), size),
        "right": Target((round(offset_px), 0), size),
    }
