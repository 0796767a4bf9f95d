"""The thesis's two methods on its own display."""

import numpy as np
import pytest

from devices.characterise import ThesisFits, table_c1_codes, thesis_display
from devices.characterise.thesis import THESIS_CURVES, thesis_fits
from devices.errors import DeviceError
from tests.example_displays import noisy

CODES = table_c1_codes()
XYZ = thesis_display().xyz(CODES)


def test_without_noise_table_3_6_comes_back() -> None:
    fits = thesis_fits(CODES, XYZ, thesis_display().primaries_XYZ_cd_m2)
    for fit, true in zip(fits.forward["gog"], THESIS_CURVES, strict=True):
        np.testing.assert_allclose(fit.coefficients, [*true, 0.0], atol=1e-8)
    for fit, (gain, offset, gamma) in zip(fits.inverse["gog"], THESIS_CURVES, strict=True):
        np.testing.assert_allclose(fit.coefficients, [1 / gain, offset, 1 / gamma, 0], atol=1e-6)


def test_the_ramp_s_own_matrix_gives_the_same_curve_in_parts_of_its_full_light(fits: ThesisFits) -> None:
    for fit, back, (gain, offset, gamma) in zip(fits.forward["gog"], fits.inverse["gog"], THESIS_CURVES, strict=True):
        full = gain + offset
        np.testing.assert_allclose(fit.coefficients, [gain / full, offset / full, gamma, 0], atol=1e-8)
        np.testing.assert_allclose(back.coefficients, [full / gain, offset / full, 1 / gamma, 0], atol=1e-6)
    # What was .9795, .0198 and 1.8070 while mixtures and the other channels' ramps took part.
    assert [round(float(value), 4) for value in fits.forward["gog"][0].coefficients[:3]] == [0.978, 0.022, 1.8132]


def test_mixtures_take_no_part(fits: ThesisFits) -> None:
    wrong = XYZ.copy()
    wrong[np.sum(CODES > 0, axis=1) > 1] *= 0.8
    found = thesis_fits(CODES, wrong)
    for fit, right in zip(found.forward["gogo"], fits.forward["gogo"], strict=True):
        np.testing.assert_array_equal(fit.coefficients, right.coefficients)


def test_too_short_a_ramp_is_named() -> None:
    few = np.array([True] * len(CODES))
    few[28:51] = False  # of green, 10 and 250, 255 stay
    with pytest.raises(DeviceError, match="green alone at 5 codes or more"):
        thesis_fits(CODES[few], XYZ[few])


def test_with_noise_the_fits_explain_the_readings() -> None:
    fits = thesis_fits(CODES, noisy(XYZ, 0.002, 0), thesis_display().primaries_XYZ_cd_m2)
    assert min(fit.r2 for fit in fits.forward["gog"]) >= 0.999
    assert min(row.average for row in fits.XYZ_from_code if row.kind == "gog") >= 0.999
    assert len(fits.XYZ_from_code) == len(fits.code_from_XYZ) == 12


@pytest.fixture(scope="module")
def fits() -> ThesisFits:
    """Fits to the readings alone."""
    return thesis_fits(CODES, XYZ)


def test_json_is_plain(fits: ThesisFits) -> None:
    told = fits.to_json()
    assert set(told["method_2_light_from_code"]) == {"gamma", "gog", "ggo", "gogo"}
    rows = told["method_1_XYZ_from_code_r2"]
    assert {"model", "channel", "X", "Y", "Z", "average", "fits"} <= rows[0].keys()
    (green,) = (row for row in rows if (row["model"], row["channel"]) == ("gog", "green"))
    # Y of green alone, as a share of its largest, is green's own curve, whose offset is none.
    assert green["fits"]["Y"]["gamma"] == pytest.approx(THESIS_CURVES[1][2], abs=0.02)
    assert green["fits"]["Y"]["standard_errors"]["gamma"] > 0
    assert green["Y"] == green["fits"]["Y"]["r2"] == pytest.approx(1, abs=1e-4)


def test_channels_never_alone_are_refused() -> None:
    grey = np.ptp(CODES, axis=1) == 0
    with pytest.raises(DeviceError, match="alone"):
        thesis_fits(CODES[grey], XYZ[grey])
