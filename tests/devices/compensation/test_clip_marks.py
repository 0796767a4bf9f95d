"""Marks stand exactly where the ledger counts."""

import numpy as np

from devices.compensation import clip_marks
from devices.display import DisplayModel, ToneCurve


def _model() -> DisplayModel:
    curve = ToneCurve(gamma=2.2)
    return DisplayModel(np.zeros(3), np.array([[40.0, 35, 18], [20, 70, 7], [2, 11, 95]]), (curve, curve, curve))


def test_marks_are_red_above_blue_below_and_grey_inside() -> None:
    model = _model()
    linear = np.array([[[0.5, 0.5, 0.5], [1.5, 0.5, 0.5]], [[-0.2, 0.5, 0.5], [1.5, -0.2, 0.5]]])
    codes = model.code(clip_marks(model, linear @ model.primaries_XYZ_cd_m2.T))
    assert np.allclose(codes[0, 1], [1, 0, 0], atol=1e-3)
    assert np.allclose(codes[1, 0], [0, 0, 1], atol=1e-3)
    assert np.allclose(codes[1, 1], [1, 0, 1], atol=1e-3)
    assert np.ptp(codes[0, 0]) < 1e-3
    assert 0.1 < codes[0, 0, 0] < 0.9


def test_as_many_marks_as_the_ledger_counts() -> None:
    model = _model()
    linear = np.random.default_rng(0).uniform(-0.1, 1.2, (40, 50, 3))
    xyz = linear @ model.primaries_XYZ_cd_m2.T
    codes = model.code(clip_marks(model, xyz))
    marked = (np.ptp(codes, axis=-1) > 0.5).sum()
    assert marked == model.clipping(xyz).any_channel
