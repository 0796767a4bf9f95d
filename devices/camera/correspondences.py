"""Colours that a camera and an instrument both saw: what a camera model is fitted to.

Colours seen at several exposures and in several lights are brought to one (thesis Table 4.2). Between sets the thesis
dims the light as it lengthens the exposure. A row of any set becomes what the camera would have seen at the reference
exposure in the reference light: its signal is divided by the exposure, relative to the reference, and signal and XYZ
alike are multiplied until the set's brightest patch has the luminance of the reference's.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from devices.camera.camera_model import ExposureSet, Form
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
_ONE_LIGHT = 0.01
_MOST_OFF = 0.03


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


@dataclass(frozen=True, slots=True, eq=False)
class Pooled:
    """``signal`` (n,): by what each row's signal is divided; ``light`` (n,): by what its light is multiplied."""

    reference: Exposure | None
    signal: Floats
    light: Floats
    sets: tuple[ExposureSet, ...]


def pool(colours: Correspondences, form: Form, asked: Exposure | None) -> Pooled:
    """Return how to bring the rows of ``colours`` to one exposure: ``asked``, or the least that they have.

    Raises
    ------
    DeviceError
        If the form is affine and there are several exposures, or that asked for is none of the colours'.
    """
    ones = np.ones(len(colours))
    if colours.exposures is None:
        return Pooled(asked, ones, ones, ())
    distinct = sorted(dict.fromkeys(colours.exposures), key=lambda one: (one.light, one.time_s, one.iso))
    reference = asked if asked is not None else distinct[0]
    if not any(reference.same_signal(one) for one in distinct):
        raise DeviceError(
            Finding(f"the exposure asked for, {reference}, is none of the table's", colours.file, remedy="leave it out")
        )
    if form == "affine" and len(distinct) > 1:
        raise DeviceError(
            Finding(
                f"the colours were seen at {len(distinct)} exposures, and an affine model serves one",
                colours.file,
                remedy="fit the linear form, or give the rows of one exposure",
            )
        )
    rows = {one: np.array([other == one for other in colours.exposures]) for one in distinct}
    brightest = {one: float(colours.XYZ[rows[one], 1].max()) for one in distinct}
    base = next(brightest[one] for one in distinct if reference.same_signal(one))
    signal, light = ones.copy(), ones.copy()
    for one in distinct:
        signal[rows[one]] = one.relative_to(reference)
        light[rows[one]] = base / brightest[one] if brightest[one] > 0 else 1.0
    return Pooled(reference, signal, light, _sets(distinct, brightest))


def _sets(exposures: list[Exposure], brightest: dict[Exposure, float]) -> tuple[ExposureSet, ...]:
    """Return the exposures that share a light, each light by its brightest patch."""
    grouped: list[tuple[float, list[Exposure]]] = []
    for one in exposures:
        near = [members for level, members in grouped if abs(level - brightest[one]) <= _ONE_LIGHT * level]
        if near:
            near[0].append(one)
        else:
            grouped.append((brightest[one], [one]))
    return tuple(ExposureSet(level, tuple(members)) for level, members in grouped)


def uneven(colours: Correspondences, used: NDArray[np.bool_], estimated: Floats) -> list[str]:
    """Return in sentences which exposures, of several, are off: the settings say one thing and the sensor another."""
    if colours.exposures is None or len(set(colours.exposures)) < 2:
        return []
    ratio = estimated[:, 1] / np.maximum(colours.XYZ[:, 1], 1e-12)
    said = []
    for one in dict.fromkeys(colours.exposures):
        rows = used & np.array([other == one for other in colours.exposures])
        if rows.any() and abs(np.median(ratio[rows]) - 1.0) > _MOST_OFF:
            said.append(f"at {one} the camera saw {np.median(ratio[rows]):.3f} × the light that its settings say")
    return said
