"""A picture for two eyes as the codes that its file holds, with what makes light of them: exact, small and fast.

Codes of 8 or 16 bits become XYZ by a table for each channel and a matrix. The picture is kept in that form where no
step changes it: half floats of XYZ would move the dark channels of saturated colours by some codes. Of JPEG, the
picture's own files are kept, with a checksum of the codes that they gave: see `stimuli.pictures.own_files`.
"""

from __future__ import annotations

import hashlib
import io
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import count, islice
from pathlib import Path
from tokenize import TokenError
from typing import Any

import numpy as np
from numpy.typing import NDArray

from documents.files import open_regular, system_fault, unwritable, whole_file
from stimuli.errors import StimulusError
from stimuli.pictures.own_files import OwnFiles, decoders
from stimuli.pictures.picture_input import MAX_BYTES, refuse_undecoded
from stimuli.pictures.region import Region
from stimuli.pictures.stereo_image import Eye, StereoImage, XYZImage

# Of codes as they are, and of the files that they are decoded from.
SUFFIX, OWN_FILES = ".codes", ".own"
SUFFIXES = (SUFFIX, OWN_FILES)
Codes = NDArray[np.uint8] | NDArray[np.uint16]
_AGAIN = "build the stimuli again: cyclopean stimuli build --force"
# What NumPy raises for a header that was changed, or that asks for all memory, and a file that ends.
_DAMAGED = (
    OSError,
    ValueError,
    EOFError,
    TypeError,
    KeyError,
    StopIteration,
    RuntimeError,
    SyntaxError,
    MemoryError,
    OverflowError,
    TokenError,
)
# Rows converted at a time: what stays in the processor's cache.
_ROWS = 32


@dataclass(frozen=True, eq=False, slots=True)
class CodedPicture:
    """Codes of both eyes, (height, width, 3), or of grey (height, width, 1); a flat picture holds one array for both.

    ``light`` is the linear light of each code and channel, shape (levels, 3); ``matrix``, shape (3, 3), makes XYZ in
    cd/m² of it. ``own`` are the picture's files, where these are kept in place of the codes.
    """

    left: Codes
    right: Codes
    light: NDArray[np.float64]
    matrix: NDArray[np.float64]
    own: OwnFiles | None = None

    @classmethod
    def of(
        cls, eyes: Sequence[Codes], light: NDArray[np.float64], matrix: NDArray[np.float64], own: OwnFiles | None = None
    ) -> CodedPicture:
        """Return the picture of one eye's codes, or of two; ``own`` files are kept if they are fewer bytes."""
        whole: list[Any] = [np.ascontiguousarray(codes) for codes in eyes]
        smaller = own is not None and own.size < sum(codes.nbytes for codes in whole)
        return cls(whole[0], whole[-1], light, matrix, own if smaller else None)

    @property
    def suffix(self) -> str:
        """That of the file that `save` writes."""
        return SUFFIX if self.own is None else OWN_FILES

    @property
    def is_flat(self) -> bool:
        """Whether both eyes see the same codes."""
        return self.left is self.right

    @property
    def height_px(self) -> int:
        """Rows."""
        return int(self.left.shape[0])

    @property
    def width_px(self) -> int:
        """Columns."""
        return int(self.left.shape[1])

    def eye(self, eye: Eye) -> XYZImage:
        """Return XYZ in cd/m² that ``eye`` sees, float32 (height, width, 3)."""
        return decoded(self.left if eye == "left" else self.right, self.light, self.matrix)

    def luminance_cd_m2(self, eye: Eye) -> NDArray[np.float32]:
        """Return the luminance that ``eye`` sees, (height, width): the second channel of `eye`, without the others."""
        codes = self.left if eye == "left" else self.right
        return decoded(codes, self.light, self.matrix[1:2])[..., 0]

    def image(self, region: Region | None = None) -> StereoImage:
        """Return the picture, or a region of it, in XYZ."""
        eyes = [self.left] if self.is_flat else [self.left, self.right]
        shown = [_part(codes, region) for codes in eyes]
        images = [decoded(codes, self.light, self.matrix) for codes in shown]
        return StereoImage(images[0], images[-1])

    def save(self, path: Path) -> str:
        """Write the codes to ``path``, as a whole or not at all, and return the file's SHA-256.

        Arrays in NumPy's format, one after the other: CRC-32 of the codes, light, matrix, and the codes of each eye, or
        what `OwnFiles.arrays` yields. ``path`` has the picture's `suffix`.

        Raises
        ------
        StimulusError
            If it cannot be written.
        """
        eyes = [self.left] if self.is_flat else [self.left, self.right]
        sums = np.array([_sum(codes) for codes in eyes], np.uint32)
        digest = hashlib.sha256()
        try:
            with whole_file(path, keep_suffix=True, make_folder=False) as draft, draft.open("wb", 0) as file:
                kept = eyes if self.own is None else self.own.arrays()
                for array in map(np.ascontiguousarray, (sums, self.light, self.matrix, *kept)):
                    for part in (_header(array), array.data):
                        digest.update(part)
                        file.write(part)
        except OSError as error:
            wanted = sum(codes.nbytes for codes in eyes) if self.own is None else self.own.size
            raise StimulusError(unwritable(error, path, "picture", wanted_bytes=wanted)) from error
        return digest.hexdigest()


