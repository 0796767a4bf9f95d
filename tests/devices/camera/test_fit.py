"""Fits of cameras to charts: exact, honest about errors, over several exposures, and without outliers."""

from __future__ import annotations

import itertools
import json
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from devices.camera import Correspondences, Exposure, Form, Loss, fit_camera, parse_exposure
from devices.camera import solve as solve_module
from devices.camera.camera_file import format_camera
from devices.camera.exposure import parse_seconds
from devices.camera.solve import design, find_outliers, left_out_xyz, solve, why
from devices.colour import delta_e_2000, xyz_to_lab
from devices.errors import DeviceError
from devices.readings import colorchecker_xyY
from tests.kept import known

# Fits to a chart of a known camera: the matrix back, errors honest, what does not belong left out by name.

See = Callable[..., Correspondences]
FORMS: tuple[Form, ...] = ("linear", "affine")
LOSSES: tuple[Loss, ...] = ("xyz", "delta-e")
OTHERS = (("affine", "xyz"), ("linear", "delta-e"))
NIGHTLY = pytest.mark.nightly


@pytest.mark.parametrize(
    ("form", "loss"),
    [("linear", "xyz"), ("affine", "delta-e"), *(pytest.param(*both, marks=NIGHTLY) for both in OTHERS)],
)
def test_a_known_camera_comes_back_without_noise(seen: See, matrix: np.ndarray, form: Form, loss: Loss) -> None:
    offset = (1.0, 2.0, 3.0) if form == "affine" else (0.0, 0.0, 0.0)
    found = fit_camera(seen(offset), form, loss)
    # float64 through a condition number near 10: 1e-9 of the largest number is what was promised.
    assert np.abs(found.model.matrix - matrix).max() < 1e-9 * matrix.max()
    assert np.abs(found.model.offset_XYZ - offset).max() < 1e-9 * matrix.max()
    assert known(found.held_out).max < 1e-9
    assert found.left_out == ()
    assert found.standard_errors.max() < 1e-9 * matrix.max()
    assert found.standard_errors.shape == ((3, 4) if form == "affine" else (3, 3))


def test_black_is_subtracted_before_the_linear_fit(seen: See, matrix: np.ndarray) -> None:
    black = np.array([0.02, 0.03, 0.01])
    colours = seen()
    lifted = Correspondences(colours.rgb + black, colours.XYZ, colours.names, colours.saturated)
    found = fit_camera(lifted, "linear", black_rgb=black)
    assert np.abs(found.model.matrix - matrix).max() < 1e-9 * matrix.max()
    assert found.model.xyz(lifted.rgb) == pytest.approx(colours.XYZ, abs=1e-9)
    # Left in, it spoils the linear fit, and the affine one takes it into its offset.
    assert fit_camera(lifted, "linear").fitted.mean > 1
    assert fit_camera(lifted, "affine").fitted.max < 1e-9


def test_it_is_expression_4_8_transposed(seen: See) -> None:
    colours = seen(noise=0.02)
    C = design(colours.rgb, "affine")
    printed = np.linalg.inv(C.T @ C) @ (C.T @ colours.XYZ)
    assert printed.shape == (4, 3)
    found = solve(C, colours.XYZ, "xyz", colours.XYZ[18])
    assert found.M.shape == (3, 4)
    assert pytest.approx(printed.T, rel=1e-9, abs=1e-9) == found.M


@pytest.mark.parametrize(
    ("form", "loss"),
    [
        ("linear", "xyz"),
        ("affine", "xyz"),
        pytest.param("affine", "delta-e", marks=pytest.mark.nightly),
    ],
)
def test_leaving_one_out_is_fitting_to_the_others(seen: See, form: Form, loss: Loss) -> None:
    colours = seen(noise=0.02, rows=list(range(0, 24, 2)))
    C, white = design(colours.rgb, form), colours.XYZ[9]
    quick = left_out_xyz(C, colours.XYZ, loss, white, solve(C, colours.XYZ, loss, white))
    for i in (0, 9):
        others = np.arange(12) != i
        slow = C[i] @ solve(C[others], colours.XYZ[others], loss, white).M.T
        assert quick[i] == pytest.approx(slow, rel=1e-9 if loss == "xyz" else 1e-4)
    found = fit_camera(colours, form, loss)
    assert known(found.held_out).mean > found.fitted.mean


