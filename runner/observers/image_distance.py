"""How far pictures are from a reference picture: what an image-based observer judges by."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np
from numpy.typing import NDArray

from devices.colour.ciede2000 import delta_e_2000
from devices.colour.spaces import xyz_to_lab
from devices.display.display_file import EyeModels
from documents import Finding
from runner.errors import SessionError
from stimuli.pictures.stereo_image import StereoImage

Floats = NDArray[np.float64]


def mean_delta_e_00(
    load: Callable[[str], StereoImage], names: Iterable[str], reference: str, models: EyeModels
) -> dict[str, float]:
    """Return each picture's mean ΔE00 to ``reference``, over all pixels of both eyes' views.

    Lab is relative to each eye's white. What was asked of the display is compared, not what its gamut leaves of it.

    Raises
    ------
    SessionError
        If a picture is not as large as the reference.
    """
    whites = models.left.white_XYZ_cd_m2, models.right.white_XYZ_cd_m2
    wanted = _labs(load(reference), whites)
    distances = {}
    for name in names:
        labs = _labs(load(name), whites)
        for lab, other in zip(labs, wanted, strict=True):
            if lab.shape != other.shape:
                sizes = f"'{name}' is of {lab.shape[1]} x {lab.shape[0]} px, '{reference}' of " + (
                    f"{other.shape[1]} x {other.shape[0]} px"
                )
                raise SessionError(Finding(sizes, remedy="an image-based observer compares pictures of one size"))
        both = [float(delta_e_2000(lab, other).mean()) for lab, other in zip(labs, wanted, strict=True)]
        distances[name] = sum(both) / len(both)
    return distances


def _labs(image: StereoImage, whites: tuple[Floats, Floats]) -> tuple[Floats, Floats]:
    left = xyz_to_lab(image.left.astype(np.float64), whites[0])
    if image.is_flat and np.array_equal(*whites):
        return left, left
    return left, xyz_to_lab(image.right.astype(np.float64), whites[1])
