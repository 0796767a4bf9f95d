"""From a raw file to a sensor's linear values, and to a camera's picture: black, white, interpolation, nothing else."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from devices.camera import Exposure
from documents import Finding, InputError
from documents.files import open_regular, sha256_of_file
from documents.text import visible
from stimuli.develop.camera_image import CameraImage
from stimuli.develop.demosaic import BAND_PHOTOSITES, COLOURS, Mosaic
from stimuli.develop.levels import Levels
from stimuli.develop.libraw import RawContent, read_by_libraw
from stimuli.develop.linear_files import read_linear
from stimuli.develop.metadata import camera_name, exif_exposure
from stimuli.develop.options import DEFAULT_DEMOSAIC as DEFAULT_DEMOSAIC
from stimuli.develop.options import Demosaic
from stimuli.develop.sensor_image import DEMOSAICS as DEMOSAICS
from stimuli.develop.sensor_image import SensorImage, make_picture
from stimuli.errors import StimulusError
from stimuli.pictures.picture_input import refuse_no_picture

# Forms of DNG whose pixels cannot be taken for what the sensor recorded, found by the tags of the file's pictures.

_BITS, _COMPRESSION, _PHOTOMETRIC, _SUB_IFDS, _SAMPLE_FORMAT, _DNG_VERSION = 258, 259, 262, 330, 339, 50706
_WANTED = (_BITS, _COMPRESSION, _PHOTOMETRIC, _SUB_IFDS, _SAMPLE_FORMAT, _DNG_VERSION)
_SENSOR = {32803, 34892}  # a colour filter array, and linear raw
_MOST_DIRECTORIES = 64
_MOST_ENTRIES = 4096
_SIZES = {1: 1, 3: 2, 4: 4, 13: 4}
_FORMATS = {1: "B", 3: "H", 4: "I", 13: "I"}
_LOSSY_JPEG, _JPEG_XL, _DEFLATE = 34892, 52546, (8, 32946)
_REMEDY = (
    "convert it with Adobe DNG Converter, lossless and without 'use lossy compression', or give the camera's own file"
)

Tags = dict[int, tuple[int, ...]]


def unreadable_form(path: Path) -> Finding | None:
    """Return what is wrong with the DNG at ``path``; None if nothing is, or it is no DNG or cannot be read at all."""
    try:
        directories = list(_directories(path))
    except (OSError, InputError):
        return None  # LibRaw reports it
    if not any(_DNG_VERSION in tags for tags in directories):
        return None
    for tags in directories:
        if not _SENSOR & set(tags.get(_PHOTOMETRIC, ())):
            continue
        (compression, *_) = tags.get(_COMPRESSION) or (1,)
        if compression == _LOSSY_JPEG:
            return Finding(
                "the DNG was compressed with loss (JPEG), which changed its light", str(path), remedy=_REMEDY
            )
        if compression == _JPEG_XL:
            return Finding("the DNG is compressed by JPEG XL, which LibRaw does not read", str(path), remedy=_REMEDY)
        if compression in _DEFLATE and max(tags.get(_BITS) or (16,)) <= 16 and not _is_float(tags):
            what = "the DNG has whole numbers compressed by Deflate, which LibRaw does not read"
            return Finding(what, str(path), remedy="write it uncompressed or by lossless JPEG; or export a 16-bit TIFF")
    return None


def _is_float(tags: Tags) -> bool:
    return 3 in tags.get(_SAMPLE_FORMAT, ())


def _directories(path: Path) -> Iterator[Tags]:
    """Yield the tags of each picture in a TIFF file, at most a few; none if it is no TIFF file or is damaged."""
    with open_regular(path, "photograph") as file:
        head = file.read(8)
        order = {b"II*\0": "<", b"MM\0*": ">"}.get(head[:4])
        if order is None or len(head) < 8:
            return
        waiting, seen = [struct.unpack(order + "I", head[4:])[0]], set[int]()
        while waiting and len(seen) < _MOST_DIRECTORIES:
            offset = waiting.pop(0)
            if offset == 0 or offset in seen:
                continue
            seen.add(offset)
            file.seek(offset)
            start = file.read(2)
            count = struct.unpack(order + "H", start)[0] if len(start) == 2 else 0
            entries = file.read(12 * count + 4)
            if not 0 < count <= _MOST_ENTRIES or len(entries) < 12 * count:
                continue
            tags: Tags = {}
            for place in range(0, 12 * count, 12):
                tag, kind, number = struct.unpack_from(order + "HHI", entries, place)
                if tag not in _WANTED or kind not in _SIZES:
                    continue
                if number > _MOST_DIRECTORIES:
                    continue
                data = entries[place + 8 : place + 12]
                if number * _SIZES[kind] > 4:
                    file.seek(struct.unpack(order + "I", data)[0])
                    data = file.read(number * _SIZES[kind])
                if len(data) >= number * _SIZES[kind]:
                    tags[tag] = struct.unpack_from(f"{order}{number}{_FORMATS[kind]}", data)
            waiting += tags.get(_SUB_IFDS, ())
            if len(entries) == 12 * count + 4:
                waiting.append(struct.unpack_from(order + "I", entries, 12 * count)[0])
            yield tags


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
    refuse_no_picture(path, "file")
    if form := unreadable_form(path):
        raise StimulusError(form)
    raw = read_by_libraw(path)
    levels = levels or Levels()
    read_codes = _three_colours if raw.stack else _one_colour_each
    values, saturated, pattern, linearised = read_codes(raw, path, levels)
    given, source = (exposure, "told") if exposure else (exif_exposure(path, raw.exposure), "metadata")
    read = {"step": "read", "file": path.name, "kind": "raw", "sha256": sha256_of_file(path)}
    return SensorImage(
        values,
        saturated,
        pattern,
        path,
        (read, linearised),
        given,
        source,
        camera_name(path),
        raw.flip if rotate else _AS_STORED,
        _gains(raw),
    )


Read = tuple[NDArray[np.float32], NDArray[np.bool_], NDArray[np.int64] | None, dict[str, Any]]


def _one_colour_each(raw: RawContent, path: Path, levels: Levels) -> Read:
    """Return the values of a sensor behind a Bayer filter."""
    if raw.pattern is None or raw.filters is None:
        raise StimulusError.at(
            path, "the raw file has no colours (a monochrome sensor)", "give that of a colour sensor"
        )
    shape = np.shape(raw.pattern)
    if shape != (2, 2) or raw.colours != 3 or raw.colour_names[:3] != "RGB":
        sides = "×".join(str(side) for side in shape)
        what = f"the colour filter is {sides} of {visible(raw.colour_names)}, not Bayer"
        raise StimulusError.at(path, what, "export it as a linear TIFF")
    codes = raw.codes
    filters = np.array(raw.filters, np.int64)
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


def _three_colours(raw: RawContent, path: Path, levels: Levels) -> Read:
    """Return the values of a linear DNG, whose pixels have three colours each."""
    if raw.colours != 3 or raw.colour_names[:3] != "RGB":
        what = f"the linear DNG has {raw.colours} colours ({visible(raw.colour_names)}), not R, G and B"
        raise StimulusError.at(path, what, "export RGB")
    codes = raw.codes[..., :3]
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


def _levels(raw: RawContent, levels: Levels) -> tuple[list[float], list[float], list[float]]:
    whites = levels.white_codes(raw.white)
    full = levels.saturation_codes(whites, raw.whites)
    return levels.black_codes(raw.blacks), whites, full


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


def _gains(raw: RawContent) -> NDArray[np.float64]:
    """Return the gains that balance red, green and blue, the largest 1: the camera's, or those of daylight, or none."""
    for balance in raw.balances:
        gains = np.asarray((balance or ())[:3], dtype=np.float64)
        if len(gains) == 3 and np.isfinite(gains).all() and (gains > 0).all() and gains.max() < 100 * gains.min():
            return np.asarray(gains / gains.max())
    return np.ones(3)


