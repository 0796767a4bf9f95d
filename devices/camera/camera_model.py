"""A characterised camera: linear camera RGB to absolute XYZ and back.

XYZ = M · (RGB − black) + V: the affine form of thesis Expressions 4.1 to 4.3, whose V holds the light of the room in
which it was fitted, or the linear form, V = 0. A linear camera's signal is proportional to the light and to the
exposure, so that a linear model serves every exposure; V does not scale so, and an affine model serves its own alone.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from devices.camera.exposure import Exposure
from devices.colour_matching import DEFAULT_OBSERVER
from devices.errors import DeviceError
from documents import Finding
from documents.arrays import Floats

AnyFloats = NDArray[np.floating[Any]]
Bools = NDArray[np.bool_]
Form = Literal["affine", "linear"]

# Pixels worked on at a time: their float64 copies stay small beside the picture.
_BLOCK = 1 << 16
_MOST_CONDITION = 1e6


@dataclass(frozen=True, slots=True)
class ExposureSet:
    """Exposures at which a chart was photographed in one light; its white patch had ``white_luminance_cd_m2``."""

    white_luminance_cd_m2: float
    exposures: tuple[Exposure, ...]


@dataclass(frozen=True, eq=False)
class CameraModel:
    """``matrix`` (3, 3) in cd/m² for RGB in shares of full scale, ``offset_XYZ`` (3,) in cd/m², ``black_rgb`` (3,).

    ``black_rgb`` is what remains to be subtracted from RGB, a share of full scale; zero where development has done it.
    ``exposure`` is that of the photograph fitted to, None where it is unknown. ``safe_luminance_cd_m2`` is the range of
    luminances at that exposure that the fit was tested on (thesis Figure 5.8). ``exposure_sets`` are those that the
    camera was tried at (thesis Table 4.2). ``observer`` is the colorimetric observer of XYZ. Raises DeviceError if the
    numbers are not finite, the matrix has no inverse, the range is none, or a linear model has an offset.
    """

    matrix: Floats
    offset_XYZ: Floats
    black_rgb: Floats
    exposure: Exposure | None = None
    safe_luminance_cd_m2: tuple[float, float] | None = None
    form: Form = "linear"
    name: str = ""
    source: str = ""
    exposure_sets: tuple[ExposureSet, ...] = ()
    observer: str = DEFAULT_OBSERVER

    def __post_init__(self) -> None:
        for name, shape in (("matrix", (3, 3)), ("offset_XYZ", (3,)), ("black_rgb", (3,))):
            array = np.array(getattr(self, name), dtype=np.float64)
            if array.shape != shape or not np.all(np.isfinite(array)):
                raise DeviceError(f"'{name}' of a camera is {array.tolist()}; finite numbers of shape {shape} needed")
            array.flags.writeable = False
            object.__setattr__(self, name, array)
        if not np.linalg.cond(self.matrix) <= _MOST_CONDITION:
            raise DeviceError(
                Finding("the camera's matrix has no inverse", remedy="its rows must not depend on one another")
            )
        if self.form == "linear" and np.any(self.offset_XYZ != 0):
            raise DeviceError(Finding("a linear camera model has an offset", remedy="write form: affine, or no offset"))
        if self.safe_luminance_cd_m2 is not None:
            low, high = self.safe_luminance_cd_m2
            if not (0 <= low < high < np.inf):
                raise DeviceError(
                    Finding(f"the safe luminance zone is {low:g} to {high:g}", remedy="it must rise, from 0 or more")
                )

    @cached_property
    def _inverse(self) -> Floats:
        return np.asarray(np.linalg.inv(self.matrix), dtype=np.float64)

    def xyz(self, rgb: ArrayLike, exposure: Exposure | None = None) -> AnyFloats:
        """Return XYZ in cd/m², shape (..., 3), for linear camera RGB, shape (..., 3), in shares of full scale.

        ``exposure`` is that of the photograph, the model's own where it is None. float32 RGB gives float32 XYZ,
        computed in float64. XYZ of colours outside the camera's gamut, and of noise, may be negative.

        Raises
        ------
        DeviceError
            If the model is affine and the exposure is not its own, or the model's exposure is not known.
        """
        matrix = self.matrix / self.signal_scale(exposure)
        return _each_block(rgb, matrix, self.offset_XYZ - matrix @ self.black_rgb)

    def rgb(self, xyz: ArrayLike, exposure: Exposure | None = None) -> AnyFloats:
        """Return linear camera RGB, shape (..., 3), for XYZ in cd/m², shape (..., 3); else as `xyz`.

        What the sensor would clip is returned as it is, above 1.
        """
        inverse = self._inverse * self.signal_scale(exposure)
        return _each_block(xyz, inverse, self.black_rgb - inverse @ self.offset_XYZ)

    def signal_scale(self, exposure: Exposure | None) -> float:
        """Return the signal at ``exposure`` for that at the model's own; DeviceError as `xyz`."""
        if exposure is None or (self.exposure is not None and exposure.same_signal(self.exposure)):
            return 1.0
        if self.exposure is None:
            raise DeviceError(
                Finding(
                    f"the camera model{self._called} does not say its exposure, and the photograph was taken at "
                    f"{exposure}",
                    remedy="write the model's 'exposure', or leave the photograph's out if they are the same",
                )
            )
        if self.form == "affine":
            raise DeviceError(
                Finding(
                    f"the affine camera model{self._called} was fitted at {self.exposure} and the photograph was taken "
                    f"at {exposure}",
                    remedy="an offset does not scale with exposure: fit a linear model, or one at this exposure",
                )
            )
        return exposure.relative_to(self.exposure)

    def safe_luminance(self, exposure: Exposure | None = None) -> tuple[float, float] | None:
        """Return the lowest and highest luminance in cd/m² that can be trusted at ``exposure``; None if not known.

        What was tested is a range of the sensor's signal: at half the exposure it stands for twice the luminance.
        """
        if self.safe_luminance_cd_m2 is None:
            return None
        scale = self.signal_scale(exposure)
        low, high = self.safe_luminance_cd_m2
        return low / scale, high / scale

    def unsafe(self, xyz: ArrayLike, exposure: Exposure | None = None) -> tuple[Bools, Bools]:
        """Return where luminance lies below and where above the safe zone, shape (...), for XYZ, shape (..., 3).

        Both are False throughout where the model has no zone.
        """
        luminance = np.asarray(xyz)[..., 1]
        zone = self.safe_luminance(exposure)
        if zone is None:
            return np.zeros(luminance.shape, dtype=bool), np.zeros(luminance.shape, dtype=bool)
        return np.asarray(luminance < zone[0]), np.asarray(luminance > zone[1])

    def tried_at(self, exposure: Exposure) -> bool:
        """Return whether the camera was characterised, or tried, at ``exposure``."""
        known = [other for tried in self.exposure_sets for other in tried.exposures]
        return any(exposure.same_signal(other) for other in [*known, *([self.exposure] if self.exposure else [])])

    @property
    def _called(self) -> str:
        return f" '{self.name}'" if self.name else ""


def _each_block(values: ArrayLike, matrix: Floats, offset: Floats) -> AnyFloats:
    """Return matrix · value + offset for values (..., 3), in the values' float32 or in float64."""
    given = np.asarray(values)
    if given.shape[-1:] != (3,):
        raise DeviceError(f"colours have three numbers each, not shape {given.shape}")
    kind = np.float32 if given.dtype in (np.float16, np.float32) else np.float64
    flat = given.reshape(-1, 3)
    out: AnyFloats = np.empty(flat.shape, dtype=kind)
    for start in range(0, len(flat), _BLOCK):
        block = slice(start, start + _BLOCK)
        out[block] = flat[block].astype(np.float64) @ matrix.T + offset
    return out.reshape(given.shape)
