"""Anaglyphs: the projection against a solver that knows nothing of it, and the framebuffer against that."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from devices.compensation import Mixture
from devices.display import DisplayModel, EyeModels, ToneCurve
from documents.arrays import Floats
from runner import Picture, Scene
from runner.presenter import ModeOptions, PresentationError, Presenter, Surface, find_mode
from runner.presenter.surfaces.egl import EglSurface
from runner.scene import Text
from stimuli.pictures import StereoImage
from tests.runner.families import by_family
from tests.runner.presenter.conftest import on_surfaces

Stereo = Callable[..., StereoImage]
Ramps = Callable[[DisplayModel], NDArray[np.float32]]
MakeModel = Callable[..., DisplayModel]

# What the modes pass unless told otherwise, and the channels of the left eye.
DEFAULTS = {
    "anaglyph-red-cyan": ((0.90, 0.05, 0.02), (0.03, 0.75, 0.80), (True, False, False)),
    "anaglyph-green-magenta": ((0.03, 0.75, 0.05), (0.85, 0.05, 0.80), (False, True, False)),
    "anaglyph-amber-blue": ((0.90, 0.75, 0.03), (0.02, 0.03, 0.70), (True, True, False)),
}
PASSED, STOPPED = st.floats(0.6, 1.0), st.floats(0.0, 0.15)


def slow_linear(seen: tuple[Floats, Floats], primaries: Floats, left: Floats, right: Floats) -> Floats:
    """Linear light, unclipped, by a solver at each pixel; ``left`` and ``right``: (pixels, 3), XYZ above black."""
    stacked = np.concatenate(seen)
    wanted = np.concatenate([left, right], axis=1).T
    light = np.linalg.lstsq(stacked, wanted, rcond=None)[0].T
    white = np.tile(primaries.sum(axis=1), 2)
    return np.asarray(light / np.linalg.lstsq(stacked, white, rcond=None)[0])


def slow_codes(curves: tuple[ToneCurve, ...], linear: Floats) -> Floats:
    """8-bit codes, not rounded."""
    clipped = np.clip(linear, 0.0, 1.0)
    return np.stack([curve.code(clipped[:, i]) for i, curve in enumerate(curves)], axis=1) * 255.0


def mixture_of(mode: str, models: EyeModels, **options: Any) -> Mixture:
    mixture = find_mode(mode, ModeOptions.parse(options)).mixture(models)
    assert mixture is not None
    return mixture


@pytest.mark.parametrize(
    ("surface", "mode"), on_surfaces(tuple(DEFAULTS), ("anaglyph-red-cyan",)), indirect=["surface"]
)
def test_every_pixel_is_the_rounded_projection(
    surface: Surface, mode: str, model: MakeModel, colour_ramps: Ramps
) -> None:
    display = model(2.4, 0.05, 0.003)
    models = EyeModels(display, display)
    left = colour_ramps(display)
    rng = np.random.default_rng(2)
    near = left * rng.uniform(0.8, 1.2, (480, 320, 1)).astype(np.float32)  # views of one thing are alike
    picture = StereoImage(np.concatenate([left, left], axis=1), np.concatenate([near, near[::-1]], axis=1))
    with Presenter(surface, find_mode(mode), models, lambda _: picture) as presenter:
        presenter.show(Scene((Picture("ramps"),)))
        shown = presenter.capture()["screen"].reshape(-1, 3)
        work = presenter.counters
    through = [display.primaries_XYZ_cd_m2 * np.array(passes) for passes in DEFAULTS[mode][:2]]
    XYZ = [view.reshape(-1, 3).astype(np.float64) - display.black_XYZ_cd_m2 for view in (picture.left, picture.right)]
    linear = slow_linear((through[0], through[1]), display.primaries_XYZ_cd_m2, XYZ[0], XYZ[1])
    curves = tuple(curve for curve in display.curves if isinstance(curve, ToneCurve))
    error = shown - slow_codes(curves, linear)
    assert np.abs(error).max() <= 0.501
    assert (work.decodes, work.uploads, work.colour_passes, work.frames_drawn) == (1, 2, 1, 1)


@pytest.mark.parametrize("mode", by_family(DEFAULTS))
def test_split_channels_are_each_eyes_own_codes(
    egl: EglSurface, mode: str, random_stereo: Stereo, same_models: EyeModels
) -> None:
    picture = random_stereo(480, 640)
    split = find_mode(mode, ModeOptions.parse({"anaglyph": "channels"}))
    with Presenter(egl, split, same_models, lambda _: picture) as presenter:
        presenter.show(Scene((Picture("a"),)))
        shown = presenter.capture()["screen"]
    codes = [same_models.left.code(view) * 255.0 for view in (picture.left, picture.right)]
    expected = np.where(np.array(DEFAULTS[mode][2]), *codes)
    assert np.abs(shown - expected).max() <= 0.501


@pytest.mark.parametrize("mode", by_family(DEFAULTS))
def test_a_grey_picture_seen_by_both_eyes_is_shown_as_without_filters(
    egl: EglSurface, mode: str, same_models: EyeModels
) -> None:
    share = np.linspace(0.0, 1.0, 640)[np.newaxis, :, np.newaxis]
    grey = StereoImage.flat((share * same_models.left.white_XYZ_cd_m2).astype(np.float32))
    with Presenter(egl, find_mode(mode), same_models, lambda _: grey) as presenter:
        presenter.show(Scene((Picture("grey"), Text("██", (0, 100), 40, luminance_share=0.3))))
        shown = presenter.capture()["screen"]
        assert presenter.counters.uploads == 1
    assert np.abs(shown[239] - same_models.left.code(grey.left[0]) * 255.0).max() <= 0.501
    ink = same_models.left.code(0.3 * same_models.left.white_XYZ_cd_m2) * 255.0
    assert np.abs(shown[280:].reshape(-1, 3).max(axis=0) - ink).max() <= 0.501


@given(st.tuples(PASSED, STOPPED, STOPPED), st.tuples(STOPPED, PASSED, PASSED))
def test_no_other_light_comes_nearer_to_what_both_eyes_should_see(
    left: tuple[float, float, float], right: tuple[float, float, float]
) -> None:
    primaries = np.array([[10.83, 9.67, 5.68], [5.62, 18.65, 2.20], [0.54, 1.63, 29.18]])
    curve = ToneCurve(1.0, 0.0, 1.0)
    display = DisplayModel(np.zeros(3), primaries, (curve, curve, curve))
    mixture = mixture_of("anaglyph-red-cyan", EyeModels(display, display), left_filter=left, right_filter=right)
    rng = np.random.default_rng(0)
    asked = rng.uniform(0, 20, (2, 40, 3))
    got = asked[0] @ mixture.left.T + asked[1] @ mixture.right.T
    expected = slow_linear((primaries * np.array(left), primaries * np.array(right)), primaries, asked[0], asked[1])
    np.testing.assert_allclose(got, expected, rtol=1e-7, atol=1e-8)
    white = display.white_XYZ_cd_m2
    np.testing.assert_allclose(mixture.left @ white + mixture.right @ white, 1.0, rtol=1e-9)


def test_a_filter_can_be_a_matrix_on_XYZ(same_models: EyeModels) -> None:
    primaries = same_models.left.primaries_XYZ_cd_m2
    passes = [0.9, 0.1, 0.05]
    matrix = primaries @ np.diag(passes) @ np.linalg.inv(primaries)
    shares = mixture_of("anaglyph-red-cyan", same_models, left_filter=passes)
    by_matrix = mixture_of("anaglyph-red-cyan", same_models, left_filter=matrix.tolist())
    np.testing.assert_allclose(by_matrix.left, shares.left, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(by_matrix.right, shares.right, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("swap", [False, True])
@pytest.mark.parametrize("stated", [{}, {"left_filter": [0.8, 0.1, 0.1]}], ids=["assumed", "stated"])
def test_the_filters_that_are_said_are_those_that_the_picture_is_made_for(
    same_models: EyeModels, stated: dict[str, Any], swap: bool
) -> None:
    mode = find_mode("anaglyph-red-cyan", ModeOptions.parse({**stated, "swap_eyes": swap}))
    mixture, through = mode.mixture(same_models), mode.seen_through(same_models)
    assert mixture is not None
    assert through is not None
    primaries = same_models.left.primaries_XYZ_cd_m2
    for passes, by_mixture in ((through.left, mixture.left_through), (through.right, mixture.right_through)):
        np.testing.assert_allclose(by_mixture @ primaries, primaries * np.array(passes), rtol=1e-9, atol=1e-9)
    assert len(through.assumed) == 2 - len(stated)


def test_a_display_measured_through_each_filter_needs_none_and_its_white_is_white(model: MakeModel) -> None:
    bare = model(2.2, 0.02)
    left, right = (
        DisplayModel(bare.black_XYZ_cd_m2 * share, bare.primaries_XYZ_cd_m2 * np.array(passes), bare.curves)
        for share, passes in ((0.4, (0.9, 0.05, 0.02)), (0.6, (0.03, 0.75, 0.8)))
    )
    models = EyeModels(left, right)
    mixture = mixture_of("anaglyph-red-cyan", models)
    np.testing.assert_allclose(mixture.code(left.white_XYZ_cd_m2, right.white_XYZ_cd_m2), 1.0, rtol=1e-9)
    codes = np.random.default_rng(1).random((50, 3))  # what three channels can do for both eyes is done exactly
    np.testing.assert_allclose(mixture.code(left.xyz(codes), right.xyz(codes)), codes, atol=1e-9)
    swapped = mixture_of("anaglyph-red-cyan", models, swap_eyes=True)  # measured through the lens that the eye wears
    np.testing.assert_allclose(swapped.left, mixture.left, atol=1e-12)
    with pytest.raises(PresentationError, match="characterised per eye"):
        mixture_of("anaglyph-red-cyan", models, left_filter=[1, 1, 1])


@pytest.mark.parametrize("split", ["least-squares", "channels"])
def test_swapped_eyes_wear_each_others_filters(split: str, same_models: EyeModels) -> None:
    plain = mixture_of("anaglyph-amber-blue", same_models, anaglyph=split)
    swapped = mixture_of("anaglyph-amber-blue", same_models, anaglyph=split, swap_eyes=True)
    left, right = same_models.left.xyz(np.random.default_rng(1).random((2, 50, 3)))
    np.testing.assert_array_equal(swapped.code(left, right), plain.code(right, left))
    assert (swapped.code(left, right) != plain.code(left, right)).any()


REFUSED: list[tuple[str, dict[str, Any], str]] = [
    ("anaglyph-red-cyan", {"left_filter": [1, 0, 0], "right_filter": [0, 1, 0]}, "neither eye can see"),
    ("anaglyph-red-cyan", {"left_filter": [1, 1, 1], "right_filter": [0.06, 0.5, 1]}, "need negative light to make"),
    ("anaglyph-red-cyan", {"left_filter": [0.9, 1.2, 0]}, "expected the shares of red, green and blue"),
    ("anaglyph-red-cyan", {"left_filter": "red"}, "expected the shares"),
    ("anaglyph-red-cyan", {"anaglyph": "channel"}, "did you mean 'channels'"),
    ("anaglyph-red-cyan", {"left_offset_px": [1, 0]}, "cannot move or mirror one of them"),
    ("side-by-side", {"left_filter": [1, 1, 1]}, "'side-by-side' has no filters"),
]


@pytest.mark.parametrize(("mode", "options", "said"), REFUSED)
def test_what_cannot_be_is_refused(mode: str, options: dict[str, Any], said: str, same_models: EyeModels) -> None:
    with pytest.raises(PresentationError, match=said):
        find_mode(mode, ModeOptions.parse(options)).mixture(same_models)
