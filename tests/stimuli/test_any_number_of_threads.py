"""What is shared among threads is the same, to the last bit, with any number of them."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from devices.colour import ciede2000, delta_e_2000, delta_e_2000_parts
from devices.compensation import clipping, eye_clip_costs
from devices.display import DisplayModel, EyeModels, ToneCurve
from stimuli.measures import SeenPicture, difference_map
from stimuli.pictures import RowFile, rows
from stimuli.pictures.resampling import axis_weights, resample
from tests.threads import shared_and_alike

RNG = np.random.default_rng(0)
WHITE = np.array([95.0, 100.0, 109.0])
XYZ = RNG.uniform(0.0, 1.2, (2, 60, 50, 3)) * WHITE
LABS = RNG.uniform([0, -90, -90], [100, 90, 90], (2, 3000, 3))
PRIMARIES = np.array([[10.83, 9.67, 5.68], [5.62, 18.65, 2.20], [0.54, 1.63, 29.18]])
MODEL = DisplayModel(np.array([0.03, 0.03, 0.04]), PRIMARIES, (ToneCurve(gamma=2.2),) * 3)
MODELS = EyeModels(MODEL, MODEL)


def seen_difference() -> NDArray[Any]:
    first, second = (SeenPicture(picture, 40.0, WHITE) for picture in XYZ)
    return difference_map(first, second, WHITE, filtered=True)


def resampled() -> NDArray[Any]:
    image = np.tile(XYZ[0, ..., 1], (10, 8))
    return resample(image, axis_weights(600, 150.0, 0.3), axis_weights(400, 100.0, 0.3, "cubic"))


def clip_costs() -> NDArray[Any]:
    costs = eye_clip_costs(MODELS, None, 0.6 * XYZ[0], 0.5 * XYZ[1])
    return np.array([list(costs[eye].values()) for eye in ("left", "right")])


USERS: tuple[Callable[[], NDArray[Any]], ...] = (
    lambda: delta_e_2000(LABS[0], LABS[1]),
    lambda: delta_e_2000_parts(LABS[0], LABS[1]).S_H,
    lambda: difference_map(XYZ[0], XYZ[1], WHITE),
    seen_difference,
    resampled,
    clip_costs,
)


@pytest.mark.parametrize("user", USERS)
def test_one_thread_or_several_give_the_same_bits(
    user: Callable[[], NDArray[Any]], monkeypatch: pytest.MonkeyPatch
) -> None:
    for module, name, size in (
        (ciede2000, "_BLOCK", 64),
        (ciede2000, "_SHARE", 256),
        (clipping, "_BLOCK", 32),
        (clipping, "_SHARE", 128),
        (rows, "BAND_PIXELS", 300),
    ):
        monkeypatch.setattr(module, name, size)
    shared_and_alike(user, monkeypatch)


def test_threads_read_and_write_their_own_rows() -> None:
    numbered = np.repeat(np.arange(64, dtype=np.float32), 20_000 * 3).reshape(64, 20_000, 3)
    rows = RowFile.of(numbered)

    def read_and_write(row: int) -> bool:
        right = all(bool((rows[row : row + 1] == row).all()) for _ in range(20))
        rows.write(row, numbered[row : row + 1])
        return right

    with ThreadPoolExecutor(8) as pool:
        assert all(pool.map(read_and_write, list(range(64)) * 2))
    assert np.array_equal(rows[:], numbered)
