"""Colorimetric observers: tables by name, cone fundamentals, and cone contrasts."""

from __future__ import annotations

import numpy as np
import pytest
from colour.colorimetry import MSDS_CMFS
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from pydantic import ValidationError

from devices.colour_matching import (
    STANDARD_OBSERVERS,
    Departure,
    ObserverSpec,
    colorimetric_observer,
    cone_contrasts,
    cone_fundamentals,
    dkl_direction,
    dkl_from_xyz,
    lms_from_xyz,
    mixed_observers,
    quantal_fundamentals,
    xyz_from_lms,
    xyz_of_cone_contrasts,
    xyz_of_dkl,
)
from devices.errors import DeviceError
from documents.yaml import FileModel


# Colorimetric observers by name: the published tables, and how names are read.
@pytest.mark.parametrize("name", STANDARD_OBSERVERS)
def test_standard_functions_are_the_published_tables_to_the_last_digit(name: str) -> None:
    from colour.colorimetry.datasets.cmfs import MSDS_CMFS

    published = MSDS_CMFS[f"{name} Degree Standard Observer"]
    observer = colorimetric_observer(name)
    np.testing.assert_array_equal(observer.wavelengths_nm, published.wavelengths)
    np.testing.assert_array_equal(observer.functions, published.values)


@pytest.mark.parametrize(
    ("name", "efficacy"),
    [("CIE 1964 10", 683.6), ("CIE 2015 2", 683.358), ("CIE 2015 10", 683.144), ("CIE 1931 2", 683.002)],
)
def test_efficacy_is_683_at_540_THz(name: str, efficacy: float) -> None:
    observer = colorimetric_observer(name)
    assert 683 / observer.functions_at([555.017])[0, 1] == pytest.approx(efficacy, abs=1e-2)
    assert observer.efficacy_lm_W == pytest.approx(efficacy, rel=4e-6)


@pytest.mark.parametrize(
    ("written", "name"),
    [
        ("1964_10", "CIE 1964 10"),
        ("1931_2", "CIE 1931 2"),
        ("2012_2", "CIE 2015 2"),
        ("cie 2015 10°", "CIE 2015 10"),
        ("CIE 1964 10 deg", "CIE 1964 10"),
        ("CIE 2006 4 age 45", "CIE 2006 4 age 45"),
        ("CIE 2006 4.0° age 45", "CIE 2006 4 age 45"),
    ],
)
def test_names_may_be_written_in_several_ways(written: str, name: str) -> None:
    assert colorimetric_observer(written).name == name


@pytest.mark.parametrize("wrong", ["CIE 1976", "1931_10", "", "CIE 2006 4", "CIE 2006 4 age 15", "CIE 2006 11 age 32"])
def test_another_name_is_refused_with_what_to_write(wrong: str) -> None:
    with pytest.raises(DeviceError) as caught:
        colorimetric_observer(wrong)
    assert len(caught.value.findings) == 1
    assert caught.value.findings[0].remedy


def test_equal_names_are_equal_observers() -> None:
    assert colorimetric_observer("1964_10") == colorimetric_observer("CIE 1964 10")
    assert len({colorimetric_observer(name) for name in (*STANDARD_OBSERVERS, "1931_2")}) == len(STANDARD_OBSERVERS)
    with pytest.raises(ValueError, match="read-only"):
        colorimetric_observer("CIE 1931 2").functions[0, 0] = 1.0


class _File(FileModel):
    observer: ObserverSpec = "CIE 1931 2"


def test_a_file_names_an_observer_or_gives_age_and_field() -> None:
    assert _File.model_validate({"observer": "1964_10"}).observer == "CIE 1964 10"
    by_age = {"kind": "cie2006", "age_years": 32, "field_deg": 10}
    assert _File.model_validate({"observer": by_age}).observer == "CIE 2006 10 age 32"
    for wrong in ("CIE 1976", {**by_age, "age_years": 12}, {**by_age, "kind": "cie2015"}, 3):
        with pytest.raises(ValidationError):
            _File.model_validate({"observer": wrong})


def test_mixed_observers_are_found_and_equal_ones_are_not() -> None:
    assert mixed_observers([("a", "CIE 1931 2"), ("b", "CIE 1931 2")]) is None
    assert mixed_observers([]) is None
    found = mixed_observers([("a", "CIE 1931 2"), ("b", "CIE 1931 2"), ("c", "CIE 1964 10")])
    assert found is not None
    assert "c of CIE 1964 10" in found.message


# Cone fundamentals by CIE 170-1 and x̄, ȳ, z̄ by CIE 170-2 against published tables and the programme of the CIE.

# CIE 170-2:2015, Expressions for 2° and 10° (8 decimals).
MATRIX_2 = [[1.94735469, -1.41445123, 0.36476327], [0.68990272, 0.34832189, 0.0], [0.0, 0.0, 1.93485343]]
MATRIX_10 = [[1.93986443, -1.34664359, 0.43044935], [0.69283932, 0.34967567, 0.0], [0.0, 0.0, 2.14687945]]


