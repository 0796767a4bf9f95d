"""Colours that a camera and an instrument both saw: what a camera model is fitted to, and the checks on them.

Colours seen at several exposures and in several lights are brought to one (thesis Table 4.2). Between sets the thesis
dims the light as it lengthens the exposure. A row of any set becomes what the camera would have seen at the reference
exposure in the reference light: its signal is divided by the exposure, relative to the reference, and signal and XYZ
alike are multiplied until the set's brightest patch has the luminance of the reference's.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from devices.camera.camera_model import CameraModel, ExposureSet, Form
from devices.camera.exposure import Exposure
from devices.camera.solve import condition_of
from devices.colour.spaces import xyz_to_lab
from devices.errors import DeviceError
from documents import Finding
from documents.arrays import Floats
from documents.text import counted

Bools = NDArray[np.bool_]
# A channel this near full scale is taken to have been clipped there.
FULL_SCALE = 0.995
_MOST_NEGATIVE = -0.02
_DEAD = 1e-3
_NAMED = 6
_COLOURS = ("red", "green", "blue")
_ONE_LIGHT = 0.01
_MOST_OFF = 0.03
# Twice the unknowns of a row of the matrix: with fewer, errors cannot be separated from noise.
LEAST = {"linear": 6, "affine": 8}
MOST_CONDITION = 200.0
_GREY = 8.0
_MOST_BELOW = 0.02


@dataclass(frozen=True, slots=True, eq=False)
class Correspondences:
    """``rgb`` (n, 3), linear, in shares of full scale; ``XYZ`` (n, 3) in cd/m²; a name for each.

    ``saturated`` (n, 3) marks channels that clipped anywhere within the patch; ``file`` is what findings carry.
    ``exposures`` has the exposure of each, where they are known and may differ. ``observer`` is the colorimetric
    observer of XYZ, where the file names it. ``noise_rgb`` (n, 3) are the standard errors of ``rgb``, where repeated
    photographs have shown them; 0 for colours that were photographed once.
    Raises DeviceError, with a finding for each fault, if the numbers cannot be those of a linear camera and a meter.
    """

    rgb: Floats
    XYZ: Floats
    names: tuple[str, ...]
    saturated: Bools
    file: str | None = None
    exposures: tuple[Exposure, ...] | None = None
    observer: str | None = None
    noise_rgb: Floats | None = None

    def __post_init__(self) -> None:
        if not (self.rgb.shape == self.XYZ.shape == self.saturated.shape == (len(self.names), 3)):
            raise DeviceError(
                Finding(f"camera RGB {self.rgb.shape} and XYZ {self.XYZ.shape} do not go together", self.file)
            )
        if self.exposures is not None and len(self.exposures) != len(self.names):
            raise DeviceError(Finding(f"{len(self.names)} colours have {len(self.exposures)} exposures", self.file))
        if self.noise_rgb is not None and self.noise_rgb.shape != self.rgb.shape:
            raise DeviceError(Finding(f"camera RGB {self.rgb.shape} and noise {self.noise_rgb.shape}", self.file))
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
        findings = []
        low = (self.rgb < _MOST_NEGATIVE).any(axis=1)
        if low.any():
            findings.append(
                Finding(
                    f"the camera's values of {self.named(low)} are below zero",
                    self.file,
                    remedy="too high a black was subtracted",
                )
            )
        dark = (self.XYZ < 0).any(axis=1)
        if dark.any():
            findings.append(
                Finding(f"XYZ of {self.named(dark)} is below zero", self.file, remedy="no light is negative")
            )
        elif self.XYZ[:, 1].max() <= 0:
            findings.append(Finding("no colour has a luminance above 0", self.file, remedy="check the columns"))
        span = np.ptp(self.rgb, axis=0)
        # A channel that stays at full scale is exposed too long, which the fit says of each patch.
        same = (span < _DEAD) & ~self.saturated.any(axis=0)
        dead = [colour for colour, is_same in zip(_COLOURS, same, strict=True) if is_same]
        if dead and len(self) > 1:
            findings.append(
                Finding(
                    f"the camera's {' and '.join(dead)} hardly change{'s' if len(dead) == 1 else ''} over the colours",
                    self.file,
                    remedy="the channel is dead or not exposed, or the colours are all alike",
                )
            )
        return findings


@dataclass(frozen=True, slots=True, eq=False)
class PooledColours:
    """``signal`` (n,): by what each row's signal is divided; ``light`` (n,): by what its light is multiplied."""

    reference: Exposure | None
    signal: Floats
    light: Floats
    sets: tuple[ExposureSet, ...]


def pool(colours: Correspondences, form: Form, asked: Exposure | None) -> PooledColours:
    """Return how to bring the rows of ``colours`` to one exposure: ``asked``, or the least that they have.

    Raises
    ------
    DeviceError
        If the form is affine and there are several exposures, or that asked for is none of the colours'.
    """
    ones = np.ones(len(colours))
    if colours.exposures is None:
        return PooledColours(asked, ones, ones, ())
    distinct = sorted(
        dict.fromkeys(colours.exposures), key=lambda exposure: (exposure.light, exposure.time_s, exposure.iso)
    )
    reference = asked if asked is not None else distinct[0]
    if not any(reference.same_signal(exposure) for exposure in distinct):
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
    rows = {exposure: np.array([other == exposure for other in colours.exposures]) for exposure in distinct}
    brightest = {exposure: float(colours.XYZ[rows[exposure], 1].max()) for exposure in distinct}
    base = next(brightest[exposure] for exposure in distinct if reference.same_signal(exposure))
    signal, light = ones.copy(), ones.copy()
    for exposure in distinct:
        signal[rows[exposure]] = exposure.relative_to(reference)
        light[rows[exposure]] = base / brightest[exposure] if brightest[exposure] > 0 else 1.0
    return PooledColours(reference, signal, light, _sets(distinct, brightest))


