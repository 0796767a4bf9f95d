"""The regions of two pictures in the camera's own RGB, as thesis Section 5.5 compares them beside xyY.

A camera model is one matrix, so that the mean RGB of a region follows from its mean XYZ, and with it the standard
error: the photograph's RGB come back, and so do those of a spectral rendering that was taken by the sensor's
sensitivities. Of a rendering in XYZ they are what the model says that the camera records; sensor and observer then
agree on which colours look alike, which no real sensor does. Where negative XYZ were set to 0, RGB are those of that.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from devices.camera import CameraModel, Exposure
from documents.arrays import Floats
from documents.text import JsonResult
from stimuli.comparison.areas import AreaMean
from stimuli.comparison.table import RegionTable

Triple = tuple[float, float, float]
CHANNELS = ("red", "green", "blue")


@dataclass(frozen=True, slots=True)
class CameraRGBRow:
    """One region in linear camera RGB, shares of full scale at the photograph's exposure, red, green and blue.

    ``delta_rgb`` is rendering minus photograph, ``delta_rgb_se`` its standard errors from the scatter within the
    regions, None where they are not known; ``ratio_rgb`` is photograph / rendering, None where the rendering has no
    signal. ``delta_r`` and ``delta_g`` are differences of R/(R + G + B) and G/(R + G + B), which no intensity changes.
    ``above_full_scale`` names the channels that the rendering would fill.
    """

    name: str
    excluded: bool
    photo_rgb: Triple
    rendering_rgb: Triple
    delta_rgb: Triple
    delta_rgb_se: Triple | None
    ratio_rgb: tuple[float | None, float | None, float | None]
    delta_r: float | None
    delta_g: float | None
    above_full_scale: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class CameraRGBTable(JsonResult):
    """All regions in the RGB of ``camera`` at ``exposure`` (the camera file's own where None).

    The rendering's light was multiplied by ``scaled_by`` before. ``mean_ratio_rgb`` and ``rms_delta_rgb`` are of the
    regions that count: thesis Figure 5.9's factor for each channel, and what is left as it is.
    """

    camera: str
    exposure: str | None
    scaled_by: float
    rows: tuple[CameraRGBRow, ...]
    mean_ratio_rgb: tuple[float | None, float | None, float | None]
    rms_delta_rgb: tuple[float | None, float | None, float | None]

    @property
    def title(self) -> str:
        """Whose RGB these are, in words."""
        return (f"Camera RGB of {self.camera}" if self.camera else "Camera RGB") + (
            f" at {self.exposure}" if self.exposure else ""
        )


def camera_rgb_table(
    table: RegionTable,
    photo: Sequence[AreaMean],
    rendering: Sequence[AreaMean],
    camera: CameraModel,
    exposure: Exposure | None = None,
) -> CameraRGBTable:
    """Return the regions of ``table``, whose means are ``photo`` and ``rendering``, in the RGB of ``camera``.

    Raises
    ------
    DeviceError
        If the camera model does not serve the exposure: see `CameraModel.rgb`.
    """
    slope = np.asarray(np.linalg.inv(camera.matrix) * camera.signal_scale(exposure), dtype=np.float64)
    rows = []
    for row, photo_area, rendering_area in zip(table.rows, photo, rendering, strict=True):
        first = camera.rgb(photo_area.XYZ, exposure).astype(np.float64)
        second = camera.rgb(table.scaled_by * rendering_area.XYZ, exposure).astype(np.float64)
        r_g = [_chromaticity(rgb) for rgb in (first, second)]
        delta = None if r_g[0] is None or r_g[1] is None else r_g[1] - r_g[0]
        rows.append(
            CameraRGBRow(
                row.name,
                bool(row.excluded),
                _triple(first),
                _triple(second),
                _triple(second - first),
                _standard_errors(slope, photo_area, rendering_area, table.scaled_by),
                _ratio(first, second),
                None if delta is None else float(delta[0]),
                None if delta is None else float(delta[1]),
                tuple(name for name, value in zip(CHANNELS, second, strict=True) if value > 1),
            )
        )
    return CameraRGBTable(
        camera.name,
        str(exposure or camera.exposure) if exposure or camera.exposure else None,
        table.scaled_by,
        tuple(rows),
        _of_channels([row.ratio_rgb for row in rows if not row.excluded], np.mean),
        _of_channels([row.delta_rgb for row in rows if not row.excluded], lambda x: np.sqrt(np.mean(np.square(x)))),
    )


def _chromaticity(rgb: Floats) -> Floats | None:
    total = float(rgb.sum())
    return np.asarray(rgb[:2] / total) if total > 0 else None


def _standard_errors(slope: Floats, photo: AreaMean, rendering: AreaMean, scale: float) -> Triple | None:
    if photo.covariance_XYZ is None or rendering.covariance_XYZ is None:
        return None
    covariance = slope @ (photo.covariance_XYZ + scale**2 * rendering.covariance_XYZ) @ slope.T
    return _triple(np.sqrt(np.maximum(np.diag(covariance), 0.0)))


def _ratio(photo: Floats, rendering: Floats) -> tuple[float | None, float | None, float | None]:
    red, green, blue = (float(p / r) if r > 0 else None for p, r in zip(photo, rendering, strict=True))
    return red, green, blue


def _of_channels(values: Sequence[Sequence[float | None]], of: Any) -> tuple[float | None, float | None, float | None]:
    columns = [[row[channel] for row in values if row[channel] is not None] for channel in range(3)]
    red, green, blue = (float(of(column)) if column else None for column in columns)
    return red, green, blue


def _triple(values: Any) -> Triple:
    return float(values[0]), float(values[1]), float(values[2])