@pytest.mark.parametrize("field_deg", [2, 10])
def test_the_published_fundamentals_come_out(field_deg: int) -> None:
    from colour.colorimetry.datasets.cmfs import MSDS_CMFS

    published = np.asarray(MSDS_CMFS[f"Stockman & Sharpe {field_deg} Degree Cone Fundamentals"].values)
    _, found = cone_fundamentals(field_deg, 32)
    seen = published > 0
    np.testing.assert_array_equal(found > 0, seen)
    assert np.abs(found[seen] / published[seen] - 1).max() <= 5e-5
    assert np.abs(found[:, :2][seen[:, :2]] / published[:, :2][seen[:, :2]] - 1).max() <= 1.5e-5


@pytest.mark.parametrize(("field_deg", "matrix"), [(2, MATRIX_2), (10, MATRIX_10)])
def test_the_published_matrices_and_functions_come_out(field_deg: int, matrix: list[list[float]]) -> None:
    np.testing.assert_allclose(xyz_from_lms(field_deg, 32), matrix, atol=1.2e-4)
    published = colorimetric_observer(f"CIE 2015 {field_deg}").functions
    computed = colorimetric_observer(f"CIE 2006 {field_deg} age 32").functions
    assert np.abs(computed - published).max() <= 3e-5


# x̄, ȳ, z̄ at 450, 550 and 600 nm of the CIE's own programme (ciefunctions 1.0.2) [CIETC197]. Its x̄ stops short of the
# least squares that it looks for, so that only ȳ and z̄ are compared closely.
@pytest.mark.parametrize(
    ("field_deg", "age_years", "programme"),
    [
        (1, 25, [0.3323087, 0.06545683, 1.797793, 0.3947596, 0.9892716, 0.00431874, 1.171988, 0.7125856, 3.972e-5]),
        (4, 45, [0.3472785, 0.06731288, 1.960341, 0.4772621, 0.9859036, 0.0034092, 1.14223, 0.6889272, 3.302e-5]),
        (6, 32, [0.3619016, 0.08626856, 2.014165, 0.5184071, 0.9906827, 0.00267068, 1.133905, 0.6641166, 2.501e-5]),
        (2, 70, [0.3556269, 0.03806255, 1.910648, 0.350567, 0.9472614, 0.00638045, 1.172066, 0.7766251, 7.003e-5]),
        (10, 80, [0.3576252, 0.04565474, 2.126766, 0.3956787, 0.9241006, 0.00492984, 1.205241, 0.7897598, 5.9e-5]),
    ],
)
def test_other_fields_and_ages_are_those_of_the_programme_of_the_cie(
    field_deg: float, age_years: float, programme: list[float]
) -> None:
    expected = np.reshape(programme, (3, 3))
    found = colorimetric_observer(f"CIE 2006 {field_deg} age {age_years}").functions_at([450, 550, 600])
    np.testing.assert_allclose(found[:, 1:], expected[:, 1:], atol=4e-4)
    np.testing.assert_allclose(found[:, 0], expected[:, 0], atol=6e-2)


@pytest.mark.parametrize("field_deg", [1, 3.3, 10])
@pytest.mark.parametrize("age_years", [20, 60, 80])
def test_equal_energy_is_in_the_middle_and_luminance_peaks_at_1(field_deg: float, age_years: float) -> None:
    functions = colorimetric_observer(f"CIE 2006 {field_deg} age {age_years}").functions
    areas = functions.sum(axis=0)
    np.testing.assert_allclose(areas, areas[1], rtol=1e-9)
    assert 0.999 < functions[:, 1].max() <= 1.0
    assert functions.min() >= 0


# Departures from the average.
def test_departures_act_where_they_should() -> None:
    plain = np.log10(quantal_fundamentals(10, 32)[:, :2])
    lens = np.log10(quantal_fundamentals(10, 32, Departure(lens=0.5))[:, :2])
    assert lens[10, 1] - plain[10, 1] < -0.5
    assert lens[300, 1] == pytest.approx(plain[300, 1], abs=1e-9)
    macula = np.log10(quantal_fundamentals(10, 32, Departure(macula=1.0))[:, :2])
    assert macula[68, 1] - plain[68, 1] == pytest.approx(-0.095, abs=0.004)
    # A pigment of shifted absorbance, thin enough that density plays no part, is the pigment shifted.
    thin = {"density_L": -0.99, "density_M": -0.99, "density_S": -0.99}
    still = quantal_fundamentals(10, 32, Departure(**thin))
    moved = quantal_fundamentals(10, 32, Departure(**thin, shift_L_nm=3.0))
    medium = quantal_fundamentals(10, 32, Departure(**thin))[:, 1]
    np.testing.assert_array_equal(moved[:, 1], medium)
    # No medium absorbs there.
    assert moved[290:380, 0] == pytest.approx(still[287:377, 0], rel=1e-6)


# Cone contrasts and DKL: against spectra, against the published construction, and there and back.

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
