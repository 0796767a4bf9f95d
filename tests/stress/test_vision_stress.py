"""Cone contrasts, adaptation and contrast sensitivity at the edges: dark and bright, near whites and far, any field."""

from __future__ import annotations

import itertools
from typing import get_args

import numpy as np
import pytest

from devices.colour import WHITE_POINTS_XYZ, adaptation_matrix
from devices.colour.adaptation import AdaptationMethod
from devices.colour_matching import cone_contrasts, dkl_from_xyz, xyz_of_cone_contrasts, xyz_of_dkl
from devices.display import FinestDetail, contrast_sensitivity, finest_visible

pytestmark = pytest.mark.stress


@pytest.mark.parametrize("field", [1.0, 2.0, 4.7, 10.0])
@pytest.mark.parametrize("age", [20.0, 32.0, 80.0])
def test_cones_of_any_observer_there_and_back(field: float, age: float) -> None:
    observer = f"CIE 2006 {field:g} age {age:g}"
    rng = np.random.default_rng(int(10 * field + age))
    for scale in (1e-4, 1.0, 1e4):
        background = scale * np.array([0.95, 1.0, 1.09]) * rng.uniform(0.8, 1.2, 3)
        lights = background * rng.uniform(0.0, 4.0, (500, 3))
        contrasts = cone_contrasts(lights, background, observer)
        real = lights[(contrasts >= -1).all(axis=1)]
        assert len(real) > 100
        back = xyz_of_cone_contrasts(cone_contrasts(real, background, observer), background, observer)
        np.testing.assert_allclose(back, real, rtol=0, atol=1e-12 * scale * 10)
        back = xyz_of_dkl(dkl_from_xyz(real, background, observer), background, observer)
        np.testing.assert_allclose(back, real, rtol=0, atol=1e-12 * scale * 10)


@pytest.mark.parametrize("method", get_args(AdaptationMethod))
def test_degrees_between_none_and_complete(method: AdaptationMethod) -> None:
    """Linear in the degree; what lies between two whites goes from the one to the other without turning back."""
    for before, after in itertools.permutations(WHITE_POINTS_XYZ.values(), 2):
        none, full = (adaptation_matrix(before, after, method, degree) for degree in (0.0, 1.0))
        np.testing.assert_allclose(none, np.eye(3), rtol=0, atol=1e-13)
        for degree in np.linspace(0, 1, 21):
            between = adaptation_matrix(before, after, method, float(degree))
            np.testing.assert_allclose(between, (1 - degree) * none + degree * full, rtol=0, atol=1e-12)


def test_contrast_sensitivity_over_all_light() -> None:
    frequencies, light, fields = np.geomspace(1e-3, 1e3, 200), np.geomspace(1e-6, 1e6, 60), np.geomspace(0.01, 180, 20)
    found = contrast_sensitivity(frequencies[:, None, None], light[:, None], fields)
    assert np.isfinite(found).all()
    assert (found >= 0).all()
    for luminance in light:
        finest = finest_visible(float(luminance))
        assert 0 <= finest < 100
    for density in np.geomspace(0.5, 500, 30):
        for white in (0.01, 1.0, 100.0, 1e4):
            assert len(FinestDetail.of(float(density), white).sentences()) == 2


def test_acuity_rises_with_light() -> None:
    acuity = [finest_visible(float(light)) for light in np.geomspace(1e-3, 1e4, 30)]
    assert all(np.diff(acuity) > 0)
