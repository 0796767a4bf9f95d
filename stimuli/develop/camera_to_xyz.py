"""From a camera's picture to absolute XYZ through the camera's characterisation."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from devices.camera import CameraModel
from devices.colour_matching import DEFAULT_OBSERVER
from documents import Finding
from documents.text import counted
from stimuli.develop.camera_image import CameraImage
from stimuli.develop.options import Negative
from stimuli.errors import StimulusError

_BAND_PIXELS = 1 << 19


@dataclass(frozen=True, eq=False, slots=True)
class Developed:
    """XYZ in cd/m², float32 (height, width, 3), 0 or above, and how far it can be trusted.

    ``saturated`` is bool (height, width): a channel was full, so that the XYZ is a lower bound. ``below_safe`` and
    ``above_safe`` count pixels whose luminance is outside the zone that the camera was tested in, ``safe_cd_m2``, None
    where the camera file has none. ``clipped`` counts pixels with a negative XYZ that was set to 0, ``lowest`` is the
    lowest before. ``steps`` record all of it, after the steps of the camera's picture.
    """

    xyz: NDArray[np.float32]
    saturated: NDArray[np.bool_]
    safe_cd_m2: tuple[float, float] | None
    below_safe: int
    above_safe: int
    clipped: int
    lowest: float
    steps: tuple[Mapping[str, Any], ...]


def to_xyz(image: CameraImage, camera: CameraModel, *, negative: Negative = "clip") -> Developed:
    """Return the absolute XYZ of a photograph, scaled by its exposure relative to that of the camera model.

    Parameters
    ----------
    image
        Linear camera RGB.
    camera
        The camera's characterisation.
    negative
        What to do with XYZ below 0, from noise about black and colours outside the camera's gamut: ``clip`` it to 0 and
        count it, or ``refuse`` the picture.

    Returns
    -------
    Developed
        XYZ in cd/m² of the camera file's observer, float32 (height, width, 3), and how far it can be trusted.

    Raises
    ------
    StimulusError
        If the exposure is not known while the camera model's is, or XYZ is negative and refused.
    DeviceError
        If the camera model does not serve this exposure: see `CameraModel.xyz`.
    """
    rows = XYZRows(image, camera, negative)
    xyz = np.empty(image.rgb.shape, np.float32)
    for band, part in rows:
        xyz[band] = part
    return rows.developed(xyz)


class XYZRows:
    """The XYZ of a photograph a band of rows at a time; afterwards `developed` says how far all of it can be trusted.

    Arguments, and errors of the first band, as of `to_xyz`. With ``negative`` ``refuse`` the picture is gone through
    before, so that nothing is given of one that is refused.
    """

    def __init__(self, image: CameraImage, camera: CameraModel, negative: Negative = "clip") -> None:
        if image.exposure is None and camera.exposure is not None:
            raise StimulusError(
                Finding(
                    "the photograph's file has no exposure, and luminance depends on it",
                    image.source,
                    remedy=f"give it; the camera was characterised at {camera.exposure}",
                )
            )
        self.image, self.camera = image, camera
        self._below = self._above = self._clipped = self._saturated = 0
        self._lowest = np.inf
        self._sum, self._highest = 0.0, 0.0
        camera.signal_scale(image.exposure)  # an exposure that the camera does not serve is refused here
        if negative == "refuse":
            self._refuse_negative()

    def __iter__(self) -> Iterator[tuple[slice, NDArray[np.float32]]]:
        """Yield rows and their XYZ in cd/m², float32 (rows, width, 3), 0 or above."""
        self._below = self._above = self._clipped = self._saturated = 0
        self._lowest, self._sum, self._highest = np.inf, 0.0, 0.0
        for band in self._bands():
            xyz = self._raw(band)
            below, above = self.camera.unsafe(xyz, self.image.exposure)
            self._below += int(np.count_nonzero(below))
            self._above += int(np.count_nonzero(above))
            self._lowest = min(self._lowest, float(xyz.min()))
            self._clipped += int(np.count_nonzero((xyz < 0).any(axis=-1)))
            self._saturated += int(np.count_nonzero(self.image.saturated[band].any(axis=-1)))
            np.maximum(xyz, np.float32(0), out=xyz)
            self._sum += float(xyz[..., 1].sum(dtype=np.float64))
            self._highest = max(self._highest, float(xyz[..., 1].max()))
            yield band, xyz

    @property
    def mean_cd_m2(self) -> float:
        """Mean luminance of all rows."""
        return self._sum / (self.image.rgb.size // 3)

    @property
    def highest_cd_m2(self) -> float:
        """Highest luminance of all rows."""
        return self._highest

    def developed(self, xyz: NDArray[np.float32] | None = None) -> Developed:
        """Return what is to be said of all rows, after the last; ``xyz`` is the picture, if it was kept."""
        zone = self.camera.safe_luminance(self.image.exposure)
        step = {
            "step": "camera_to_xyz",
            "camera": self.camera.name,
            "camera_source": self.camera.source,
            "form": self.camera.form,
            "signal_beside_characterisation": self.camera.signal_scale(self.image.exposure),
            "safe_luminance_cd_m2": None if zone is None else list(zone),
            "below_safe_pixels": self._below,
            "above_safe_pixels": self._above,
            "saturated_pixels": self._saturated,
            "negative_pixels_set_to_0": self._clipped,
            "lowest_XYZ_cd_m2": min(self._lowest, 0.0),
            "pixels": self.image.rgb.size // 3,
        } | ({} if self.camera.observer == DEFAULT_OBSERVER else {"observer": self.camera.observer})
        return Developed(
            np.empty((0, 0, 3), np.float32) if xyz is None else xyz,
            np.asarray(self.image.saturated.any(axis=-1)),
            zone,
            self._below,
            self._above,
            self._clipped,
            self._lowest,
            (*self.image.steps, step),
        )

    def _bands(self) -> Iterator[slice]:
        height, width, _ = self.image.rgb.shape
        step = max(1, _BAND_PIXELS // width)
        return (slice(first, min(first + step, height)) for first in range(0, height, step))

    def _raw(self, band: slice) -> NDArray[np.float32]:
        return np.asarray(self.camera.xyz(self.image.rgb[band], self.image.exposure), dtype=np.float32)

    def _refuse_negative(self) -> None:
        pixels, lowest = 0, 0.0
        for band in self._bands():
            xyz = self._raw(band)
            pixels += int(np.count_nonzero((xyz < 0).any(axis=-1)))
            lowest = min(lowest, float(xyz.min()))
        if pixels:
            raise StimulusError(
                Finding(
                    f"{counted(pixels, 'pixel has', 'pixels have')} negative XYZ, down to {lowest:.3g} cd/m²",
                    self.image.source,
                    remedy="check black level and camera file, or let them be set to 0",
                )
            )
