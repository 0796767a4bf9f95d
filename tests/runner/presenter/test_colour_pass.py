"""The shader against its NumPy twin, on a framebuffer of floats."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from devices.compensation import Correction, cancel_crosstalk
from devices.display import Crosstalk, DisplayModel, EyeModels, code_tables, table_codes
from runner.presenter import ColourPass, Dithering
from runner.presenter.colour_pass import release_codes
from runner.presenter.compensated_pass import CompensatedPass
from runner.presenter.surfaces.egl import EglSurface
from tests.choice import nightly
from tests.devices.display.test_model import smooth
from tests.runner.presenter.test_plvc_pass import plvc, read, upload

pytestmark = pytest.mark.usefixtures("each_arithmetic")

# Of one 8-bit code. Where a channel's light is zero but for the last bit of a double (1e-17), the two differ by
# 1e-17 ^ (1 / 2.9): 0.001 of a code. The table's first cell, below code 0.02, is 0.002 off the closed form at 2.9.
TWIN_TOLERANCE_CODES = 1.5e-3
CLOSED_FORM_TOLERANCE_CODES = 2.5e-3
CLOSED_FORM_TOLERANCE_ABOVE_A_QUARTER_CODES = 5e-4


@pytest.mark.parametrize(
    ("gamma", "black", "lift"), [(2.8, 0.0, 0.0), (1.6, 0.25, 2.0**-8), *nightly((2.2, 0.0, 0.0), (2.8, 0.25, 2.0**-8))]
)
def test_the_shader_computes_what_its_twin_computes(
    egl: EglSurface,
    model: Callable[..., DisplayModel],
    colour_ramps: Callable[[DisplayModel], NDArray[np.float32]],
    gamma: float,
    black: float,
    lift: float,
) -> None:
    display = model(gamma, black, lift)
    XYZ = colour_ramps(display)
    height, width, _ = XYZ.shape
    colour_pass = ColourPass(egl.context, display)
    uploaded = egl.context.texture((width, height), 3, XYZ.tobytes(), alignment=1, dtype="f4")
    computed = colour_pass.run(uploaded, dtype="f4")
    codes = np.frombuffer(computed.read(components=3, dtype="f4"), np.float32)
    codes = codes.reshape(height, width, 3)[::-1] * 255.0
    twin = table_codes(display, XYZ.astype(np.float64), code_tables(display)) * 255.0
    closed_form = display.code(XYZ) * 255.0
    assert np.abs(codes - twin).max() < TWIN_TOLERANCE_CODES
    assert abs((codes - twin).mean()) < 1e-5
    assert np.abs(codes - closed_form).max() < CLOSED_FORM_TOLERANCE_CODES
    assert np.abs(codes - closed_form)[closed_form > 0.25].max() < CLOSED_FORM_TOLERANCE_ABOVE_A_QUARTER_CODES
    assert codes.min() == 0.0
    assert codes.max() == pytest.approx(closed_form.max(), abs=1e-4)
    release_codes(computed)
    uploaded.release()
    colour_pass.release()


@pytest.mark.parametrize("gamma", [*nightly(1.6), 2.8])
def test_without_dithering_codes_are_rounded_and_nothing_else(
    egl: EglSurface,
    model: Callable[..., DisplayModel],
    colour_ramps: Callable[[DisplayModel], NDArray[np.float32]],
    gamma: float,
) -> None:
    """Bit for bit what the same pass computes before rounding; a dithered pass is another program and differs."""
    display = model(gamma, 0.1)
    XYZ = colour_ramps(display)
    height, width, _ = XYZ.shape
    uploaded = egl.context.texture((width, height), 3, XYZ.tobytes(), alignment=1, dtype="f4")
    plain = ColourPass(egl.context, display)
    computed = np.frombuffer(plain.run(uploaded, dtype="f4").read(components=3, dtype="f4"), np.float32)
    rounded = np.frombuffer(plain.run(uploaded).read(components=3, alignment=1), np.uint8)
    assert np.array_equal(rounded, np.floor(computed * np.float32(255.0) + np.float32(0.5)))
    dithered = ColourPass(egl.context, display, dithering=Dithering())
    codes = np.frombuffer(dithered.run(uploaded).read(components=3, alignment=1), np.uint8)
    assert np.count_nonzero(codes != rounded) > 0.05 * codes.size
    # Either side of the light, so at most one code from the nearest; a pass before and after leaves the other alone.
    assert np.abs(codes.astype(int) - rounded).max() == 1
    assert np.array_equal(np.frombuffer(plain.run(uploaded).read(components=3, alignment=1), np.uint8), rounded)


# The colour pass on displays with a residual, drawn at random, read back on EGL, against float64.


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