def _sets(exposures: list[Exposure], brightest: dict[Exposure, float]) -> tuple[ExposureSet, ...]:
    """Return the exposures that share a light, each light by its brightest patch."""
    grouped: list[tuple[float, list[Exposure]]] = []
    for exposure in exposures:
        near = [members for level, members in grouped if abs(level - brightest[exposure]) <= _ONE_LIGHT * level]
        if near:
            near[0].append(exposure)
        else:
            grouped.append((brightest[exposure], [exposure]))
    return tuple(ExposureSet(level, tuple(members)) for level, members in grouped)


def uneven(colours: Correspondences, used: NDArray[np.bool_], estimated: Floats) -> list[str]:
    """Return in sentences which exposures, of several, are off: the settings say one thing and the sensor another."""
    if colours.exposures is None or len(set(colours.exposures)) < 2:
        return []
    ratio = estimated[:, 1] / np.maximum(colours.XYZ[:, 1], 1e-12)
    notes = []
    for exposure in dict.fromkeys(colours.exposures):
        rows = used & np.array([other == exposure for other in colours.exposures])
        if rows.any() and abs(np.median(ratio[rows]) - 1.0) > _MOST_OFF:
            notes.append(f"at {exposure} the camera saw {np.median(ratio[rows]):.3f} × the light that its settings say")
    return notes


def check_black(colours: Correspondences, black: Floats) -> None:
    """Raise DeviceError unless ``black`` (3,) are numbers below the values that it is subtracted from."""
    if black.shape != (3,) or not np.all(np.isfinite(black)):
        raise DeviceError(Finding(f"the black is {black.tolist()}", remedy="give three shares of full scale"))
    below = (colours.rgb - black < -_MOST_BELOW).any(axis=1)
    if below.any():
        raise DeviceError(
            Finding(
                f"the black {', '.join(f'{value:g}' for value in black)} is above the values of {colours.named(below)}",
                colours.file,
                remedy="give it in shares of full scale, and only if it was not subtracted before",
            )
        )


def check_enough(colours: Correspondences, used: NDArray[np.bool_], form: Form) -> None:
    """Raise DeviceError unless the ``used`` patches (n,) are enough for a fit of that form."""
    count, least = int(used.sum()), LEAST[form]
    if count >= least:
        return
    gone = len(colours) - count
    if gone:
        raise DeviceError(
            Finding(
                f"{gone} of {len(colours)} patches are saturated or do not fit, and "
                f"{counted(count, 'is', 'are')} too few for a fit "
                f"({colours.named(~used)})",
                colours.file,
                remedy=f"photograph the chart again with a shorter exposure; at least {least} patches must be left",
            )
        )
    raise DeviceError(
        Finding(
            f"there {'is 1 patch' if count == 1 else f'are {count} patches'}; the {form} form needs {least} at "
            "the very least",
            colours.file,
            remedy="photograph a chart of 24",
        )
    )


def check_determined(colours: Correspondences, C: Floats, form: Form) -> None:
    """Raise DeviceError unless the columns of ``C`` (n, 3 or 4) determine a matrix."""
    condition = condition_of(C)
    if condition <= MOST_CONDITION:
        return
    shown = f"{condition:.0f}" if condition < 1e9 else "infinite"
    raise DeviceError(
        Finding(
            f"the camera's values do not determine a matrix: their condition number is {shown}, at most "
            f"{MOST_CONDITION:.0f} is allowed",
            colours.file,
            remedy="the colours are too alike, two channels carry the same, or one is dead"
            + ("; the linear form asks less" if form == "affine" else ""),
        )
    )


def remarks(colours: Correspondences, used: NDArray[np.bool_], model: CameraModel, white: Floats) -> list[str]:
    """Return what is odd about a fit to the ``used`` colours that is no error, a sentence each."""
    notes = []
    if white[1] <= 1.5 or abs(white[1] - 100.0) < 1e-9:
        notes.append(f"the brightest patch has Y = {white[1]:.4g}; if XYZ are relative, so is what the model gives")
    if model.exposure is None:
        notes.append("no exposure was given: the model cannot be carried to photographs of another exposure")
    power = None
    if len(set(colours.exposures or ())) < 2:
        power = _power(colours.rgb[used] - model.black_rgb, colours.XYZ[used], white)
    if power is not None and not 0.8 <= power <= 1.25:
        notes.append(
            f"the camera's values of grey go as luminance to the power {power:.2f}; if the picture is bent by a "
            "gamma, or its black is not subtracted, the model is wrong"
        )
    return notes


def _power(rgb: Floats, XYZ: Floats, white: Floats) -> float | None:
    """Return the slope of log signal over log luminance of the greys, 1 for a linear camera; None without greys."""
    signal, luminance = rgb.mean(axis=1), XYZ[:, 1]
    grey = np.linalg.norm(xyz_to_lab(XYZ, white)[:, 1:], axis=1) < _GREY
    grey &= (signal > 0) & (luminance > 0)
    if grey.sum() < 4 or np.ptp(np.log(luminance[grey])) < 1.0:
        return None
    return float(np.polyfit(np.log(luminance[grey]), np.log(signal[grey]), 1)[0])
