"""A simulated sensor of known gain and read noise: brackets of one scene as DNG files."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from documents.arrays import Floats
from tests.stimuli.develop.dng import Tag, exposure_tags, save_dng

BLACK, WHITE = 600, 15520
SPAN = WHITE - BLACK
FULL_E, READ_E = 30000.0, 6.0
TIMES = ((1, 250), (1, 125), (1, 60), (1, 30), (1, 15), (1, 8))  # thesis Section 5.3


def record(light: Floats, time: float, seed: int, full_e: float = FULL_E, read_e: float = READ_E) -> Floats:
    """Return values in shares of full scale of ``light``, which fills the sensor in one second at 1; not clipped."""
    rng = np.random.default_rng(seed)
    electrons = rng.poisson(light * time * full_e) + rng.normal(0, read_e, light.shape)
    return np.asarray(electrons / full_e)


def codes(values: Floats) -> NDArray[np.uint16]:
    """Return the sensor's codes, full at WHITE."""
    return np.clip(np.rint(BLACK + values * SPAN), 0, WHITE).astype(np.uint16)


def scene(height: int = 96, width: int = 128, stops: float = 11.0, seed: int = 0) -> Floats:
    """Return patches of light, smooth shading within each, whose brightest just fills a sensor in 1/300 s."""
    rng = np.random.default_rng(seed)
    patches = 2.0 ** rng.uniform(-stops, 0, (-(-height // 16), -(-width // 16)))
    light = np.kron(patches, np.ones((16, 16)))[:height, :width]
    rows, columns = np.mgrid[:height, :width]
    return np.asarray(300 * light * (1 + 0.15 * np.sin(rows / 7) * np.cos(columns / 9)) / 1.15)


def bracket(
    folder: Path,
    lights: Floats | Sequence[Floats],
    times: Sequence[tuple[int, int]] = TIMES,
    *,
    actual: Sequence[float] | None = None,
    tags: Sequence[Tag] = (),
    iso: int = 200,
    **options: object,
) -> list[Path]:
    """Save a raw file for each time; ``actual`` are the seconds that the shutter was really open."""
    folder.mkdir(exist_ok=True)
    paths = []
    for number, time in enumerate(times):
        light = lights if isinstance(lights, np.ndarray) else lights[number]
        seconds = time[0] / time[1] if actual is None else actual[number]
        paths.append(
            save_dng(
                folder / f"{time[0]}_{time[1]}.dng",
                codes(record(light, seconds, seed=number)),
                black=(BLACK,),
                white=WHITE,
                tags=[*exposure_tags(time, (8, 1), iso), *tags],
                **options,  # type: ignore[arg-type]  # options of save_dng by name
            )
        )
    return paths
