"""TIFF and OpenEXR files of linear camera RGB: read as a camera's picture, and written so that they read back."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from devices.camera import Exposure
from documents.files import sha256_of_file
from documents.text import counted
from stimuli.develop.camera_image import CameraImage
from stimuli.develop.levels import Levels
from stimuli.develop.metadata import EXPOSURE_ATTRIBUTE, earlier_steps, exposure_step, spec_exposure
from stimuli.errors import StimulusError
from stimuli.pictures.exr_header import refuse_other_than_a_view
from stimuli.pictures.exr_views import channel_runs, refuse_many_values
from stimuli.pictures.exr_write import write_pixel_rows
from stimuli.pictures.picture_input import opened, reason, refuse_no_picture, refuse_undecoded, text_of
from stimuli.pictures.picture_pixels import EXIF_FLIPS, turned

if TYPE_CHECKING:
    import OpenImageIO


MAX_PIXELS = 200_000_000
# Rows that are in memory in double precision at a time.
_BAND_ROWS = 64
# OpenEXR compresses sixteen rows together.
_WRITTEN_ROWS = 128
# Of all channels together: R, G, B and alpha, or R, G, B and their saturation, of the largest picture.
MAX_VALUES = 7 * MAX_PIXELS
SATURATED = tuple(f"saturated.{channel}" for channel in "RGB")
STEPS_ATTRIBUTE = "cyclopean:steps"
_RGB = ("R", "G", "B")
_FORMATS = ("tiff", "openexr")
_LINEAR = ("linear", "lin_", "raw", "data", "scene_linear", "unknown")


def read_linear(
    path: Path,
    *,
    levels: Levels | None = None,
    rotate: bool = True,
    exposure: Exposure | None = None,
    assume_linear: bool = False,
) -> CameraImage:
    """Return the linear camera RGB in the TIFF or OpenEXR file at ``path``.

    Integers are divided by their type's largest, floats taken as shares of full scale; with ``levels`` it is
    (value − black) / (white − black). A channel is saturated where its value reaches ``levels.saturated``, else white;
    a file that this program wrote brings its own map. ``assume_linear`` takes the numbers as linear camera RGB
    whatever the file declares.

    Raises
    ------
    StimulusError
        If the file is missing, cut short, neither TIFF nor OpenEXR, has not R, G and B, has 8 bits, declares a
        gamma, a profile or chromaticities, or holds NaN or infinity.
    """
    import OpenImageIO as oiio

    refuse_no_picture(path, "file")
    hint = oiio.ImageSpec()
    hint.attribute("oiio:RawColor", 1)
    hint.attribute("oiio:UnassociatedAlpha", 1)
    with opened(path, "write it again", hint, whole=True) as picture:
        if picture.format_name() not in _FORMATS:
            raise StimulusError.at(path, f"the picture is {picture.format_name()}, not raw, TIFF or OpenEXR", _REMEDY)
        return _read(picture, path, levels or Levels(), rotate, exposure, assume_linear)


_REMEDY = "export the photograph as 16-bit or float TIFF, linear, in the camera's own RGB"


def _read(
    picture: OpenImageIO.ImageInput, path: Path, levels: Levels, rotate: bool, given: Exposure | None, linear: bool
) -> CameraImage:
    spec = picture.spec()
    _refuse(spec, path, linear)
    if picture.seek_subimage(1, 0):
        raise StimulusError.at(path, "the file holds more than one picture", "keep one")
    picture.seek_subimage(0, 0)
    names = list(spec.channelnames)
    has_map = all(name in names for name in SATURATED)
    stored = _channels(picture, path, [names.index(name) for name in (*_RGB, *(SATURATED if has_map else ()))])
    values = stored[..., :3]
    whole = np.issubdtype(values.dtype, np.integer)
    black = 0.0 if levels.black is None else levels.black
    white = (float(np.iinfo(values.dtype).max) if whole else 1.0) if levels.white is None else levels.white
    if not white > black:
        raise StimulusError.at(path, f"the white level {white:g} is not above the black level {black:g}", "give both")
    full = white if levels.saturated is None else levels.saturated
    bad = 0 if whole else int((~np.isfinite(values)).any(axis=-1).sum())
    if bad:
        raise StimulusError.at(path, f"{counted(bad, 'pixel is', 'pixels are')} NaN or infinite", "correct the picture")
    if has_map:
        saturated, map_from = stored[..., 3:] > 0, "file"
    else:
        saturated, map_from = values >= full, "values"
    rgb = np.empty(values.shape, dtype=np.float32)
    for first in range(0, len(rgb), _BAND_ROWS):
        band = slice(first, first + _BAND_ROWS)
        rgb[band] = (values[band].astype(np.float64) - black) / (white - black)
    del stored, values
    flip = EXIF_FLIPS.get(_orientation(spec), 0) if rotate else 0
    steps: tuple[Mapping[str, Any], ...] = earlier_steps(spec.getattribute(STEPS_ATTRIBUTE))
    kind = f"{picture.format_name()} {spec.format}"
    steps += ({"step": "read", "file": path.name, "kind": kind, "sha256": sha256_of_file(path)},)
    steps += ({"step": "scale", "black": black, "white": white, "saturated_from": full, "saturation_map": map_from},)
    if flip:
        steps += ({"step": "rotate", "libraw_flip": flip},)
    exposure, source = (given, "told") if given else (spec_exposure(spec), "metadata")
    if exposure:
        steps += (exposure_step(exposure, source),)
    return CameraImage(
        np.ascontiguousarray(turned(rgb, flip)),
        np.ascontiguousarray(turned(saturated, flip)),
        exposure,
        str(path),
        steps,
    )


def _channels(picture: OpenImageIO.ImageInput, path: Path, wanted: Sequence[int]) -> NDArray[Any]:
    """Return the ``wanted`` channels, (height, width, channels), in the file's own numbers; others are not read."""
    spec = picture.spec()
    made: NDArray[Any] | None = None
    for run in channel_runs([wanted]):
        stored: NDArray[Any] | None = picture.read_image(0, 0, run.start, run.stop, spec.format)
        if stored is None:
            problem = reason(text_of(picture.geterror))
            refuse_undecoded(path, f"the picture is cut short or damaged: {problem}", "copy it again")
        if list(run) == list(wanted):
            return stored
        if made is None:
            made = np.empty((*stored.shape[:2], len(wanted)), stored.dtype)
        for place, index in enumerate(wanted):
            if index in run:
                made[..., place] = stored[..., index - run.start]
    assert made is not None
    return made


