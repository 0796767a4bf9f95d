"""What the page shows of the two pictures and of their differences, drawn while they are at hand."""

from __future__ import annotations

import base64
import io
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from stimuli.comparison.difference_map import Floats32, Mask
from stimuli.comparison.regions import Region
from stimuli.comparison.row_source import RowSource

Floats = NDArray[np.float64]

LONGEST_PX = 900
MOST_PROFILES = 6
# The patches of a ColorChecker that its grey scale begins and ends with.
GREYS = (19, 24)


@dataclass(frozen=True, eq=False, slots=True)
class Drawn:
    """SVG figures by name, both pictures as data URLs, and the luminance in cd/m² that they show as white.

    ``profiles`` are names and SVGs. ``white_is_display`` says that the page's white has the colour of the display's,
    not of CIELAB's.
    """

    figures: dict[str, str]
    photo_url: str
    rendering_url: str
    white_cd_m2: float
    profiles: tuple[tuple[str, str], ...] = ()
    white_is_display: bool = False


def draw_map(name: str, delta_e: Floats32, limit: float, within: Mask, compared: Mask) -> dict[str, str]:
    """Return a map of ΔE00 and the histogram of the compared pixels, as SVG by ``name``."""
    from stimuli.comparison.difference_figures import histogram_figure, map_figure

    words = {"plain": "pixel by pixel", "seen": "as the eye resolves it"}[name]
    return {
        f"{name} map": map_figure(delta_e, f"ΔE00 {words}, 0 to 10", within),
        f"{name} histogram": histogram_figure(delta_e, limit, f"How many pixels differ by how much, {words}", compared),
    }


def draw_profiles(photo: RowSource, rendering: RowSource, regions: Sequence[Region]) -> tuple[tuple[str, str], ...]:
    """Return the luminance along a line across every plate and along each chart's greys, as names and SVGs."""
    from stimuli.comparison.difference_figures import profile_figure

    found = []
    for name, start, end in _lines(regions)[:MOST_PROFILES]:
        one, two = (_along(picture, start, end) for picture in (photo, rendering))
        found.append((name, profile_figure(one, two, f"Luminance along a line, {name}")))
    return tuple(found)


def _lines(regions: Sequence[Region]) -> list[tuple[str, Floats, Floats]]:
    """Return names and both ends, x and y from the picture's corner: of plates from side to side, of charts the greys'.

    Where there is neither, of the first region.
    """
    lines = []
    for region in regions:
        if region.kind == "plate" or region.sparkle:
            lines.append((f"across '{region.name}'", *_across(region.photo_px)))
        elif region.kind == "patch" and region.number == GREYS[0]:
            last = next(one for one in regions if one.entry == region.entry and one.number == GREYS[1])
            ends = region.photo_px.mean(axis=0), last.photo_px.mean(axis=0)
            lines.append((f"along the greys of '{region.entry}'", *ends))
    if not lines:
        lines.append((f"across '{regions[0].name}'", *_across(regions[0].photo_px)))
    return lines


def _across(outline_px: Floats) -> tuple[Floats, Floats]:
    if len(outline_px) == 4:
        top_left, top_right, bottom_right, bottom_left = outline_px
        return (top_left + bottom_left) / 2, (top_right + bottom_right) / 2
    low, high = outline_px.min(axis=0), outline_px.max(axis=0)
    middle = (low[1] + high[1]) / 2
    return np.array([low[0], middle]), np.array([high[0], middle])


def _along(picture: RowSource, start: Floats, end: Floats) -> Floats:
    """Return Y along a line; only the rows that it crosses are read."""
    from stimuli.comparison.difference_figures import profile

    # Regions count from the corner of a pixel, profiles from its middle.
    ends = np.array([start, end]) - 0.5
    top = int(np.clip(np.floor(ends[:, 1].min()), 0, picture.shape[0] - 1))
    bottom = int(np.clip(np.ceil(ends[:, 1].max()) + 1, top + 1, picture.shape[0]))
    rows = np.concatenate([picture[at : min(at + 256, bottom)][:, :, 1] for at in range(top, bottom, 256)])
    (x, y), (other_x, other_y) = (ends - [0.0, top]).tolist()
    return profile(rows, (x, y), (other_x, other_y))


def draw_pictures(photo: RowSource, rendering: RowSource, white_XYZ: ArrayLike) -> tuple[str, str, float]:
    """Return both pictures as PNG in data URLs, made smaller in linear light, one white for both, and its luminance.

    White has the colour of ``white_XYZ`` (3,), of any luminance, to which the eye is taken to be adapted; its luminance
    is the 99.5th percentile of the photograph's, so that some highlights are cut off.
    """
    small = [_small(one) for one in (photo, rendering)]
    luminance = float(np.percentile(small[0][..., 1], 99.5))
    luminance = luminance if luminance > 0 else 1.0
    white = np.asarray(white_XYZ, dtype=np.float64)
    white = white / white[1] * luminance
    first, second = (_png(one, white) for one in small)
    return first, second, luminance


def _small(picture: RowSource) -> Floats:
    """Return a picture as means over squares, so that its longer side is at most about `LONGEST_PX` pixels."""
    height, width = picture.shape[:2]
    side = max(1, -(-max(height, width) // LONGEST_PX))
    rows, columns = height // side, width // side
    found = np.empty((rows, columns, 3))
    group = max(1, (1 << 20) // (width * side))
    for first in range(0, rows, group):
        last = min(first + group, rows)
        part = picture[first * side : last * side][:, : columns * side]
        found[first:last] = part.reshape(last - first, side, columns, side, 3).mean(axis=(1, 3))
    return found


def _png(xyz: Floats, white: Floats) -> str:
    from PIL import Image

    from devices.colour.srgb import srgb

    out = io.BytesIO()
    Image.fromarray(np.round(255 * srgb(xyz, white)).astype(np.uint8)).save(out, "PNG", optimize=True)
    return "data:image/png;base64," + base64.b64encode(out.getvalue()).decode("ascii")
