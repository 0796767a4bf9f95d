"""Contrast of sparkles over the exposure of their photographs (thesis Section 4.4.4, Figures 4.10 and 4.11).

The longer a photograph is exposed, the more its background fills the sensor, while the sparkles, which filled it
before, stay as they are: the contrast between them falls. In XYZ, which are divided by the exposure, the background
then stays and the sparkles fall. A display clips the brightest of them once more.

All pictures are measured at the same places: those of the sparkles of the shortest exposure, which clips fewest. A
sparkle's luminance is the most of the 3 × 3 pixels about its place, its background the local median, its contrast
Weber's (Expression 2.13).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from devices.display import DisplayModel, EyeModels
from devices.eyes import Eye
from documents import Finding
from documents.text import JsonResult, with_error
from stimuli.errors import StimulusError
from stimuli.luminance import factor_to
from stimuli.pictures import StereoImage, XYZImage
from stimuli.sparkles import SparkleThreshold, Uncertain, find_peaks, local_background, measure_sparkles

Luminance = NDArray[np.float32]
_ROWS = 64
_WINDOW_PX = 64


@dataclass(frozen=True, slots=True)
class SparkleContrast(JsonResult):
    """Means over all sparkles, with standard errors: luminance in cd/m², that of the background, Weber contrast."""

    sparkle_cd_m2: Uncertain
    background_cd_m2: Uncertain
    contrast: Uncertain
    json_keys: ClassVar = {"contrast": "weber_contrast"}


@dataclass(frozen=True, slots=True)
class ExposureRow(JsonResult):
    """One exposure. ``as_shown`` is on the display, None where none is given.

    ``factor`` is what the picture was multiplied by; ``width_px`` is the full width at half maximum of the sparkles
    that are above the threshold in this picture.
    """

    name: str
    exposure_s: float
    factor: float
    mean_cd_m2: float
    max_cd_m2: float
    as_photographed: SparkleContrast
    as_shown: SparkleContrast | None
    width_px: Uncertain
    json_keys: ClassVar = {
        "mean_cd_m2": "mean_luminance_cd_m2",
        "max_cd_m2": "max_luminance_cd_m2",
        "width_px": "sparkle_width_px",
    }
    json_also: ClassVar = ("exposed_sparkle_cd_s_m2", "exposed_background_cd_s_m2")

    @property
    def exposed_sparkle_cd_s_m2(self) -> float:
        """What a sparkle gave the sensor: its luminance, before the factor, times the exposure."""
        return self.as_photographed.sparkle_cd_m2.value / self.factor * self.exposure_s

    @property
    def exposed_background_cd_s_m2(self) -> float:
        """What the background gave the sensor."""
        return self.as_photographed.background_cd_m2.value / self.factor * self.exposure_s


@dataclass(frozen=True, slots=True)
class ContrastOverExposure(JsonResult):
    """The exposures, shortest first, measured in the picture of ``eye`` at the places of ``sparkles`` sparkles.

    ``figure`` is the file of the figure that was drawn of them.
    """

    eye: Eye
    sparkles: int
    rows: tuple[ExposureRow, ...]
    figure: Path | None = None
    json_keys: ClassVar = {"rows": "exposures"}

    def told(self) -> Iterator[str]:
        """Yield a line for each exposure, and where the figure is."""
        yield f"{self.sparkles} sparkles of the shortest exposure, {self.eye} eye; ± standard error"
        width = max(len(row.name) for row in self.rows)
        for row in self.rows:
            contrast = row.as_photographed.contrast
            sparkle, background = row.as_photographed.sparkle_cd_m2, row.as_photographed.background_cd_m2
            words = (
                f"{row.name:<{width}}  {exposure_words(row.exposure_s):>5} s: sparkles {sparkle.value:.4g} cd/m² on "
                f"{background.value:.4g}, contrast {with_error(contrast.value, contrast.se)}"
            )
            if row.as_shown is not None:
                words += f", on the display {with_error(row.as_shown.contrast.value, row.as_shown.contrast.se)}"
            if row.width_px.value == row.width_px.value:
                words += f"; {row.width_px.value:.2f} px wide"
            yield words
        if self.figure is not None:
            yield f"Figure: {self.figure}"


def exposure_words(time_s: float) -> str:
    """Return an exposure as cameras name it, such as 1/15."""
    return f"{time_s:.3g}" if time_s >= 0.3 else f"1/{1 / time_s:.3g}"


def contrast_over_exposure(
    pictures: Sequence[tuple[str, float, StereoImage]],
    models: EyeModels | None = None,
    *,
    threshold: SparkleThreshold | None = None,
    mean_cd_m2: float | None = None,
    eye: Eye = "left",
) -> ContrastOverExposure:
    """Return how the contrast of sparkles changes with the exposure (thesis Figures 4.10 and 4.11).

    Parameters
    ----------
    pictures
        Name, exposure in s, and picture in XYZ in cd/m², of one plate from one place: two or more exposures.
    models
        The display's models, for the contrast as it is shown.
    threshold
        What is a sparkle in the shortest exposure; twice the local background if left out.
    mean_cd_m2
        A mean luminance that each picture is brought to first, as the thesis calibrates its pictures; None for none.
    eye
        Whose picture is measured.

    Returns
    -------
    ContrastOverExposure
        For each exposure the luminance of sparkles and background, the contrast, and the width.

    Raises
    ------
    StimulusError
        If there are fewer than two exposures, sizes differ, or the shortest exposure has no sparkles.

    Examples
    --------
    A sparkle that would have 100 cd/m² on 2 cd/m², on a sensor that holds 10 cd·s/m²:

    >>> def photograph(exposure_s: float) -> StereoImage:
    ...     light = np.full((64, 64, 3), 2.0, np.float32)
    ...     light[32, 32] = min(100.0, 10.0 / exposure_s)
    ...     return StereoImage.flat(light)
    >>> found = contrast_over_exposure([(f"{time} s", time, photograph(time)) for time in (0.1, 0.5, 1.0)])
    >>> [row.as_photographed.contrast.value for row in found.rows]
    [49.0, 9.0, 4.0]
    """
    ordered = sorted(pictures, key=lambda picture: picture[1])
    _check(ordered)
    first = ordered[0][2].luminance_cd_m2(eye)
    peaks = find_peaks(first, threshold or SparkleThreshold(), window_px=_WINDOW_PX)
    if not len(peaks):
        raise StimulusError(
            Finding(
                f"'{ordered[0][0]}', the shortest exposure, has no sparkles",
                remedy="lower the threshold, or give pictures of a plate that sparkles",
            )
        )
    model = None if models is None else models.eye(eye)
    places = peaks.row, peaks.column
    rows = []
    for name, exposure_s, image in ordered:
        mean = float(image.luminance_cd_m2(eye).mean(dtype=np.float64))
        factor = 1.0 if mean_cd_m2 is None else factor_to(mean, mean_cd_m2)
        luminance = np.asarray(image.luminance_cd_m2(eye) * np.float32(factor))
        shown = None if model is None else _contrast(_shown(image.eye(eye), factor, model), *places)
        rows.append(
            ExposureRow(
                name,
                exposure_s,
                factor,
                mean * factor,
                float(luminance.max()),
                _contrast(luminance, *places),
                shown,
                measure_sparkles(luminance, threshold or SparkleThreshold()).width_px,
            )
        )
    return ContrastOverExposure(eye, len(peaks), tuple(rows))


def _check(ordered: Sequence[tuple[str, float, StereoImage]]) -> None:
    times = [exposure_s for _, exposure_s, _ in ordered]
    if len(set(times)) < 2:
        there_are = "there is one" if times else "there is none"
        raise StimulusError(Finding(f"contrast over exposure needs two exposures or more; {there_are}"))
    if not all(np.isfinite(time) and time > 0 for time in times):
        raise StimulusError(Finding("an exposure is no time above 0 s"))
    sizes = {(image.width_px, image.height_px) for _, _, image in ordered}
    if len(sizes) > 1:
        named = " and ".join(f"{width} × {height} px" for width, height in sorted(sizes))
        raise StimulusError(
            Finding(f"the exposures differ in size: {named}", remedy="give photographs of one plate from one place")
        )


def _contrast(luminance: Luminance, row: NDArray[np.int64], column: NDArray[np.int64]) -> SparkleContrast:
    background = local_background(luminance, _WINDOW_PX).at(row.astype(np.float64), column.astype(np.float64))
    height, width = luminance.shape
    sparkle = np.max(
        [
            luminance[np.clip(row + down, 0, height - 1), np.clip(column + across, 0, width - 1)]
            for down in (-1, 0, 1)
            for across in (-1, 0, 1)
        ],
        axis=0,
    ).astype(np.float64)
    lit = background > 0
    weber = (sparkle[lit] - background[lit]) / background[lit]
    return SparkleContrast(_mean(sparkle), _mean(background), _mean(weber))


def _mean(values: NDArray[np.float64]) -> Uncertain:
    if not len(values):
        return Uncertain(float("nan"), float("nan"))
    se = float(values.std(ddof=1) / np.sqrt(len(values))) if len(values) > 1 else float("nan")
    return Uncertain(float(values.mean()), se)


def _shown(xyz: XYZImage, factor: float, model: DisplayModel) -> Luminance:
    """Return the luminance of a picture on the display, which clips what it cannot show, a few rows at a time."""
    out = np.empty(xyz.shape[:2], np.float32)
    for top in range(0, len(xyz), _ROWS):
        rows = slice(top, top + _ROWS)
        out[rows] = model.xyz(model.code(factor * xyz[rows].astype(np.float64)))[..., 1]
    return out
