"""Outliers: the half that agrees best, and the patches taken in again."""

from __future__ import annotations

import itertools
from collections.abc import Callable

import numpy as np
import pytest

from devices.camera import Correspondences, solve
from devices.camera.solve import find_outliers, why
from devices.colour import delta_e_2000, xyz_to_lab

See = Callable[..., Correspondences]


@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.nightly) for seed in (1, 2))])
def test_the_best_half_is_near_the_best_of_all_halves(seen: See, seed: int) -> None:
    """Every half of eleven patches is tried; draws find one that fits nearly as well, without the two outliers."""
    rng = np.random.default_rng(seed)
    colours = seen(rows=rng.choice(24, 11, replace=False))
    C = colours.rgb * (1 + 0.01 * rng.standard_normal((11, 3)))
    C[:2] *= 1.7
    white = colours.XYZ[np.argmax(colours.XYZ[:, 1])]
    lab = xyz_to_lab(colours.XYZ, white)
    half = (11 + 3 + 1) // 2

    def left(rows: list[int]) -> float:
        M, *_ = np.linalg.lstsq(C[rows], colours.XYZ[rows], rcond=None)
        return float(np.sort(delta_e_2000(xyz_to_lab(C @ M, white), lab))[:half].sum())

    best = min(left(list(rows)) for rows in itertools.combinations(range(11), half))
    kept = np.flatnonzero(solve._best_half(C, colours.XYZ, lab, white)).tolist()
    assert left(kept) <= 1.25 * best
    assert not {0, 1} & set(kept)
    off, _ = find_outliers(C, colours.XYZ, white)
    assert {0, 1} <= set(np.flatnonzero(off).tolist())
    assert off.sum() <= 3  # eleven patches say little of one another


def test_what_is_predicted_well_after_all_is_taken_in_again(seen: See, monkeypatch: pytest.MonkeyPatch) -> None:
    colours = seen()
    C = colours.rgb * (1 + 0.012 * np.random.default_rng(97).standard_normal((24, 3)))
    off, _ = find_outliers(C, colours.XYZ, colours.XYZ[18])
    assert not off.any()
    # The matrix of the best half alone would have it out.
    monkeypatch.setattr(solve, "_ROUNDS", 1)
    off, _ = find_outliers(C, colours.XYZ, colours.XYZ[18])
    assert off.sum() == 1


def test_too_few_to_tell(seen: See) -> None:
    colours = seen(rows=[0, 5, 7, 11, 14, 18, 2])
    C = colours.rgb.copy()
    C[0] *= 3
    assert not find_outliers(C, colours.XYZ, colours.XYZ[5])[0].any()


def test_words() -> None:
    measured, white = np.array([19.0, 20.0, 21.0]), np.array([95.0, 100.0, 105.0])
    assert why(1.5 * measured, measured, white).startswith("specular: the camera saw 1.50 ×")
    assert why(0.5 * measured, measured, white).startswith("shaded: the camera saw 0.50 ×")
    assert why(measured * [1.3, 1.0, 0.7], measured, white).startswith("not the colour measured (ΔE00 ")
