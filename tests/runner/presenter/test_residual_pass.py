"""The colour pass on displays with a residual, drawn at random, read back on EGL, against float64."""

from __future__ import annotations

import numpy as np
import pytest

from devices.compensation import Correction, cancel_crosstalk
from devices.display import Crosstalk, EyeModels
from runner.presenter.compensated_pass import CompensatedPass
from runner.presenter.surfaces.egl import EglSurface
from tests.devices.display.test_model import smooth
from tests.runner.presenter.test_plvc_pass import plvc, read, upload

pytestmark = pytest.mark.usefixtures("each_arithmetic")


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
