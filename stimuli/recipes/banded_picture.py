"""An OpenEXR picture from its file to another one some rows at a time, never whole in memory.

For pictures that no step changes, or that steps multiply: what each pixel becomes depends on that pixel alone. What
comes out is, byte for byte, what `read_exr_counted`, the multiplications and `write_exr` make of the whole picture.
Whatever is unusual (tiles, several parts, a data window of its own, light below 0 or not finite) is left to them: they
say exactly what is wrong, or clip and count it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stimuli.errors import StimulusError
from stimuli.luminance.scale import scaled
from stimuli.pictures.exr_read import Decoding, chosen_views, matrix_of, middle_view
from stimuli.pictures.exr_views import FilePart, View, channel_runs, header_view, parts_of
from stimuli.pictures.exr_write import HALF_MAX, LEAST_PX, bands_of_blocks, write_pixel_rows, xyz_spec
from stimuli.pictures.luminance_chroma import is_reconstructed
from stimuli.pictures.picture_input import opened
from stimuli.pictures.stereo_image import Eye, StereoImage

Pixels = NDArray[Any]
# The codes of half floats from 0 to the largest: those of infinity, NaN and what is below 0 lie above them.
_LARGEST_CODE = 0x7BFF


class _Unusual(Exception):
    """A row holds what the whole picture must be looked at for."""


@dataclass(slots=True)
class BandedPicture:
    """A picture in an OpenEXR file that `save` reads, multiplies by ``factors`` and writes, some rows at a time.

    ``views`` are those that are shown, left then right, or one; ``centre`` is whether the file has a view of neither
    eye. Its luminance is known once it was saved.
    """

    path: Path
    part: FilePart
    views: tuple[View, ...]
    matrices: tuple[NDArray[np.float64] | None, ...]
    centre: bool
    factors: tuple[float, ...] = ()
    _luminance: list[NDArray[np.float32]] = field(default_factory=list)

    @classmethod
    def of(
        cls,
        path: Path,
        decoding: Decoding,
        *,
        flat: bool,
        flat_eye: Eye | None,
        observer: str,
    ) -> BandedPicture | None:
        """Return the picture in the file at ``path``, None if it is small or unusual; no pixel is read yet."""
        try:
            with opened(path, whole=True) as picture:
                if picture.format_name() != "openexr":
                    return None
                parts = list(parts_of(picture, path))
                if len(parts) != 1:
                    return None
                part = parts[0]
                names = chosen_views(tuple(part.groups), path, flat, flat_eye)
                views = tuple(header_view(name, part, path) for name in names)
            if not _is_plain(part, names) or any(view.observer != observer for view in views):
                return None
            matrices = tuple(_matrix(view, str(path), decoding) for view in views)
        except StimulusError:
            return None
        return cls(path, part, views, matrices, middle_view(tuple(part.groups)) is not None)

    @property
    def is_flat(self) -> bool:
        """Whether both eyes see the same view."""
        return len(self.views) == 1

    @property
    def width_px(self) -> int:
        """Columns."""
        return int(self.part.spec.width)

    @property
    def height_px(self) -> int:
        """Rows."""
        return int(self.part.spec.height)

    @property
    def exact(self) -> bool:
        """Whether single precision is to be kept where no step changes it."""
        return all(view.exact for view in self.views)

    def luminance(self) -> StereoImage:
        """Return its luminance in the place of X, Y and Z, in the memory of one of them, once it was saved."""
        seen = [np.broadcast_to(plane[..., None], (*plane.shape, 3)) for plane in self._luminance]
        return StereoImage(seen[0], seen[-1])

    def save(self, path: Path, observer: str) -> bool:
        """Write the picture to ``path`` as `write_exr` does; return False, with nothing written, if it is unusual.

        Raises
        ------
        StimulusError
            If the file cannot be written.
        """
        names = ("center",) if self.is_flat else ("left", "right")
        spec = xyz_spec(self.width_px, self.height_px, names, observer, self.exact and not self.factors)
        size = self.height_px, self.width_px
        self._luminance = [np.empty(size, np.float32) for _ in self.views]
        try:
            write_pixel_rows(path, spec, self._made())
        except (_Unusual, StimulusError) as error:
            if isinstance(error, StimulusError) and isinstance(error.__cause__, OSError):
                raise
            return False
        return True

    def _made(self) -> Iterator[tuple[slice, Pixels]]:
        """Yield the rows of all views beside each other, as they are written; the next are read meanwhile."""
        columns = [list(self.part.groups[view.name]) for view in self.views]
        # Where the file's channels are those of the views in their order, they are not copied.
        as_stored = [index for each in columns for index in each] == list(range(3 * len(columns)))
        unchanged = all(matrix is None for matrix in self.matrices) and not self.factors
        for rows, stored in self._read():
            half = stored.dtype == np.float16
            _refuse_unusual(stored)
            if unchanged and as_stored and half:
                light = stored
            else:
                light = np.empty((*stored.shape[:2], 3 * len(columns)), np.float32)
                for number, (indices, matrix) in enumerate(zip(columns, self.matrices, strict=True)):
                    view = slice(indices[0], indices[0] + 3)
                    light[..., 3 * number : 3 * number + 3] = self._light(stored[..., view].astype(np.float32), matrix)
            del stored  # not beside what is written
            for number, luminance in enumerate(self._luminance):
                luminance[rows] = light[..., 3 * number + 1]
            yield rows, light
            del light

    def _light(self, pixels: NDArray[np.float32], matrix: NDArray[np.float64] | None) -> NDArray[np.float32]:
        if matrix is not None:
            with np.errstate(over="ignore"):
                pixels = (pixels.astype(np.float64) @ matrix.T).astype(np.float32)
        for factor in self.factors:
            pixels = scaled(pixels, factor)
        if not (pixels.min() >= 0.0 and pixels.max() <= HALF_MAX):
            raise _Unusual
        return pixels

    def _read(self) -> Iterator[tuple[slice, Pixels]]:
        spec = self.part.spec
        indices = [self.part.groups[view.name] for view in self.views]
        (run,) = channel_runs(indices)
        bands = list(bands_of_blocks(spec.height, spec.width))
        kind = "half" if str(spec.format) == "half" else "float"
        with opened(self.path) as picture, ThreadPoolExecutor(1, thread_name_prefix="read rows") as thread:

            def read(rows: slice) -> Pixels:
                first, last = spec.y + rows.start, spec.y + rows.stop
                stored = picture.read_scanlines(self.part.number, 0, first, last, 0, run.start, run.stop, kind)
                if stored is None:
                    raise _Unusual
                return np.asarray(stored).reshape(rows.stop - rows.start, spec.width, len(run))

            coming = thread.submit(read, bands[0])
            for number, rows in enumerate(bands):
                stored = [coming.result()]
                if number + 1 < len(bands):
                    coming = thread.submit(read, bands[number + 1])
                yield rows, stored.pop()  # kept by whoever takes it, no longer than that


def _is_plain(part: FilePart, names: Sequence[str]) -> bool:
    """Return whether the views are large, in scanlines, as large as their window, each in three channels in a row."""
    spec = part.spec
    window = (spec.x, spec.y, spec.width, spec.height) == (spec.full_x, spec.full_y, spec.full_width, spec.full_height)
    groups = [part.groups[name] for name in names]
    in_a_row = all(list(group) == list(range(group[0], group[0] + 3)) for group in groups)
    together = len(channel_runs(groups)) == 1 and min(group[0] for group in groups) == 0
    large = spec.width * spec.height >= LEAST_PX
    alike = not spec.channelformats
    return large and window and in_a_row and together and alike and not spec.tile_width and not is_reconstructed(spec)


def _matrix(view: View, file: str, decoding: Decoding) -> NDArray[np.float64] | None:
    """Return what makes XYZ in cd/m² of the view's values, None where they are that."""
    matrix = matrix_of(view, file, decoding.colour_space)
    given = (decoding.white_luminance_cd_m2, view.white_luminance_cd_m2)
    luminance = next((value for value in given if value is not None), 1.0)
    if not (math.isfinite(luminance) and luminance > 0):
        raise StimulusError.at(Path(file), "its luminance is not above 0", "declare one")
    return None if luminance == 1.0 and np.array_equal(matrix, np.eye(3)) else luminance * matrix


def _refuse_unusual(stored: Pixels) -> None:
    """Raise `_Unusual` if a value is below 0, -0, infinite, NaN, or, in single precision, above the largest half."""
    if stored.dtype == np.float16:
        if stored.view(np.uint16).max() > _LARGEST_CODE:
            raise _Unusual
    elif not (stored.min() >= 0.0 and stored.max() <= HALF_MAX):
        raise _Unusual
