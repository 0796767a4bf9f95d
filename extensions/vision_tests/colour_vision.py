"""Colour vision: a ring of dots along each dichromat's confusion line. A screen, no diagnosis."""

from __future__ import annotations

import random
from functools import partial
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from documents import Finding
from documents.yaml import Positive
from extensions.vision_tests.confusion_plates import AXES, SCALES, Axis, ConfusionPlate, copunctal_xy
from extensions.vision_tests.record import SIDES, Side
from extensions.vision_tests.vision_test import (
    Levels,
    Presented,
    Screen,
    VisionSeries,
    VisionTest,
    VisionTestSpec,
    four_targets,
)
from runner.errors import SessionError

NAME = "colour_vision"
PLATE_DEG = 10.0
# How much lighter the ring of a control plate is than its ground: more than the dots differ among themselves.
_CONTROL_SCALE = 0.25


class ColourVisionSpec(VisionTestSpec):
    """Rings of dots on the confusion lines of ``axes``; levels are distances in CIE 1976 u'v'."""

    test: Literal["colour_vision"]
    """Which vision test this is."""
    pass_delta_uv: Positive = 0.02
    """The distance in u'v' that must be seen to pass."""
    levels_delta_uv: Levels = (0.05, 0.03, 0.02)
    """The distances in u'v' that are shown, from large to small."""
    axes: Annotated[tuple[Axis, ...], Field(min_length=1)] = AXES
    """The confusion lines that are tested."""
    controls: Annotated[int, Field(ge=0, le=20)] = 3
    """How many plates that everyone sees are mixed in."""

    def make(self, screen: Screen, seed: str) -> VisionTest:
        """Return the test; levels outside the display's gamut are left out, and its ``facts`` say which.

        Raises
        ------
        SessionError
            If the display cannot show the pass mark on one of the axes.
        InputError
            If the rig's observer has no cone fundamentals.
        """
        plate = ConfusionPlate(screen.fitting_px(PLATE_DEG), screen.shown, copunctal_xy(screen.observer))
        rng = random.Random(f"{seed}/{NAME}")
        wanted = sorted({*self.levels_delta_uv, self.pass_delta_uv}, reverse=True)
        ring_size = plate.side_px * 0.5

        def presentation(series: str, level: float, number: int, ring_XYZ: Any, strength: float | None) -> Presented:
            name = f"{seed}/{NAME}/{series}/{level:g}/{number}"
            side: Side = rng.choice(SIDES)
            details = {"ring_XYZ_cd_m2": [round(float(value), 4) for value in ring_XYZ]}
            return Presented(name, partial(plate.draw, side, ring_XYZ, name), side, strength, details)

        def along(axis: Axis, level: float) -> tuple[Presented, ...]:
            signs = [sign for sign in (1, -1) if plate.can_show(axis, sign * level)]
            first = rng.randrange(2)
            return tuple(
                presentation(axis, level, n, plate.colour(axis, signs[(n + first) % len(signs)] * level), level)
                for n in range(self.repeats)
            )

        axes = tuple(dict.fromkeys(self.axes))
        series = []
        if self.controls:
            # All the ring's dots are darker than the ground's, by light that every eye sees.
            dark = plate.ground_XYZ * _CONTROL_SCALE
            shown = tuple(presentation("control", 0.0, number, dark, None) for number in range(self.controls))
            series.append(
                VisionSeries("control", f"{NAME}_control", {0.0: shown}, max(1, self.controls - 1), control=True)
            )
        outside: dict[str, list[float]] = {}
        for axis in axes:
            can = [level for level in wanted if any(plate.can_show(axis, sign * level) for sign in (1, -1))]
            if self.pass_delta_uv not in can:
                most = f"at most {max(can):g}" if can else f"less than {min(wanted):g}"
                raise SessionError(
                    Finding(
                        f"screening: along the {axis} line the display shows {most} of u'v', "
                        f"not the pass mark of {self.pass_delta_uv:g}",
                        remedy="raise or lower pass_delta_uv, or leave the axis out",
                    )
                )
            outside[axis] = [level for level in wanted if level not in can]
            series.append(
                VisionSeries(axis, f"{NAME}_{axis}", {level: along(axis, level) for level in can}, self.required)
            )
        facts = {
            "what_it_is": "a screen, no diagnosis",
            "ground_XYZ_cd_m2": [round(float(value), 4) for value in plate.ground_XYZ],
            "dots_scaled_by": [round(scale, 2) for scale in SCALES],
            "copunctal_xy": {axis: list(plate.points[axis]) for axis in axes},
            "plate_deg": round(screen.degrees(plate.side_px), 2),
            "levels_delta_uv": wanted,
            "outside_the_gamut_delta_uv": outside,
            "luminance_of_ring_per_ground": {axis: _luminances(plate, axis, self.pass_delta_uv) for axis in axes},
        }
        return VisionTest(
            NAME,
            "delta_uv",
            self.pass_delta_uv,
            "colour_page",
            "gap_question",
            plate.side_px,
            tuple(series),
            facts,
            four_targets(0.55 * ring_size, 0.5 * ring_size),
        )


def _luminances(plate: ConfusionPlate, axis: Axis, level: float) -> list[float]:
    """Return what luminance the ring's mean has of the ground's, for each sign that can be shown at ``level``."""
    return [
        round(float(np.asarray(plate.colour(axis, sign * level))[1] / plate.ground_XYZ[1]), 4)
        for sign in (1, -1)
        if plate.can_show(axis, sign * level)
    ]
