"""Near acuity: Landolt rings at the rig's own distance, dark on light, with both eyes open [ISO8596]."""

from __future__ import annotations

import math
import random
from functools import partial
from typing import Annotated, Any, Literal

from pydantic import Field

from documents import Finding
from runner.blocks.screening.vision_test import (
    Level,
    Presentation,
    Repeats,
    Screen,
    Series,
    VisionTest,
    VisionTestSpec,
    four_targets,
)
from runner.errors import SessionError
from stimuli.vision_tests.optotypes import landolt
from stimuli.vision_tests.random_dots import SIDES

NAME = "near_acuity"
LogMAR = Annotated[float, Field(ge=-1, le=2)]
Sizes = Annotated[tuple[LogMAR, ...], Field(min_length=1, max_length=20)]
GROUND_DEG = 6.0
GROUND_SHARE, RING_SHARE = 0.80, 0.02
_WORDS = (
    "Fine detail\n\nYou will see a small ring with a gap, like the letter C, in the middle of a bright square.\n\n"
    "Press the arrow key that points to the gap: up, down, left or right. The rings get smaller. "
    "Stay where you sit. If you cannot tell, guess."
)


def finest_logmar(screen: Screen) -> float:
    """Return the smallest size that the screen shows: the gap is one pixel, of those that an eye is really shown."""
    return math.log10(60.0 * screen.degrees(max(screen.grain_px)))


def gap_px(screen: Screen, logmar: float) -> float:
    """Return the width of the gap, which subtends 10 to the power of ``logmar`` minutes of arc."""
    return screen.px(10.0**logmar / 60.0)


class NearAcuitySpec(VisionTestSpec):
    """Landolt rings; ``levels_logmar`` are logarithms of the gap in minutes of arc."""

    test: Literal["near_acuity"]
    repeats: Repeats = 5
    required: Repeats = 4
    pass_logmar: LogMAR = 0.2
    levels_logmar: Sizes = (0.6, 0.5, 0.4, 0.3, 0.2, 0.1, 0.0, -0.1)

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
        rng = random.Random(f"{seed}/{NAME}")
        ground, ring = screen.shown.grey(GROUND_SHARE), screen.shown.grey(RING_SHARE)

        def presentation(level: float, number: int) -> Presentation:
            name = f"{seed}/{NAME}/{level:g}/{number}"
            gap, open_at = gap_px(screen, level), rng.choice(SIDES)
            make = partial(landolt, gap, open_at, side, ground, ring)
            return Presentation(name, make, open_at, 10.0**level, {"gap_px": round(gap, 4)})

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
            NAME,
            "logmar",
            self.pass_logmar,
            _WORDS,
            "Where is the gap in the ring?",
            side,
            (
                Series(
                    NAME,
                    NAME,
                    tuple(
                        Level(
                            level, tuple(presentation(level, number) for number in range(self.repeats)), self.required
                        )
                        for level in levels
                    ),
                ),
            ),
            facts,
            four_targets(side / 4, side / 3),
            logarithmic=True,
        )
