"""Acuity of observers on the rig itself: near acuity by Landolt rings, stereo acuity by squares of random dots.

Near acuity is tested at the rig's own distance, dark on light, with both eyes open [ISO8596]. Stereo acuity asks which
of four squares of random dots lies in front of the others or behind them, in the spirit of the tests of stereopsis that
[ITU2021] asks of observers (VT-04): random dots, four answers, disparities from coarse to fine.
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Sequence
from functools import partial
from typing import Annotated, Any, Literal

from pydantic import Field

from documents import Finding
from documents.yaml import Positive
from extensions.vision_tests.optotypes import landolt
from extensions.vision_tests.random_dots import DotField, stereogram
from extensions.vision_tests.record import SIDES
from extensions.vision_tests.vision_test import (
    Levels,
    Presented,
    Repeats,
    Screen,
    VisionSeries,
    VisionTest,
    VisionTestSpec,
    four_targets,
)
from runner.errors import SessionError
from runner.scene import Box

NEAR, STEREO = "near_acuity", "stereo_acuity"

LogMAR = Annotated[float, Field(ge=-1, le=2)]
Sizes = Annotated[tuple[LogMAR, ...], Field(min_length=1, max_length=20)]
GROUND_DEG = 6.0
NEAR_GROUND_SHARE, RING_SHARE = 0.80, 0.02


def finest_logmar(screen: Screen) -> float:
    """Return the smallest size that the screen shows: the gap is one pixel, of those that an eye is really shown."""
    return math.log10(60.0 * screen.degrees(max(screen.grain_px)))


def gap_px(screen: Screen, logmar: float) -> float:
    """Return the width of the gap, which subtends 10 to the power of ``logmar`` minutes of arc."""
    return screen.px(10.0**logmar / 60.0)


class NearAcuitySpec(VisionTestSpec):
    """Landolt rings; ``levels_logmar`` are logarithms of the gap in minutes of arc."""

    test: Literal["near_acuity"]
    """Which vision test this is."""
    repeats: Repeats = 5
    """How many times each level is shown."""
    required: Repeats = 4
    """How many right answers of a level pass it."""
    pass_logmar: LogMAR = 0.2
    """The size in logMAR that must be seen to pass."""
    levels_logmar: Sizes = (0.6, 0.5, 0.4, 0.3, 0.2, 0.1, 0.0, -0.1)
    """The sizes in logMAR that are shown, from large to small."""

    def make(self, screen: Screen, seed: str) -> VisionTest:
        """Return the test; sizes that the screen cannot show are left out, and its ``facts`` say which.

        Raises
        ------
        SessionError
            If the screen cannot show the pass mark.
        """
        side = screen.fitting_px(GROUND_DEG)
        finest, coarsest = finest_logmar(screen), math.log10(60.0 * screen.degrees(side / 8))
        if not finest <= self.pass_logmar <= coarsest:
            raise SessionError(
                Finding(
                    f"screening: at this distance the rig shows rings of {math.ceil(100 * finest) / 100:.2f} to "
                    f"{math.floor(100 * coarsest) / 100:.2f} logMAR, not the pass mark of {self.pass_logmar:g}",
                    remedy="change pass_logmar, or leave near_acuity out and test acuity with a printed chart",
                )
            )
        wanted = sorted({*self.levels_logmar, self.pass_logmar}, reverse=True)
        levels = [level for level in wanted if finest <= level <= coarsest]
        rng = random.Random(f"{seed}/{NEAR}")
        ground, ring = screen.shown.grey(NEAR_GROUND_SHARE), screen.shown.grey(RING_SHARE)

        def presentation(level: float, number: int) -> Presented:
            name = f"{seed}/{NEAR}/{level:g}/{number}"
            gap, open_at = gap_px(screen, level), rng.choice(SIDES)
            make = partial(landolt, gap, open_at, side, ground, ring)
            return Presented(name, make, open_at, 10.0**level, {"gap_px": round(gap, 4)})

        facts: dict[str, Any] = {
            "finest_logmar": round(finest, 4),
            "one_pixel_arcmin": round(60 * screen.degrees(1.0), 4),
            "ground_luminance_cd_m2": round(float(ground[1]), 3),
            "ring_luminance_cd_m2": round(float(ring[1]), 3),
            "eyes": "both open",
            "levels_logmar": levels,
            "not_shown_logmar": [level for level in wanted if level not in levels],
        }
        return VisionTest(
            NEAR,
            "logmar",
            self.pass_logmar,
            "near_page",
            "gap_question",
            side,
            (_series(NEAR, self, levels, presentation),),
            facts,
            four_targets(side / 4, side / 3),
            logarithmic=True,
        )


Depth = Literal["crossed", "uncrossed", "both"]
# The finest parallax that is called faithful, in pixels that an eye is really shown. Codes of 8 bits hold a hundredth
# of it; how sharp the panel is between its pixels nobody measured, and that decides.
FINEST_PX = 0.2
FIELD_DEG, TARGET_SHARE, OFFSET_SHARE = 10.0, 0.26, 0.30
_DOTS_PER_SQUARE_DEG, _SPOT_ARCMIN = 40.0, 1.0
# Dots brighter than a ground that is not black: what leaks from a dot to the other eye can be taken off the ground.
STEREO_GROUND_SHARE, DOT_SHARE = 0.10, 0.70
_MEASURED = "measured back from codes of 8 bits, a parallax errs by less than 0.02 px; the panel and the eyes were not"


def finest_arcsec(screen: Screen) -> float:
    """Return the smallest disparity that the screen is taken to show faithfully."""
    return screen.disparity_arcsec(FINEST_PX * screen.grain_px[0])


def coarsest_arcsec(screen: Screen) -> float:
    """Return the largest disparity: a quarter of a square's side."""
    return -screen.disparity_arcsec(-dot_field(screen).target_px / 4)


