"""The error budget on displays drawn at random, of every kind of curve, in lit rooms, with leaks and uneven panels."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from devices.budget import Encoding, OwnPixels, Step
from devices.display import EYES, EyeModels
from tests.displays import corrections, eye_models
from tests.stress.how_many import how_many

pytestmark = pytest.mark.stress


@given(models=eye_models(), data=st.data())
@settings(max_examples=how_many(30, 150), suppress_health_check=list(HealthCheck), deadline=None)
def test_finer_tables_and_codes_never_cost_more_and_touch_no_other_step(models: EyeModels, data: st.DataObject) -> None:
    """Beyond the gamut, in the dark and at every light between: finite, at least 0, and each step by itself."""
    correction = data.draw(corrections((96, 64), lifts=models.left.additive and models.right.additive))
    dithered = data.draw(st.booleans())
    rng = np.random.default_rng(data.draw(st.integers(0, 2**31)))
    gains = None if correction.gain_map is None else rng.uniform(0.6, 1.1, 800)
    light = rng.uniform(-0.1, 1.2, (800, 3)) * 10.0 ** rng.uniform(-6.0, 0.0, (800, 1))
    asked = {eye: np.maximum(models.eye(eye).xyz_of_linear(light), 0.0) for eye in EYES}

    def costs(levels: int, entries: int) -> dict[Step, float]:
        path = OwnPixels(models, Encoding(levels, entries, dithered), correction, gains)
        found = path.differences(asked)
        assert all(np.isfinite(eyes[eye]).all() and (eyes[eye] >= 0.0).all() for eyes in found.values() for eye in EYES)
        return {step: float(np.mean([eyes[eye].mean() for eye in EYES])) for step, eyes in found.items()}

    fine, coarse_codes, coarse_table = costs(1023, 2048), costs(63, 2048), costs(1023, 16)
    assert coarse_codes[Step.CODES] >= fine[Step.CODES]
    assert coarse_table[Step.LOOK_UP_TABLE] >= fine[Step.LOOK_UP_TABLE] - 1e-9
    others = fine.keys() - {Step.CODES, Step.LOOK_UP_TABLE, Step.TOGETHER}
    assert all(fine[step] == coarse_codes[step] == coarse_table[step] for step in others)
