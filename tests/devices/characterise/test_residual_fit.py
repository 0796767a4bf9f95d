"""The residual is chosen where it helps and nowhere else, and what is left out is what a fit without it leaves."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from devices.characterise import residual_fit, table_c1_codes
from devices.characterise.choose import characterise
from devices.characterise.cross_validation import fit_all
from devices.characterise.figures import differences
from devices.characterise.patches import patches
from devices.characterise.residual_fit import fit_curves_too, fit_residual, knots_among
from devices.display import Plvc
from devices.readings import Measurements
from tests.devices.display.test_residual import smooth
from tests.example_displays import liquid_crystal_XYZ, noisy

CODES = np.concatenate([table_c1_codes(), np.random.default_rng(0).integers(0, 256, (40, 3)) / 255])
FRESH = np.random.default_rng(9).uniform(0, 1, (300, 3))


@pytest.mark.nightly
def test_it_is_chosen_where_it_helps_and_keeps_what_it_promises() -> None:
    model = smooth(2, 0.02, 8)
    found = characterise(Measurements(CODES, noisy(model.xyz(CODES), 0.001, 1)))
    held = {candidate.name: candidate.held_out.mean for candidate in found.candidates}
    assert found.chosen.name == "residual"
    assert held["residual"] <= 0.5
    assert held["residual"] < held["plvc"] - 0.05
    fresh = patches(FRESH, model.xyz(FRESH), white=found.patches.white)
    assert differences(found.chosen.model, fresh).mean() <= 1.2 * held["residual"]
    assert found.chosen.table_error_codes is not None
    assert found.chosen.inversion_error_codes is not None
    assert found.chosen.inversion_error_codes < 1e-6


@pytest.mark.nightly
def test_it_is_not_chosen_where_it_does_not_help() -> None:
    """Nor on an additive display: see `test_choose`."""
    found = characterise(Measurements(CODES, noisy(liquid_crystal_XYZ(CODES), 0.002, 0)))
    assert found.chosen.name != "residual"


def test_what_is_left_out_is_what_the_fit_without_it_leaves() -> None:
    rng = np.random.default_rng(1)
    J, target, penalty = rng.normal(size=(60, 12)), rng.normal(size=60), 0.3 * np.eye(12)
    quick = residual_fit._left_out(J, target, penalty).reshape(-1, 3)
    for row in range(20):
        own = np.arange(3 * row, 3 * row + 3)
        rest = np.setdiff1d(np.arange(60), own)
        without = np.linalg.solve(J[rest].T @ J[rest] + penalty, J[rest].T @ target[rest])
        np.testing.assert_allclose(quick[row], target[own] - J[own] @ without, atol=1e-10)


def test_the_normal_equations_are_those_of_the_columns() -> None:
    rng = np.random.default_rng(1)
    A, target, functions = rng.normal(size=(40, 3, 3)), rng.normal(size=120), rng.normal(size=(40, 7))
    J = residual_fit._columns(A, functions)
    normal, wanted = residual_fit._normal_equations(A, target, functions)
    np.testing.assert_allclose(normal, J.T @ J, atol=1e-12)
    np.testing.assert_allclose(wanted, J.T @ target, atol=1e-12)


def test_knots_are_readings_far_from_each_other() -> None:
    light = np.random.default_rng(2).uniform(0, 1, (200, 3))
    knots = knots_among(light, 12)
    apart = np.linalg.norm(knots[:, None] - knots[None], axis=2) + np.eye(12)
    assert apart.min() > 0.25
    assert len(knots_among(light[:3], 12)) == 3
    np.testing.assert_array_equal(knots, np.round(1024 * knots) / 1024)


@pytest.mark.nightly
def test_a_model_that_cannot_be_undone_is_passed_over_for_a_stiffer_one(monkeypatch: pytest.MonkeyPatch) -> None:
    data = patches(CODES, noisy(smooth(2, 0.02, 8).xyz(CODES), 0.001, 1))
    plvc = fit_all(data, {}, residual=False)["plvc"]
    assert isinstance(plvc.model, Plvc)
    free, _ = fit_residual(data, plvc.model, plvc.free_numbers)
    tried: list[Plvc] = []

    def clashes(model: Plvc, steps: int = 13) -> int:
        tried.append(model)
        return 1 if len(tried) == 1 else 0

    monkeypatch.setattr(Plvc, "clashes", clashes)
    other, _ = fit_residual(data, plvc.model, plvc.free_numbers)
    assert len(tried) == 3
    assert tried[1] is tried[2] is not tried[0]
    assert np.abs(other.xyz(FRESH) - free.xyz(FRESH)).max() > 0


def test_plvc_is_found_again_where_its_curves_are_fitted_along() -> None:
    model = replace(smooth(2), residual=None)
    data = patches(CODES, noisy(model.xyz(CODES), 0.001, 1))
    fresh = patches(FRESH, model.xyz(FRESH), white=data.white)
    fit = fit_all(data, {}, residual=False)["plvc"]
    assert fit.before is not None
    assert differences(fit.model, fresh).mean() < 0.6 * differences(fit.before, fresh).mean()


def test_curves_are_not_fitted_along_where_that_could_not_be_undone(monkeypatch: pytest.MonkeyPatch) -> None:
    data = patches(CODES, noisy(smooth(2).xyz(CODES), 0.001, 1))
    before = fit_all(data, {}, residual=False)["plvc"].before
    assert before is not None
    monkeypatch.setattr(Plvc, "clashes", lambda model: 1)
    assert fit_curves_too(data, before) is before
