"""The pictures to compare: files read to absolute XYZ, for one eye or two."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from threading import Lock
from typing import TYPE_CHECKING, Any

import numpy as np

from devices.colour_matching import DEFAULT_OBSERVER
from devices.eyes import AnyEye
from documents import Finding, InputError
from stimuli.comparison.options import Holds, ReadOptions
from stimuli.errors import StimulusError
from stimuli.pictures.picture_header import is_ordinary
from stimuli.pictures.picture_input import MAX_BYTES, MAX_SPECTRAL_BYTES, opened, refuse_no_picture
from stimuli.pictures.rows import Mask, RowFile, RowsDone, bands, over_bands
from stimuli.pictures.stereo_image import XYZImage

if TYPE_CHECKING:
    from devices.camera import CameraModel, Exposure
    from stimuli.pictures.exr_read import Decoding

_TIFF = (".tif", ".tiff")
_FOR_SCREENS = (".png", ".jpg", ".jpeg", ".bmp", ".gif", ".webp", ".tif", ".tiff")
_ENVI = (".hdr", ".img", ".bsq", ".bil", ".bip", ".dat")
_MOST_MISTAKEN = 0.5


@dataclass(frozen=True, eq=False, slots=True)
class EyeXYZ:
    """The view of one eye: XYZ in cd/m², and where the sensor was full, bool (height, width); None without a sensor."""

    xyz: RowFile
    saturated: Mask | None


@dataclass(frozen=True, eq=False, slots=True)
class PictureFile:
    """A file's views: ``both``, or ``left`` and ``right``.

    ``safe_cd_m2`` is the zone of luminance that its camera was tested in, ``notes`` are sentences on the
    reading, ``steps`` how the file became XYZ, ``observer`` the colorimetric observer of these, ``exposure`` that of a
    photograph.
    """

    file: Path
    sha256: str
    holds: Holds
    views: Mapping[AnyEye, EyeXYZ]
    safe_cd_m2: tuple[float, float] | None
    notes: tuple[str, ...]
    steps: tuple[Mapping[str, Any], ...]
    observer: str = DEFAULT_OBSERVER
    exposure: Exposure | None = None

    @property
    def size_px(self) -> tuple[int, int]:
        """Width and height."""
        height, width = next(iter(self.views.values())).xyz.shape[:2]
        return width, height

    def to_json(self) -> dict[str, Any]:
        """Return facts on the file, without its pixels."""
        width, height = self.size_px
        return {
            "file": str(self.file),
            "sha256": self.sha256,
            "holds": self.holds,
            "observer": self.observer,
            "eyes": list(self.views),
            "width_px": width,
            "height_px": height,
            "safe_luminance_cd_m2": None if self.safe_cd_m2 is None else list(self.safe_cd_m2),
            "said": list(self.notes),
            "steps": [dict(step) for step in self.steps],
        }


def read_picture(path: Path, reading: ReadOptions, given: Holds | None, what: str, done: RowsDone) -> PictureFile:
    """Return the picture at ``path``; ``given`` is the kind of its values if the file does not declare it.

    ``what`` is the picture's name in messages.

    Raises
    ------
    StimulusError, DeviceError
        If the file cannot be read, or is camera RGB and there is no camera file, or was taken at an exposure that the
        camera file does not serve, or holds NaN or infinity.
    """
    from documents.files import sha256_of_file

    if path.suffix.lower() != ".hdr" or path.exists():
        refuse_no_picture(path, what, MAX_SPECTRAL_BYTES if path.suffix.lower() in _ENVI else MAX_BYTES)
    if reading.decoding is not None and given is None and is_ordinary(path):
        return _ordinary(path, reading.decoding, done)
    holds = given or what_it_holds(path)
    digest = sha256_of_file(path) if path.is_file() else ""
    if holds != "spectral":
        _refuse_bytes(path, what)
    if holds == "spectral":
        return _spectral(path, digest, reading, what, done)
    if holds == "camera-rgb":
        return _camera_rgb(path, digest, reading, what, done)
    if path.suffix.lower() in _TIFF:
        return _tiff_xyz(path, digest, holds, done)
    return _exr(path, digest, holds if given else None, done)


def what_it_holds(path: Path) -> Holds:
    """Return the kind of values in a file, by its suffix and, for OpenEXR, by its channels and declarations."""
    suffix = path.suffix.lower()
    if suffix in _ENVI:
        return "spectral"
    if suffix != ".exr":
        return "camera-rgb"
    with opened(path) as picture:
        spec = picture.spec()
        names = {name.rpartition(".")[2] for name in spec.channelnames}
        if {"X", "Y", "Z"} <= names or names <= {"Y", "RY", "BY", "A"}:
            return "xyz"
        if not {"R", "G", "B"} <= names:
            return "spectral"
        return "camera-rgb" if spec.getattribute("chromaticities") is None else "xyz"


def _ordinary(path: Path, decoding: Decoding, done: RowsDone) -> PictureFile:
    """Read a PNG, JPEG or the like as the light of the display that its codes are for."""
    from documents.files import sha256_of_file
    from stimuli.pictures.ordinary import read_ordinary

    read = read_ordinary([path], decoding)
    image = read.image
    done(image.height_px, image.height_px)
    shown: dict[AnyEye, XYZImage] = (
        {"both": image.left} if image.is_flat else {"left": image.left, "right": image.right}
    )
    views: dict[AnyEye, EyeXYZ] = {eye: EyeXYZ(RowFile.of(xyz), None) for eye, xyz in shown.items()}
    note = f"{read.bits} bits of {read.colour_space}, white at {read.white_luminance_cd_m2:g} cd/m²"
    step = {
        "step": "read",
        "file": path.name,
        "colour_space": read.colour_space,
        "white_luminance_cd_m2": read.white_luminance_cd_m2,
        "packing": read.packing,
    }
    return PictureFile(path, sha256_of_file(path), "xyz", views, None, (note,), (step,))


def _exr(path: Path, digest: str, given: Holds | None, done: RowsDone) -> PictureFile:
    """Read a picture of light a band of rows at a time; negative XYZ is set to 0 and counted."""
    from stimuli.pictures.exr_read import Decoding, read_exr_counted
    from stimuli.pictures.region import Region

    space = given if given in ("xyz", "rec709") else "declared"
    width, height = _exr_size(path)
    views: dict[AnyEye, RowFile] = {}
    turn = Lock()

    def read_band(band: slice) -> tuple[int, str]:
        """Put the rows into the views' files; return how many pixels were clipped, and whose XYZ they are."""
        part = Region(0, band.start, width, band.stop - band.start)
        try:
            read = read_exr_counted(path, Decoding(space, negative="clip"), region=part)
        except StimulusError as error:
            raise _in_rows(error, band, height) from error
        eyes: tuple[AnyEye, ...] = ("both",) if read.image.is_flat else ("left", "right")
        with turn:
            for eye in eyes:
                if eye not in views:
                    views[eye] = RowFile((height, width, 3))
        for eye in eyes:
            views[eye].write(band.start, read.image.left if eye != "right" else read.image.right)
        return read.clipped_pixels, read.observer

    parts = over_bands(read_band, (height, width), done)
    clipped, observer = sum(pixels for pixels, _ in parts), parts[-1][1]
    notes = (f"{clipped} pixels with negative XYZ were set to 0",) if clipped else ()
    step = {"step": "read", "file": path.name, "colour_space": space, "negative_pixels_set_to_0": clipped}
    eye_views: dict[AnyEye, EyeXYZ] = {eye: EyeXYZ(rows, None) for eye, rows in views.items()}
    return PictureFile(path, digest, given or "xyz", eye_views, None, notes, (step,), observer)


