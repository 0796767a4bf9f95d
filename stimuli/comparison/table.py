"""The differences of regions: the columns of thesis Tables 5.2 to 5.5.

Differences are rendering minus photograph; the thesis prints their absolute values. CIELAB is computed after the
rendering was multiplied with ``scaled_by``, which is 1 where luminances are compared as they are.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from devices.colour import delta_e_2000, delta_e_2000_parts, xyY_from_XYZ, xyz_to_lab
from documents.arrays import Floats
from documents.text import JsonResult, significant
from stimuli.comparison.areas import AreaMean
from stimuli.comparison.luminance import LuminanceFactor, luminance_factor
from stimuli.comparison.options import LuminanceMode
from stimuli.comparison.regions import PairedArea
from stimuli.comparison.regions_file import AreaKind

Triple = tuple[float, float, float]

# Of the colour, as the step of the slopes: far above rounding, far below where a slope changes.
_STEP = 1e-4
# The length of a difference that lies within its own error has a skew distribution, and no standard error of use.
LEAST_Z = 2.0


@dataclass(frozen=True, slots=True)
class RegionSide:
    """One region in one picture: mean and standard deviation of its pixels, and its chromaticity and luminance."""

    XYZ: Triple
    sd_XYZ: Triple
    x: float
    y: float
    luminance_cd_m2: float
    pixels: int
    saturated_share: float


@dataclass(frozen=True, slots=True)
class RegionRow:
    """One region. ``excluded`` holds the reasons why it does not count, none if it does.

    ``luminance_ratio`` is photo / rendering, None if the rendering holds no light. ``delta_e`` and its terms are as in
    `ColourDifference`. Names ending in ``_se`` are standard errors, from the scatter within the regions; None where
    they are not known.
    """

    name: str
    kind: AreaKind
    entry: str
    number: int | None
    excluded: tuple[str, ...]
    photo: RegionSide
    rendering: RegionSide
    delta_x: float
    delta_y: float
    delta_xy: float
    luminance_ratio: float | None
    delta_e: float
    delta_L: float
    delta_C: float
    delta_H: float
    S_L: float
    S_C: float
    S_H: float
    R_T: float
    delta_x_se: float | None = None
    delta_y_se: float | None = None
    delta_xy_se: float | None = None
    luminance_ratio_se: float | None = None
    delta_e_se: float | None = None


@dataclass(frozen=True, slots=True)
class RegionTable(JsonResult):
    """All regions; ``factor`` is of those that count, None if there is none."""

    rows: tuple[RegionRow, ...]
    white_XYZ: Triple
    luminance: LuminanceMode
    scaled_by: float
    factor: LuminanceFactor | None
    json_also: ClassVar = ("mean_delta_e",)

    @property
    def compared(self) -> tuple[RegionRow, ...]:
        """The rows that count."""
        return tuple(row for row in self.rows if not row.excluded)

    @property
    def excluded(self) -> tuple[RegionRow, ...]:
        """The rows that do not."""
        return tuple(row for row in self.rows if row.excluded)

    @property
    def mean_delta_e(self) -> float | None:
        """The mean ΔE00 of the rows that count."""
        return float(np.mean([row.delta_e for row in self.compared])) if self.compared else None


def region_table(
    regions: Sequence[PairedArea],
    photo: Sequence[AreaMean],
    rendering: Sequence[AreaMean],
    white_XYZ: ArrayLike,
    *,
    luminance: LuminanceMode = "absolute",
    safe_luminance_cd_m2: tuple[float, float] | None = None,
    most_saturated_share: float = 0.001,
    scaled_by: float | None = None,
) -> RegionTable:
    """Return the differences of the ``regions``, from their mean colours in the two pictures.

    A region does not count if more than ``most_saturated_share`` of its pixels are saturated in either picture, if the
    photograph's mean luminance lies outside ``safe_luminance_cd_m2``, or if one of the two holds no light.
    ``scaled_by`` takes the place of the factor of these regions, where ``luminance`` asks for one.
    """
    reasons = [
        _reasons(photo_area, rendering_area, safe_luminance_cd_m2, most_saturated_share)
        for photo_area, rendering_area in zip(photo, rendering, strict=True)
    ]
    pairs = [(p.XYZ[1], r.XYZ[1]) for p, r, why in zip(photo, rendering, reasons, strict=True) if not why]
    factor = luminance_factor(*np.array(pairs).T) if pairs else None
    if luminance == "absolute":
        scaled_by = 1.0
    elif scaled_by is None:
        scaled_by = 1.0 if factor is None else factor.of(luminance)
    white = np.asarray(white_XYZ, dtype=np.float64)
    rows = tuple(_rows(regions, photo, rendering, reasons, white, scaled_by))
    return RegionTable(rows, _triple(white), luminance, scaled_by, factor)


def _reasons(
    photo: AreaMean, rendering: AreaMean, zone: tuple[float, float] | None, most_saturated: float
) -> tuple[str, ...]:
    reasons = []
    for area, name in ((photo, "photograph"), (rendering, "rendering")):
        if area.saturated_share > most_saturated:
            reasons.append(f"{significant(100 * area.saturated_share)} % of its pixels are saturated in the {name}")
        if not area.XYZ[1] > 0 or not area.XYZ.sum() > 0:
            reasons.append(f"it holds no light in the {name}")
    if zone is not None and not zone[0] <= photo.XYZ[1] <= zone[1]:
        side = "below" if photo.XYZ[1] < zone[0] else "above"
        reasons.append(
            f"its luminance of {significant(photo.XYZ[1], 4)} cd/m² lies {side} the camera's safe zone, "
            f"{significant(zone[0], 4)} to {significant(zone[1], 4)} cd/m²"
        )
    return tuple(reasons)


def _differences(both_XYZ: Floats, white: Floats, scale: float) -> Floats:
    """Return Δx, Δy, Δxy, luminance ratio and ΔE00, (..., 5), of photo XYZ and rendering XYZ, (..., 6)."""
    photo, rendering = both_XYZ[..., :3], both_XYZ[..., 3:]
    photo_xyY, rendering_xyY = xyY_from_XYZ(photo), xyY_from_XYZ(rendering)
    x, y = np.moveaxis(rendering_xyY[..., :2] - photo_xyY[..., :2], -1, 0)
    ratio = np.divide(
        photo_xyY[..., 2], rendering_xyY[..., 2], out=np.full(x.shape, np.nan), where=rendering_xyY[..., 2] != 0
    )
    delta_e = delta_e_2000(_lab(photo, white), _lab(scale * rendering, white))
    return np.stack([x, y, np.hypot(x, y), ratio, delta_e], axis=-1)


def _lab(XYZ: Floats, white: Floats) -> Floats:
    return xyz_to_lab(np.maximum(XYZ, 0.0), white)


def _rows(
    regions: Sequence[PairedArea],
    photo: Sequence[AreaMean],
    rendering: Sequence[AreaMean],
    reasons: Sequence[tuple[str, ...]],
    white: Floats,
    scale: float,
) -> Iterator[RegionRow]:
    """Yield the rows; all are computed at once."""
    if not regions:
        return
    photo_XYZ, rendering_XYZ = (np.array([area.XYZ for area in side]) for side in (photo, rendering))
    covariances = (
        np.array([np.full((3, 3), np.nan) if area.covariance_XYZ is None else area.covariance_XYZ for area in side])
        for side in (photo, rendering)
    )
    values = _differences(np.concatenate([photo_XYZ, rendering_XYZ], axis=1), white, scale)
    with np.errstate(divide="ignore", invalid="ignore"):  # regions without light, whose errors are not reported
        errors = _standard_errors(lambda both: _differences(both, white, scale), photo_XYZ, rendering_XYZ, *covariances)
    parts = delta_e_2000_parts(_lab(photo_XYZ, white), _lab(scale * rendering_XYZ, white))
    for place, region in enumerate(regions):
        x, y, xy, ratio, delta_e = (float(value) for value in values[place])
        se = [float(value) if np.isfinite(value) and not reasons[place] else None for value in errors[place]]
        yield RegionRow(
            region.name,
            region.kind,
            region.entry,
            region.number,
            reasons[place],
            _side(photo[place]),
            _side(rendering[place]),
            x,
            y,
            xy,
            ratio if np.isfinite(ratio) else None,
            delta_e,
            float(parts.delta_L[place]),
            float(parts.delta_C[place]),
            float(parts.delta_H[place]),
            float(parts.S_L[place]),
            float(parts.S_C[place]),
            float(parts.S_H[place]),
            float(parts.R_T[place]),
            delta_x_se=se[0],
            delta_y_se=se[1],
            delta_xy_se=_length_error(xy, se[2]),
            luminance_ratio_se=se[3],
            delta_e_se=_length_error(delta_e, se[4]),
        )


def _side(area: AreaMean) -> RegionSide:
    x, y, luminance = (float(value) for value in xyY_from_XYZ(area.XYZ))
    return RegionSide(_triple(area.XYZ), _triple(area.sd_XYZ), x, y, luminance, area.pixels, area.saturated_share)


def _triple(values: Floats) -> Triple:
    return float(values[0]), float(values[1]), float(values[2])


def _standard_errors(
    differences: Callable[[Floats], Floats],
    photo_XYZ: Floats,
    rendering_XYZ: Floats,
    photo_covariance: Floats,
    rendering_covariance: Floats,
) -> Floats:
    """Return the standard errors (n, m) of ``differences`` (..., 6) -> (..., m), of both XYZ in one; to first order.

    XYZ are (n, 3), covariances (n, 3, 3), NaN where they are not known. The two are taken as independent: where both
    pictures show one texture at the same places, this is too much rather than too little.
    """
    at = np.concatenate([photo_XYZ, rendering_XYZ], axis=1)
    size = [np.abs(XYZ).max(axis=1, keepdims=True).repeat(3, axis=1) for XYZ in (photo_XYZ, rendering_XYZ)]
    step = _STEP * np.concatenate(size, axis=1)
    steps = step[:, :, None] * np.eye(6)
    # (n, 6, m): how each number changes with each of the six.
    slope = (differences(at[:, None] + steps) - differences(at[:, None] - steps)) / (2 * step[:, :, None])
    variance = np.einsum("nim,nij,njm->nm", slope[:, :3], photo_covariance, slope[:, :3])
    variance += np.einsum("nim,nij,njm->nm", slope[:, 3:], rendering_covariance, slope[:, 3:])
    return np.asarray(np.sqrt(np.maximum(variance, 0.0)))


def _length_error(length: float, se: float | None) -> float | None:
    """Return the standard error of a length such as ΔE00, None where the length is below two of them."""
    return se if se is not None and length >= LEAST_Z * se else None
