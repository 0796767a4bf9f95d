"""A display model of tables, through the fragment shader: within a hundredth of a code of float64."""

from __future__ import annotations

import numpy as np
import pytest

from devices.display import DisplayModel, TableCurve
from runner.presenter import ColourPass
from runner.presenter.colour_pass import release_codes
from runner.presenter.surfaces.egl import EglSurface

pytestmark = pytest.mark.usefixtures("each_arithmetic")


def test_tables_reach_the_framebuffer_exactly(egl: EglSurface) -> None:
    x = np.linspace(0, 1, 27)
    light = x**2.3 * 1.3 / (1 + 0.3 * x**3)
    curve = TableCurve(tuple(x.tolist()), tuple((light / light[-1]).tolist()))
    matrix = np.array([[41.2, 35.8, 18.0], [21.3, 71.5, 7.2], [1.9, 11.9, 95.0]])
    model = DisplayModel(np.array([0.09, 0.1, 0.13]), matrix, (curve, curve, curve))
    asked = np.random.default_rng(1).uniform(0, 1, (64, 64, 3))
    XYZ = np.ascontiguousarray(model.xyz(asked), dtype=np.float32)
    colour_pass = ColourPass(egl.context, model)
    uploaded = egl.context.texture((64, 64), 3, XYZ.tobytes(), alignment=1, dtype="f4")
    computed = colour_pass.run(uploaded, dtype="f4")
    codes = np.frombuffer(computed.read(components=3, dtype="f4"), np.float32).reshape(64, 64, 3)[::-1] * 255.0
    exact = model.code(XYZ.astype(np.float64)) * 255.0
    assert np.abs(codes - exact).max() < 0.01  # a cubic between entries of the presenter's table
    assert np.abs(np.round(codes) - exact).max() <= 0.51
    release_codes(computed)
    uploaded.release()
    colour_pass.release()
