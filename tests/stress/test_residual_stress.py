"""The residual pushed to its edges: many displays undone and shown, and figures that fresh colours bear out."""

from __future__ import annotations

import numpy as np
import pytest

from devices.characterise.choose import characterise
from devices.characterise.figures import differences
from devices.characterise.patches import patches
from devices.display import Plvc
from devices.errors import DeviceError
from devices.readings import Measurements
from tests.devices.characterise.test_residual_fit import CODES, FRESH
from tests.devices.display.test_residual import smooth
from tests.example_displays import noisy

pytestmark = pytest.mark.stress


def display(seed: int) -> Plvc:
    """Return a random display: how large its residual is, how many knots it has and how wide they are."""
    rng = np.random.default_rng(seed)
    count = int(rng.integers(1, 49))
    return smooth(seed, 10 ** rng.uniform(-3.0, 0.5) / count**0.5, count, float(rng.uniform(0.1, 3.0)))


def refused(model: Plvc) -> bool:
    """Return whether ``model`` cannot be undone."""
    try:
        return not model.steps
    except DeviceError as error:
        return "cannot be undone" in str(error)


def test_many_displays_are_undone_everywhere_or_refused() -> None:
    served = 0
    for seed in range(40):
        model = display(seed)
        if refused(model):
            continue
        served += 1
        rng = np.random.default_rng(seed)
        T = np.concatenate(
            [rng.uniform(0, 1, (300, 3)), 10 ** rng.uniform(-8, 0, (300, 3)), rng.uniform(-0.5, 1.5, (300, 3))]
        )
        found, _ = model.newton(model.in_primaries(model.xyz_of_linear(T)), model.steps)
        np.testing.assert_allclose(found, T, atol=1e-9)
    assert 10 < served < 40


@pytest.mark.parametrize("seed", range(6))
def test_held_out_figures_foretell_fresh_colours(seed: int) -> None:
    model = smooth(seed, 0.01 if seed % 2 else 0.003, 12, 0.875)
    found = characterise(Measurements(CODES, noisy(model.xyz(CODES), 0.001, seed)))
    fresh = patches(FRESH, model.xyz(FRESH), white=found.patches.white)
    assert found.chosen.held_out.mean <= 0.5
    assert differences(found.chosen.model, fresh).mean() <= 1.3 * found.chosen.held_out.mean
