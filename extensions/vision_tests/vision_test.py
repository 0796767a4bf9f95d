"""What the vision tests share: the screen as an eye sees it, and descending series of levels.

A series shows some presentations at each level from coarse to fine, until a level is not passed.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Annotated, Any

from pydantic import Field, model_validator

from devices.colour_matching import DEFAULT_OBSERVER
from devices.display import EyeModels, disparity_arcmin, mm_from_px, px_from_mm, size_mm, visual_angle_deg
from documents.yaml import FileModel, Positive
from extensions.vision_tests.record import SIDES, Side
from extensions.vision_tests.shown_range import ShownRange
from runner.ports import Button
from runner.scene import Item
from stimuli.pictures import StereoImage

Repeats = Annotated[int, Field(ge=1, le=20)]
Levels = Annotated[tuple[Positive, ...], Field(min_length=1, max_length=20)]


@dataclass(frozen=True, slots=True)
class Screen:
    """An eye's view of ``view_px`` and the geometry in which it is seen.

    ``grain_px`` is how many pixels of the view, across and down, there are to one that the eye is really shown: 2 where
    a mode squeezes the view or gives the eye every second row or column, else 1.
    """

    view_px: tuple[int, int]
    pixel_pitch_mm: float
    distance_mm: float
    interpupillary_distance_mm: float
    grain_px: tuple[int, int]
    models: EyeModels
    observer: str = DEFAULT_OBSERVER

    @property
    def shown(self) -> ShownRange:
        """The light that both eyes can be shown."""
        return ShownRange(self.models)

    def px(self, angle_deg: float) -> float:
        """Return how many pixels subtend an angle, about the middle of the view."""
        return float(px_from_mm(size_mm(angle_deg, self.distance_mm), self.pixel_pitch_mm))

    def degrees(self, length_px: float) -> float:
        """Return the angle of a length about the middle of the view."""
        return float(visual_angle_deg(mm_from_px(length_px, self.pixel_pitch_mm), self.distance_mm))

    def fitting_px(self, angle_deg: float) -> int:
        """Return the side of a square of ``angle_deg``, or of the largest one that fits with words above and below."""
        width, height = self.view_px
        return int(min(self.px(angle_deg), 0.92 * width, 0.68 * height))

    def parallax_px(self, disparity_arcsec: float) -> float:
        """Return the right eye's place minus the left's for a disparity: negative is in front, nearer than the screen.

        Undoes `disparity_arcmin` of devices.display.viewing: the eyes converge on the point by as much more than on the
        screen.
        """
        eyes_mm = self.interpupillary_distance_mm
        screen_deg = float(visual_angle_deg(eyes_mm, self.distance_mm))
        parallax_mm = eyes_mm - size_mm(screen_deg - disparity_arcsec / 3600.0, self.distance_mm)
        return float(px_from_mm(parallax_mm, self.pixel_pitch_mm))

    def disparity_arcsec(self, parallax_px: float) -> float:
        """Return the disparity of a parallax; positive is behind the screen."""
        geometry = self.pixel_pitch_mm, self.distance_mm, self.interpupillary_distance_mm
        return 60.0 * float(disparity_arcmin(parallax_px, *geometry))


@dataclass(frozen=True, slots=True)
class Presented:
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
class VisionSeries:
    """Presentations by level, from coarse to fine, smaller being finer.

    A level is passed by ``required`` right answers. A ``control`` shows only whether the test was understood.
    """

    name: str
    task: str
    levels: Mapping[float, tuple[Presented, ...]]
    required: int
    control: bool = False


@dataclass(frozen=True, slots=True)
class VisionTest:
    """One test: its series, one after the other, all of which must reach ``pass_mark``.

    The interface's words called ``page`` are read before it, those called ``question`` stand above each picture of
    ``side_px``, with ``marks`` on it and ``targets`` to click. ``facts`` say what the screen can show of it and stand
    in the record.
    """

    name: str
    unit: str
    pass_mark: float
    page: str
    question: str
    side_px: int
    series: tuple[VisionSeries, ...]
    facts: Mapping[str, Any]
    targets: Mapping[str, Button]
    marks: tuple[Item, ...] = ()
    logarithmic: bool = False

    @property
    def presentations(self) -> int:
        """How many presentations there are for someone who sees everything."""
        return sum(len(shown) for series in self.series for shown in series.levels.values())


SLOPE = 4.0  # log odds per factor of e in strength
LAPSES = 0.02
_STEP = 0.02
_BEYOND = math.log(2.0)


def threshold_estimate(strengths: Sequence[float], right: Sequence[bool], options: int) -> float | None:
    """Return the threshold of a logistic psychometric function by maximum likelihood; None without a maximum.

    The probability of a right answer is guess + (1 - guess - lapses) · logistic(slope · ln(strength / threshold)), with
    a slope of 4 and 0.02 lapses: a few answers cannot estimate these two. The search goes from half the smallest of
    ``strengths``, all above 0, to twice the largest; a maximum at either end gives None.

    Parameters
    ----------
    strengths
        Shape (m,): strength of each presentation, above 0, in the unit of the test.
    right
        Shape (m,): whether each answer was right.
    options
        Number of answers to choose from, at least 2; the guessing rate is 1 / options.

    Returns
    -------
    float | None
        The threshold in the unit of ``strengths``; None without answers, or without a maximum within the search.

    Examples
    --------
    >>> threshold = threshold_estimate([1, 1, 2, 2, 4, 4], [False, False, True, False, True, True], 4)
    >>> threshold is not None and 1 < threshold < 4
    True
    """
    if not strengths:
        return None
    guess = 1.0 / options
    low = math.log(min(strengths)) - _BEYOND
    count = math.ceil((math.log(max(strengths)) + _BEYOND - low) / _STEP)
    places = [math.log(strength) for strength in strengths]

    def log_likelihood(threshold: float) -> float:
        total = 0.0
        for place, was_right in zip(places, right, strict=True):
            known = 1.0 / (1.0 + math.exp(-SLOPE * (place - threshold)))
            chance = guess + (1.0 - guess - LAPSES) * known
            total += math.log(chance if was_right else 1.0 - chance)
        return total

    likelihoods = [log_likelihood(low + _STEP * index) for index in range(count + 1)]
    best = max(range(count + 1), key=likelihoods.__getitem__)
    return None if best in (0, count) else math.exp(low + _STEP * best)


@dataclass(slots=True)
class TrialAnswers:
    """The answers to a series so far."""

    series: VisionSeries
    strengths: list[float] = field(default_factory=list)
    right: list[bool] = field(default_factory=list)
    threshold: float | None = None
    _here: list[bool] = field(default_factory=list)

    def add(self, presentation: Presented, *, right: bool) -> None:
        """Note an answer at the current level."""
        self._here.append(right)
        self.right.append(right)
        if presentation.strength is not None:
            self.strengths.append(presentation.strength)

    def can_pass(self, level: float, *, if_wrong: bool = False) -> bool:
        """Return whether ``level`` can still be passed, also if the next answer is wrong."""
        wrong = self._here.count(False) + if_wrong
        return len(self.series.levels[level]) - wrong >= self.series.required

    def end_level(self, level: float) -> bool:
        """Close the current level, and return whether it was passed."""
        passed = self._here.count(True) >= self.series.required
        if passed:
            self.threshold = level
        self._here = []
        return passed

    @property
    def estimate(self) -> float | None:
        """The threshold by maximum likelihood, as a strength; None if the answers leave it open."""
        if len(self.strengths) != len(self.right):
            return None
        return threshold_estimate(self.strengths, self.right, len(SIDES))


def four_targets(offset_px: float, size_px: float) -> dict[str, Button]:
    """Return a square to click at each side, its middle at ``offset_px`` from the middle of the view."""
    size = round(size_px), round(size_px)
    return {
        "up": Button((0, -round(offset_px)), size),
        "down": Button((0, round(offset_px)), size),
        "left": Button((-round(offset_px), 0), size),
        "right": Button((round(offset_px), 0), size),
    }


class VisionTestSpec(FileModel):
    """A test; a level is passed by ``required`` right answers of ``repeats``, and the first failed ends a series."""

    repeats: Repeats = 4
    """How many times each level is shown."""
    required: Repeats = 3
    """How many right answers of a level pass it."""

    @model_validator(mode="after")
    def _possible(self) -> VisionTestSpec:
        if self.required > self.repeats:
            raise ValueError(f"'required' is {self.required} of only {self.repeats} 'repeats'")
        return self

    @abstractmethod
    def make(self, screen: Screen, seed: str) -> VisionTest:
        """Return the test on ``screen``; raise SessionError if the screen cannot show its pass mark."""
