"""Photographs, from their files to OpenEXR files of absolute XYZ or of linear camera RGB, and what was done to them."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, ClassVar

from devices.camera import Exposure
from documents import Finding, InputError
from documents.files import unwritable, write_whole, writing
from documents.options import Typed
from documents.pages import Table
from documents.text import JsonResult
from stimuli.develop.calibration_frames import Calibration, read_calibration
from stimuli.develop.camera_image import CameraImage
from stimuli.develop.camera_to_xyz import XYZRows
from stimuli.develop.linear_files import write_camera_exr
from stimuli.develop.options import DevelopOptions
from stimuli.develop.read import read_camera_image
from stimuli.errors import StimulusError
from stimuli.pictures.exr_write import write_exr_rows


def calibration_of(options: DevelopOptions) -> Calibration:
    """Return the dark frames and flat fields, read and pooled; StimulusError if they are none."""
    return read_calibration(options.dark, options.flat, levels=options.levels, assume_linear=options.linear)


@dataclass(frozen=True, slots=True)
class LuminanceReport(JsonResult):
    """The light of a developed photograph, and how far it can be trusted: see `camera_to_xyz.Developed`.

    ``exposure_was_characterised`` is true if the camera file was tested at this exposure; None where that is unknown.
    """

    mean_cd_m2: float
    max_cd_m2: float
    safe_cd_m2: tuple[float, float] | None
    below_safe_pixels: int
    above_safe_pixels: int
    negative_pixels: int
    exposure_was_characterised: bool | None
    json_keys: ClassVar = {
        "mean_cd_m2": "mean_luminance_cd_m2",
        "max_cd_m2": "max_luminance_cd_m2",
        "safe_cd_m2": "safe_luminance_cd_m2",
        "negative_pixels": "negative_pixels_set_to_0",
    }


@dataclass(frozen=True, slots=True)
class DevelopedPhotograph(JsonResult):
    """A photograph that was developed to ``output``; ``luminance`` is None where it stayed camera RGB."""

    photo: str
    output: str
    width_px: int
    height_px: int
    exposure: Exposure | None
    saturated_share: tuple[float, float, float]
    notes: tuple[str, ...]
    steps: tuple[dict[str, Any], ...]
    luminance: LuminanceReport | None
    json_keys: ClassVar = {"notes": "said", "luminance": "*"}
    json_names: ClassVar = "photo output holds width_px height_px exposure saturated_share notes steps luminance"

    @property
    def holds(self) -> str:
        """What its values are."""
        return "camera RGB" if self.luminance is None else "XYZ"


@dataclass(frozen=True, slots=True)
class DevelopReport(JsonResult):
    """The photographs that were developed, and findings on those that were not."""

    photographs: tuple[DevelopedPhotograph, ...]
    findings: tuple[Finding, ...]
    json_only: ClassVar = "photographs"

    @property
    def failure(self) -> InputError | None:
        """What is wrong with those that were not developed; None where all were."""
        return InputError(self.findings) if self.findings else None

    def told(self) -> Iterator[str | Table]:
        """Yield a table of the photographs, and notes on them."""
        if not self.photographs:
            return
        title = "Saturated pixels of R, G, B"
        has_xyz = self.photographs[0].luminance is not None
        if has_xyz:
            title += "; luminance in cd/m²; pixels outside the camera's safe zone; pixels below 0, set to 0"
        headings = ("photograph", "size", "exposure", "saturated %", *(("mean", "max", "unsafe %", "< 0") * has_xyz))
        yield Table.of_texts(title, headings, [_cells(photograph) for photograph in self.photographs])
        for photograph in self.photographs:
            for note in photograph.notes:
                yield f"Note: {photograph.photo}: {note}."
            if photograph.luminance and photograph.luminance.exposure_was_characterised is False:
                yield f"Note: {photograph.photo}: the camera file was not tested at this exposure."


def _cells(photograph: DevelopedPhotograph) -> list[str]:
    exposure, light = photograph.exposure, photograph.luminance
    size = f"{photograph.width_px}×{photograph.height_px}"
    saturated = " ".join(f"{100 * share:.3g}" for share in photograph.saturated_share)
    shown = "not known"
    if exposure is not None:
        shown = f"{exposure.time_text} f/{exposure.f_number:g} {exposure.iso:g}"
    cells = [photograph.photo, size, shown, saturated]
    if light is not None:
        unsafe = light.below_safe_pixels + light.above_safe_pixels
        percent = 100 * unsafe / (photograph.width_px * photograph.height_px)
        cells += [f"{light.mean_cd_m2:.4g}", f"{light.max_cd_m2:.4g}"]
        cells += ["–" if light.safe_cd_m2 is None else f"{percent:.3g}", str(light.negative_pixels)]
    return cells


def develop_photographs(
    photos: Annotated[Sequence[Path], Typed(metavar="PHOTO...")],
    output: Annotated[str | Path, Typed("-o --output", "OUT.exr|FOLDER", read="builtins.str")],
    options: DevelopOptions | None = None,
    *,
    progress: Callable[[str, int, int], None] = lambda what, done, total: None,
) -> DevelopReport:
    """Turn photographs into pictures of linear light.

    PHOTO is a raw file of a camera with a Bayer filter, or a TIFF or OpenEXR file of linear camera RGB. Black is
    subtracted and colours are interpolated; no white balance, curve or clipping is applied. With --camera the result
    is absolute XYZ in cd/m²; without it, camera RGB in shares of full scale. The steps go into a .steps.json beside it.

    --dark and --flat are photographs without light, and of an even light, by the same camera: they are applied before
    colours are interpolated.

    A photograph that cannot be developed is reported, the others are written, and the exit status is 2.

    Parameters
    ----------
    photos
        Raw photographs.
    output
        OpenEXR file or folder to write.
    options
        The camera, the demosaicing, and what is done with light that the camera cannot measure.
    progress
        Called with what is being done, how many photographs are done, and how many there are.

    Returns
    -------
    DevelopReport
        What was written, and what could not be developed. One photograph goes into a file, unless ``output`` is a
        folder or ends in a slash; several go into a folder, which is made.

    Raises
    ------
    InputError
        If ``output`` does not suit, or a photograph would be written over.

    Examples
    --------
    >>> import numpy as np
    >>> from tempfile import TemporaryDirectory
    >>> rgb = np.full((4, 6, 3), 0.25, np.float32)
    >>> with TemporaryDirectory() as folder:
    ...     photos = [Path(folder, name) for name in ("one.exr", "two.exr")]
    ...     for photo in photos:
    ...         write_camera_exr(photo, CameraImage(rgb, rgb >= 1, None, photo.name, ()))
    ...     report = develop_photographs(photos, Path(folder, "developed"))
    >>> [photograph.width_px for photograph in report.photographs], report.findings
    ([6, 6], ())
    """
    options = options or DevelopOptions()
    calibration = calibration_of(options)
    places = _places(photos, Path(output), str(output).endswith("/"))
    developed: list[DevelopedPhotograph] = []
    findings: list[Finding] = []
    for done, (photo, place) in enumerate(places.items()):
        progress("Developing", done, len(places))
        try:
            developed.append(develop_photograph(photo, place, options, calibration))
        except InputError as error:
            findings += [finding if finding.file else replace(finding, file=str(photo)) for finding in error.findings]
    progress("Developing", len(places), len(places))
    return DevelopReport(tuple(developed), tuple(findings))


def develop_photograph(
    photo: Path, output: Path, options: DevelopOptions, calibration: Calibration | None = None
) -> DevelopedPhotograph:
    """Develop a photograph to an OpenEXR file, and write the steps beside it.

    Parameters
    ----------
    photo
        A raw file of a Bayer sensor, or a TIFF or OpenEXR file of linear camera RGB.
    output
        The OpenEXR file (.exr) to write; the steps go into a .steps.json beside it.
    options
        How it is developed; with a camera model to XYZ in cd/m², without one to camera RGB in shares of full scale.
    calibration
        The dark frames and flat fields of ``options``, where they were read before.

    Returns
    -------
    DevelopedPhotograph
        Size, exposure, saturated shares, luminance, and every step.

    Raises
    ------
    StimulusError, DeviceError
        If the photograph cannot be read or does not go with the camera file, and neither file is then touched; or if
        they cannot be written.

    Examples
    --------
    >>> import numpy as np
    >>> from tempfile import TemporaryDirectory
    >>> rgb = np.full((4, 6, 3), 0.25, np.float32)
    >>> with TemporaryDirectory() as folder:
    ...     linear = Path(folder, "linear.exr")
    ...     write_camera_exr(linear, CameraImage(rgb, rgb >= 1, None, "linear.exr", ()))
    ...     developed = develop_photograph(linear, Path(folder, "out.exr"), DevelopOptions())
    >>> developed.width_px, developed.height_px, developed.luminance
    (6, 4, None)
    """
    image = read_camera_image(
        photo,
        demosaic=options.demosaic,
        levels=options.levels,
        rotate=not options.as_stored,
        exposure=options.exposure,
        assume_linear=options.linear,
        calibration=calibration_of(options) if calibration is None else calibration,
    )
    return write_developed(image, photo.name, output, options)


def write_developed(image: CameraImage, name: str, output: Path, options: DevelopOptions) -> DevelopedPhotograph:
    """Write ``image`` to the OpenEXR file ``output``, in XYZ where ``options`` have a camera, and its steps beside it.

    ``name`` is that of the photograph in the result. Errors as of `develop_photograph`.
    """
    luminance, steps = None, image.steps
    if options.camera is None:
        write_camera_exr(output, image)
    else:
        rows = XYZRows(image, options.camera, options.negative)
        height, width, _ = image.rgb.shape
        write_exr_rows(output, (width, height), rows, options.camera.observer)
        developed = rows.developed()
        steps = developed.steps
        luminance = LuminanceReport(
            rows.mean_cd_m2,
            rows.highest_cd_m2,
            developed.safe_cd_m2,
            developed.below_safe,
            developed.above_safe,
            developed.clipped,
            None if image.exposure is None else options.camera.tried_at(image.exposure),
        )
    result = _result(name, output, image, tuple(dict(step) for step in steps), luminance)
    sidecar = output.with_suffix(".steps.json")
    text = json.dumps(result.to_json(), indent=1, allow_nan=False, ensure_ascii=False) + "\n"
    try:
        write_whole(sidecar, text, make_folder=False)
    except OSError as error:
        raise StimulusError(unwritable(error, sidecar, "record of the steps")) from error
    return result


def _result(
    name: str, output: Path, image: CameraImage, steps: tuple[dict[str, Any], ...], luminance: LuminanceReport | None
) -> DevelopedPhotograph:
    height, width, _ = image.rgb.shape
    return DevelopedPhotograph(
        name,
        output.name,
        int(width),
        int(height),
        image.exposure,
        image.saturated_share,
        image.full_early(),
        steps,
        luminance,
    )


def _places(photos: Sequence[Path], output: Path, into_folder: bool) -> dict[Path, Path]:
    """Return where each photograph goes, refusing what would be written over."""
    if len(set(photos)) < len(photos):
        raise InputError(Finding("a photograph is named twice", remedy="name it once"))
    if not (output.is_dir() or into_folder or len(photos) > 1):
        if output.suffix.lower() != ".exr":
            raise InputError(Finding("the output is no .exr file", str(output), remedy="name one, or a folder"))
        places = {photos[0]: output}
    else:
        if output.suffix.lower() == ".exr" and not output.is_dir():
            raise InputError(
                Finding(f"{len(photos)} photographs do not go into one file", str(output), remedy="name a folder")
            )
        with writing(output, "photographs"):
            output.mkdir(parents=True, exist_ok=True)
        places = {photo: output / f"{photo.stem}.exr" for photo in photos}
    written: dict[str, Path] = {}
    for photo, place in places.items():
        if place.exists() and any(place.resolve() == other.resolve() for other in photos):
            raise InputError(Finding("the photograph would be written over", str(place), remedy="name another output"))
        twin = written.setdefault(place.name.casefold(), photo)
        if twin is not photo:
            raise InputError(
                Finding(f"it would be written to the same file as {twin}", str(photo), remedy="rename one")
            )
    return places