@pytest.mark.nightly
def test_many_colours_are_left_out_in_groups(seen: See) -> None:
    rng = np.random.default_rng(6)
    rgb = rng.uniform(0.02, 0.9, (300, 3)) @ np.array([[0.6, 0.3, 0.1], [0.3, 0.5, 0.2], [0.1, 0.2, 0.7]])
    XYZ = np.maximum(rgb @ np.array([[2.0, 0.8, 0.1], [0.4, 1.5, -0.3], [0.0, -0.3, 2.2]]), 0.01) * 50
    XYZ *= 1 + 0.02 * rng.standard_normal(XYZ.shape)
    white = XYZ[np.argmax(XYZ[:, 1])]
    fitted = solve(rgb, XYZ, "delta-e", white)
    out = left_out_xyz(rgb, XYZ, "delta-e", white, fitted)
    assert np.all(np.isfinite(out))
    # Nearly what the whole fit says, yet of matrices that have not seen the colour.
    assert 0 < np.abs(out - rgb @ fitted.M.T).max() < 0.05 * XYZ.max()
    order = rng.permutation(300)
    assert left_out_xyz(rgb[order], XYZ[order], "delta-e", white, fitted) == pytest.approx(out[order], rel=1e-5)


def test_the_least_delta_e_is_where_no_small_step_is_better(seen: See) -> None:
    colours = seen(noise=0.03, seed=4)
    white = colours.XYZ[18]
    lab = xyz_to_lab(colours.XYZ, white)
    best = solve(colours.rgb, colours.XYZ, "delta-e", white).M

    def cost(M: np.ndarray) -> float:
        return float((delta_e_2000(xyz_to_lab(colours.rgb @ M.T, white), lab) ** 2).sum())

    for row in range(3):
        for column in range(3):
            for step in (-0.3, 0.3):
                moved = best.copy()
                moved[row, column] += step
                assert cost(moved) > cost(best)


@pytest.mark.parametrize("loss", ["xyz", pytest.param("delta-e", marks=pytest.mark.nightly)])
def test_standard_errors_are_the_spread_of_repeated_fits(seen: See, loss: Loss) -> None:
    colours = seen()
    white = colours.XYZ[18]
    rng = np.random.default_rng(2)
    fits = [
        solve(colours.rgb, colours.XYZ + rng.normal(0, 0.05, (24, 3)), loss, white)
        for _ in range(400 if loss == "xyz" else 60)
    ]
    spread = np.std([fit.M for fit in fits], axis=0, ddof=1)
    told = np.sqrt(np.mean([fit.standard_errors**2 for fit in fits], axis=0))
    # The sandwich over 24 colours is itself uncertain, and 60 fits give the spread to 10 %.
    lowest, highest = (0.85, 1.18) if loss == "xyz" else (0.6, 1.6)
    assert np.all((told / spread > lowest) & (told / spread < highest))


@pytest.mark.parametrize("form", FORMS)
def test_saturated_and_specular_patches_are_left_out_and_named(seen: See, matrix: np.ndarray, form: Form) -> None:
    found = fit_camera(seen(noise=0.005, times={"white 9.5": 2.2, "foliage": 1.6, "orange": 0.6}), form)
    told = {patch.name: patch.left_out_reason for patch in found.left_out}
    assert set(told) == {"white 9.5", "foliage", "orange"}
    assert told["white 9.5"].startswith("saturated: ")
    assert "green" in told["white 9.5"]
    assert told["foliage"].startswith("specular: the camera saw 1.6")
    assert told["orange"].startswith("shaded: the camera saw 0.6")
    assert all(patch.held_out_delta_e is None for patch in found.left_out)
    assert np.abs(found.model.matrix - matrix).max() < 6  # noise of half a percent
    # Kept in, the bright one alone bends the matrix by far more.
    colours = seen(noise=0.005, times={"foliage": 1.6, "orange": 0.6})
    bent = solve(design(colours.rgb, form), colours.XYZ, "xyz", colours.XYZ[18]).M[:, :3]
    assert np.abs(bent - matrix).max() > 12
    zone = known(found.model.safe_luminance_cd_m2)
    assert zone[1] < 90 * 0.7  # white is no longer within


@pytest.mark.nightly
def test_a_real_sensor_s_errors_are_no_outliers() -> None:
    """A camera whose sensitivities are no mixture of the observer's errs everywhere; nothing of that is left out."""
    import colour

    sensor = colour.MSDS_CAMERA_SENSITIVITIES["Nikon 5100 (NPL)"]
    shape = colour.SpectralShape(400, 700, 10)
    chart = colour.SDS_COLOURCHECKERS["ISO 17321-1"]
    light = colour.SDS_ILLUMINANTS["D50"].copy().align(shape).values
    reflectances = np.array([sd.copy().align(shape).values for sd in chart.values()])
    observer = colour.MSDS_CMFS["CIE 1931 2 Degree Standard Observer"].copy().align(shape).values
    rgb = (reflectances * light) @ sensor.copy().align(shape).values
    XYZ = (reflectances * light) @ observer
    rgb, XYZ = 0.8 * rgb / rgb.max(), 100 * XYZ / (light @ observer[:, 1])
    for loss in LOSSES:
        found = fit_camera(Correspondences(rgb, XYZ, tuple(chart), rgb > 1), "linear", loss)
        assert found.left_out == ()
        assert 0.3 < found.fitted.mean < known(found.held_out).mean < 3