def _in_rows(error: StimulusError, rows: slice, height: int) -> StimulusError:
    """Return the error with the rows that it is about, where the rest of the picture was not read."""
    if (rows.start, rows.stop) == (0, height):
        return error
    return StimulusError(
        [
            Finding(f"{finding.message}, in rows {rows.start} to {rows.stop - 1}", finding.file, remedy=finding.remedy)
            for finding in error.findings
        ]
    )


def _exr_size(path: Path) -> tuple[int, int]:
    from stimuli.pictures.picture_input import MAX_PIXELS

    with opened(path) as picture:
        spec = picture.spec()
        size = int(spec.full_width), int(spec.full_height)
    if not 0 < size[0] * size[1] <= MAX_PIXELS:
        raise _wrong(path, f"a picture of {size[0]} × {size[1]} pixels is beyond {MAX_PIXELS}", "crop it")
    return size


def _refuse_bytes(path: Path, what: str) -> None:
    """Refuse a picture of 8 bits, such as a PNG: it is coded for a screen, whatever is declared."""
    if path.suffix.lower() not in _FOR_SCREENS:
        return
    import OpenImageIO as oiio

    try:
        with opened(path) as picture:
            bits = picture.spec().format
    except StimulusError:
        return  # the reader of its kind reports the fault
    if bits == oiio.UINT8:
        raise _wrong(
            path,
            f"the {what} has 8 bits a channel, which are gamma-coded for a screen and are no light",
            "add --colour-space srgb --picture-white 100 (cd/m²) to take it as the light of a display; or export it "
            "linear, as OpenEXR or float TIFF",
        )


