"""Where on the panel the pixels of a picture's codes stand: what the pass must know to even the panel out.

A place is in pixels of the panel as `devices.compensation.gain_map` has them. It moves by the same step from one
column of codes to the next, and from one row to the next, so that four numbers tell all. Where the display stretches a
squeezed signal
back over its panel, a code's place is the middle of the pixels that it is stretched over.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from devices.display.display_file import Eye
from runner.presenter.modes.mode import EyeArea
from runner.presenter.placing import place_item
from runner.presenter.rectangle import Size


@dataclass(frozen=True, slots=True)
class PanelPlaces:
    """The middle of the top left code, x and y in pixels of the panel, and the step to the next column and row."""

    first_px: tuple[float, float]
    step_px: tuple[int, int]


def panel_places(areas: Sequence[EyeArea], eye: Eye, codes_px: Size, offset_px: tuple[int, int]) -> PanelPlaces:
    """Return where codes of ``codes_px``, shown to ``eye`` at ``offset_px`` of its view, stand.

    ``areas`` are those of a surface that is the panel; ``codes_px`` counts pixels of the signal, as in `place_item`.
    """
    area = next(area for area in areas if eye in area.eyes)
    place, _ = place_item(area, codes_px, offset_px)
    across = _axis(place.left, place.width, area.rectangle.left, area.squeeze[0], reverse=area.mirror[0])
    down = _axis(place.top, place.height, area.rectangle.top, area.squeeze[1], reverse=area.mirror[1])
    if area.squeeze == (1, 1):
        across = across[0] + area.rectangle.left, across[1]
        down = down[0] + area.rectangle.top, down[1]
    return PanelPlaces((across[0], down[0]), (across[1], down[1]))


def _axis(first: int, count: int, origin: int, squeeze: int, *, reverse: bool) -> tuple[float, int]:
    """Return the first code's middle, from the edge of the eye's view, and the step to the next."""
    middle = first - origin + (count - 0.5 if reverse else 0.5)
    return middle * squeeze, -squeeze if reverse else squeeze
