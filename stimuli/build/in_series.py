"""A picture as one of a series shows it: so many times as bright, or grey."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from stimuli.luminance.greyscale import greyscale
from stimuli.luminance.scale import scaled
from stimuli.pictures.stereo_image import XYZImage
from stimuli.recipes.series_recipe import SeriesSpec


def in_series(xyz_cd_m2: XYZImage, luminance_scale: float, series: SeriesSpec) -> XYZImage:
    """Return the picture (rows, columns, 3) times ``luminance_scale``, and grey if the series is.

    Grey keeps each pixel's luminance Y and gives it the chromaticity of the series's white.
    """
    bright = scaled(xyz_cd_m2, luminance_scale)
    return bright if series.greyscale_white_xy is None else greyscale(bright, series.greyscale_white_xy)


def series_steps(series: SeriesSpec) -> list[Mapping[str, Any]]:
    """Return what the series did, for the manifest."""
    steps: list[Mapping[str, Any]] = [{"step": "scale", "luminance_scale": series.luminance_scale}]
    if series.greyscale_white_xy is not None:
        steps.append({"step": "greyscale", "white_xy": list(series.greyscale_white_xy)})
    return steps
