"""Random-dot stereograms: the parallax is what was asked, and one eye alone sees nothing of it."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from documents.arrays import Floats
from stimuli.errors import StimulusError
from stimuli.vision_tests import SIDES, DotField, Side, stereogram
from stimuli.vision_tests.random_dots import spots, views

FIELD = DotField(240, 64.0, 72.0, (1.0, 1.0), 2400)
GROUND, DOT = np.array([2.0, 2.1, 2.5]), np.array([19.0, 20.0, 24.0])


def shifted(view: Floats, by_px: float) -> Floats:
    """Move a view to the right, by its Fourier transform."""
    frequency = np.fft.rfftfreq(view.shape[1])
    turned = np.fft.rfft(view, axis=1) * np.exp(-2j * np.pi * frequency * by_px)
    return np.fft.irfft(turned, view.shape[1], axis=1)


def measured_px(left: Floats, right: Floats, middle: tuple[float, float], half: int, about_px: float) -> float:
    """Measure how far right of the left eye's the right eye's patch of ``half`` about ``middle`` is, to 0.001 px."""
    column, row = (round(place + left.shape[0] / 2) for place in middle)
    left, right = left[row - half : row + half], right[row - half : row + half]
    area = np.s_[:, column - half : column + half]
    patch = left[area] - left[area].mean()

    def unlike(parallax_px: float) -> float:
        # Half of it each way, so that neither view is favoured.
        first, second = shifted(left, parallax_px / 2)[area], shifted(right, -parallax_px / 2)[area]
        return float(((first - second) ** 2).sum() / (patch**2).sum())

    low, high = about_px - 1.5, about_px + 1.5
    for _ in range(4):
        tries = np.linspace(low, high, 13)
        best = tries[int(np.argmin([unlike(one) for one in tries]))]
        step = tries[1] - tries[0]
        low, high = best - step, best + step
    return float(best)


@pytest.mark.parametrize(
    ("side", "parallax_px"),
    [("down", -1.37), ("right", -0.13), ("left", 6.6)],
)
def test_the_parallax_is_what_was_asked_to_a_fiftieth_of_a_pixel(side: Side, parallax_px: float) -> None:
    left, right = views(FIELD, side, parallax_px, f"{side}{parallax_px}")
    for place in SIDES:
        # The middle of the square, clear of its edges in both views.
        found = measured_px(left, right, FIELD.middle_px(place), 20, 0.0 if place != side else parallax_px)
        assert found == pytest.approx(parallax_px if place == side else 0.0, abs=0.02), place


def test_each_eye_has_half_of_it() -> None:
    still, same = views(FIELD, "left", 0.0, "s")
    assert np.array_equal(still, same)
    left, right = views(FIELD, "left", 3.0, "s")
    middle = FIELD.middle_px("left")
    assert measured_px(still, left, middle, 20, -1.5) == pytest.approx(-1.5, abs=0.02)
    assert measured_px(still, right, middle, 20, 1.5) == pytest.approx(1.5, abs=0.02)


@pytest.mark.nightly
def test_a_classifier_of_one_view_is_at_chance() -> None:
    """Templates learned from one eye's views, light and edges in small patches, do not tell where the square is."""
    small = DotField(120, 32.0, 36.0, (1.0, 1.0), 600)

    def features(view: Floats) -> Floats:
        edges = np.abs(np.diff(view, axis=1, append=0.0))
        patches = [one.reshape(30, 4, 30, 4).mean(axis=(1, 3)).ravel() for one in (view, edges)]
        return np.concatenate([one - one.mean() for one in patches])

    def seen(side: Side, parallax_px: float, seed: str) -> Floats:
        return features(views(small, side, parallax_px, seed)[0])

    template = {side: np.mean([seen(side, 6.0, f"train {n}") for n in range(60)], axis=0) for side in SIDES}
    right = 0
    for n in range(20):
        for side in SIDES:
            view = seen(side, 6.0, f"test {n}")
            like = {guess: float(template[guess] @ view) for guess in SIDES}
            right += max(like, key=like.__getitem__) == side
    assert right / 80 < 0.25 + 4 * np.sqrt(0.25 * 0.75 / 80)


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
@settings(max_examples=8, deadline=None)
@given(st.floats(-6, 6), st.sampled_from(SIDES), st.integers(0, 10**6))
def test_any_parallax_is_kept(parallax_px: float, side: Side, seed: int) -> None:
    left, right = views(FIELD, side, parallax_px, str(seed))
    assert measured_px(left, right, FIELD.middle_px(side), 20, parallax_px) == pytest.approx(parallax_px, abs=0.02)


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