def _refuse(spec: OpenImageIO.ImageSpec, path: Path, linear: bool) -> None:
    if spec.deep or not 0 < spec.width * spec.height <= MAX_PIXELS:
        raise StimulusError.at(
            path, f"a picture of {spec.width} × {spec.height} pixels is deep or too large", "flatten or crop it"
        )
    refuse_many_values(path, spec, MAX_VALUES)
    stored, shown = (
        (spec.x, spec.y, spec.width, spec.height),
        (spec.full_x, spec.full_y, spec.full_width, spec.full_height),
    )
    if stored != shown:
        message = "it stores another part than its display window, and cameras' pixels have their places"
        raise StimulusError.at(path, message, "write it again with one window: oiiotool IN --croptofull -o OUT")
    refuse_other_than_a_view(spec, path)
    missing = [name for name in _RGB if name not in spec.channelnames]
    if missing:
        channels = ", ".join(spec.channelnames[:6])
        raise StimulusError.at(path, f"the picture lacks the channel {missing[0]}; it has {channels}", _REMEDY)
    if linear:
        return
    declared = str(spec.getattribute("oiio:ColorSpace") or "")
    if declared and not declared.lower().startswith(_LINEAR):
        raise StimulusError.at(
            path, f"the picture declares the colour space '{declared}', which is not linear", _UNLESS
        )
    if spec.getattribute("ICCProfile") is not None:
        profile = spec.getattribute("ICCProfile:profile_description") or "without a name"
        raise StimulusError.at(
            path, f"the picture carries a colour profile ({profile}), so it is no camera RGB", _UNLESS
        )
    if spec.getattribute("chromaticities") is not None:
        raise StimulusError.at(path, "the picture declares chromaticities, so it is no camera RGB", _UNLESS)
    if str(spec.format) in _EIGHT_BITS:
        raise StimulusError.at(path, "the picture has 8 bits, which linear light does not fit into", _UNLESS)


_UNLESS = f"{_REMEDY}; or declare that the numbers are linear camera RGB"
_EIGHT_BITS = ("uint8", "int8")


def _orientation(spec: OpenImageIO.ImageSpec) -> int:
    value = spec.getattribute("Orientation")
    return value if isinstance(value, int) else 1


def write_camera_exr(path: Path, image: CameraImage) -> None:
    """Write ``image`` to ``path``, as a whole or not at all: R, G, B in single precision and the saturation map.

    Exposure and steps go along, and no chromaticities, because a camera's RGB has none. Nothing is rounded:
    `read_linear` returns the same numbers.

    Raises
    ------
    StimulusError
        If the file cannot be written.
    """
    import OpenImageIO as oiio

    path = Path(path)
    height, width, _ = image.rgb.shape
    spec = oiio.ImageSpec(width, height, 6, "float")
    spec.channelnames = ("R", "G", "B", *SATURATED)
    spec.channelformats = (oiio.FLOAT,) * 3 + (oiio.HALF,) * 3
    spec.attribute(STEPS_ATTRIBUTE, json.dumps(list(image.steps), ensure_ascii=False))
    if image.exposure:
        numbers = (image.exposure.time_s, image.exposure.f_number, image.exposure.iso)
        spec.attribute(EXPOSURE_ATTRIBUTE, json.dumps(numbers))
        spec.attribute("ExposureTime", numbers[0])
        spec.attribute("FNumber", numbers[1])
    bands = (slice(first, min(first + _WRITTEN_ROWS, height)) for first in range(0, height, _WRITTEN_ROWS))
    rows = (
        (band, np.concatenate([image.rgb[band], image.saturated[band].astype(np.float32)], axis=-1)) for band in bands
    )
    write_pixel_rows(path, spec, rows)
