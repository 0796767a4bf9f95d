"""The thesis's two methods on its own display."""

import numpy as np
import pytest

from devices.characterise.example_displays import THESIS_CURVES, noisy, table_c1_codes, thesis_display
from devices.characterise.thesis import ThesisFits, thesis_fits
from devices.errors import DeviceError

CODES = table_c1_codes()
XYZ = thesis_display().xyz(CODES)


def test_table_c_1_has_120_patches() -> None:
    assert CODES.shape == (120, 3)
    assert len(np.unique(CODES, axis=0)) == 120


def test_without_noise_table_3_6_comes_back() -> None:
    fits = thesis_fits(CODES, XYZ, thesis_display().primaries_XYZ_cd_m2)
    for fit, true in zip(fits.forward["gog"], THESIS_CURVES, strict=True):
        np.testing.assert_allclose(fit.coefficients, [*true, 0.0], atol=1e-8)
    for fit, (gain, offset, gamma) in zip(fits.inverse["gog"], THESIS_CURVES, strict=True):
        np.testing.assert_allclose(fit.coefficients, [1 / gain, offset, 1 / gamma, 0], atol=1e-6)


def test_with_noise_the_fits_explain_the_readings() -> None:
    fits = thesis_fits(CODES, noisy(XYZ, 0.002, 0), thesis_display().primaries_XYZ_cd_m2)
    assert min(fit.r2 for fit in fits.forward["gog"]) >= 0.999
    assert min(row.average for row in fits.XYZ_from_code if row.kind == "gog") >= 0.999
    assert len(fits.XYZ_from_code) == len(fits.code_from_XYZ) == 12


@pytest.fixture(scope="module")
def fits() -> ThesisFits:
    """Fits to the readings alone."""
    return thesis_fits(CODES, XYZ)


def test_the_matrix_is_taken_from_the_primaries(fits: ThesisFits) -> None:
    whole = [curve.linear(1.0) for curve in thesis_display().curves]
    # The lit channel's neighbours give a little light at code 0: red's offset.
    np.testing.assert_allclose(fits.primaries_XYZ_cd_m2, thesis_display().primaries_XYZ_cd_m2 * whole, atol=0.02)


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