_LINEAR_SUFFIXES = (".tif", ".tiff", ".exr")


# The first bytes of files that a camera or a browser has already given a tone curve.
_CURVED = {b"\xff\xd8\xff": "a JPEG", b"\x89PNG": "a PNG", b"GIF8": "a GIF", b"RIFF": "a WebP"}


def read_sensor_image(
    path: Path,
    *,
    levels: Levels | None = None,
    rotate: bool = True,
    exposure: Exposure | None = None,
    assume_linear: bool = False,
) -> SensorImage:
    """Return the linear values of the sensor in a raw file, or those of a TIFF or OpenEXR file of linear camera RGB.

    Parameters and errors as of `read_camera_image`. The values of a TIFF or OpenEXR stand upright already.
    """
    path = Path(path)
    if path.suffix.lower() in _LINEAR_SUFFIXES:
        image = read_linear(path, levels=levels, rotate=rotate, exposure=exposure, assume_linear=assume_linear)
        steps = image.steps[:-1] if image.exposure else image.steps
        source = "told" if exposure else "metadata"
        return SensorImage(image.rgb, image.saturated, None, path, steps, image.exposure, source, camera_name(path))
    if path.exists():
        with open_regular(path, "photograph", error=StimulusError) as file:
            start = file.read(4)
        for magic, name in _CURVED.items():
            if start.startswith(magic):
                raise StimulusError.at(
                    path,
                    f"the picture is {name}: the camera's tone curve is in it, and cannot be taken out",
                    "give the raw file; or show the picture as it is, by a recipe of kind: pictures",
                )
    return read_sensor(path, levels=levels, rotate=rotate, exposure=exposure)
