"""A raw file of known linear values: an uncompressed DNG of a Bayer sensor."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import tifffile
from numpy.typing import NDArray

Tag = tuple[int, str, int, Any, bool]

# red, green, blue of the test camera seen by XYZ, only so that LibRaw knows a camera at all
_COLOR_MATRIX = (0.8, -0.2, -0.1, -0.3, 1.1, 0.2, 0.0, 0.1, 0.6)


def _rationals(values: Sequence[float]) -> tuple[int, ...]:
    parts = [Fraction(value).limit_denominator(100_000) for value in values]
    return tuple(number for part in parts for number in (part.numerator, part.denominator))


def exposure_tags(time: tuple[int, int], f_number: tuple[int, int], iso: int) -> list[Tag]:
    return [(33434, "2I", 1, time, True), (33437, "2I", 1, f_number, True), (34855, "H", 1, iso, True)]


def _save(
    path: Path,
    codes: NDArray[np.uint16],
    photometric: int,
    tags: Sequence[Tag],
    neutral: Sequence[float] = (0.5, 1.0, 0.7),
    **more: Any,
) -> Path:
    known: list[Tag] = [
        (50706, "B", 4, b"\x01\x04\x00\x00", True),  # DNGVersion
        (50707, "B", 4, b"\x01\x01\x00\x00", True),
        (50708, "s", 0, "Synthetic camera", True),  # UniqueCameraModel
        (50721, "2i", 9, _rationals(_COLOR_MATRIX), True),  # ColorMatrix1
        (50728, "2I", 3, _rationals(neutral), True),  # AsShotNeutral
        (50778, "H", 1, 21, True),  # CalibrationIlluminant1
    ]
    more |= {"subfiletype": 0, "metadata": None, "software": None, "rowsperstrip": codes.shape[0]}
    tifffile.imwrite(path, codes, photometric=photometric, extratags=[*known, *tags], **more)
    return path


def save_dng(
    path: Path,
    codes: NDArray[np.uint16],
    *,
    black: Sequence[int] = (0,),
    white: int = 65535,
    pattern: Sequence[int] = (0, 1, 1, 2),
    neutral: Sequence[float] = (0.5, 1.0, 0.7),
    tags: Sequence[Tag] = (),
) -> Path:
    side = 1 if len(black) == 1 else 2
    bayer: list[Tag] = [
        (33421, "H", 2, (2, 2), True),  # CFARepeatPatternDim
        (33422, "B", 4, bytes(pattern), True),  # CFAPattern
        (50710, "B", 3, b"\x00\x01\x02", True),  # CFAPlaneColor
        (50711, "H", 1, 1, True),  # CFALayout
        (50713, "H", 2, (side, side), True),  # BlackLevelRepeatDim
        (50714, "I", len(black), tuple(black), True),  # BlackLevel
        (50717, "I", 1, white, True),  # WhiteLevel
    ]
    return _save(path, codes, 32803, [*bayer, *tags], neutral)


def camera_tags(make: str, model: str) -> list[Tag]:
    return [(271, "s", 0, make, True), (272, "s", 0, model, True)]


def save_linear_dng(
    path: Path,
    codes: NDArray[np.uint16],
    *,
    black: Sequence[int] = (0, 0, 0),
    white: int = 65535,
    tags: Sequence[Tag] = (),
) -> Path:
    """Save codes (height, width, 3) as a linear DNG: PhotometricInterpretation 34892, LinearRaw."""
    levels: list[Tag] = [
        (50713, "H", 2, (1, 1), True),  # BlackLevelRepeatDim
        (50714, "I", 3, tuple(black), True),  # BlackLevel
        (50717, "I", 3, (white,) * 3, True),  # WhiteLevel
    ]
    return _save(path, codes, 34892, [*levels, *tags], planarconfig=1)


def retagged(path: Path, tag: int, value: int) -> Path:
    """Write another value of a SHORT tag into the first directory of a little-endian TIFF file."""
    content = bytearray(path.read_bytes())
    start = int.from_bytes(content[4:8], "little")
    for place in range(start + 2, start + 2 + 12 * int.from_bytes(content[start : start + 2], "little"), 12):
        if int.from_bytes(content[place : place + 2], "little") == tag:
            content[place + 8 : place + 10] = value.to_bytes(2, "little")
            path.write_bytes(content)
            return path
    raise AssertionError(f"there is no tag {tag}")


def coded(
    rgb: NDArray[np.float64],
    black: Sequence[int] = (0,),
    white: int = 65535,
    pattern: Sequence[int] = (0, 1, 1, 2),
) -> NDArray[np.uint16]:
    """Return the codes that a Bayer sensor records of linear RGB (height, width, 3) in shares of full scale."""
    rows, columns = np.mgrid[: rgb.shape[0], : rgb.shape[1]]
    place = 2 * (rows % 2) + columns % 2
    colour = np.array(pattern)[place]
    level = np.resize(np.array(black, float), 4)[place]
    light = np.take_along_axis(rgb, colour[..., None], axis=2)[..., 0]
    codes: NDArray[np.uint16] = np.clip(np.rint(level + light * (white - level)), 0, 65535).astype(np.uint16)
    return codes


def write_dng(path: Path, rgb: NDArray[np.float64], **options: Any) -> Path:
    """Save what a sensor with those levels and that pattern records of linear RGB."""
    shared = {key: options[key] for key in ("black", "white", "pattern") if key in options}
    return save_dng(path, coded(rgb, **shared), **options)


def smooth() -> NDArray[np.float64]:
    """Return 48 × 64 pixels whose three colours rise linearly, each in its own direction."""
    rows, columns = np.mgrid[:48, :64]
    return np.stack([0.2 + 0.004 * columns, 0.3 + 0.003 * rows + 0.002 * columns, 0.1 + 0.005 * rows], axis=-1)
