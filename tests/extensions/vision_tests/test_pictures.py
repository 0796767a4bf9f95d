"""Confusion plates, Landolt rings and random-dot stereograms: what they show is what was asked."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from devices.colour_matching import cone_fundamentals
from devices.display import DisplayModel, EyeModels, ToneCurve
from devices.readings import xyz_from_spectra
from documents import InputError
from documents.arrays import Floats
from extensions.vision_tests import (
    AXES,
    COPUNCTAL_XY,
    SCALES,
    SIDES,
    Axis,
    ConfusionPlate,
    DotField,
    Screen,
    ShownRange,
    Side,
    copunctal_xy,
    landolt,
    stereogram,
)
from extensions.vision_tests.colour_vision import ColourVisionSpec
from extensions.vision_tests.confusion_plates import GROUND_SHARE, confused, missing_light, packed, uv_from_XYZ
from extensions.vision_tests.optotypes import in_ring, ring_coverage
from extensions.vision_tests.random_dots import spots, views
from stimuli.errors import StimulusError
from tests.extensions.vision_tests.conftest import measured_px, model

# Plates: dichromats see no ring, others see one as far off as was asked, and nothing leaves the gamut.

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
    plate = ConfusionPlate(120, shown)
    for axis in AXES:
        for delta_uv in (0.02, -0.02):
            assert plate.can_show(axis, delta_uv)
            drawn = plate.draw("up", plate.colour(axis, delta_uv), "s")
            for eye in (shown.models.left, shown.models.right):
                assert eye.clipping(drawn.left).any_channel == 0


@pytest.mark.parametrize("axis", AXES)
def test_no_pixel_of_a_plate_tells_a_dichromat_where_the_ring_is(axis: Axis) -> None:
    """The plate of one seed with the ring coloured, and with a ring like the ground: the same to the dichromat."""
    plate = ConfusionPlate(200, ALIKE)
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
    plate = ConfusionPlate(200, ALIKE)
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
    places, _, in_figure = ConfusionPlate(300, ALIKE).dots(side, "s")
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
    assert not ConfusionPlate(100, ALIKE).can_show("protan", 0.5)


def test_around_the_plate_the_screen_is_black() -> None:
    plate = ConfusionPlate(120, ALIKE)
    corner = plate.draw("up", plate.colour("tritan", 0.02), "s").left[:5, :5]
    assert np.all(np.round(255 * ONE.code(corner)) == 0)


def test_the_light_of_a_plate_is_that_of_its_dots() -> None:
    """Each disc has the light of its area: drawn by coverage, the sum over the picture is right to a hundredth."""
    plate = ConfusionPlate(240, ALIKE)
    _, radii, _ = plate.dots("up", "s")
    picture = plate.draw("up", plate.ground_XYZ, "s").left[:, :, 1].astype(np.float64)
    rng = np.random.default_rng(np.frombuffer(b"s/light", dtype=np.uint8))
    light = rng.choice(SCALES, len(radii)) * plate.ground_XYZ[1]
    black = ALIKE.black_XYZ_cd_m2[1]
    expected = float(np.sum(np.pi * radii**2 * (light - black)))
    assert float((picture - black).sum()) == pytest.approx(expected, rel=0.01)
    assert plate.ground_XYZ == pytest.approx(ALIKE.grey(GROUND_SHARE))


# Landolt rings have the size that they should, at any size.

# Of a ring with gap 1: from radius 1.5 to 2.5, less what a strip of width 1 cuts out of it on one side.
_CHORD = [0.5 * (0.5 * np.sqrt(radius**2 - 0.25) + radius**2 * np.arcsin(0.5 / radius)) * 2 for radius in (1.5, 2.5)]
AREA = np.pi * (2.5**2 - 1.5**2) - (_CHORD[1] - _CHORD[0])


@settings(max_examples=5, deadline=None)
@given(st.floats(1.0, 30.0), st.sampled_from(SIDES))
def test_it_covers_the_area_that_it_should(gap_px: float, side: Side) -> None:
    assert ring_coverage(gap_px, side).sum() == pytest.approx(AREA * gap_px**2, rel=0.005)


def test_a_pixel_is_covered_as_a_finer_count_says() -> None:
    covered = ring_coverage(2.3, "down")
    count, fine = len(covered), 100
    places = (np.arange(count * fine) + 0.5) / fine - count / 2
    slow = np.array(
        [
            [
                in_ring(
                    places[None, column * fine : (column + 1) * fine],
                    places[row * fine : (row + 1) * fine, None],
                    2.3,
                    "down",
                ).mean()
                for column in range(count)
            ]
            for row in range(count)
        ]
    )
    assert np.abs(covered - slow).max() < 0.02


def test_the_picture_is_dark_on_light_and_alike_for_both_eyes() -> None:
    ground, ring = np.array([19.0, 20.0, 23.0]), np.array([0.4, 0.5, 0.6])
    image = landolt(3.0, "up", 60, ground, ring)
    assert image.is_flat
    assert image.left.shape == (61, 61, 3)
    assert image.left[0, 0] == pytest.approx(ground, rel=1e-6)
    assert image.left.min(axis=(0, 1)) == pytest.approx(ring, rel=1e-5)
    dark = (ground - image.left.astype(np.float64)).sum(axis=(0, 1)) / (ground - ring)
    assert dark == pytest.approx([AREA * 9] * 3, rel=0.005)


@pytest.mark.nightly
@settings(max_examples=10, deadline=None)
@given(st.floats(1.0, 12.0))
@example(3.2)  # places of a finer grid lie on the ring's edges
def test_the_four_are_one_turned(gap_px: float) -> None:
    up, down, left, right = (ring_coverage(gap_px, side) for side in SIDES)
    assert np.array_equal(np.flipud(up), down)
    assert np.array_equal(np.fliplr(left), right)
    assert np.array_equal(up.T, left)


def test_at_the_smallest_size_the_gap_is_a_pixel() -> None:
    covered = ring_coverage(1.0, "right")
    middle = len(covered) // 2
    assert covered[middle, middle + 2] < 0.05
    for other in ((0, -2), (2, 0), (-2, 0)):
        assert covered[middle + other[0], middle + other[1]] > 0.95


# Random-dot stereograms: the parallax is what was asked, and one eye alone sees nothing of it.

FIELD = DotField(240, 64.0, 72.0, (1.0, 1.0), 2400)
GROUND, DOT = np.array([2.0, 2.1, 2.5]), np.array([19.0, 20.0, 24.0])


def seen_px(left: Floats, right: Floats, side: Side, about_px: float) -> float:
    """Measure the parallax of a square about its middle, clear of its edges in both views."""
    column, row = (round(place + len(left) / 2) for place in FIELD.middle_px(side))
    rows, patch = slice(row - 20, row + 20), slice(column - 20, column + 20)
    return measured_px(left[rows], right[rows], patch, about_px)


@pytest.mark.parametrize(
    ("side", "parallax_px"),
    [("down", -1.37), ("right", -0.13), ("left", 6.6)],
)
def test_the_parallax_is_what_was_asked_to_a_fiftieth_of_a_pixel(side: Side, parallax_px: float) -> None:
    left, right = views(FIELD, side, parallax_px, f"{side}{parallax_px}")
    for place in SIDES:
        found = seen_px(left, right, place, 0.0 if place != side else parallax_px)
        assert found == pytest.approx(parallax_px if place == side else 0.0, abs=0.02), place


def test_each_eye_has_half_of_it() -> None:
    still, same = views(FIELD, "left", 0.0, "s")
    assert np.array_equal(still, same)
    left, right = views(FIELD, "left", 3.0, "s")
    assert seen_px(still, left, "left", -1.5) == pytest.approx(-1.5, abs=0.02)
    assert seen_px(still, right, "left", 1.5) == pytest.approx(1.5, abs=0.02)


def test_spots_are_those_of_the_formula() -> None:
    """Against the plain product over all spots, without cutting them off."""
    rng = np.random.default_rng(3)
    places = rng.uniform(-30, 30, (60, 2))
    axis = np.arange(60) - 29.5
    dark = np.ones((60, 60))
    for x, y in places:
        dark *= 1.0 - np.exp(-0.5 * (((axis[None, :] - x) / 1.3) ** 2 + ((axis[:, None] - y) / 2.1) ** 2))
    assert np.abs(spots(places, (1.3, 2.1), 60) - (1.0 - dark)).max() < 0.012


def test_light_lies_between_ground_and_dot_and_the_seed_decides() -> None:
    image = stereogram(FIELD, "down", -1.5, GROUND, DOT, "a")
    for view in (image.left, image.right):
        assert view.shape == (240, 240, 3)
        assert view.dtype == np.float32
        assert np.all(view >= GROUND.astype(np.float32) - 1e-6)
        assert np.all(view <= DOT.astype(np.float32) + 1e-6)
    again, other = (stereogram(FIELD, "down", -1.5, GROUND, DOT, seed) for seed in ("a", "b"))
    assert np.array_equal(again.left, image.left)
    assert np.array_equal(again.right, image.right)
    assert not np.array_equal(other.left, image.left)


@pytest.mark.parametrize(("target", "offset"), [(64.0, 30.0), (64.0, 100.0)])
def test_squares_that_overlap_or_leave_the_field_are_refused(target: float, offset: float) -> None:
    with pytest.raises(StimulusError, match="four squares"):
        DotField(240, target, offset, (1.0, 1.0), 100)


@pytest.mark.nightly
def test_one_eye_alone_sees_the_same_dots_everywhere() -> None:
    """Mean and spread of one view, at the square, at its edges and elsewhere, over many stereograms."""
    squares, elsewhere, edges = [], [], []
    half, parallax_px = 32, 8.0
    for seed in range(60):
        _, right = views(FIELD, "up", parallax_px, str(seed))
        columns = 120 + np.arange(-half, half)
        squares.append(right[np.ix_(48 + np.arange(-half, half), columns + 4)].mean())
        elsewhere.append(right[np.ix_(192 + np.arange(-half, half), columns + 4)].mean())
        # Where the field comes to sight beside the square, and where it is hidden.
        edges.append(right[16:80, 120 - half - 4 : 120 - half + 4].mean())
        edges.append(right[16:80, 120 + half : 120 + half + 8].mean())
    mean = float(np.mean(elsewhere))
    assert np.mean(squares) == pytest.approx(mean, abs=4 * np.std(squares) / np.sqrt(60))
    assert np.mean(edges) == pytest.approx(mean, abs=4 * np.std(edges) / np.sqrt(120))
    assert np.std(squares) == pytest.approx(np.std(elsewhere), rel=0.5)
