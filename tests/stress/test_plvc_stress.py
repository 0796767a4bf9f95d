"""PLVC pushed to its edges: many displays, strong drift, steep and flat curves, colours far outside, huge pictures."""

from __future__ import annotations

import numpy as np
import pytest

from devices.display import Plvc, TableCurve
from devices.errors import DeviceError

pytestmark = pytest.mark.stress

PRIMARIES = np.array([[40.0, 35, 18], [20, 70, 7], [2, 11, 95]])


def display(seed: int) -> Plvc:
    """Return a random display: primaries' scale, black, curves, drift and mixtures all at random."""
    rng = np.random.default_rng(seed)
    primaries = PRIMARIES * 10 ** rng.uniform(-2, 2)
    curves = []
    for _ in range(3):
        codes = np.concatenate([[0.0], np.sort(rng.uniform(0.01, 0.99, rng.integers(1, 30))), [1.0]])
        codes = codes[np.concatenate([[True], np.diff(codes) > 1e-3])]
        codes[-1] = 1.0
        curves.append(TableCurve(tuple(codes), tuple(codes ** rng.uniform(1.2, 3.0))))
    bend, mixed = 10 ** rng.uniform(-3, -0.7, 2)
    own = primaries.T[:, np.newaxis] * (1.0 + bend * rng.uniform(-1, 1, (3, 4, 3)))
    mixtures = 0.3 * mixed * rng.uniform(-1, 1, (10, 3)) * primaries.sum(axis=1)
    black = primaries.sum(axis=1) * 10 ** rng.uniform(-6, -2)
    return Plvc(black, primaries, (curves[0], curves[1], curves[2]), own, mixtures)


def refused(model: Plvc) -> str:
    """Return why ``model`` is not served, empty if it is."""
    try:
        return "" if model.steps else "no steps"
    except DeviceError as error:
        return str(error)


def test_hundreds_of_displays_are_undone_everywhere_or_refused() -> None:
    served = 0
    for seed in range(300):
        model = display(seed)
        if why := refused(model):
            assert "cannot be undone" in why
            continue
        served += 1
        rng = np.random.default_rng(seed)
        T = np.concatenate([rng.uniform(0, 1, (300, 3)), 10 ** rng.uniform(-8, 0, (300, 3))])
        T = np.concatenate([T, rng.uniform(-0.5, 1.5, (300, 3))])
        found, _ = model.newton(model.in_primaries(model.xyz_of_linear(T)), model.steps)
        np.testing.assert_allclose(found, T, atol=1e-9)
        codes = np.maximum(rng.uniform(0, 1, (300, 3)), 0.05)
        assert np.abs(model.code(model.xyz(codes)) - codes).max() * 255 <= 1e-6
    assert 60 < served < 300


@pytest.mark.parametrize("far", [1e3, 1e9, 1e30, 1e300])
def test_colours_however_far_outside_have_finite_codes(far: float) -> None:
    model = next(m for m in map(display, range(50)) if not refused(m))
    XYZ = far * np.random.default_rng(1).uniform(-1, 1, (1000, 3))
    codes = model.code(XYZ)
    assert np.all((codes >= 0) & (codes <= 1))
    assert model.clipping(XYZ).any_channel == 1000
