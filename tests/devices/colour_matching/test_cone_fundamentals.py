"""Cone fundamentals by CIE 170-1 and x̄, ȳ, z̄ by CIE 170-2 against published tables and the programme of the CIE."""

from __future__ import annotations

import numpy as np
import pytest

from devices.colour_matching import colorimetric_observer, cone_fundamentals, xyz_from_lms

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


def test_older_lenses_and_smaller_fields_take_more_blue() -> None:
    def blue(field_deg: float, age_years: float) -> float:
        from devices.colour_matching.cone_fundamentals import quantal_fundamentals

        at_450, at_550 = quantal_fundamentals(field_deg, age_years)[[60, 160], 1]
        return float(at_450 / at_550)

    by_age = [blue(10, age) for age in (20, 40, 60, 80)]
    assert by_age == sorted(by_age, reverse=True)
    by_field = [blue(field, 32) for field in (1, 2, 5, 10)]
    assert by_field == sorted(by_field)
    # The age's two expressions meet at 60.
    assert blue(2, 60) == pytest.approx(blue(2, 60.0001), rel=1e-4)