def _sum(codes: NDArray[Any]) -> int:
    return zlib.crc32(np.ascontiguousarray(codes).data)


def _header(array: NDArray[Any]) -> bytes:
    """Return what stands before an array's numbers in NumPy's format."""
    with io.BytesIO() as held:
        np.lib.format.write_array_header_1_0(held, np.lib.format.header_data_from_array_1_0(array))
        return held.getvalue()


def _part(codes: Codes, region: Region | None) -> Codes:
    return codes if region is None else codes[region.top : region.bottom, region.left : region.right]


def read_coded(path: Path) -> CodedPicture:
    """Read what `CodedPicture.save` wrote; StimulusError if it is damaged, or its files give other codes by now."""
    try:
        with open_regular(path, "picture", limit_bytes=MAX_BYTES, error=StimulusError) as file:
            sums, light, matrix = (np.load(file, allow_pickle=False) for _ in range(3))
            rest = (np.load(file, allow_pickle=False) for _ in count())
            own = OwnFiles.of_arrays(rest) if path.suffix == OWN_FILES else None
            eyes = list(islice(rest, len(sums))) if own is None else own.decoded()
        same = [_sum(codes) for codes in eyes] == sums.tolist() and 1 <= len(eyes) <= 2
    except _DAMAGED as error:
        refuse_undecoded(path, f"the picture is damaged: {' '.join(str(error).split())}", _AGAIN, error)
    except StimulusError as error:
        if system_fault(error):
            raise
        message = f"the picture is damaged: {error.findings[0].message}"
        raise StimulusError.at(path, message, _AGAIN) from error
    if not same:
        other = "its checksum differs" if own is None else f"its files give other codes with {_named(decoders())}"
        raise StimulusError.at(path, f"the picture is damaged: {other}", _AGAIN)
    return CodedPicture.of(eyes, light, matrix, own)


def _named(versions: Mapping[str, str]) -> str:
    return ", ".join(f"{name} {version}" for name, version in versions.items())


def decoded(codes: Codes, light: NDArray[np.float64], matrix: NDArray[np.float64]) -> XYZImage:
    """Return XYZ in cd/m², float32 (height, width, 3), of codes (height, width, 3 or 1).

    Of a ``matrix`` (1, 3), its one channel, (height, width, 1).

    A table for each channel and a matrix in single precision, some rows at a time: within 5e-7 of the value of
    `stimuli.pictures.colour_spaces.ColourEncoding.xyz` in double precision.
    """
    import cv2

    height, width, channels = codes.shape
    # Of grey, each code has its own XYZ.
    table = light @ matrix.T if channels == 1 else light
    # One curve for all channels, as of every named colour space, is looked up faster than three.
    alike = channels == 3 and bool((light == light[:, :1]).all())
    tables = np.ascontiguousarray(table[:, :1] if alike else table, dtype=np.float32)
    rows = matrix.astype(np.float32)
    out = np.empty((height, width, len(matrix)), np.float32)
    for first in range(0, height, _ROWS):
        band: NDArray[Any] = np.ascontiguousarray(codes[first : first + _ROWS])
        if channels == 1:
            out[first : first + _ROWS] = tables[band[..., 0]]
        else:
            cv2.transform(cv2.LUT(band, tables[:, None]), rows, dst=out[first : first + _ROWS])
    return out
