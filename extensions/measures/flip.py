"""ꟻLIP: the difference that is seen when two pictures alternate, by NVIDIA's own implementation.

P. Andersson et al. 2020, "ꟻLIP: A difference evaluator for alternating images", and 2021, "Visualizing errors in
rendered high dynamic range images". Pictures become linear sRGB whose (1, 1, 1) is the white of the display, to which
the eye is adapted. A band of rows is measured at a time, with the rows that the filters reach; the map is that of the
whole.
"""

from __future__ import annotations

from abc import abstractmethod
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from devices.colour import linear_srgb_matrix
from documents.arrays import Floats, Floats32
from stimuli.errors import StimulusError
from stimuli.measures import EyeMeasured, MapMeasure, ViewingConditions
from stimuli.pictures import Rows, bands_with_margin

# Beyond this the filters, which run over pixels, take minutes for a picture of a million.
MOST_PIXELS_PER_DEGREE = 2000.0
# The widest filter, of blue and yellow, ends at this many degrees; that of edges and points ends before it.
_REACH_DEG = 3.0 * np.sqrt(0.04 / (2.0 * np.pi**2))
_LUMINANCE = np.array([0.2126, 0.7152, 0.0722], dtype=np.float32)
_LEAST = float(np.finfo(np.float32).eps)


class _FlipKind(MapMeasure):
    """What both kinds have in common: the mean of the map, the package, and how a band is measured."""

    unit = ""
    better = "lower"
    identical = 0.0
    map_highest = 1.0
    needs_display_white = True
    package = "flip_evaluator"
    extra = "measures"
    _range: ClassVar[str]

    @abstractmethod
    def _parameters(self, reference_XYZ: Rows, matrix: Floats) -> dict[str, Any]:
        """Return what the implementation is given beside the pixels per degree."""

    def error_map(self, reference_XYZ: Rows, test_XYZ: Rows, viewing: ViewingConditions) -> Floats32:
        """Return ꟻLIP of each pixel, 0 to 1, float32 (height, width). Raises StimulusError."""
        return self._mapped(reference_XYZ, test_XYZ, viewing)[0]

    def _mapped(
        self, reference_XYZ: Rows, test_XYZ: Rows, viewing: ViewingConditions
    ) -> tuple[Floats32, tuple[float, float]]:
        """Return the map, and the percentages of both pictures' pixels with a component above the display's white."""
        from flip_evaluator import evaluate

        density = viewing.pixels_per_degree
        if density > MOST_PIXELS_PER_DEGREE:
            raise StimulusError.of(
                f"the pictures are seen at {density:.4g} pixels per degree, and ꟻLIP is computed up to "
                f"{MOST_PIXELS_PER_DEGREE:g}",
                f"check the viewing distance, or leave out '{self.name}'",
            )
        matrix = linear_srgb_matrix(viewing.white_XYZ)
        parameters = {"ppd": float(density), **self._parameters(reference_XYZ, matrix)}
        errors = np.empty(reference_XYZ.shape[:2], dtype=np.float32)
        above = np.zeros(2)
        for wanted, read, inner in bands_with_margin(errors.shape, int(np.ceil(_REACH_DEG * density)) + 1):
            linear = [_linear(picture[read], matrix) for picture in (reference_XYZ, test_XYZ)]
            found = evaluate(
                *linear,
                self._range,
                inputsRGB=False,
                applyMagma=False,
                computeMeanError=False,
                parameters=dict(parameters),
            )
            errors[wanted] = found[0][..., 0][inner]
            above += [np.count_nonzero((one[inner] > 1.0).any(axis=-1)) for one in linear]
        first, second = (100.0 * above / errors.size).tolist()
        return errors, (first, second)


class Flip(_FlipKind):
    """The mean of ꟻLIP (LDR-ꟻLIP), of pictures as a display of the standard range shows them."""

    name = "flip"
    title = "ꟻLIP"
    source = "Andersson2020"
    symmetric = True
    map_title = "ꟻLIP"
    _range: ClassVar[str] = "LDR"

    def _parameters(self, reference_XYZ: Rows, matrix: Floats) -> dict[str, Any]:
        return {}

    def measure(self, reference_XYZ: Rows, test_XYZ: Rows, viewing: ViewingConditions) -> EyeMeasured:
        """Return the mean and the map, and how much of either picture is outside what ꟻLIP takes."""
        errors, above = self._mapped(reference_XYZ, test_XYZ, viewing)
        remarks: tuple[str, ...] = ()
        if any(above):
            remarks = (
                f"red, green or blue is above the display's white in {above[0]:.3g} % of the reference's pixels and "
                f"{above[1]:.3g} % of the test picture's, and clipped for ꟻLIP; HDR-ꟻLIP takes it as it is",
            )
        return EyeMeasured(self.pooled(errors.ravel()), errors, remarks)


class HdrFlip(_FlipKind):
    """The mean of HDR-ꟻLIP: the largest ꟻLIP of each pixel over a range of exposures, which the reference sets."""

    name = "hdr-flip"
    title = "HDR-ꟻLIP"
    source = "Andersson2021"
    map_title = "HDR-ꟻLIP"
    _range: ClassVar[str] = "HDR"

    def _parameters(self, reference_XYZ: Rows, matrix: Floats) -> dict[str, Any]:
        """Return the exposures by the rule of [Andersson2021]: from the brightest pixel's to the median's.

        The implementation finds them, in a picture of three pixels with the same two luminances.
        """
        from flip_evaluator import evaluate

        height, width = reference_XYZ.shape[:2]
        luminance = np.empty((height, width), dtype=np.float32)
        for band, _, _ in bands_with_margin((height, width), 0):
            luminance[band] = _linear(reference_XYZ[band], matrix) @ _LUMINANCE
        middle = np.partition(luminance, luminance.size // 2, axis=None)[luminance.size // 2]
        if luminance.max() <= _LEAST:
            raise StimulusError.of(
                "the reference is black, and HDR-ꟻLIP takes its exposures from the reference's light",
                f"leave out '{self.name}', or exchange the pictures",
            )
        places = [divmod(int(at), width) for at in (np.argmax(luminance == middle), np.argmax(luminance))]
        few = np.stack([_linear(reference_XYZ[row : row + 1], matrix)[0, column] for row, column in places])
        found = evaluate(few[None, [0, 0, 1]], few[None, [0, 0, 1]], self._range, applyMagma=False)[2]
        return {name: found[name] for name in ("startExposure", "stopExposure", "numExposures")}


def _linear(rows: NDArray[np.floating], matrix: Floats) -> Floats32:
    """Return rows of XYZ as linear sRGB at or above 0, float32."""
    return np.maximum(np.asarray(rows, dtype=np.float64) @ matrix.T, 0.0).astype(np.float32)
