"""From a raw file to a sensor's linear values, and to a camera's picture: black, white, interpolation, nothing else."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from devices.camera import Exposure
from documents.files import sha256_of_file
from stimuli.develop.camera_image import CameraImage
from stimuli.develop.demosaic import BAND_PHOTOSITES, COLOURS, Mosaic
from stimuli.develop.dng_tags import unreadable_form
from stimuli.develop.levels import Levels
from stimuli.develop.metadata import camera_name, exif_exposure
from stimuli.develop.sensor_image import DEFAULT_DEMOSAIC as DEFAULT_DEMOSAIC
from stimuli.develop.sensor_image import DEMOSAICS as DEMOSAICS
from stimuli.develop.sensor_image import Demosaic as Demosaic
from stimuli.develop.sensor_image import SensorImage, make_picture
from stimuli.errors import StimulusError
from stimuli.pictures.picture_input import refuse_no_picture

if TYPE_CHECKING:
    import rawpy

MAX_PHOTOSITES = 200_000_000
# The flip of a file whose picture stays as it is stored.
_AS_STORED = 0


def read_raw(
    path: Path,
    *,
    demosaic: Demosaic = DEFAULT_DEMOSAIC,
    levels: Levels | None = None,
    rotate: bool = True,
    exposure: Exposure | None = None,
) -> CameraImage:
    """Return the linear camera RGB in the raw file at ``path``: `read_sensor`, then `make_picture`.

    Raises
    ------
    StimulusError
        If the file is missing, cut short, no raw file, or of no Bayer sensor, or its levels leave nothing.
    """
    if demosaic not in DEMOSAICS:
        raise StimulusError.of(f"there is no demosaicing '{demosaic}'", f"one of {', '.join(DEMOSAICS)}")
    return make_picture(read_sensor(path, levels=levels, rotate=rotate, exposure=exposure), demosaic)


def read_sensor(
    path: Path, *, levels: Levels | None = None, rotate: bool = True, exposure: Exposure | None = None
) -> SensorImage:
    """Return the linear values of the sensor in the raw file at ``path``, as they are stored.

    value = (code − black) / (white − black), in float. Codes are those after the linearisation table that the file
    itself carries. No white balance, curve, matrix, clipping, or brightening is applied, and no part cut off but the
    sensor's masked border. ``levels`` take the place of the file's. A linear DNG has three colours for each pixel. With
    ``rotate`` the picture that is made of them is turned upright by the file's orientation.

    Raises
    ------
    StimulusError
        As `read_raw`.
    """
    import rawpy

    refuse_no_picture(path, "file")
    if form := unreadable_form(path):
        raise StimulusError(form)
    try:
        with rawpy.imread(str(path)) as raw:
            return _linear_values(raw, path, levels or Levels(), rotate, exposure)
    except rawpy.LibRawFileUnsupportedError as error:
        raise StimulusError.at(
            path, "this is no raw file that LibRaw knows", "give a raw file, TIFF or OpenEXR"
        ) from error
    except (rawpy.LibRawIOError, rawpy.LibRawDataError) as error:
        raise StimulusError.at(path, "the raw file is cut short or damaged", "copy it from the card again") from error
    except rawpy.LibRawError as error:
        reason = str(error).removeprefix("b").strip("'\"")
        raise StimulusError.at(path, f"the raw file cannot be read: {reason}", "convert it to DNG") from error


def _linear_values(raw: rawpy.RawPy, path: Path, levels: Levels, rotate: bool, given: Exposure | None) -> SensorImage:
    import rawpy

    if raw.raw_type == rawpy.RawType.Stack:
        values, saturated, pattern, linearised = _three_colours(raw, path, levels)
    else:
        values, saturated, pattern, linearised = _one_colour_each(raw, path, levels)
    exposure, source = (given, "told") if given else (exif_exposure(path, raw), "metadata")
    read = {"step": "read", "file": path.name, "kind": "raw", "sha256": sha256_of_file(path)}
    return SensorImage(
        values,
        saturated,
        pattern,
        path,
        (read, linearised),
        exposure,
        source,
        camera_name(path),
        int(raw.sizes.flip) if rotate else _AS_STORED,
        _gains(raw),
    )


Read = tuple[NDArray[np.float32], NDArray[np.bool_], NDArray[np.int64] | None, dict[str, Any]]


def _one_colour_each(raw: rawpy.RawPy, path: Path, levels: Levels) -> Read:
    """Return the values of a sensor behind a Bayer filter."""
    if raw.raw_pattern is None:
        raise StimulusError.at(
            path, "the raw file has no colours (a monochrome sensor)", "give that of a colour sensor"
        )
    if raw.raw_pattern.shape != (2, 2) or raw.num_colors != 3 or raw.color_desc[:3] != b"RGB":
        name = raw.color_desc.decode("ascii", "replace")
        shape = "×".join(str(side) for side in raw.raw_pattern.shape)
        raise StimulusError.at(path, f"the colour filter is {shape} of {name}, not Bayer", "export it as a linear TIFF")
    codes = _visible(raw, path)
    filters = raw.raw_colors_visible[:2, :2].astype(np.int64)
    pattern = np.where(filters == 3, 1, filters)
    blacks, whites, full = _levels(raw, levels)
    values = np.empty(codes.shape, np.float32)
    saturated = np.empty(codes.shape, bool)
    for row in range(2):
        for column in range(2):
            place = slice(row, None, 2), slice(column, None, 2)
            _linearise(codes, place, int(filters[row, column]), (blacks, whites, full), path, values, saturated)
    used = sorted(set(filters.ravel().tolist()))
    step = _step(codes, values, blacks, whites, full, used)
    step["filters"] = ["".join(COLOURS[colour][0].upper() for colour in row) for row in pattern]
    step["saturated_photosites"] = Mosaic(values, saturated, pattern).saturated_photosites()
    return values, saturated, pattern, step


def _three_colours(raw: rawpy.RawPy, path: Path, levels: Levels) -> Read:
    """Return the values of a linear DNG, whose pixels have three colours each."""
    if raw.num_colors != 3 or raw.color_desc[:3] != b"RGB":
        name = raw.color_desc.decode("ascii", "replace")
        raise StimulusError.at(
            path, f"the linear DNG has {raw.num_colors} colours ({name}), not R, G and B", "export RGB"
        )
    codes = _visible(raw, path)[..., :3]
    blacks, whites, full = _levels(raw, levels)
    values = np.empty(codes.shape, np.float32)
    saturated = np.empty(codes.shape, bool)
    for colour in range(3):
        place = slice(None), slice(None), colour
        _linearise(codes, place, colour, (blacks, whites, full), path, values, saturated)
    step = _step(codes, values, blacks, whites, full, [0, 1, 2])
    step["saturated_photosites"] = {
        name: {
            "photosites": int(np.count_nonzero(saturated[..., colour])),
            "share": float(saturated[..., colour].mean()),
        }
        for colour, name in enumerate(COLOURS)
    }
    return values, saturated, None, step


def _visible(raw: rawpy.RawPy, path: Path) -> NDArray[np.uint16]:
    sizes = raw.sizes
    if sizes.width * sizes.height > MAX_PHOTOSITES:
        raise StimulusError.at(
            path, f"{sizes.width} × {sizes.height} photosites are beyond {MAX_PHOTOSITES}", "crop it"
        )
    codes = raw.raw_image_visible
    if codes.shape[:2] != (sizes.height, sizes.width) or min(codes.shape[:2]) < 2:
        raise StimulusError.at(
            path, f"the raw file has {codes.shape[1]} × {codes.shape[0]} photosites of {sizes}", "check it"
        )
    return codes


def _levels(raw: rawpy.RawPy, levels: Levels) -> tuple[list[float], list[float], list[float]]:
    whites = levels.white_codes(int(raw.white_level))
    full = levels.saturation_codes(whites, raw.camera_white_level_per_channel)
    return levels.black_codes(raw.black_level_per_channel), whites, full


def _linearise(
    codes: NDArray[np.uint16],
    place: tuple[Any, ...],
    filter_: int,
    levels: tuple[list[float], list[float], list[float]],
    path: Path,
    values: NDArray[np.float32],
    saturated: NDArray[np.bool_],
) -> None:
    """Fill in the values of one filter's photosites, a band of rows at a time."""
    black, white, full = (level[filter_] for level in levels)
    if not white > black:
        raise StimulusError.at(path, f"the white level {white:g} is not above the black level {black:g}", "give both")
    stored, value, mark = codes[place], values[place], saturated[place]
    rows = max(1, BAND_PHOTOSITES // max(1, stored.shape[1]))
    for first in range(0, len(stored), rows):
        band = slice(first, first + rows)
        value[band] = (stored[band] - np.float32(black)) * np.float32(1.0 / (white - black))
        mark[band] = stored[band] >= full


def _step(
    codes: NDArray[np.uint16],
    values: NDArray[np.float32],
    blacks: list[float],
    whites: list[float],
    full: list[float],
    used: list[int],
) -> dict[str, Any]:
    largest = int(codes.max())
    return {
        "step": "linearise",
        "black": [blacks[index] for index in used],
        "white": whites[0],
        "saturated_from": [full[index] for index in used],
        "largest_code": largest,
        "photosites_at_largest_code": int(np.count_nonzero(codes == largest)),
        "below_black": int(np.count_nonzero(values < 0)),
    }


def _gains(raw: rawpy.RawPy) -> NDArray[np.float64]:
    """Return the gains that balance red, green and blue, the largest 1: the camera's, or those of daylight, or none."""
    for balance in (raw.camera_whitebalance, raw.daylight_whitebalance):
        gains = np.asarray(balance[:3], dtype=np.float64)
        if np.isfinite(gains).all() and (gains > 0).all() and gains.max() < 100 * gains.min():
            return np.asarray(gains / gains.max())
    return np.ones(3)
