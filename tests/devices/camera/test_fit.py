"""Fits to a chart of a known camera: the matrix back, errors honest, what does not belong left out by name."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from devices.camera import Correspondences, Exposure, Form, Loss, fit_camera
from devices.camera.solve import design, left_out_xyz, solve
from devices.colour import XYZ_from_xyY, delta_e_2000, xyz_to_lab
from devices.errors import DeviceError
from devices.readings import colorchecker_xyY

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
    assert found.held_out is not None
    assert found.held_out.max < 1e-9
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
    assert found.held_out is not None
    assert found.held_out.mean > found.fitted.mean


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


@pytest.mark.nightly
@given(st.floats(1e-3, 1e4), st.sampled_from(FORMS))
@settings(deadline=None, max_examples=4)
def test_scaling_the_exposure_scales_XYZ(times: float, form: Form) -> None:
    names, xyY = colorchecker_xyY()
    XYZ = XYZ_from_xyY(xyY) * 100
    rgb = 0.5 * XYZ / 100 * (1 + 0.004 * np.random.default_rng(3).standard_normal(XYZ.shape))
    plain = fit_camera(Correspondences(rgb, XYZ, names, rgb > 1), form)
    scaled = fit_camera(Correspondences(rgb, XYZ * times, names, rgb > 1), form)
    assert scaled.model.matrix == pytest.approx(times * plain.model.matrix, rel=1e-9)
    assert scaled.model.xyz(rgb) == pytest.approx(times * plain.model.xyz(rgb), rel=1e-9)
    assert scaled.fitted.mean == pytest.approx(plain.fitted.mean, rel=1e-6)
    if form == "linear":
        at = Exposure(0.1, 8.0, 800)
        fitted = fit_camera(Correspondences(rgb, XYZ, names, rgb > 1), form, exposure=at).model
        longer = Exposure(0.1 * times, 8.0, 800)
        if not longer.same_signal(at):
            assert fitted.xyz(rgb, longer) == pytest.approx(plain.model.xyz(rgb) / times, rel=1e-9)


@given(st.permutations(range(24)), st.sampled_from(FORMS))
@settings(deadline=None, max_examples=3)
def test_the_order_of_patches_does_not_matter(order: list[int], form: Form) -> None:
    names, xyY = colorchecker_xyY()
    XYZ = XYZ_from_xyY(xyY) * 100
    rgb = 0.5 * XYZ / 100 * (1 + 0.004 * np.random.default_rng(3).standard_normal(XYZ.shape))
    rgb[3] *= 1.7  # an outlier
    rows = np.array(order)
    plain = fit_camera(Correspondences(rgb, XYZ, names, rgb > 1), form)
    mixed = fit_camera(Correspondences(rgb[rows], XYZ[rows], tuple(names[i] for i in rows), rgb > 1), form)
    assert mixed.model.matrix == pytest.approx(plain.model.matrix, rel=1e-8, abs=1e-8)
    assert {patch.name for patch in mixed.left_out} == {patch.name for patch in plain.left_out} == {names[3]}
    assert mixed.patches[order.index(5)].delta_e == pytest.approx(plain.patches[5].delta_e, abs=1e-8)


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
    zone = found.model.safe_luminance_cd_m2
    assert zone is not None
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
        assert found.held_out is not None
        assert 0.3 < found.fitted.mean < found.held_out.mean < 3


def test_repeated_rows_leave_more_colours_than_needed(seen: See) -> None:
    colours = seen(rows=[0, 1, 2, 3, 14, 18, 18])
    found = fit_camera(colours)
    assert found.held_out is not None
    assert found.held_out.patches == 7


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
