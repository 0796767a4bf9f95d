"""ColorVideoVDP: the quality of a picture on the display and at the distance at which it is seen, by its own authors.

R. K. Mantiuk et al. 2024, "ColorVideoVDP: A visual difference predictor for image, video and display distortions"
[Mantiuk2024]; their program, `cvvdp`, does the work. Pictures are given to it as XYZ in cd/m², so
that no colour is out of a display's gamut. The metric's own white is D65; no other adaptation is made.
"""

from __future__ import annotations

import logging
import warnings
from typing import Any

import numpy as np

from documents.arrays import Floats32
from stimuli.errors import StimulusError
from stimuli.measures import EyeMeasured, Measure, ViewingConditions
from stimuli.pictures import Rows, bands_with_margin

# The range of light that the metric is made for; what lies outside takes its ends.
LEAST_CD_M2, MOST_CD_M2 = 0.005, 10_000.0
MOST_PIXELS_PER_DEGREE = 2000.0


class ColorVideoVDP(Measure):
    """The quality in just-objectionable differences (JOD): 10 for identical pictures, 1 JOD less where 75 % see it."""

    name = "cvvdp"
    title = "ColorVideoVDP"
    unit = "JOD"
    better = "higher"
    identical = 10.0
    source = "Mantiuk2024"
    map_title = "ColorVideoVDP, difference in JOD"
    package = "pycvvdp"
    extra = "vdp"

    def measure(self, reference_XYZ: Rows, test_XYZ: Rows, viewing: ViewingConditions) -> EyeMeasured:
        """Return the quality, and the map of the difference. Raises StimulusError."""
        density, shape = viewing.pixels_per_degree, reference_XYZ.shape[:2]
        if density > MOST_PIXELS_PER_DEGREE:
            raise StimulusError.of(
                f"the pictures are seen at {density:.4g} pixels per degree, and ColorVideoVDP is computed up to "
                f"{MOST_PIXELS_PER_DEGREE:g}",
                f"check the viewing distance, or leave out '{self.name}'",
            )
        with warnings.catch_warnings():
            # Its dependencies warn of their own old code, which is none of ours.
            warnings.simplefilter("ignore")
            torch, metric = _metric((shape[1], shape[0]), density)
            reference, test = (_in_range(picture) for picture in (reference_XYZ, test_XYZ))
            with torch.no_grad():
                quality, stats = metric.predict(test, reference, dim_order="HWC")
        remarks: tuple[str, ...] = ()
        shares = [_outside(picture) for picture in (reference_XYZ, test_XYZ)]
        if any(shares):
            remarks = (
                f"X, Y or Z is below {LEAST_CD_M2:g} or above {MOST_CD_M2:g} cd/m² in "
                f"{shares[0]:.3g} % of the reference's pixels and {shares[1]:.3g} % of the test picture's, "
                "and clipped for ColorVideoVDP",
            )
        errors = np.asarray(stats["heatmap"][0, 0, 0].numpy(), dtype=np.float32)
        return EyeMeasured(float(quality), errors, remarks)


def _metric(size_px: tuple[int, int], pixels_per_degree: float) -> tuple[Any, Any]:
    """Return the module torch, and the metric for pictures in absolute light of so many pixels per degree."""
    try:
        import torch
        from pycvvdp import cvvdp
        from pycvvdp.display_model import vvdp_display_geometry, vvdp_display_photo_eotf
    except (ImportError, RuntimeError, OSError) as error:
        raise StimulusError.of(
            f"ColorVideoVDP cannot be loaded: {error}",
            "pip install '.[vdp]' in an environment of its own; torch and torchvision must be builds for each other",
        ) from error
    photometry = vvdp_display_photo_eotf(
        MOST_CD_M2,
        contrast=MOST_CD_M2 / LEAST_CD_M2,
        source_colorspace="BT.709-linear",
        E_ambient=0,
        name="absolute light",
    )
    # The primaries are those of XYZ.
    photometry.rgb2xyz_list = np.eye(3).tolist()
    geometry = vvdp_display_geometry(size_px, ppd=pixels_per_degree)
    level = logging.getLogger().level
    try:
        metric = cvvdp(
            display_photometry=photometry,
            display_geometry=geometry,
            heatmap="raw",
            quiet=True,
            device=torch.device("cpu"),  # a graphics card rounds otherwise: values would depend on the computer
        )
    finally:
        logging.getLogger().setLevel(level)
    return torch, metric


def _in_range(picture: Rows) -> Floats32:
    return np.asarray(np.clip(picture[:], LEAST_CD_M2, MOST_CD_M2), dtype=np.float32)


def _outside(picture: Rows) -> float:
    """Return the percentage of pixels whose light is beyond the metric's range."""
    outside = 0
    for band, _, _ in bands_with_margin(picture.shape, 0):
        outside += int(((picture[band] < LEAST_CD_M2) | (picture[band] > MOST_CD_M2)).any(axis=-1).sum())
    return 100.0 * outside / (picture.shape[0] * picture.shape[1])
