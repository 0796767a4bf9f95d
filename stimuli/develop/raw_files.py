"""From a raw file to a camera's picture: black, white, interpolation, nothing else."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, cast, get_args

import numpy as np
from numpy.typing import NDArray

from devices.camera import Exposure
from documents.files import looked_for, sha256_of_file
from stimuli.develop.camera_image import CameraImage
from stimuli.develop.demosaic import (
    COLOURS,
    REACH_PX,
    Adaptive,
    Linear,
    Mosaic,
    interpolate,
    libraw_interpolate,
    quantum,
    superpixel,
)
from stimuli.develop.levels import Levels
from stimuli.develop.metadata import exif_exposure, exposure_step, turned
from stimuli.errors import StimulusError

if TYPE_CHECKING:
    import rawpy

Demosaic = Literal["superpixel", "bilinear", "malvar", "vng", "ppg", "ahd"]
DEMOSAICS: tuple[Demosaic, ...] = get_args(Demosaic)
# It is linear, so that mean light and the ratio of exposures stay: docs/decisions/0012-demosaicing.md.
DEFAULT_DEMOSAIC: Demosaic = "malvar"
MAX_PHOTOSITES = 200_000_000


def read_raw(
    path: Path,
    *,
    demosaic: Demosaic = DEFAULT_DEMOSAIC,
    levels: Levels | None = None,
    rotate: bool = True,
    exposure: Exposure | None = None,
) -> CameraImage:
    """Return the linear camera RGB in the raw file at ``path``.

    value = (code − black) / (white − black), per photosite in float, then ``demosaic``. Codes are those after the
    linearisation table that the file itself carries. No white balance, curve, matrix, clipping, or brightening is
    applied, and no part cut off but the sensor's masked border. ``levels`` take the place of the file's. With
    ``rotate`` the picture is turned upright by the file's orientation.

    Raises
    ------
    StimulusError
        If the file is missing, cut short, no raw file, or none of a Bayer sensor, or its levels leave nothing.
    """
    import rawpy

    if demosaic not in DEMOSAICS:
        raise StimulusError.of(f"there is no demosaicing '{demosaic}'", f"one of {', '.join(DEMOSAICS)}")
    if not path.is_file():
        raise StimulusError.at(path, "there is no such file", looked_for(path))
    try:
        with rawpy.imread(str(path)) as raw:
            return _developed(raw, path, demosaic, levels or Levels(), rotate, exposure)
    except rawpy.LibRawFileUnsupportedError as error:
        raise StimulusError.at(
            path, "this is no raw file that LibRaw knows", "give a raw file, TIFF or OpenEXR"
        ) from error
    except (rawpy.LibRawIOError, rawpy.LibRawDataError) as error:
        raise StimulusError.at(path, "the raw file is cut short or damaged", "copy it from the card again") from error
    except rawpy.LibRawError as error:
        reason = str(error).removeprefix("b").strip("'\"")
        raise StimulusError.at(path, f"the raw file cannot be read: {reason}", "convert it to DNG") from error


def _developed(
    raw: rawpy.RawPy, path: Path, method: Demosaic, levels: Levels, rotate: bool, given: Exposure | None
) -> CameraImage:
    mosaic, linearised = _mosaic(raw, path, levels)
    step: dict[str, Any] = {"step": "demosaic", "method": method}
    if method == "superpixel":
        rgb, saturated = superpixel(mosaic)
    elif method in get_args(Linear):
        rgb, saturated = interpolate(mosaic, cast(Linear, method))
    else:
        gains = _gains(raw)
        step["balance_while_choosing_directions"] = gains.tolist()
        step["rounded_to_full_scale"] = quantum(mosaic, gains)
        step["saturation_reach_px"] = REACH_PX[cast(Adaptive, method)]
        rgb, saturated = libraw_interpolate(raw, mosaic, cast(Adaptive, method), gains)
    flip = int(raw.sizes.flip) if rotate else 0
    rgb, saturated = np.ascontiguousarray(turned(rgb, flip)), np.ascontiguousarray(turned(saturated, flip))
    step["saturated_pixels"] = saturated.reshape(-1, 3).sum(axis=0).tolist()
    exposure, from_where = (given, "told") if given else (exif_exposure(path, raw), "metadata")
    read = {"step": "read", "file": path.name, "kind": "raw", "sha256": sha256_of_file(path)}
    turn = {"step": "rotate", "libraw_flip": flip, "size_px": [rgb.shape[1], rgb.shape[0]]}
    steps: tuple[Mapping[str, Any], ...] = (read, linearised, step, turn)
    if exposure:
        steps += (exposure_step(exposure, from_where),)
    return CameraImage(rgb, saturated, exposure, str(path), steps)


def _mosaic(raw: rawpy.RawPy, path: Path, levels: Levels) -> tuple[Mosaic, dict[str, Any]]:
    import rawpy

    sizes = raw.sizes
    if raw.raw_type != rawpy.RawType.Flat or raw.raw_pattern is None:
        raise StimulusError.at(
            path, "the raw file holds pixels that were interpolated already", "export it as a linear TIFF"
        )
    if raw.raw_pattern.shape != (2, 2) or raw.num_colors != 3 or raw.color_desc[:3] != b"RGB":
        name = raw.color_desc.decode("ascii", "replace")
        shape = "×".join(str(side) for side in raw.raw_pattern.shape)
        raise StimulusError.at(path, f"the colour filter is {shape} of {name}, not Bayer", "export it as a linear TIFF")
    if sizes.width * sizes.height > MAX_PHOTOSITES:
        raise StimulusError.at(
            path, f"{sizes.width} × {sizes.height} photosites are beyond {MAX_PHOTOSITES}", "crop it"
        )
    codes = raw.raw_image_visible
    if codes.shape != (sizes.height, sizes.width) or min(codes.shape) < 2:
        raise StimulusError.at(
            path, f"the raw file has {codes.shape[1]} × {codes.shape[0]} photosites of {sizes}", "check it"
        )
    filters = raw.raw_colors_visible[:2, :2].astype(np.int64)
    pattern = np.where(filters == 3, 1, filters)
    blacks = levels.black_codes(raw.black_level_per_channel)
    whites = levels.white_codes(int(raw.white_level))
    full = levels.saturation_codes(whites, raw.camera_white_level_per_channel)
    values = np.empty(codes.shape, np.float32)
    saturated = np.empty(codes.shape, bool)
    for row in range(2):
        for column in range(2):
            place = slice(row, None, 2), slice(column, None, 2)
            filter_ = int(filters[row, column])
            black, white = blacks[filter_], whites[filter_]
            if not white > black:
                raise StimulusError.at(
                    path, f"the white level {white:g} is not above the black level {black:g}", "give both"
                )
            values[place] = (codes[place] - np.float32(black)) * np.float32(1.0 / (white - black))
            saturated[place] = codes[place] >= full[filter_]
    mosaic = Mosaic(values, saturated, pattern)
    largest = int(codes.max())
    step = {
        "step": "linearise",
        "black": [blacks[index] for index in sorted(set(filters.ravel().tolist()))],
        "white": whites[0],
        "saturated_from": [full[index] for index in sorted(set(filters.ravel().tolist()))],
        "filters": ["".join(COLOURS[colour][0].upper() for colour in row) for row in pattern],
        "largest_code": largest,
        "photosites_at_largest_code": int(np.count_nonzero(codes == largest)),
        "saturated_photosites": mosaic.saturated_photosites(),
        "below_black": int(np.count_nonzero(values < 0)),
    }
    return mosaic, step


def _gains(raw: rawpy.RawPy) -> NDArray[np.float64]:
    """Return the gains that balance red, green and blue, the largest 1: the camera's, or those of daylight, or none."""
    for balance in (raw.camera_whitebalance, raw.daylight_whitebalance):
        gains = np.asarray(balance[:3], dtype=np.float64)
        if np.isfinite(gains).all() and (gains > 0).all() and gains.max() < 100 * gains.min():
            return np.asarray(gains / gains.max())
    return np.ones(3)
