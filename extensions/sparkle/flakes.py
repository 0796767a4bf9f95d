"""Where the flakes lie, how large they are and how they tilt."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from documents.arrays import Floats32
from extensions.sparkle.scene import Clusters, Plate


@dataclass(frozen=True, eq=False, slots=True)
class Flakes:
    """Flakes, float32 arrays of one shape (n,).

    A flake's normal points along (``slope_x``, ``slope_y``, 1); its ``depth_mm`` is below the coat's surface.
    """

    x_mm: Floats32
    y_mm: Floats32
    depth_mm: Floats32
    diameter_mm: Floats32
    slope_x: Floats32
    slope_y: Floats32

    def __len__(self) -> int:
        return len(self.x_mm)

    def chosen(self, which: NDArray[np.bool_] | NDArray[np.int64]) -> Flakes:
        """Return the flakes for which ``which``, shape (n,), is true, or those of the indices ``which``."""
        return Flakes(*(getattr(self, field.name)[which] for field in fields(self)))


def scatter_flakes(plate: Plate, seed: int) -> Flakes:
    """Scatter the plate's flakes at random: equal plates and seeds give equal flakes.

    Their number is Poisson; each property draws from a stream of its own, so that a change to one leaves the others.

    Parameters
    ----------
    plate
        The plate, with the density, size, depth and tilt of its flakes.
    seed
        Of all random draws, 0 or above.

    Returns
    -------
    Flakes
        Places and sizes in mm and slopes, float32 arrays of one shape (n,). Places are from the middle of the plate.

    Examples
    --------
    >>> from pathlib import Path
    >>> from stimuli.recipes import read_recipe
    >>> recipe, _ = read_recipe(Path("configs/stimuli/manitoba_gray.yaml"))
    >>> plate = recipe.plate.model_copy(update={"size_mm": (10.0, 5.0)}).plate()
    >>> flakes = scatter_flakes(plate, seed=1)
    >>> bool(np.abs(flakes.x_mm).max() <= 5), bool((flakes.x_mm == scatter_flakes(plate, seed=1).x_mm).all())
    (True, True)
    """
    streams = [np.random.default_rng(child) for child in np.random.SeedSequence(seed).spawn(6)]
    number, place, depth, size, tilt, gather = streams
    n = int(number.poisson(plate.flakes_per_mm2 * plate.width_mm * plate.height_mm))
    x, y = (place.random((2, n), dtype=np.float32) - np.float32(0.5)) * np.array(
        [[plate.width_mm], [plate.height_mm]], dtype=np.float32
    )
    slopes = tilt.standard_normal((2, n), dtype=np.float32) * np.float32(np.tan(np.radians(plate.tilt_sd_deg)))
    if plate.clusters is not None:
        _gather(x, y, slopes, plate, plate.clusters, gather)
    return Flakes(
        x_mm=x,
        y_mm=y,
        depth_mm=depth.random(n, dtype=np.float32) * np.float32(plate.flake_depth_max_um / 1000.0),
        diameter_mm=_diameters_um(plate, n, size) / np.float32(1000.0),
        slope_x=slopes[0],
        slope_y=slopes[1],
    )


def _gather(
    x: Floats32, y: Floats32, slopes: Floats32, plate: Plate, clusters: Clusters, random: np.random.Generator
) -> None:
    """Move the first share of the flakes into clusters, and tilt these; the plate's density stays even on average.

    Places are wrapped around the plate's edges. The order of the flakes carries no meaning.
    """
    n = round(clusters.share * len(x))
    count = max(1, round(n / clusters.flakes))
    member = random.integers(count, size=n)
    for places, size_mm in ((x, plate.width_mm), (y, plate.height_mm)):
        middle = random.random(count, dtype=np.float32) * np.float32(size_mm)
        spread = np.float32(clusters.radius_mm) * random.standard_normal(n, dtype=np.float32)
        wrapped = np.mod(middle[member] + spread, np.float32(size_mm)) - np.float32(0.5 * size_mm)
        places[:n] = np.clip(wrapped, np.float32(-0.5 * size_mm), np.float32(0.5 * size_mm))
    together = random.standard_normal((2, count), dtype=np.float32)
    slopes[:, :n] += np.float32(np.tan(np.radians(clusters.tilt_sd_deg))) * together[:, member]


def _diameters_um(plate: Plate, n: int, random: np.random.Generator) -> Floats32:
    """Draw (n,) lognormal diameters between the bounds; what falls outside is drawn again, not piled on the bound."""
    median, spread = np.float32(plate.flake_diameter_median_um), np.float32(plate.flake_diameter_spread)
    sizes: Floats32 = median * np.exp(spread * random.standard_normal(n, dtype=np.float32))
    while True:
        outside = (sizes < plate.flake_diameter_min_um) | (sizes > plate.flake_diameter_max_um)
        again = int(outside.sum())
        if again == 0:
            return sizes
        sizes[outside] = median * np.exp(spread * random.standard_normal(again, dtype=np.float32))
