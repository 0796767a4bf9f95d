"""Outliers: the half that agrees best, and the patches taken in again.

Exposures: Expression 4.9, and how two compare.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from devices.camera import Correspondences, Exposure, parse_exposure, solve
from devices.camera.exposure import parse_seconds
from devices.camera.solve import find_outliers, why
from devices.colour import delta_e_2000, xyz_to_lab
from devices.errors import DeviceError

See = Callable[..., Correspondences]
_ABOVE = st.floats(1e-4, 1e4)
EXPOSURES = st.builds(Exposure, _ABOVE, st.floats(0.5, 64), st.floats(1, 1e6))


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


def test_exposure_value_is_expression_4_9() -> None:
    assert Exposure(1.0, 1.0, 3200).ev == 0
    assert Exposure(1 / 16, 8.0, 800).ev == pytest.approx(10.0, abs=1e-12)


def test_a_stop_more_by_time_by_aperture_or_by_iso() -> None:
    plain = Exposure(1 / 15, 8.0, 800)
    assert Exposure(2 / 15, 8.0, 800).relative_to(plain) == pytest.approx(2)
    assert Exposure(1 / 15, 8.0 / 2**0.5, 800).relative_to(plain) == pytest.approx(2)
    assert Exposure(1 / 15, 8.0, 1600).relative_to(plain) == pytest.approx(2)


@given(EXPOSURES, EXPOSURES)
def test_one_beside_the_other_and_back(one: Exposure, other: Exposure) -> None:
    assert one.relative_to(other) * other.relative_to(one) == pytest.approx(1, rel=1e-12)
    # At one ISO, an exposure value less is twice the signal.
    alike = Exposure(one.time_s, one.f_number, other.iso)
    assert alike.relative_to(other) == pytest.approx(2 ** (other.ev - alike.ev), rel=1e-9)


def test_what_metadata_round_is_the_same_and_a_third_of_a_stop_is_not() -> None:
    third = Exposure(1 / 3, 8.0, 800)
    assert Exposure(0.3333, 8.0, 800).same_signal(third)
    assert not Exposure(1 / 3 * 2 ** (1 / 3), 8.0, 800).same_signal(third)


def test_written_as_on_a_camera() -> None:
    assert parse_exposure("1/15,8,800") == Exposure(1 / 15, 8.0, 800.0)
    assert parse_exposure(" 1.3 , f/2.8 ") == Exposure(1.3, 2.8, 100.0)
    assert parse_seconds("1/2.5") == pytest.approx(0.4)
    assert str(Exposure(1 / 15, 8.0, 800)) == "1/15 s, f/8, ISO 800"
    assert str(Exposure(0.4, 8.0, 800)) == "0.4 s, f/8, ISO 800"


@pytest.mark.parametrize("text", ["", "1/15", "a,8,800", "1/0,8,800", "1,8,800,3", "0,8,800", "1,-8,800", "nan,8,800"])
def test_what_is_no_exposure_is_refused_with_one_finding(text: str) -> None:
    with pytest.raises(DeviceError) as caught:
        parse_exposure(text)
    assert len(caught.value.findings) == 1
    assert caught.value.findings[0].remedy
