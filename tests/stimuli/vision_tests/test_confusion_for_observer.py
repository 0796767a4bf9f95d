"""Confusion lines of another colorimetric observer than CIE 1931 2° follow from that observer's cone fundamentals."""

from __future__ import annotations

from typing import get_args

import numpy as np
import pytest

from devices.colour_matching import cone_fundamentals
from devices.display import DisplayModel, EyeModels, ToneCurve
from devices.measurements import xyz_from_spectra
from documents import InputError
from runner.blocks.screening.colour_vision import ColourVisionSpec
from runner.blocks.screening.vision_test import Screen
from stimuli.vision_tests import COPUNCTAL_XY, Axis, copunctal_xy
from stimuli.vision_tests.confusion_plates import confused

WAVES = np.arange(390.0, 831.0)
AXES: tuple[Axis, ...] = get_args(Axis)


def _model(observer: str) -> DisplayModel:
    spectra = np.stack([np.exp(-(((WAVES - mid) / 25) ** 2)) for mid in (620, 535, 460)]) * 2e-3
    curve = ToneCurve(1.0, 0.0, 2.2)
    return DisplayModel(np.zeros(3), xyz_from_spectra(spectra, WAVES, observer).T, (curve, curve, curve))


def test_points_of_cie_2015_follow_from_the_published_matrix() -> None:
    """LMS to XYZ for 2°, as CIE 170-2:2015 prints it."""
    matrix = np.array([[1.94735469, -1.41445123, 0.36476327], [0.68990272, 0.34832189, 0.0], [0.0, 0.0, 1.93485343]])
    points = copunctal_xy("CIE 2015 2")
    np.testing.assert_allclose([points[axis] for axis in AXES], (matrix / matrix.sum(axis=0))[:2].T, atol=2e-4)
    assert copunctal_xy("CIE 1931 2") == COPUNCTAL_XY


@pytest.mark.parametrize(
    ("observer", "field_deg", "age"), [("CIE 2015 10", 10.0, 32.0), ("CIE 2006 4 age 65", 4.0, 65.0)]
)
def test_the_cones_that_a_dichromat_has_answer_alike(observer: str, field_deg: float, age: float) -> None:
    """XYZ of spectra give their LMS by least squares; ring and ground differ in those of the missing cones alone."""
    waves, lms = cone_fundamentals(field_deg, age)
    spectra = np.random.default_rng(1).uniform(0, 1, (50, len(waves)))
    XYZ = xyz_from_spectra(spectra, waves, observer)
    to_lms = np.linalg.lstsq(XYZ, spectra @ lms, rcond=None)[0]
    for missing, axis in enumerate(AXES):
        ground = XYZ[0]
        ring = confused(axis, ground, 0.03, copunctal_xy(observer))
        change = np.abs((ring @ to_lms) / (ground @ to_lms) - 1)
        assert change[missing] > 0.01
        assert np.delete(change, missing).max() < 1e-4
        plain = np.abs((confused(axis, ground, 0.03) @ to_lms) / (ground @ to_lms) - 1)
        assert np.delete(plain, missing).max() > 10 * np.delete(change, missing).max()


def test_an_observer_without_cone_fundamentals_has_none() -> None:
    with pytest.raises(InputError, match="CIE 1964 10 has no cone fundamentals") as caught:
        copunctal_xy("CIE 1964 10")
    assert len(caught.value.findings) == 1


def test_the_screening_takes_the_points_of_the_rigs_observer() -> None:
    spec = ColourVisionSpec(test="colour_vision", axes=("protan",))
    for observer in ("CIE 1931 2", "CIE 2015 10"):
        models = EyeModels(_model(observer), _model(observer))
        screen = Screen((960, 1080), 0.2768, 700.0, 65.0, (1, 1), models, observer)
        assert spec.make(screen, "a").facts["copunctal_xy"] == {"protan": list(copunctal_xy(observer)["protan"])}
