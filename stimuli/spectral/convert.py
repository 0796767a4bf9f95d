"""From a spectral picture to what the standard observer sees, or to what a camera records.

The virtual camera is that of thesis Section 5.4: two spectra that the observer cannot distinguish may differ to a
camera. Through the sensor's own sensitivities a rendering becomes comparable with a photograph, number by number,
metamerism included.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from devices.camera import Exposure
from devices.colour_matching import DEFAULT_OBSERVER, colorimetric_observer
from documents import Finding
from documents.options import Typed
from documents.text import JsonResult, counted
from stimuli.develop.camera_image import CameraImage
from stimuli.develop.linear_files import write_camera_exr
from stimuli.errors import StimulusError
from stimuli.pictures.exr_write import write_exr
from stimuli.pictures.stereo_image import StereoImage
from stimuli.spectral.bands import read_spectral
from stimuli.spectral.curves import read_sensitivities
from stimuli.spectral.light import LEAST, MOST, Illumination, observer_weights, spectral_step, weighted
from stimuli.spectral.options import Quantity, SpectralOptions
from stimuli.spectral.picture import SpectralPicture


@dataclass(frozen=True, eq=False, slots=True)
class SpectralXYZ:
    """XYZ in cd/m², float32 (height, width, 3), 0 or above; ``clipped`` pixels were below, down to ``lowest``."""

    xyz: NDArray[np.float32]
    clipped: int
    lowest: float
    steps: tuple[Mapping[str, Any], ...]


def spectral_to_xyz(
    picture: SpectralPicture,
    light: Illumination | None = None,
    *,
    negative: Literal["clip", "refuse"] = "refuse",
    observer: str = DEFAULT_OBSERVER,
) -> SpectralXYZ:
    """Return the absolute XYZ of a spectral picture for a colorimetric observer.

    Bands are summed at their own spacing, a block of rows at a time, as
    `devices.readings.spectra.xyz_from_spectra` does.

    Parameters
    ----------
    picture
        Radiance, or reflectance with an illuminant.
    light
        The illuminant and its luminance on a perfect diffuser, for reflectance.
    negative
        What to do with XYZ below 0: ``refuse`` the picture, or ``clip`` to 0.
    observer
        The name of the observer, such as ``CIE 2015 10``.

    Returns
    -------
    SpectralXYZ
        XYZ in cd/m², float32 (height, width, 3), and the pixels that were clipped.

    Raises
    ------
    StimulusError
        If the light does not go with the picture, a value is NaN or infinite, or XYZ is negative and refused.
    """
    light = light or Illumination()
    waves = picture.wavelengths_nm
    name = colorimetric_observer(observer).name
    weights = observer_weights(waves, name) * light.per_band(picture, name)[:, None]
    xyz = weighted(picture, weights)
    lowest = float(xyz.min())
    clipped = int((xyz < 0).any(axis=-1).sum())
    if clipped and negative == "refuse":
        raise picture.wrong(
            f"{counted(clipped, 'pixel has', 'pixels have')} negative XYZ, down to {lowest:.3g} cd/m²",
            "correct it, or let them be set to 0",
        )
    np.maximum(xyz, np.float32(0), out=xyz)
    step = {
        **spectral_step("spectra_to_xyz", picture, light),
        "observer": name,
        "negative_pixels_set_to_0": clipped,
        "lowest_XYZ_cd_m2": min(lowest, 0.0),
    }
    return SpectralXYZ(xyz, clipped, lowest, (step,))


def spectral_to_camera(
    picture: SpectralPicture,
    sensitivities: Path,
    full_scale_luminance_cd_m2: float,
    light: Illumination | None = None,
    *,
    exposure: Exposure | None = None,
) -> CameraImage:
    """Return linear camera RGB of ``picture``, summed at its own spacing, a block of rows at a time.

    The sensor's gain is such that light of equal energy at every wavelength and of ``full_scale_luminance_cd_m2``
    just fills the first of its channels. Channels beyond that stay at 1 and are marked saturated; noise and lens are
    left out. ``exposure`` is kept with the picture.

    Raises
    ------
    StimulusError
        If the sensitivities or the light do not go with the picture, or a value is NaN or infinite.
    """
    if not (np.isfinite(full_scale_luminance_cd_m2) and full_scale_luminance_cd_m2 > 0):
        raise StimulusError.of(f"full scale is at {full_scale_luminance_cd_m2} cd/m²", "give a luminance above 0")
    if not LEAST <= full_scale_luminance_cd_m2 <= MOST:
        message = f"full scale is at {full_scale_luminance_cd_m2:g} cd/m²"
        raise StimulusError.of(message, f"give {LEAST:g} to {MOST:g}")
    light = light or Illumination()
    waves = picture.wavelengths_nm
    # As wide as half the way to either neighbour, and to the only one at the ends.
    seen = read_sensitivities(sensitivities, waves) * np.gradient(waves)[:, None]
    luminance = float(observer_weights(waves)[:, 1].sum())
    filled = float(seen.sum(axis=0).max())
    if not filled > 0:
        raise picture.wrong(f"{sensitivities.name} sees nothing in the picture's bands", "check its wavelengths")
    gain = luminance / (full_scale_luminance_cd_m2 * filled)
    rgb = weighted(picture, gain * seen * light.per_band(picture)[:, None])
    saturated = rgb >= 1
    np.minimum(rgb, np.float32(1), out=rgb)
    step = {
        **spectral_step("spectra_to_camera", picture, light),
        "sensitivities": sensitivities.name,
        "full_scale_luminance_cd_m2": full_scale_luminance_cd_m2,
        "saturated_pixels": saturated.reshape(-1, 3).sum(axis=0).tolist(),
    }
    return CameraImage(rgb, saturated, exposure, str(picture.path), (step,))


@dataclass(frozen=True, slots=True)
class SpectralReport(JsonResult):
    """A spectral picture that was converted: to XYZ with its luminance, or to camera RGB with its saturated share."""

    file: str
    output: str
    width_px: int
    height_px: int
    quantity: Quantity
    notes: tuple[str, ...]
    step: Mapping[str, Any]
    mean_luminance_cd_m2: float | None = None
    max_luminance_cd_m2: float | None = None
    saturated_share: tuple[float, float, float] | None = None
    json_names: ClassVar = "file output width_px height_px mean_luminance_cd_m2 max_luminance_cd_m2 steps"
    json_optional: ClassVar = ("mean_luminance_cd_m2", "max_luminance_cd_m2")

    @property
    def steps(self) -> list[Mapping[str, Any]]:
        """The step that made the picture."""
        return [self.step]

    def told(self) -> Iterator[str]:
        """Yield what was written, and notes."""
        if self.saturated_share is not None:
            shares = " ".join(f"{100 * share:.2f} %" for share in self.saturated_share)
            result = f"camera RGB, saturated R, G, B {shares}"
        else:
            mean, highest = self.mean_luminance_cd_m2, self.max_luminance_cd_m2
            result = f"XYZ, mean {mean:.4g} cd/m², largest {highest:.4g} cd/m²"
        step = self.step
        bands = f"{step['bands']} bands over {step['first_nm']:g}..{step['last_nm']:g} nm"
        size = f"{self.width_px} × {self.height_px} pixels of {bands}"
        yield f"{self.output}: {size}, {self.quantity}; {result}."
        yield from (f"Note: {note}." for note in self.notes)


def convert_spectral(
    file: Annotated[str | Path, Typed(metavar="FILE", read="builtins.str")],
    output: Annotated[str | Path, Typed("-o --output", "OUT.exr", read="builtins.str")],
    options: SpectralOptions | None = None,
) -> SpectralReport:
    """Turn a spectral picture into XYZ, or into what a camera records.

    FILE is OpenEXR with a channel per wavelength (S0.550nm, T.550nm or 550nm) or ENVI (.hdr). Radiance is in
    W/(sr m² nm). By the --observer's functions it becomes absolute XYZ; with --sensitivities, linear camera RGB that
    can be compared with a photograph.

    Parameters
    ----------
    file
        The spectral picture: OpenEXR (.exr) with a channel for each wavelength, or ENVI (.hdr, or the data beside it).
    output
        OpenEXR file to write.
    options
        The light, the observer or the camera, and what the values are.

    Returns
    -------
    SpectralReport
        Size in pixels and the step that was taken; mean and largest luminance in cd/m², or the share of saturated
        pixels of each channel of a camera.

    Raises
    ------
    InputError
        If options do not go together, ``output`` is no .exr file or is ``file`` itself, or the picture cannot be read,
        converted or written.
    """
    options = options or SpectralOptions()
    _refuse_together(options)
    file, output = Path(file), Path(output)
    if output.suffix.lower() != ".exr":
        raise StimulusError(Finding("the output is no .exr file", str(output), remedy="name one"))
    if output.exists() and file.exists() and output.samefile(file):
        remedy = "name another output"
        raise StimulusError(Finding("the spectral picture would be written over", str(output), remedy=remedy))
    picture = read_spectral(file, options.quantity)
    light = Illumination(options.illuminant, options.white_luminance_cd_m2, options.scale)
    report = SpectralReport(
        str(file), str(output), picture.width_px, picture.height_px, picture.quantity, picture.notes, {}
    )
    sensitivities, full_scale_cd_m2 = options.sensor.sensitivities, options.sensor.full_scale_cd_m2
    if sensitivities is not None and full_scale_cd_m2 is not None:
        image = spectral_to_camera(picture, sensitivities, full_scale_cd_m2, light, exposure=options.exposure)
        write_camera_exr(output, image)
        return replace(report, step=image.steps[-1], saturated_share=image.saturated_share)
    observed = spectral_to_xyz(picture, light, negative=options.negative, observer=options.observer)
    write_exr(output, StereoImage.flat(observed.xyz), options.observer)
    luminance = observed.xyz[..., 1]
    return replace(
        report,
        step=observed.steps[-1],
        mean_luminance_cd_m2=float(luminance.mean(dtype=float)),
        max_luminance_cd_m2=float(luminance.max()),
    )


def _refuse_together(asked: SpectralOptions) -> None:
    """Raise StimulusError if options were given that do not go together."""
    of_camera = asked.sensor.sensitivities is not None
    if of_camera != (asked.sensor.full_scale_cd_m2 is not None):
        raise StimulusError.of("sensitivities and full scale go together", "give both, or leave both out")
    if asked.exposure is not None and not of_camera:
        raise StimulusError.of("an exposure goes with sensitivities: XYZ has none", "leave it out")
    if of_camera and colorimetric_observer(asked.observer).name != DEFAULT_OBSERVER:
        raise StimulusError.of(
            "the observer is that of XYZ, and with sensitivities camera RGB is written",
            "leave it out; the camera file names the observer of its XYZ: cyclopean camera fit --observer",
        )
