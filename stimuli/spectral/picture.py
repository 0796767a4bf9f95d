"""A picture of many wavelengths, from an OpenEXR or ENVI file, read a few rows at a time."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from documents.arrays import Floats
from documents.text import counted
from stimuli.errors import StimulusError
from stimuli.spectral.options import Quantity

MAX_PIXELS = 200_000_000
MAX_BANDS = 4096
# Of the rows that are read together, at least one: 1.6 GB in single precision.
MAX_CHUNK_VALUES = 400_000_000
MUST_COVER_NM = (400.0, 700.0)
MOST_SPACING_NM = 20.0
# The observer's functions are tabulated over 360..830 nm; a band beyond either end still bounds the last one within.
_SEEN_NM = (350.0, 840.0)
# Values of a block: 32 MB in single precision, whatever the file's size.
_BLOCK_VALUES = 8_000_000


def seen_bands(wavelengths_nm: Floats) -> NDArray[np.bool_]:
    """Return which bands an observer may see."""
    return np.asarray((wavelengths_nm > _SEEN_NM[0]) & (wavelengths_nm < _SEEN_NM[1]))


@dataclass(frozen=True, eq=False, slots=True)
class SpectralPicture:
    """Where the bands of a picture are, and how to read them.

    ``wavelengths_nm`` rise, shape (bands,). ``quantity`` is radiance in W/(sr m² nm), or reflectance, a share.
    ``read_rows`` takes the first row and the first not to read and returns float32 (rows, width, bands) with the bands
    in that order. ``chunk_rows`` rows are stored together. ``notes`` are sentences on what was left out of the file.
    Raises StimulusError if the bands do not rise, leave out a part of 400..700 nm, or are more than 20 nm apart.
    """

    path: Path
    wavelengths_nm: Floats
    height_px: int
    width_px: int
    quantity: Quantity
    read_rows: Callable[[int, int], NDArray[np.float32]]
    chunk_rows: int = 1
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        waves = self.wavelengths_nm
        if len(waves) < 4:
            raise self.wrong(f"the picture has {len(waves)} bands", "a spectral picture has bands over 400..700 nm")
        if not (np.isfinite(waves).all() and (np.diff(waves) > 0).all()):
            place = int(np.argmin(np.diff(waves) > 0)) if np.isfinite(waves).all() else 0
            raise self.wrong(
                f"its wavelengths do not rise: {waves[place]:g} nm, then {waves[place + 1]:g} nm",
                "order the bands by wavelength, each once",
            )
        seen = waves[seen_bands(waves)]
        if len(seen) < 2 or seen[0] > MUST_COVER_NM[0] or seen[-1] < MUST_COVER_NM[1]:
            raise self.wrong(
                f"its wavelengths run over {waves[0]:g}..{waves[-1]:g} nm"
                + (f", those that anyone sees over {seen[0]:g}..{seen[-1]:g} nm" if 0 < len(seen) < len(waves) else ""),
                "a colour needs 400..700 nm at least",
            )
        widest = int(np.argmax(np.diff(seen)))
        if seen[widest + 1] - seen[widest] > MOST_SPACING_NM:
            raise self.wrong(
                f"between {seen[widest]:g} and {seen[widest + 1]:g} nm there is no band",
                f"bands must lie at most {MOST_SPACING_NM:g} nm apart",
            )
        if not 0 < self.height_px * self.width_px <= MAX_PIXELS or len(waves) > MAX_BANDS:
            size = f"{self.width_px} × {self.height_px} pixels of {len(waves)} bands"
            raise self.wrong(f"{size} are beyond {MAX_PIXELS} of {MAX_BANDS}", "crop it")
        if min(self.chunk_rows, self.height_px) * self.width_px * len(waves) > MAX_CHUNK_VALUES:
            stored = f"{self.chunk_rows} rows of {self.width_px} pixels of {len(waves)} bands are stored together"
            raise self.wrong(f"{stored}, more than {MAX_CHUNK_VALUES} values", "crop it, or write smaller tiles")

    def blocks(self) -> Iterator[tuple[slice, NDArray[np.float32]]]:
        """Yield the rows and the values of one block after the other, float32 (rows, width, bands).

        Raises
        ------
        StimulusError
            If the file ends too soon, or a value is NaN or infinite.
        """
        rows = max(1, _BLOCK_VALUES // (self.width_px * len(self.wavelengths_nm)))
        rows = max(self.chunk_rows, rows - rows % self.chunk_rows)
        for first in range(0, self.height_px, rows):
            last = min(first + rows, self.height_px)
            values = self.read_rows(first, last)
            bad = int((~np.isfinite(values)).any(axis=-1).sum())
            if bad:
                raise self.wrong(
                    f"in rows {first}..{last - 1}, {counted(bad, 'pixel is', 'pixels are')} NaN or infinite",
                    "correct the picture",
                )
            yield slice(first, last), values

    def wrong(self, message: str, remedy: str) -> StimulusError:
        """Return the error on a fault of the file."""
        return StimulusError.at(self.path, message, remedy)
