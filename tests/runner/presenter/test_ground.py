"""The background and the words on it: each eye's light through its own display model, in every mode."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from devices.compensation import Compensation, Correction
from devices.display import EYES, Crosstalk, DisplayModel, EyeModels
from runner import Scene
from runner.presenter import MODES, Presenter, coverage, find_mode
from runner.presenter.ground import Ground, Inks, Light
from runner.scene import Box, Text
from tests.choice import nightly
from tests.runner.families import by_family

Make = Callable[..., Presenter]
Model = Callable[..., DisplayModel]
GROUNDS = (
    Ground(Light(luminance_cd_m2=6.0)),
    Ground(Light(share_of_white=0.5), Light(share_of_white=0.02)),
    Ground(Light(luminance_cd_m2=4.0, xy=(0.34, 0.31)), Light(luminance_cd_m2=15.0)),
)


def test_a_light_is_of_a_luminance_or_a_share_of_white_and_of_a_colour(model: Model) -> None:
    display = model(2.2)
    white = display.white_XYZ_cd_m2
    np.testing.assert_allclose(Light(share_of_white=0.25).XYZ_cd_m2(display), 0.25 * white)
    grey = Light(luminance_cd_m2=5.0).XYZ_cd_m2(display)
    np.testing.assert_allclose(grey, 5.0 * white / white[1])
    X, Y, Z = Light(luminance_cd_m2=5.0, xy=(0.34, 0.31)).XYZ_cd_m2(display)
    assert pytest.approx((0.34, 0.31, 5.0)) == (X / (X + Y + Z), Y / (X + Y + Z), Y)


@pytest.mark.parametrize("ground", [*nightly(*GROUNDS[:2]), GROUNDS[2]])
@pytest.mark.parametrize("mode", by_family(name for name in MODES if name not in ("quad-buffered", "dual-window")))
def test_every_pixel_of_an_eye_is_the_background_that_was_asked_for(
    make_presenter: Make, model: Model, mode: str, ground: Ground
) -> None:
    models = EyeModels(model(1.9, black=0.02), model(2.4, black=0.05))
    if mode == "flat":
        models = EyeModels(models.left, models.left)
    presenter = make_presenter({}, mode=mode, models=models, ground=ground)
    presenter.show(Scene())
    compensation = find_mode(mode).compensation(models, (640, 480), Correction())
    for area in presenter.areas:
        for eye in area.eyes:
            view = presenter.eye_view(eye)
            own = view if area.weave is None else view[area.weave.mask(*view.shape[:2])]
            code_there = own.reshape(-1, 3)[0]
            assert (own == code_there).all()
            wanted = [ground.background_XYZ_cd_m2(models.eye(each)) for each in EYES]
            mixture = compensation.mixture
            code = models.eye(eye).code(wanted[EYES.index(eye)]) if mixture is None else mixture.code(*wanted)
            assert np.abs(code_there - 255 * code).max() <= 0.501


@pytest.mark.parametrize("ground", [*nightly(*GROUNDS[:2]), GROUNDS[2]])
def test_edges_of_letters_are_smooth_in_linear_light(make_presenter: Make, model: Model, ground: Ground) -> None:
    """A pixel that a letter covers in part has as much of the letter's light, and the rest of the background's."""
    display = model(2.2)
    models = EyeModels(display, display)
    presenter = make_presenter({}, models=models, ground=ground, mode="flat")
    text = Text("Which is closer?", (0, 0), 24, 400)
    presenter.show(Scene((text,)))
    seen = presenter.eye_view("left")
    covered = coverage(text.words, text.height_px, text.width_px)
    assert covered is not None
    height, width = covered.shape
    top, left = (480 - height) // 2, (640 - width) // 2
    part = covered[:, :, np.newaxis] / 255.0
    below, words = ground.background_XYZ_cd_m2(display), ground.text_XYZ_cd_m2(display)
    wanted = 255 * display.code((1 - part) * below + part * words)
    # Rounded three times: the ink, what shows through it, and their sum.
    assert np.abs(seen[top : top + height, left : left + width] - wanted).max() <= 1.51


def test_words_are_lighter_than_what_is_dark_and_darker_than_what_is_light(model: Model) -> None:
    display = model(2.2, black=0.05)
    for share in (0.0, 0.02, 0.1, 0.19, 0.21, 0.5, 1.0):
        ground = Ground(Light(share_of_white=share))
        words, below = ground.text_XYZ_cd_m2(display)[1], ground.background_XYZ_cd_m2(display)[1]
        assert (words > below) == (share < 0.2)
        assert ground.contrast(display) >= 3.0
        assert words <= display.white_XYZ_cd_m2[1]


def test_without_a_ground_nothing_changes(make_presenter: Make, model: Model) -> None:
    scene = Scene((Text("Which is closer?"), Box((0, 40), (50, 10), 0.2)))
    plain, black = make_presenter({}), make_presenter({}, ground=Ground())
    plain.show(scene)
    black.show(scene)
    difference = plain.eye_view("left").astype(int) - black.eye_view("left").astype(int)
    assert np.abs(difference).max() <= 1


def test_crosstalk_is_taken_off_the_background_as_it_is_off_pictures(make_presenter: Make, model: Model) -> None:
    models = EyeModels(model(2.2, black=0.05), model(2.2, black=0.05))
    crosstalk = Crosstalk(0.04 * np.eye(3), 0.02 * np.eye(3))
    ground = Ground(Light(luminance_cd_m2=6.0))
    presenter = make_presenter({}, models=models, ground=ground, correction=Correction(crosstalk))
    presenter.show(Scene())
    codes = {eye: presenter.eye_view(eye)[5, 5] / 255 for eye in EYES}
    uncorrected = models.left.code(ground.background_XYZ_cd_m2(models.left))
    assert (codes["left"] < uncorrected).all()
    assert (codes["left"] < codes["right"]).all()  # more leaks into the left eye


@pytest.mark.parametrize(
    ("ground", "outside"),
    [
        (Ground(Light(share_of_white=1.0)), []),
        (Ground(Light(share_of_white=0.0)), []),
        (Ground(Light(luminance_cd_m2=0.0)), []),
        (Ground(Light(luminance_cd_m2=1000.0)), ["background"]),
        (Ground(Light(luminance_cd_m2=5.0, xy=(0.7, 0.29))), ["background"]),
        (Ground(Light(share_of_white=0.2), Light(luminance_cd_m2=20.0, xy=(0.2, 0.7))), ["text"]),
    ],
)
@pytest.mark.parametrize("mode", ["side-by-side", "anaglyph-red-cyan"])
def test_what_the_display_cannot_show_is_known(model: Model, ground: Ground, outside: list[str], mode: str) -> None:
    models = EyeModels(model(2.2, black=0.05), model(2.2, black=0.05))
    compensation: Compensation = find_mode(mode).compensation(models, (640, 480), Correction())
    leaves = Inks(ground, compensation).leaves_gamut()
    assert [what for what, beyond in leaves.items() if beyond] == outside
