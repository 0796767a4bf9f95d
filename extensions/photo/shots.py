"""The photographs of a bracket, by exposure; their values wait in temporary files, so that few are in memory."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from devices.camera import Exposure
from stimuli.develop import SensorImage
from stimuli.pictures import RowFile

# Photographs are compared by squares of this many photosites.
BLOCK_PX = 8
_BAND_PHOTOSITES = 1 << 20

Values = NDArray[np.float32]
Mask = NDArray[np.bool_]


class Shot:
    """One photograph: its ``sensor`` without the values, which are read by rows, and its ``exposure``.

    ``level`` is the share of full scale from which its photosites are full.
    """

    def __init__(self, sensor: SensorImage, exposure: Exposure) -> None:
        self.shape = sensor.values.shape
        self.exposure = exposure
        self.level = full_level(sensor)
        height, width = self.shape[:2]
        self._flat = (height, int(np.prod(self.shape[1:])))
        self._rows = RowFile((height, width, 1 if len(self.shape) == 2 else 3))
        for rows in self.bands():
            self._rows.write(rows.start, sensor.values[rows].reshape(-1, width, self._rows.shape[2]))
        self._full = np.packbits(sensor.saturated.reshape(self._flat), axis=1)
        self.sensor = replace(sensor, values=np.empty((0, 0), np.float32), saturated=np.empty((0, 0), bool))

    @property
    def name(self) -> str:
        """The name of the file."""
        return self.sensor.source.name

    def bands(self) -> Iterator[slice]:
        """Return slices that go through the rows, whole blocks each."""
        height = self.shape[0]
        width = int(np.prod(self.shape[1:]))
        step = max(BLOCK_PX, _BAND_PHOTOSITES // width // BLOCK_PX * BLOCK_PX)
        return (slice(first, min(first + step, height)) for first in range(0, height, step))

    def read(self, rows: slice) -> tuple[Values, Mask]:
        """Return the values of those rows, and where they are full."""
        shape = (rows.stop - rows.start, *self.shape[1:])
        full = np.unpackbits(self._full[rows], axis=1, count=self._flat[1]).astype(bool)
        return self._rows[rows].reshape(shape), full.reshape(shape)


def full_level(sensor: SensorImage) -> float:
    """Return the share of full scale from which photosites are full, by the step that scaled them."""
    for step in reversed(sensor.steps):
        if step["step"] == "linearise":
            shares = [
                (full - black) / (float(step["white"]) - black)
                for full, black in zip(step["saturated_from"], step["black"], strict=True)
            ]
            return float(min(1.0, *shares))
        if step["step"] == "scale":
            span = float(step["white"]) - float(step["black"])
            return float(min(1.0, (float(step["saturated_from"]) - float(step["black"])) / span))
    return 1.0


def block_sums(values: NDArray[Any]) -> NDArray[np.float64]:
    """Return the sums over blocks of photosites, of all colours together; those at the edges may be smaller."""
    wide = BLOCK_PX * (values.shape[2] if values.ndim == 3 else 1)
    flat = values.reshape(len(values), -1)
    beyond = (-len(flat)) % BLOCK_PX, (-flat.shape[1]) % wide
    padded = np.pad(flat, ((0, beyond[0]), (0, beyond[1])))
    shape = len(padded) // BLOCK_PX, BLOCK_PX, padded.shape[1] // wide, wide
    return np.asarray(padded.reshape(shape).sum(axis=(1, 3), dtype=np.float64))


def by_photosite(blocks: Mask, shape: tuple[int, ...]) -> Mask:
    """Return a map of blocks for photosites of ``shape``."""
    spread = np.repeat(np.repeat(blocks, BLOCK_PX, axis=0), BLOCK_PX, axis=1)[: shape[0], : shape[1]]
    return spread if len(shape) == 2 else np.repeat(spread[..., None], shape[2], axis=2)
