"""The error budget: what each step costs each eye, what all cost together, and what is not known; and a scene for it.

Of the scene the mean light over any pixel is known: a picture of it is right on every grid of pixels. Each channel's
light is a product of raised cosines in x and in y, squared: from next to nothing to 0.88 of full, most of it dark, as
pictures are. Its mean over an interval is a closed form. The finest detail has a period of 12 pixels of the display.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from devices.budget.path import PathStep
from devices.display.model import EYES, Eye, EyeModels
from documents.arrays import Floats
from documents.text import JsonResult

_LEAST, _MOST = 2e-4, 0.88
# Periods of red, green and blue, in pixels of the display, and how far the right eye's picture is moved.
_PERIODS_X_PX, _PERIODS_Y_PX = (96.0, 24.0, 48.0), (32.0, 64.0, 24.0)
_DISPARITY_PX = 7.0


@dataclass(frozen=True, slots=True)
class StepCost:
    """Mean, 95th percentile and largest ΔE00 of one step for one eye.

    Examples
    --------
    >>> StepCost.of(np.array([0.0, 0.1, 0.2])).max
    0.2
    """

    mean: float
    p95: float
    max: float

    @classmethod
    def of(cls, differences: Floats) -> StepCost:
        """Return the cost of ΔE00 (n,), n at least 1."""
        return cls(float(differences.mean()), float(np.percentile(differences, 95)), float(differences.max()))

    def to_json(self) -> dict[str, float]:
        """Return four digits of each."""
        return {name: float(f"{getattr(self, name):.4g}") for name in self.__slots__}


@dataclass(frozen=True, slots=True)
class BudgetRow(JsonResult):
    """One step in ``words``; ``eyes`` is None where what it costs is not known, and the words say why.

    Examples
    --------
    >>> BudgetRow(PathStep.CROSSTALK, "not measured", None).to_json()
    {'step': 'crosstalk_left', 'words': 'not measured', 'left': None, 'right': None}
    """

    step: PathStep
    words: str
    eyes: Mapping[Eye, StepCost] | None
    json_keys: ClassVar = {"costs": "*"}
    json_names: ClassVar = "step words costs"

    @property
    def costs(self) -> Mapping[Eye, StepCost | None]:
        """What it costs each eye, None where that is not known."""
        return self.eyes or dict.fromkeys(EYES)


@dataclass(frozen=True, slots=True)
class ErrorBudget(JsonResult):
    """The steps in the order of the way, all together last; ``colours`` says what they were computed of.

    Examples
    --------
    >>> budget = ErrorBudget("two greys", (BudgetRow(PathStep.CROSSTALK, "not measured", None),))
    >>> budget.row(PathStep.CROSSTALK).words
    'not measured'
    """

    colours: str
    rows: tuple[BudgetRow, ...]
    json_keys: ClassVar = {"rows": "steps"}

    @classmethod
    def of(
        cls,
        colours: str,
        differences: Mapping[PathStep, Mapping[Eye, Floats]],
        words: Mapping[PathStep, str],
        stated: Mapping[PathStep, Mapping[Eye, StepCost]],
    ) -> ErrorBudget:
        """Return the rows of every step that there are ``words`` for: computed, ``stated`` elsewhere, or not known."""
        rows = []
        for step in PathStep:
            if step in words:
                computed = differences.get(step)
                found = stated.get(step) if computed is None else {eye: StepCost.of(computed[eye]) for eye in EYES}
                rows.append(BudgetRow(step, words[step], found))
        return cls(colours, tuple(rows))

    def row(self, step: PathStep) -> BudgetRow:
        """Return the row of ``step``; KeyError if there is none."""
        return {row.step: row for row in self.rows}[step]


@dataclass(frozen=True, slots=True)
class SmoothScene:
    """The scene for a display, of ``size_px`` pixels (width, height).

    Parameters
    ----------
    models
        What each eye sees of the display: the scene lies in the gamut of each.
    size_px
        Width and height, in pixels of the display.

    Examples
    --------
    >>> from pathlib import Path
    >>> from devices.display import read_display
    >>> models = read_display(Path("configs/displays/asus_vg248qe.yaml")).models("side-by-side")
    >>> scene = SmoothScene(models, (192, 128))
    >>> fine, coarse = scene.view("left", (384, 256)), scene.view("left", (192, 128))
    >>> bool(np.allclose(fine.reshape(128, 2, 192, 2, 3).mean(axis=(1, 3)), coarse))
    True
    """

    models: EyeModels
    size_px: tuple[int, int]

    def view(self, eye: Eye, pixels: tuple[int, int]) -> Floats:
        """Return the eye's view on a grid of ``pixels`` (width, height) over the scene, XYZ (height, width, 3)."""
        model = self.models.eye(eye).in_the_dark
        lowest, highest = model.limits
        moved_px = _DISPARITY_PX if eye == "right" else 0.0
        across = _means(self.size_px[0], pixels[0], _PERIODS_X_PX, moved_px)
        down = _means(self.size_px[1], pixels[1], _PERIODS_Y_PX, 0.0)
        light = _LEAST + _MOST * down[:, np.newaxis] * across[np.newaxis]
        return np.asarray(model.dark_XYZ_cd_m2 + (lowest + (highest - lowest) * light) @ model.primaries_XYZ_cd_m2.T)


def _means(length_px: int, pixels: int, periods_px: tuple[float, ...], moved_px: float) -> Floats:
    """Return the means over each of ``pixels`` of ((1 + cos θ)/2)² = 3/8 + cos θ/2 + cos 2θ/8, (pixels, channels)."""
    edges = np.linspace(0.0, length_px, pixels + 1)[:, np.newaxis] + moved_px
    wave = 2.0 * np.pi / np.array(periods_px)
    integral = 0.375 * edges + np.sin(wave * edges) / (2.0 * wave) + np.sin(2.0 * wave * edges) / (16.0 * wave)
    return np.asarray(np.diff(integral, axis=0) * (pixels / length_px))
