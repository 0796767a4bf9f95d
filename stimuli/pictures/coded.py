"""A picture for two eyes as the codes that its file holds, with what makes light of them: exact, small and fast.

Codes of 8 or 16 bits become XYZ by a table for each channel and a matrix. The picture is kept in that form where no
step changes it: half floats of XYZ would move the dark channels of saturated colours by some codes.
"""

from __future__ import annotations

import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from documents.files import whole_file
from stimuli.errors import StimulusError
from stimuli.pictures.exr_views import Region
from stimuli.pictures.stereo_image import StereoImage, XYZImage

SUFFIX = ".npz"
Codes = NDArray[np.uint8] | NDArray[np.uint16]
# Rows converted at a time: what stays in the processor's cache.
_ROWS = 16


@dataclass(frozen=True, eq=False, slots=True)
class CodedPicture:
    """Codes of both eyes, (height, width, 3), or of grey (height, width, 1); a flat picture holds one array for both.

    ``light`` is the linear light of each code and channel, shape (levels, 3); ``matrix``, shape (3, 3), makes XYZ in
    cd/m² of it.
    """

    left: Codes
    right: Codes
    light: NDArray[np.float64]
    matrix: NDArray[np.float64]

    @property
    def size_px(self) -> tuple[int, int]:
        """Width and height."""
        return int(self.left.shape[1]), int(self.left.shape[0])

    def image(self, region: Region | None = None) -> StereoImage:
        """Return the picture, or a region of it, in XYZ."""
        eyes = [self.left] if self.left is self.right else [self.left, self.right]
        shown = [_part(codes, region) for codes in eyes]
        images = [decoded(codes, self.light, self.matrix) for codes in shown]
        return StereoImage(images[0], images[-1])

    def save(self, path: Path) -> None:
        """Write the codes to ``path``, as a whole or not at all; StimulusError if that cannot be."""
        arrays: dict[str, NDArray[Any]] = {"left": self.left, "light": self.light, "matrix": self.matrix}
        if self.right is not self.left:
            arrays["right"] = self.right
        try:
            with whole_file(path, keep_suffix=True, make_folder=False) as draft:
                np.savez(draft, allow_pickle=False, **arrays)
        except OSError as error:
            raise StimulusError.at(path, f"the picture cannot be written: {error.strerror}", "make room") from error


def _part(codes: Codes, region: Region | None) -> Codes:
    return codes if region is None else codes[region.top : region.bottom, region.left : region.right]


def read_coded(path: Path) -> CodedPicture:
    """Read what `CodedPicture.save` wrote; StimulusError if it is damaged."""
    try:
        with np.load(path, allow_pickle=False) as arrays:
            left, light, matrix = arrays["left"], arrays["light"], arrays["matrix"]
            right = arrays.get("right", left)
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile) as error:
        message = f"the picture is damaged: {(str(error).splitlines() or ['cut short'])[0]}"
        raise StimulusError.at(path, message, "build the stimuli again") from error
    return CodedPicture(left, right, light, matrix)


def decoded(codes: Codes, light: NDArray[np.float64], matrix: NDArray[np.float64]) -> XYZImage:
    """Return XYZ in cd/m², float32 (height, width, 3), of codes (height, width, 3 or 1).

    A table for each channel and a matrix in single precision, some rows at a time: within 5e-7 of the value of
    `stimuli.pictures.colour_spaces.Encoding.xyz` in double precision.
    """
    import cv2

    height, width, channels = codes.shape
    grey = channels == 1
    # Of grey, each code has its own XYZ.
    table = light @ matrix.T if grey else light
    tables = np.ascontiguousarray(table, dtype=np.float32).reshape(len(table), 1, 3)
    rows = matrix.astype(np.float32)
    out = np.empty((height, width, 3), np.float32)
    for first in range(0, height, _ROWS):
        band: NDArray[Any] = np.ascontiguousarray(codes[first : first + _ROWS])
        if grey:
            out[first : first + _ROWS] = tables[band[..., 0], 0]
        else:
            cv2.transform(cv2.LUT(band, tables), rows, dst=out[first : first + _ROWS])
    return out
