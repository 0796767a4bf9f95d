"""What the page shows of the two pictures and of their differences, drawn while they are at hand."""

from __future__ import annotations

import base64
import io
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from analysis.validation.difference_map import Floats32, Mask
from analysis.validation.row_source import RowSource

Floats = NDArray[np.float64]

LONGEST_PX = 900
_D65 = np.array([0.95047, 1.0, 1.08883])
_SRGB = np.array([[3.2406, -1.5372, -0.4986], [-0.9689, 1.8758, 0.0415], [0.0557, -0.2040, 1.0570]])


@dataclass(frozen=True, eq=False, slots=True)
class Drawn:
    """SVG figures by name, both pictures as data URLs, and the luminance in cd/m² that they show as white."""

    figures: dict[str, str]
    photo_url: str
    rendering_url: str
    white_cd_m2: float


def draw_map(name: str, delta_e: Floats32, limit: float, within: Mask, compared: Mask) -> dict[str, str]:
    """Return a map of ΔE00 and the histogram of the compared pixels, as SVG by ``name``."""
    from analysis.validation.difference_figures import histogram_figure, map_figure

    words = {"plain": "pixel by pixel", "seen": "as the eye resolves it"}[name]
    return {
        f"{name} map": map_figure(delta_e, f"ΔE00 {words}, 0 to 10", within),
        f"{name} histogram": histogram_figure(delta_e, limit, f"How many pixels differ by how much, {words}", compared),
    }


def draw_pictures(photo: RowSource, rendering: RowSource, white_XYZ: ArrayLike) -> tuple[str, str, float]:
    """Return both pictures as PNG in data URLs, made smaller in linear light, one white for both, and its luminance.

    White is the 99.5th percentile of the photograph's luminance, so that some highlights are cut off.
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

    linear = np.clip((xyz / white * _D65) @ _SRGB.T, 0.0, 1.0)
    bent = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    out = io.BytesIO()
    Image.fromarray(np.round(255 * bent).astype(np.uint8)).save(out, "PNG", optimize=True)
    return "data:image/png;base64," + base64.b64encode(out.getvalue()).decode("ascii")
