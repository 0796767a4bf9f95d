"""Cone contrasts and DKL: against spectra, against the published construction, and there and back."""

from __future__ import annotations

import numpy as np
import pytest
from colour.colorimetry import MSDS_CMFS
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from devices.colour_matching import (
    colorimetric_observer,
    cone_contrasts,
    cone_fundamentals,
    dkl_direction,
    dkl_from_xyz,
    lms_from_xyz,
    xyz_of_cone_contrasts,
    xyz_of_dkl,
)
from devices.errors import DeviceError

GREY = np.array([47.5, 50.0, 54.4])
OBSERVERS = ["CIE 1931 2", "CIE 2015 2", "CIE 2015 10", "CIE 2006 4 age 60"]


def smooth_spectra(waves: NDArray[np.float64], count: int) -> NDArray[np.float64]:
    """Broad lights, as displays and surfaces have."""
    rng = np.random.default_rng(5)
    middles, widths = rng.uniform(430, 650, (count, 1)), rng.uniform(40, 120, (count, 1))
    return np.asarray(0.2 + np.exp(-(((waves - middles) / widths) ** 2)))


@pytest.mark.parametrize(("observer", "field", "age"), [("CIE 2015 2", 2.0, 32.0), ("CIE 2006 4 age 60", 4.0, 60.0)])
def test_contrasts_are_those_of_the_spectra(observer: str, field: float, age: float) -> None:
    """Of the cone fundamentals, wavelength by wavelength; the CIE's tables have 7 figures."""
    waves, lms = cone_fundamentals(field, age)
    lights = smooth_spectra(waves, 12)
    cones, XYZ = lights @ lms, lights @ colorimetric_observer(observer).functions_at(waves)
    by_spectrum = cones[1:] / cones[0] - 1
    np.testing.assert_allclose(cone_contrasts(XYZ[1:], XYZ[0], observer), by_spectrum, rtol=0, atol=2e-5)


def test_the_cones_of_cie_1931_are_near_smith_and_pokornys() -> None:
    """Broad lights: L and M within 0.02, the ratio of S within a tenth; XYZ of 1931 are not linear in any cones."""
    cmfs = MSDS_CMFS["Smith & Pokorny 1975 Normal Trichromats"]
    waves, lms = np.asarray(cmfs.wavelengths), np.nan_to_num(np.asarray(cmfs.values))
    lights = smooth_spectra(waves, 12)
    cones, XYZ = lights @ lms, lights @ colorimetric_observer("CIE 1931 2").functions_at(waves)
    found = cone_contrasts(XYZ[1:], XYZ[0])
    ratios = cones[1:] / cones[0]
    np.testing.assert_allclose(found[:, :2], ratios[:, :2] - 1, rtol=0, atol=0.02)
    np.testing.assert_allclose(1 + found[:, 2], ratios[:, 2], rtol=0.1, atol=0)
    assert np.abs(found[:, :2]).max() > 0.3


def dkl_as_constructed(background: NDArray[np.float64], observer: str) -> NDArray[np.float64]:
    """The published construction [Brainard1996]: raw mechanisms on excitations, then each scaled by its own light."""
    matrix = lms_from_xyz(observer)
    long, middle, short = matrix @ background
    raw = np.array([[1.0, 1.0, 0.0], [1.0, -long / middle, 0.0], [-1.0, -1.0, (long + middle) / short]])
    isolating = np.linalg.inv(raw)
    pooled = np.linalg.norm(isolating / np.array([[long], [middle], [short]]), axis=0)
    answers = np.diag(raw @ (isolating / pooled))
    return np.asarray(raw / answers[:, None] @ matrix)


@pytest.mark.parametrize("observer", OBSERVERS)
def test_dkl_is_that_of_the_published_construction(observer: str) -> None:
    lights = GREY + np.random.default_rng(3).uniform(-10, 10, (30, 3))
    plain = (lights - GREY) @ dkl_as_constructed(GREY, observer).T
    np.testing.assert_allclose(dkl_from_xyz(lights, GREY, observer), plain, rtol=0, atol=1e-12)


@given(st.sampled_from(OBSERVERS), st.lists(st.floats(-0.2, 0.2), min_size=3, max_size=3))
def test_there_and_back(observer: str, asked: list[float]) -> None:
    XYZ = xyz_of_dkl(asked, GREY, observer)
    np.testing.assert_allclose(dkl_from_xyz(XYZ, GREY, observer), asked, rtol=0, atol=1e-12)
    XYZ = xyz_of_cone_contrasts(asked, GREY, observer)
    np.testing.assert_allclose(cone_contrasts(XYZ, GREY, observer), asked, rtol=0, atol=1e-12)


@pytest.mark.parametrize("observer", OBSERVERS)
def test_what_the_axes_stand_for(observer: str) -> None:
    """In the plane of azimuths luminance stays; 0° leaves S as it is, 90° L and M; each isolating light pools to 1."""
    around = xyz_of_dkl(0.1 * dkl_direction(np.arange(0.0, 360.0, 30.0)), GREY, observer)
    # Smith and Pokorny's L + M is Y within a rounding of their figures, 4e-5.
    np.testing.assert_allclose(around[:, 1], GREY[1], rtol=0, atol=1e-9)
    red = cone_contrasts(xyz_of_dkl([0, 0.1, 0], GREY, observer), GREY, observer)
    blue = cone_contrasts(xyz_of_dkl([0, 0, 0.1], GREY, observer), GREY, observer)
    grey = cone_contrasts(xyz_of_dkl([0.1, 0, 0], GREY, observer), GREY, observer)
    assert red[0] > 0 > red[1]
    assert red[2] == pytest.approx(0, abs=1e-12)
    np.testing.assert_allclose(blue, [0, 0, 0.1], rtol=0, atol=1e-12)
    assert np.ptp(grey) == pytest.approx(0, abs=1e-12)
    for one in (red, blue, grey):
        assert np.linalg.norm(one) == pytest.approx(0.1, abs=1e-12)


def test_wrong_input() -> None:
    with pytest.raises(DeviceError, match="the cones of CIE 1964 10 are not known"):
        lms_from_xyz("CIE 1964 10")
    with pytest.raises(DeviceError, match="there is no colorimetric observer"):
        lms_from_xyz("CIE 1932")
    with pytest.raises(DeviceError, match="excites L, M and S"):
        cone_contrasts(GREY, [0.0, 0.0, 0.0])
    with pytest.raises(DeviceError, match="three finite numbers"):
        cone_contrasts(GREY, [1.0, np.nan, 1.0])
    with pytest.raises(DeviceError, match=r"a cone contrast is -1\.5"):
        xyz_of_cone_contrasts([0.0, -1.5, 0.0], GREY)
    with pytest.raises(DeviceError, match="a cone contrast is -"):
        xyz_of_dkl([-2.0, 0.0, 0.0], GREY)
