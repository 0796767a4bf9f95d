"""The dither mask: void-and-cluster ranks, 64 × 64, each of 0..4095 once, tiling without a seam.

R. Ulichney, "The void-and-cluster method for dither array generation", SPIE 1913 (1993) 332–343 [Ulichney1993]. A
pattern's voids and clusters are the lowest and highest values of the pattern blurred by a Gaussian on a torus. The
paper's third phase, which looks for clusters among what is still empty, picks the same pixels as its second: on a torus
the blurred empties are a constant less the blurred dots.

The blur is kept in integers, so that adding a dot and taking it away undo each other exactly and every machine finds
the same mask. ``python -m devices.compensation.dither_mask`` writes the shipped file again; ``--check`` compares
instead.
"""

from __future__ import annotations

import argparse
import sys
from functools import cache
from importlib.resources import files
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from devices.errors import DeviceError
from documents.files import open_regular

Ranks = NDArray[np.uint16]

SIZE_PX = 64
SEED = 1993
SHIPPED = "void_and_cluster_64.npy"
# Ulichney's blur. A start of few dots leaves the sparse patterns, which show most, to be spread freely.
_SIGMA_PX = 1.5
_START_SHARE = 1 / 32
_UNIT = 2**30
_MOST_BYTES = 1_000_000


def make_mask(size_px: int = SIZE_PX, seed: int = SEED) -> Ranks:
    """Return void-and-cluster ranks 0..size_px² − 1, shape (size_px, size_px), the same for a seed on every machine.

    Raises
    ------
    DeviceError
        If the size is not in 4..256 (ranks are 16 bits).
    """
    if not 4 <= size_px <= 256:
        raise DeviceError(f"a dither mask of {size_px} pixels cannot be made; its side must be in 4..256")
    count = size_px * size_px
    blur = _blur(size_px)
    pattern = np.zeros(count, dtype=bool)
    # Raw numbers of the bit generator: NumPy promises their sequence, which it does not for its distributions.
    order = np.argsort(np.random.PCG64(seed).random_raw(count), kind="stable")
    pattern[order[: max(1, round(_START_SHARE * count))]] = True
    density = np.zeros((size_px, size_px), dtype=np.int64)
    for dot in np.flatnonzero(pattern):
        density += _at(blur, int(dot))
    start, start_density = _spread(pattern, density, blur)

    ranks = np.empty(count, dtype=np.uint16)
    pattern, density = start.copy(), start_density.copy()
    for rank in range(int(start.sum()) - 1, -1, -1):
        place = _cluster(pattern, density)
        ranks[place] = rank
        pattern[place] = False
        density -= _at(blur, place)
    pattern, density = start, start_density
    for rank in range(int(start.sum()), count):
        place = _void(pattern, density)
        ranks[place] = rank
        pattern[place] = True
        density += _at(blur, place)
    return ranks.reshape(size_px, size_px)


def _blur(size_px: int) -> NDArray[np.int64]:
    """Return the Gaussian around pixel (0, 0) of the torus, twice in each direction so that any shift is a view."""
    distance = np.minimum(np.arange(size_px), size_px - np.arange(size_px)).astype(np.float64)
    squared = distance[:, None] ** 2 + distance[None, :] ** 2
    return np.tile(np.rint(_UNIT * np.exp(-squared / (2.0 * _SIGMA_PX**2))).astype(np.int64), (2, 2))


def _at(blur: NDArray[np.int64], place: int) -> NDArray[np.int64]:
    """Return the Gaussian around pixel number ``place``."""
    size_px = len(blur) // 2
    row, column = divmod(place, size_px)
    return blur[size_px - row : 2 * size_px - row, size_px - column : 2 * size_px - column]


def _cluster(pattern: NDArray[np.bool_], density: NDArray[np.int64]) -> int:
    return int(np.argmax(np.where(pattern, density.ravel(), -1)))


def _void(pattern: NDArray[np.bool_], density: NDArray[np.int64]) -> int:
    return int(np.argmin(np.where(pattern, np.iinfo(np.int64).max, density.ravel())))


def _spread(
    pattern: NDArray[np.bool_], density: NDArray[np.int64], blur: NDArray[np.int64]
) -> tuple[NDArray[np.bool_], NDArray[np.int64]]:
    """Move dots from the tightest cluster to the largest void until a dot would return where it came from."""
    while True:
        source = _cluster(pattern, density)
        pattern[source] = False
        density -= _at(blur, source)
        target = _void(pattern, density)
        pattern[target] = True
        density += _at(blur, target)
        if source == target:
            return pattern, density


@cache
def load_mask() -> Ranks:
    """Return the shipped ranks (64, 64), read-only.

    Returns
    -------
    ndarray
        Ranks 0..4095, each once, uint16, shape (64, 64).

    Raises
    ------
    DeviceError
        If the file is no permutation of 0..4095: it was damaged.

    Examples
    --------
    >>> mask = load_mask()
    >>> mask.shape, int(mask.min()), int(mask.max())
    ((64, 64), 0, 4095)
    """
    with (files("devices.compensation") / "masks" / SHIPPED).open("rb") as stream:
        ranks = np.asarray(np.load(stream, allow_pickle=False))
    if ranks.shape != (SIZE_PX, SIZE_PX) or not np.array_equal(np.sort(ranks, axis=None), np.arange(SIZE_PX**2)):
        raise DeviceError(
            f"the dither mask {SHIPPED} is damaged; write it again with python -m devices.compensation.dither_mask"
        )
    ranks = ranks.astype(np.uint16)
    ranks.flags.writeable = False
    return ranks


def _read(file: Path) -> NDArray[np.generic]:
    with open_regular(file, "mask", limit_bytes=_MOST_BYTES, error=DeviceError) as stream:
        return np.asarray(np.load(stream, allow_pickle=False))


def main(arguments: list[str] | None = None) -> int:
    """Write the mask, or compare the file with a new one; return the exit status."""
    parser = argparse.ArgumentParser(
        prog="python -m devices.compensation.dither_mask", description="Make the dither mask again."
    )
    parser.add_argument("file", nargs="?", type=Path, default=Path(__file__).parent / "masks" / SHIPPED)
    parser.add_argument("--check", action="store_true", help="compare with the file, write nothing")
    options = parser.parse_args(arguments)
    mask = make_mask()
    if options.check:
        same = options.file.is_file() and np.array_equal(_read(options.file), mask)
        print(f"{options.file}: {'as generated' if same else 'differs from what is generated'}")
        return 0 if same else 1
    options.file.parent.mkdir(parents=True, exist_ok=True)
    with options.file.open("wb") as stream:
        np.save(stream, mask, allow_pickle=False)
    print(f"{options.file}: {mask.size} ranks")
    return 0


if __name__ == "__main__":
    sys.exit(main())