def _tiff_xyz(path: Path, digest: str, holds: Holds, done: RowsDone) -> PictureFile:
    """Read a TIFF of floats whose numbers are XYZ in cd/m², or linear Rec. 709 of white 1 cd/m²."""
    from devices.colour import rgb_to_xyz_matrix
    from stimuli.develop.linear_files import read_linear
    from stimuli.pictures.exr_header import REC709

    image = read_linear(path, assume_linear=True)
    if any(step.get("kind", "").startswith("tiff uint") for step in image.steps):
        raise _wrong(path, "its whole numbers are no light in cd/m²", "write XYZ in cd/m² as floating point")
    matrix = np.eye(3) if holds == "xyz" else rgb_to_xyz_matrix(*REC709)
    height, width, _ = image.rgb.shape
    rows = RowFile((height, width, 3))
    below = 0
    for band in bands(rows.shape):
        xyz = (image.rgb[band].astype(np.float64) @ matrix.T).astype(np.float32)
        below += int((xyz < 0).any(axis=-1).sum())
        rows.write(band.start, np.maximum(xyz, np.float32(0)))
        done(band.stop, height)
    notes = (f"{below} pixels with negative XYZ were set to 0",) if below else ()
    return PictureFile(path, digest, holds, {"both": EyeXYZ(rows, None)}, None, notes, image.steps)


def _camera_rgb(path: Path, digest: str, reading: ReadOptions, what: str, done: RowsDone) -> PictureFile:
    from stimuli.develop.read import read_camera_image

    if reading.camera is None:
        raise _wrong(
            path,
            f"the {what} is camera RGB, and there is no camera file to convert it to XYZ",
            "give --camera CAMERA.yaml; if its numbers are XYZ, add --photo-holds or --rendering-holds xyz",
        )
    image = read_camera_image(path, exposure=reading.exposure, assume_linear=reading.linear)
    return _developed(path, digest, "camera-rgb", image, reading.camera, what, done)


def _spectral(path: Path, digest: str, reading: ReadOptions, what: str, done: RowsDone) -> PictureFile:
    from stimuli.spectral.bands import read_spectral
    from stimuli.spectral.convert import spectral_to_camera, spectral_to_xyz

    picture = read_spectral(path, reading.quantity)
    sensor = reading.sensor
    if sensor.sensitivities is None or sensor.full_scale_cd_m2 is None:
        seen = spectral_to_xyz(picture, reading.light, negative="clip", observer=reading.seen_by)
        notes = (f"{seen.clipped} pixels with negative XYZ were set to 0",) if seen.clipped else ()
        rows = RowFile.of(seen.xyz)
        done(rows.shape[0], rows.shape[0])
        views: dict[AnyEye, EyeXYZ] = {"both": EyeXYZ(rows, None)}
        name = str(seen.steps[-1]["observer"])
        return PictureFile(path, digest, "spectral", views, None, picture.notes + notes, seen.steps, name)
    if reading.camera is None:
        raise _wrong(
            path,
            f"the {what} is to be taken by the sensor, and there is no camera file to convert its RGB to XYZ",
            "give --camera CAMERA.yaml, or leave --sensitivities out",
        )
    exposure = reading.exposure or reading.camera.exposure
    image = spectral_to_camera(picture, sensor.sensitivities, sensor.full_scale_cd_m2, reading.light, exposure=exposure)
    developed = _developed(path, digest, "spectral", image, reading.camera, what, done)
    return PictureFile(
        path,
        digest,
        "spectral",
        developed.views,
        developed.safe_cd_m2,
        picture.notes + developed.notes,
        developed.steps,
        developed.observer,
    )


def _developed(
    path: Path, digest: str, holds: Holds, image: Any, camera: CameraModel, what: str, done: RowsDone
) -> PictureFile:
    from stimuli.develop.camera_to_xyz import XYZRows

    height, width, _ = image.rgb.shape
    try:
        rows = XYZRows(image, camera)
        kept = RowFile((height, width, 3))
        for band, xyz in rows:
            kept.write(band.start, xyz)
            done(band.stop, height)
        developed = rows.developed()
    except InputError as error:
        # A camera model's findings on exposures name no file.
        raise type(error)(
            [
                finding if finding.file else Finding(f"the {what}: {finding.message}", str(path), remedy=finding.remedy)
                for finding in error.findings
            ]
        ) from error
    notes = []
    if developed.clipped:
        notes.append(f"{developed.clipped} pixels with negative XYZ were set to 0")
    if developed.clipped > _MOST_MISTAKEN * height * width:
        notes.append("most pixels lie outside the camera's gamut: is it this camera's file?")
    if image.exposure is not None and not camera.tried_at(image.exposure):
        notes.append(f"the camera file was not tested at this exposure, {image.exposure}")
    views: dict[AnyEye, EyeXYZ] = {"both": EyeXYZ(kept, developed.saturated)}
    steps, exposure = developed.steps, image.exposure
    return PictureFile(path, digest, holds, views, developed.safe_cd_m2, tuple(notes), steps, camera.observer, exposure)


def _wrong(path: Path, message: str, remedy: str) -> StimulusError:
    return StimulusError(Finding(message, str(path), remedy=remedy))
