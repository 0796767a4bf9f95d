"""The 24 colours asked of a display: the chart's own, adapted, and inside the gamut."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

from devices.colour import XYZ_from_xyY, xyY_from_XYZ
from devices.display import DisplayModel, ToneCurve
from devices.patches import asked_of, colorchecker_xyY

SRGB = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]]) * 100.0
NARROW = np.array([[10.83, 9.67, 5.68], [5.62, 18.65, 2.20], [0.54, 1.63, 29.18]])


def _model(primaries: np.ndarray, gain: float = 1.0, lift: float = 0.0, black: float = 0.1) -> DisplayModel:
    curve = ToneCurve(gain, 0.0, 2.2, lift)
    return DisplayModel(np.full(3, black), primaries, (curve, curve, curve))


def test_the_colours_are_those_of_colour_science() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        import colour
    chart = colour.CCS_COLOURCHECKERS["ColorChecker24 - After November 2014"]
    names, xyY = colorchecker_xyY()
    assert [name.split("(")[0].strip().lower() for name in chart.data] == list(names)
    np.testing.assert_allclose(xyY, np.array(list(chart.data.values())), atol=1e-6)


@pytest.mark.parametrize("gain", [0.95, 1.0, 1.08])
@pytest.mark.parametrize("lift", [0.0, 0.01])
@pytest.mark.parametrize("primaries", [SRGB, NARROW], ids=["srgb", "narrow"])
def test_every_colour_lies_in_the_gamut(primaries: np.ndarray, gain: float, lift: float) -> None:
    model = _model(primaries, gain, lift)
    asked = asked_of(model)
    assert len(asked) == 24
    XYZ = np.array([colour.XYZ_cd_m2 for colour in asked])
    np.testing.assert_allclose(model.xyz(model.code(XYZ)), XYZ, rtol=1e-9)


def test_an_srgb_display_lacks_only_the_cyan() -> None:
    assert [colour.name for colour in asked_of(_model(SRGB, black=0.0)) if colour.desaturated] == ["cyan"]


def test_colours_that_fit_keep_the_charts_chromaticity_adapted_as_colour_science_does() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        from colour.adaptation import chromatic_adaptation_VonKries
    model = _model(SRGB, black=0.0)
    _, xyY = colorchecker_xyY()
    white = model.white_XYZ_cd_m2
    d50 = XYZ_from_xyY([0.345703, 0.358539, 1.0])
    expected = chromatic_adaptation_VonKries(XYZ_from_xyY(xyY), d50, white / white[1], transform="Bradford")
    for colour_, theirs in zip(asked_of(model), expected, strict=True):
        if not colour_.desaturated:
            np.testing.assert_allclose(xyY_from_XYZ(colour_.XYZ_cd_m2)[:2], xyY_from_XYZ(theirs)[:2], atol=2e-5)
            np.testing.assert_allclose(colour_.XYZ_cd_m2[1] / white[1], theirs[1], rtol=2e-4)


def test_a_desaturated_colour_keeps_its_luminance() -> None:
    model = _model(NARROW, black=0.0)
    asked = {colour.name: colour for colour in asked_of(model)}
    names, xyY = colorchecker_xyY()
    cyan, white = asked["cyan"], asked["white 9.5"]
    assert cyan.desaturated
    ratio = xyY[names.index("cyan"), 2] / xyY[names.index("white 9.5"), 2]
    # Bradford's transform moves luminances of colours a little.
    assert cyan.XYZ_cd_m2[1] / white.XYZ_cd_m2[1] == pytest.approx(ratio, rel=0.06)