def test_repeated_rows_leave_more_colours_than_needed(seen: See) -> None:
    colours = seen(rows=[0, 1, 2, 3, 14, 18, 18])
    found = fit_camera(colours)
    assert known(found.held_out).patches == 7


def test_json_is_plain(seen: See) -> None:
    found = fit_camera(seen(noise=0.01, times={"white 9.5": 3.0}), exposure=Exposure(1 / 15, 8, 800))
    told = json.loads(json.dumps(found.to_json(), allow_nan=False))
    assert told["exposure"]["ev"] == pytest.approx(np.log2(64 * 15))
    assert list(told["left_out"]) == ["white 9.5"]
    assert len(told["patches"]) == 24
    assert told["safe_luminance_cd_m2"] == pytest.approx(
        [seen().XYZ[:, 1].min(), np.sort(seen().XYZ[:, 1])[-2]]  # white is out
    )


@pytest.mark.parametrize(
    ("some", "taken", "words"),
    [
        ({"rows": [0, 5, 14, 18]}, np.s_[:], "there are 4 patches; the linear form needs 6"),
        ({"times": dict.fromkeys(colorchecker_xyY()[0], 30.0)}, np.s_[:], "patches are saturated"),
        ({"rows": [18, 19, 20, 21, 22, 23]}, np.s_[:], "do not determine a matrix"),
        ({}, np.s_[:, [0, 0, 2]], "condition number is infinite"),  # two channels carry the same
        ({}, np.s_[::-1], "do not fit any one matrix"),
        # Two rows exchanged are found as outliers, too many of them.
        ({}, np.s_[np.r_[6:12, 0:6, 12:24]], "do not fit any one matrix"),
    ],
)
def test_charts_that_give_no_matrix_are_refused(seen: See, some: Any, taken: Any, words: str) -> None:
    colours = seen(**some)
    with pytest.raises(DeviceError, match=words) as caught:
        fit_camera(replace(colours, rgb=colours.rgb[taken]))
    (finding,) = caught.value.findings
    assert finding.remedy


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda rgb, XYZ: (rgb * 255, XYZ), r"the camera's values reach .*shares of full scale"),
        (lambda rgb, XYZ: (rgb * [1, 0, 1], XYZ), r"the camera's green hardly changes"),
        (lambda rgb, XYZ: (np.where(rgb == rgb[7], np.nan, rgb), XYZ), r"purplish blue are no finite numbers"),
        (lambda rgb, XYZ: (rgb, np.where(XYZ[7] == XYZ, np.inf, XYZ)), r"XYZ of purplish blue are no finite"),
        (lambda rgb, XYZ: (rgb - 0.2, XYZ), r"below zero"),
        (lambda rgb, XYZ: (rgb, XYZ - 20), r"XYZ of .* is below zero"),
        (lambda rgb, XYZ: (rgb, 0 * XYZ), r"no colour has a luminance"),
    ],
)
def test_numbers_that_no_linear_camera_gives(
    seen: See, change: Callable[..., tuple[np.ndarray, ...]], words: str
) -> None:
    colours = seen()
    rgb, XYZ = change(colours.rgb, colours.XYZ)
    with pytest.raises(DeviceError, match=words) as caught:
        Correspondences(rgb, XYZ, colours.names, colours.saturated, "chart.csv")
    assert len(caught.value.findings) == 1
    assert caught.value.findings[0].file == "chart.csv"


def test_what_is_worth_saying_is_said(seen: See) -> None:
    colours = seen()
    bent = Correspondences(colours.rgb**0.6, colours.XYZ, colours.names, colours.saturated)
    assert "go as luminance to the power 0.60" in " ".join(fit_camera(bent).notes)
    plain = fit_camera(colours, exposure=Exposure(0.1, 8))
    assert plain.notes == ()
    relative = Correspondences(colours.rgb, colours.XYZ / 100, colours.names, colours.saturated)
    assert "if XYZ are relative" in " ".join(fit_camera(relative).notes)


# Outliers: the half that agrees best, and the patches taken in again.
#
# Exposures: Expression 4.9, and how two compare.


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
    kept = np.flatnonzero(solve_module._best_half(C, colours.XYZ, lab, white)).tolist()
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
    monkeypatch.setattr(solve_module, "_ROUNDS", 1)
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


# Charts at several exposures in several lights: Table 4.2 as one fit.

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
    zone = known(found.model.safe_luminance_cd_m2)
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
    once = known(fit_camera(chart).held_out)
    together, alone = fit_camera(alike).held_out, fit_camera(apart).held_out
    assert known(together).mean == pytest.approx(once.mean, rel=1e-6)
    assert known(alone).mean < 0.97 * once.mean
