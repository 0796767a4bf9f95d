"""Colours that a camera and an instrument both saw: what a camera model is fitted to."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from devices.camera.exposure import Exposure
from devices.errors import DeviceError
from documents import Finding

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

# A channel this near full scale is taken to have been clipped there.
FULL_SCALE = 0.995
_MOST_NEGATIVE = -0.02
_DEAD = 1e-3
_NAMED = 6
_COLOURS = ("red", "green", "blue")


@dataclass(frozen=True, slots=True, eq=False)
class Correspondences:
    """``rgb`` (n, 3), linear, in shares of full scale; ``XYZ`` (n, 3) in cd/m²; a name for each.

    ``saturated`` (n, 3) marks channels that clipped anywhere within the patch; ``file`` is what findings carry.
    ``exposures`` has the exposure of each, where they are known and may differ.
    Raises DeviceError, with a finding for each fault, if the numbers cannot be those of a linear camera and a meter.
    """

    rgb: Floats
    XYZ: Floats
    names: tuple[str, ...]
    saturated: Bools
    file: str | None = None
    exposures: tuple[Exposure, ...] | None = None

    def __post_init__(self) -> None:
        if not (self.rgb.shape == self.XYZ.shape == self.saturated.shape == (len(self.names), 3)):
            raise DeviceError(
                Finding(f"camera RGB {self.rgb.shape} and XYZ {self.XYZ.shape} do not go together", self.file)
            )
        if self.exposures is not None and len(self.exposures) != len(self.names):
            raise DeviceError(Finding(f"{len(self.names)} colours have {len(self.exposures)} exposures", self.file))
        findings = self._faults()
        if findings:
            raise DeviceError(findings)

    def __len__(self) -> int:
        return len(self.names)

    def named(self, rows: ArrayLike) -> str:
        """Return the names of ``rows`` as text, the first six of them."""
        names = [self.names[i] for i in np.arange(len(self))[np.asarray(rows)]]
        more = len(names) - _NAMED
        return ", ".join(names[:_NAMED]) + (f" and {more} more" if more > 0 else "")

    def _faults(self) -> list[Finding]:
        if not len(self):
            return [Finding("there are no colours to fit to", self.file)]
        for values, what in ((self.rgb, "camera's values"), (self.XYZ, "XYZ")):
            broken = ~np.isfinite(values).all(axis=1)
            if broken.any():
                return [Finding(f"the {what} of {self.named(broken)} are no finite numbers", self.file)]
        if self.rgb.max() > 1:
            return [
                Finding(
                    f"the camera's values reach {self.rgb.max():g}; linear shares of full scale, 0..1, are needed",
                    self.file,
                    remedy="divide raw values, their black subtracted, by full scale or write '# rgb: 0..16383' above "
                    "the header; 8-bit pictures have been bent by a gamma and cannot be used",
                )
            ]
        found = []
        low = (self.rgb < _MOST_NEGATIVE).any(axis=1)
        if low.any():
            found.append(
                Finding(
                    f"the camera's values of {self.named(low)} are below zero",
                    self.file,
                    remedy="too high a black was subtracted",
                )
            )
        dark = (self.XYZ < 0).any(axis=1)
        if dark.any():
            found.append(Finding(f"XYZ of {self.named(dark)} is below zero", self.file, remedy="no light is negative"))
        elif self.XYZ[:, 1].max() <= 0:
            found.append(Finding("no colour has a luminance above 0", self.file, remedy="check the columns"))
        span = np.ptp(self.rgb, axis=0)
        # A channel that stays at full scale is exposed too long, which the fit says of each patch.
        same = (span < _DEAD) & ~self.saturated.any(axis=0)
        dead = [colour for colour, one in zip(_COLOURS, same, strict=True) if one]
        if dead and len(self) > 1:
            found.append(
                Finding(
                    f"the camera's {' and '.join(dead)} hardly change{'s' if len(dead) == 1 else ''} over the colours",
                    self.file,
                    remedy="the channel is dead or not exposed, or the colours are all alike",
                )
            )
        return found
