"""Charts at several exposures in several lights: Table 4.2 as one fit."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from devices.camera import Correspondences, Exposure, fit_camera
from devices.camera.camera_file import format_camera
from devices.errors import DeviceError

See = Callable[..., Correspondences]
AT = Exposure(1 / 15, 8.0, 800)
TABLE_4_2 = {
    132.32: (1 / 15, 1 / 13, 1 / 10),
    34.4: (1 / 8, 1 / 6, 1 / 5, 1 / 4, 1 / 3),
    14.82: (1 / 2.5, 1 / 2, 1 / 1.6, 1 / 1.3, 1.0),
    3.7: (1.3, 1.6, 2.0),
}


def _table(chart: Correspondences, matrix: np.ndarray, slow: float = 1.0, noise: float = 0.0) -> Correspondences:
    """Return the chart at every exposure of Table 4.2; that of 1/4 s lasts ``slow`` times as long as it says."""
    rng = np.random.default_rng(1)
    rgb, XYZ, names, exposures = [], [], [], []
    for white, times in TABLE_4_2.items():
        light = chart.XYZ * white / chart.XYZ[:, 1].max()
        for time_s in times:
            exposure = Exposure(time_s, 8.0, 800)
            # The camera of `matrix` saturates green at some 230 cd/m² of white at 1/15 s.
            seen = light @ np.linalg.inv(matrix).T * exposure.relative_to(AT) * (slow if time_s == 1 / 4 else 1.0)
            rgb.append(seen * (1 + noise * rng.standard_normal(seen.shape)))
            XYZ.append(light)
            names += [f"{name} at {exposure}" for name in chart.names]
            exposures += [exposure] * len(chart)
    signal = np.vstack(rgb)
    return Correspondences(
        np.minimum(signal, 1.0), np.vstack(XYZ), tuple(names), signal >= 0.995, "table.csv", tuple(exposures)
    )


def test_sixteen_exposures_are_one_camera(seen: See, matrix: np.ndarray) -> None:
    colours = _table(seen(), matrix)
    found = fit_camera(colours)
    assert found.model.exposure == AT
    assert np.abs(found.model.matrix - matrix).max() < 1e-9 * matrix.max()
    assert {patch.left_out_reason.partition(":")[0] for patch in found.left_out} <= {"saturated"}
    told = {round(one.white_luminance_cd_m2, 6): one.exposures for one in found.model.exposure_sets}
    assert {white: tuple(one.time_s for one in exposures) for white, exposures in told.items()} == TABLE_4_2
    assert found.notes == ()
    # What each row's photograph says of its light is what was measured.
    for patch, exposure, XYZ in zip(found.patches, colours.exposures or (), colours.XYZ, strict=True):
        if not patch.left_out_reason:
            assert patch.estimated_XYZ == pytest.approx(XYZ, abs=1e-9)
            assert found.model.xyz(patch.rgb, exposure) == pytest.approx(XYZ, abs=1e-9)
    assert format_camera(found.model).count("white_luminance_cd_m2") == 4


def test_the_zone_is_of_signals_at_the_model_s_exposure(seen: See, matrix: np.ndarray) -> None:
    found = fit_camera(_table(seen(), matrix))
    zone = found.model.safe_luminance_cd_m2
    assert zone is not None
    used = [patch.tested_luminance_cd_m2 for patch in found.patches if not patch.left_out_reason]
    assert zone == (min(used), max(used))
    # Of all sets, white × time is least in set 2 at 1/8 s.
    assert zone[0] == pytest.approx(0.031513 / 0.899 * 34.4 * 15 / 8, rel=0.05)


def test_another_reference_is_the_same_camera(seen: See, matrix: np.ndarray) -> None:
    colours = _table(seen(), matrix, noise=0.005)
    one, other = fit_camera(colours), fit_camera(colours, exposure=Exposure(1 / 4, 8.0, 800))
    assert other.model.exposure == Exposure(1 / 4, 8.0, 800)
    rgb = np.array([0.2, 0.3, 0.1])
    at = Exposure(1 / 30, 5.6, 400)
    assert other.model.xyz(rgb, at) == pytest.approx(one.model.xyz(rgb, at), rel=1e-9)
    assert other.fitted.mean == pytest.approx(one.fitted.mean, rel=1e-9)


def test_a_shutter_that_is_off_is_named(seen: See, matrix: np.ndarray) -> None:
    said = fit_camera(_table(seen(), matrix, slow=1.1, noise=0.002)).notes
    assert len(said) == 1
    assert said[0].startswith("at 1/4 s, f/8, ISO 800")


def test_an_affine_model_has_one_exposure(seen: See, matrix: np.ndarray) -> None:
    with pytest.raises(DeviceError, match="seen at 16 exposures") as caught:
        fit_camera(_table(seen(), matrix), "affine")
    assert len(caught.value.findings) == 1
    chart = seen()
    alone = Correspondences(chart.rgb, chart.XYZ, chart.names, chart.saturated, None, (AT,) * 24)
    assert fit_camera(alone, "affine").model.exposure == AT


def test_a_reference_that_was_not_used(seen: See, matrix: np.ndarray) -> None:
    with pytest.raises(DeviceError, match="is none of the table's"):
        fit_camera(_table(seen(), matrix), exposure=Exposure(1 / 250, 8.0, 800))


def test_a_patch_is_left_out_at_all_its_exposures(seen: See) -> None:
    """A patch that lies at every exposure in the same way foretells itself, unless it is left out at all of them."""
    chart = seen(noise=0.01)
    rgb = np.vstack([chart.rgb * 0.3, chart.rgb * 0.6, chart.rgb * 0.9])
    light = np.vstack([chart.XYZ] * 3)
    exposures = (AT,) * 24 + (Exposure(2 / 15, 8.0, 800),) * 24 + (Exposure(3 / 15, 8.0, 800),) * 24
    alike = Correspondences(rgb, light, chart.names * 3, rgb > 1, None, exposures)
    apart = Correspondences(rgb, light, tuple(str(i) for i in range(72)), rgb > 1, None, exposures)
    once = fit_camera(chart).held_out
    together, alone = fit_camera(alike).held_out, fit_camera(apart).held_out
    assert once is not None
    assert together is not None
    assert alone is not None
    assert together.mean == pytest.approx(once.mean, rel=1e-6)
    assert alone.mean < 0.97 * once.mean