def dot_field(screen: Screen) -> DotField:
    """Return the field of dots; 10° wide, or as wide as fits."""
    side = screen.fitting_px(FIELD_DEG)
    spots = tuple(max(float(grain), screen.px(_SPOT_ARCMIN / 60.0)) for grain in screen.grain_px)
    dots = round(_DOTS_PER_SQUARE_DEG * screen.degrees(side) ** 2 / (spots[0] * spots[1]) * _spot_area(screen))
    return DotField(side, TARGET_SHARE * side, OFFSET_SHARE * side, (spots[0], spots[1]), dots)


def _spot_area(screen: Screen) -> float:
    """Return the area of the spots of a mode in which each eye has all pixels: larger spots are fewer."""
    return float(max(1.0, screen.px(_SPOT_ARCMIN / 60.0))) ** 2


class StereoAcuitySpec(VisionTestSpec):
    """Random-dot stereograms; ``levels_arcsec`` from coarse to fine, the pass mark among them in any case."""

    test: Literal["stereo_acuity"]
    """Which vision test this is."""
    pass_arcsec: Positive = 140.0
    """The disparity in arcsec that must be seen to pass."""
    levels_arcsec: Levels = (600.0, 400.0, 280.0, 200.0, 140.0, 100.0, 70.0, 50.0)
    """The disparities in arcsec that are shown, from large to small."""
    depth: Depth = "both"
    """Whether the square lies in front (crossed), behind (uncrossed), or both in turn."""

    def make(self, screen: Screen, seed: str) -> VisionTest:
        """Return the test; levels that the screen cannot show are left out, and its ``facts`` say which.

        Raises
        ------
        SessionError
            If the screen cannot show the pass mark.
        """
        field = dot_field(screen)
        finest, coarsest = finest_arcsec(screen), coarsest_arcsec(screen)
        if not finest <= self.pass_arcsec <= coarsest:
            raise SessionError(
                Finding(
                    f"screening: the rig shows disparities of {finest:.0f} to {coarsest:.0f} arcsec, "
                    f"not the pass mark of {self.pass_arcsec:g} arcsec",
                    remedy="change pass_arcsec, or the viewing distance",
                )
            )
        wanted = sorted({*self.levels_arcsec, self.pass_arcsec}, reverse=True)
        levels = [level for level in wanted if finest <= level <= coarsest]
        rng = random.Random(f"{seed}/{STEREO}")
        ground, dot = screen.shown.grey(STEREO_GROUND_SHARE), screen.shown.grey(DOT_SHARE)

        def presentation(level: float, number: int) -> Presented:
            name = f"{seed}/{STEREO}/{level:g}/{number}"
            direction = ("crossed", "uncrossed")[number % 2] if self.depth == "both" else self.depth
            parallax = screen.parallax_px(-level if direction == "crossed" else level)
            side = rng.choice(SIDES)
            make = partial(stereogram, field, side, parallax, ground, dot, name)
            return Presented(name, make, side, level, {"depth": direction, "parallax_px": round(parallax, 6)})

        facts: dict[str, Any] = {
            "one_pixel_arcsec": round(screen.disparity_arcsec(1.0), 2),
            "finest_arcsec": round(finest, 2),
            "finest_px": FINEST_PX * screen.grain_px[0],
            "faithful": _MEASURED,
            "field_deg": round(screen.degrees(field.side_px), 2),
            "target_deg": round(screen.degrees(field.target_px), 2),
            "spot_arcmin": round(60 * screen.degrees(2.355 * field.spots_px[0]), 2),
            "dots": field.dots,
            "levels_arcsec": levels,
            "not_shown_arcsec": [level for level in wanted if level not in levels],
        }
        return VisionTest(
            STEREO,
            "arcsec",
            self.pass_arcsec,
            "stereo_page",
            "stereo_question",
            field.side_px,
            (_series(STEREO, self, levels, presentation),),
            facts,
            four_targets(field.target_offset_px, field.target_px),
            _cross(field.side_px),
        )


def _cross(side_px: int) -> tuple[Box, ...]:
    """Return a cross on black in the middle of the field, on the screen's plane, for the eyes to meet at."""
    arm, thick, ground = (max(1, round(share * side_px)) for share in (0.05, 0.007, 0.07))
    return Box((0, 0), (ground, ground), 0.0), Box((0, 0), (arm, thick), 0.8), Box((0, 0), (thick, arm), 0.8)


def _series(
    name: str, spec: VisionTestSpec, levels: Sequence[float], presentation: Callable[[float, int], Presented]
) -> VisionSeries:
    """Return the one series of a test, its presentations made level by level."""
    made = (tuple(presentation(level, number) for number in range(spec.repeats)) for level in levels)
    return VisionSeries(
        name,
        name,
        dict(zip(levels, made, strict=True)),
        spec.required,
    )
