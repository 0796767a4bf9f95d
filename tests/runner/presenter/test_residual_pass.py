"""The colour pass on displays with a residual, drawn at random, read back on EGL, against float64."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from devices.compensation import Correction, Crosstalk, cancel_crosstalk
from devices.display import EyeModels
from runner.presenter import ColourPass
from runner.presenter.colour_pass import channel_interaction
from runner.presenter.compensated_pass import CompensatedPass
from runner.presenter.depth import Bits
from runner.presenter.surfaces.egl import EglSurface
from tests.devices.display.test_residual import smooth
from tests.runner.presenter.test_plvc_pass import plvc, read, upload

pytestmark = pytest.mark.usefixtures("each_arithmetic")


@settings(max_examples=4, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture], derandomize=True)
@given(
    seed=st.integers(0, 10**6),
    size=st.floats(0, 0.02),
    count=st.integers(1, 48),
    width=st.floats(0.3, 2.0),
    bits=st.sampled_from([8, 10]),
)
def test_displays_at_random_are_within_rounding(
    egl: EglSurface, seed: int, size: float, count: int, width: float, bits: Bits
) -> None:
    model = smooth(seed, size / count**0.5, count, width)
    if model.clashes():
        return
    rng = np.random.default_rng(seed)
    T = np.concatenate(
        [rng.uniform(0, 1, (300, 3)), 10 ** rng.uniform(-8, 0, (300, 3)), rng.uniform(-0.3, 1.3, (25, 3))]
    )
    asked = model.xyz_of_linear(T).astype(np.float32).reshape(25, 25, 3)
    expected = model.code(asked.astype(np.float64))
    run = ColourPass(egl.context, model, bits=bits)
    off = np.abs(read(run.run(upload(egl, asked), "f4")) - expected).max() * (2**bits - 1)
    run.release()
    assert off < 0.001  # before rounding, so that codes are within 0.501


def test_codes_are_within_half_a_code(egl: EglSurface) -> None:
    model = smooth()
    T = np.random.default_rng(5).uniform(0, 1, (400, 3))
    asked = model.xyz_of_linear(T).astype(np.float32).reshape(20, 20, 3)
    expected = 255 * model.code(asked.astype(np.float64))
    assert np.abs(read(ColourPass(egl.context, model).run(upload(egl, asked)), "f1") - expected).max() <= 0.501


def test_without_the_residual_codes_are_others(egl: EglSurface) -> None:
    model = smooth()
    asked = model.xyz_of_linear(np.random.default_rng(5).uniform(0, 1, (100, 3))).astype(np.float32).reshape(10, 10, 3)
    texels = channel_interaction(model).tables["plvc_residual"]
    run = ColourPass(egl.context, model)
    table = run._pass._tables[0]
    assert table.size == (texels.shape[1], 2)
    table.write(np.zeros_like(texels).tobytes())
    off = np.abs(read(run.run(upload(egl, asked), "f4")) - model.code(asked.astype(np.float64))).max() * 255
    assert off > 1


# The shader takes a driver long to compile for each arithmetic.
@pytest.mark.parametrize(
    "each_arithmetic", ["two-floats", pytest.param("doubles", marks=pytest.mark.stress)], indirect=True
)
def test_one_eye_may_have_a_residual_and_the_other_none(egl: EglSurface) -> None:
    models = EyeModels(smooth(2), plvc())
    correction = Correction(Crosstalk(np.eye(3) * 0.03, np.eye(3) * 0.02), None)
    assert correction.crosstalk is not None
    rng = np.random.default_rng(3)
    asked = [
        m.xyz_of_linear(rng.uniform(0.1, 0.9, (225, 3))).astype(np.float32).reshape(15, 15, 3)
        for m in (models.left, models.right)
    ]
    done = cancel_crosstalk(models, correction.crosstalk, asked[0], asked[1])
    for eye, model, linear in (("left", models.left, done.left_linear), ("right", models.right, done.right_linear)):
        own, other = asked if eye == "left" else asked[::-1]
        run = CompensatedPass(egl.context, models, correction, eye)  # type: ignore[arg-type]  # one of its words
        expected = model.code(model.black_XYZ_cd_m2 + linear @ model.primaries_XYZ_cd_m2.T)
        assert np.abs(read(run.run(upload(egl, own), upload(egl, other), dtype="f4")) - expected).max() * 255 < 0.001
