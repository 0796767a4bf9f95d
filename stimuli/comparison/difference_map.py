"""ΔE00 pixel by pixel, and what it comes to: two pictures go through a few rows at a time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from devices.colour.ciede2000 import delta_e_2000
from devices.colour.spaces import xyz_to_lab
from stimuli.comparison.errors import PictureError
from stimuli.comparison.row_source import RowSource, bands

Floats32 = NDArray[np.float32]
Mask = NDArray[np.bool_]
# Called with how many rows of how many are done.
RowsDone = Callable[[int, int], None]


@dataclass(frozen=True, slots=True)
class DifferenceSummary:
    """ΔE00 over the ``pixels`` that were compared; ``above_limit_percent`` of them differ by more than ``limit``."""

    pixels: int
    mean: float
    median: float
    p95: float
    p99: float
    largest: float
    limit: float
    above_limit_percent: float

    def to_json(self) -> dict[str, float]:
        """Return the numbers by name."""
        return asdict(self)


def difference_map(
    photo: RowSource, rendering: RowSource, white_XYZ: ArrayLike, rows_done: RowsDone | None = None
) -> Floats32:
    """Return ΔE00, float32, (height, width), between two pictures in XYZ, (height, width, 3) each.

    ``white_XYZ``, shape (3,), is what CIELAB is reckoned against, in the pictures' unit. Light below 0, as a sensor's
    noise makes it, counts as none.

    Raises
    ------
    PictureError
        If the pictures differ in size, or hold what is no finite number.
    """
    if tuple(photo.shape) != tuple(rendering.shape) or len(photo.shape) != 3 or photo.shape[2] != 3:
        raise PictureError(
            f"the pictures' shapes are {tuple(photo.shape)} and {tuple(rendering.shape)}; "
            "they must be one (height, width, 3): bring them to one grid first"
        )
    height, width = photo.shape[:2]
    out = np.empty((height, width), dtype=np.float32)
    bad = 0
    for band in bands(photo.shape):
        rows = (photo[band], rendering[band])
        finite = np.isfinite(rows[0]).all(axis=-1) & np.isfinite(rows[1]).all(axis=-1)
        bad += finite.size - int(np.count_nonzero(finite))
        if not bad:
            first, second = (xyz_to_lab(np.maximum(one, 0.0), white_XYZ) for one in rows)
            out[band] = delta_e_2000(first, second)
        if rows_done is not None:
            rows_done(band.stop, height)
    if bad:
        raise PictureError(f"{bad} pixels cannot be compared: one of the pictures holds NaN or infinity there")
    return out


def summarise(delta_e: Floats32, limit: float, compared: Mask | None = None) -> DifferenceSummary:
    """Return what the ΔE00 of a map, (height, width), come to where ``compared`` is true (everywhere without it).

    Raises
    ------
    PictureError
        If no pixel is compared.
    """
    values = delta_e.ravel() if compared is None else delta_e[compared]
    if values.size == 0:
        raise PictureError("no pixel is left to compare: all are excluded")
    median, p95, p99 = (float(value) for value in np.percentile(values, [50, 95, 99]))
    return DifferenceSummary(
        pixels=int(values.size),
        mean=float(values.mean(dtype=np.float64)),
        median=median,
        p95=p95,
        p99=p99,
        largest=float(values.max()),
        limit=limit,
        above_limit_percent=100.0 * float(np.count_nonzero(values > limit)) / values.size,
    )


def histogram(
    delta_e: Floats32, compared: Mask | None = None, *, bins: int = 100, highest: float = 10.0
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return how many pixels lie in each of ``bins`` from 0 to ``highest`` ΔE00, (bins,), and the edges, (bins + 1,).

    The last bin also holds all that lies above.
    """
    values = delta_e.ravel() if compared is None else delta_e[compared]
    edges = np.linspace(0.0, highest, bins + 1)
    counts, _ = np.histogram(np.minimum(values, np.float32(highest)), edges)
    return counts.astype(np.int64), edges
