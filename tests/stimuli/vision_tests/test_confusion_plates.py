"""Plates: dichromats see no ring, others see one as far off as was asked, and nothing leaves the gamut."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from devices.colour_matching import cone_fundamentals
from devices.display import DisplayModel, EyeModels, ToneCurve
from devices.readings import xyz_from_spectra
from documents import InputError
from runner.blocks.screening.colour_vision import ColourVisionSpec
from runner.blocks.screening.vision_test import Screen
from stimuli.errors import StimulusError
from stimuli.vision_tests import AXES, COPUNCTAL_XY, SCALES, SIDES, Axis, Plate, ShownRange, Side, copunctal_xy
from stimuli.vision_tests.confusion_plates import GROUND_SHARE, confused, missing_light, packed, uv_from_XYZ

PRIMARIES = np.array([[10.83, 9.67, 5.68], [5.62, 18.65, 2.20], [0.54, 1.63, 29.18]])


def model(black: float = 0.02, scale: tuple[float, float, float] = (1.0, 1.0, 1.0)) -> DisplayModel:
    curve = ToneCurve(gamma=2.2)
    return DisplayModel(np.array([black, black, 1.5 * black]), PRIMARIES * scale, (curve, curve, curve))


ONE = model()
ALIKE = ShownRange(EyeModels(ONE, ONE))
UNLIKE = ShownRange(EyeModels(ONE, model(0.08, (0.9, 1.0, 0.8))))


def cones_left(axis: Axis) -> np.ndarray:
    """Two functions of XYZ, (2, 3), that do not answer to the missing light: what a dichromat sees."""
    light = missing_light(axis)
    return np.linalg.svd(light[None, :])[2][1:]


@given(
    st.sampled_from(AXES),
    st.floats(-0.1, 0.1).filter(lambda d: abs(d) > 1e-4),
    st.floats(0.25, 0.4),
    st.floats(0.25, 0.4),
    st.floats(0.5, 100),
)
def test_confused_colours_are_one_to_the_dichromat_and_as_far_off_as_asked(
    axis: Axis, delta_uv: float, x: float, y: float, luminance: float
) -> None:
    ground = np.array([x / y, 1.0, (1 - x - y) / y]) * luminance
    try:
        colour = confused(axis, ground, delta_uv)
    except StimulusError:
        assert abs(delta_uv) > 0.02
        return
    assert cones_left(axis) @ colour == pytest.approx(cones_left(axis) @ ground, rel=1e-9, abs=1e-9 * luminance)
    moved = uv_from_XYZ(colour) - uv_from_XYZ(ground)
    assert np.hypot(*moved) == pytest.approx(abs(delta_uv), rel=1e-6)
    # On the line through the ground and the missing point in xy, towards the point where delta_uv is above 0.
    xy, ground_xy = (one[:2] / one.sum() for one in (colour, ground))
    towards = np.array(COPUNCTAL_XY[axis]) - ground_xy
    across = towards[0] * (xy - ground_xy)[1] - towards[1] * (xy - ground_xy)[0]
    assert across == pytest.approx(0.0, abs=1e-9)
    assert np.sign(towards @ (xy - ground_xy)) == np.sign(delta_uv)


def test_the_points_are_those_of_the_literature() -> None:
    """Wyszecki & Stiles 1982; a protanope's confusion line through white meets red, a tritanope's violet and yellow."""
    assert dict(COPUNCTAL_XY) == {"protan": (0.747, 0.253), "deutan": (1.080, -0.080), "tritan": (0.171, 0.0)}
    assert uv_from_XYZ([95.047, 100.0, 108.883]) == pytest.approx([0.19783, 0.46834], abs=1e-5)


def test_greys_and_plates_stay_within_the_gamut_of_both_eyes() -> None:
    shown = UNLIKE
    for share in np.linspace(0, 1, 11):
        assert shown.holds(shown.grey(share))
    assert not shown.holds(shown.grey(1.02))
    assert not shown.holds(shown.grey(-0.02))
    plate = Plate(120, shown)
    for axis in AXES:
        for delta_uv in (0.02, -0.02):
            assert plate.can_show(axis, delta_uv)
            drawn = plate.draw("up", plate.colour(axis, delta_uv), "s")
            for eye in (shown.models.left, shown.models.right):
                assert eye.clipping(drawn.left).any_channel == 0


@pytest.mark.parametrize("axis", AXES)
def test_no_pixel_of_a_plate_tells_a_dichromat_where_the_ring_is(axis: Axis) -> None:
    """The plate of one seed with the ring coloured, and with a ring like the ground: the same to the dichromat."""
    plate = Plate(200, ALIKE)
    ring = plate.draw("left", plate.colour(axis, 0.02), "s").left.astype(np.float64)
    none = plate.draw("left", plate.ground_XYZ, "s").left.astype(np.float64)
    assert np.abs((ring - none) @ cones_left(axis).T).max() < 1e-5 * none.max()
    assert np.abs(ring - none).max() > 0.01 * none.max()
    # Other dichromats and everyone else are sent a difference.
    for other in AXES:
        if other != axis:
            assert np.abs((ring - none) @ cones_left(other).T).max() > 1e-3 * none.max()


def test_lightness_tells_nothing_of_a_dot() -> None:
    """Every dot's light is scaled at random: the ring's mean luminance differs by less than the dots do by half."""
    plate = Plate(200, ALIKE)
    spread = float(np.std(SCALES))
    for axis in AXES:
        for delta_uv in (0.02, -0.02):
            ratio = plate.colour(axis, delta_uv)[1] / plate.ground_XYZ[1]
            assert abs(ratio - 1.0) < 0.3 * spread
    image = plate.draw("up", plate.ground_XYZ, "s").left
    places, _, in_figure = plate.dots("up", "s")
    scales = image[tuple(np.round(places + 99.5).astype(int).T[::-1])][:, 1] / plate.ground_XYZ[1]
    assert set(np.round(scales, 4)) == set(np.round(SCALES, 4))
    assert set(np.round(scales[in_figure], 4)) == set(np.round(SCALES, 4))


@pytest.mark.parametrize("side", SIDES)
def test_the_ring_has_its_gap_where_it_should(side: Side) -> None:
    places, _, in_figure = Plate(300, ALIKE).dots(side, "s")
    assert 0.15 < in_figure.mean() < 0.45
    ring = places[in_figure]
    middle = {"up": (0, -1), "down": (0, 1), "left": (-1, 0), "right": (1, 0)}
    count = {
        where: int(np.sum((ring @ towards > 0) & (np.abs(ring @ towards[::-1]) < 12)))
        for where, towards in middle.items()
    }
    assert count[side] == 0
    assert all(found > 0 for where, found in count.items() if where != side)


def test_dots_do_not_overlap_and_fill_the_plate() -> None:
    sizes = (9.0, 7.0, 5.0)
    places, radii = packed(150.0, sizes, 2.0, np.random.default_rng(1))
    apart = np.hypot(*(places[:, None, :] - places[None, :, :]).transpose(2, 0, 1))
    touching = radii[:, None] + radii[None, :] + 2.0
    np.fill_diagonal(apart, np.inf)
    assert np.all(apart >= touching - 1e-6)
    assert np.all(np.hypot(*places.T) + radii <= 150.0 + 1e-6)
    assert set(radii) == set(sizes)
    assert (radii**2).sum() / 150.0**2 > 0.35


WAVES = np.arange(390.0, 831.0)


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


def test_a_line_ends_where_its_colours_do() -> None:
    with pytest.raises(StimulusError, match="no colour lies"):
        confused("tritan", [10.0, 10.0, 10.0], 5.0)
    assert not Plate(100, ALIKE).can_show("protan", 0.5)


def test_around_the_plate_the_screen_is_black() -> None:
    plate = Plate(120, ALIKE)
    corner = plate.draw("up", plate.colour("tritan", 0.02), "s").left[:5, :5]
    assert np.all(np.round(255 * ONE.code(corner)) == 0)


def test_the_light_of_a_plate_is_that_of_its_dots() -> None:
    """Each disc has the light of its area: drawn by coverage, the sum over the picture is right to a hundredth."""
    plate = Plate(240, ALIKE)
    _, radii, _ = plate.dots("up", "s")
    picture = plate.draw("up", plate.ground_XYZ, "s").left[:, :, 1].astype(np.float64)
    rng = np.random.default_rng(np.frombuffer(b"s/light", dtype=np.uint8))
    light = rng.choice(SCALES, len(radii)) * plate.ground_XYZ[1]
    black = ALIKE.black_XYZ_cd_m2[1]
    expected = float(np.sum(np.pi * radii**2 * (light - black)))
    assert float((picture - black).sum()) == pytest.approx(expected, rel=0.01)
    assert plate.ground_XYZ == pytest.approx(ALIKE.grey(GROUND_SHARE))
