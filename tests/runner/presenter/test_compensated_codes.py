"""Compensated codes through the presenter: each mode's screen against float64, and no more work than needed."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from devices.compensation import Correction, Crosstalk, GainMap, cancel_crosstalk
from devices.display import EYES, DisplayModel, Eye, EyeModels
from runner.presenter import Dithering, Picture, PresentationError, Presenter, Scene, find_mode
from runner.presenter.surfaces.egl import EglSurface
from stimuli.pictures import StereoImage
from tests.choice import nightly

pytestmark = pytest.mark.usefixtures("each_arithmetic")

Make = Callable[..., DisplayModel]
Stereo = Callable[..., StereoImage]

LEAKS = Crosstalk(np.diag([0.05, 0.04, 0.06]), np.diag([0.03, 0.05, 0.02]))
EQUAL_LEAKS = Crosstalk(np.diag([0.05, 0.04, 0.06]), np.diag([0.05, 0.04, 0.06]))
GAIN = GainMap(np.array([[0.7, 0.8, 0.75], [0.9, 1.0, 0.95], [0.8, 1.1, 0.85]]), (640, 480), "cells", "centre")
BOTH = Correction(LEAKS, GAIN)
SIZE_PX = 120, 90
OFFSET_PX = 10, -30
# What each eye sees of its picture: the surface's (left, top) of its view's first pixel, the pixels that share one of
# the signal, and where on the panel the view begins.
VIEWS: dict[str, dict[Eye, tuple[int, int]]] = {
    "side-by-side": {"left": (0, 0), "right": (320, 0)},
    "top-bottom": {"left": (0, 0), "right": (0, 240)},
    "row-interleaved": {"left": (0, 0), "right": (0, 0)},
    "checkerboard": {"left": (0, 0), "right": (0, 0)},
}


@pytest.fixture
def per_eye(model: Make) -> EyeModels:
    """A display model for each eye."""
    right = model(2.0, 0.06)
    return EyeModels(model(2.4, 0.1), DisplayModel(right.black_XYZ_cd_m2, 0.9 * PRIMARIES, right.curves))


PRIMARIES = np.array([[10.83, 9.67, 5.68], [5.62, 18.65, 2.20], [0.54, 1.63, 29.18]])


def _sent(
    models: EyeModels, image: StereoImage, gains: dict[Eye, NDArray[np.float64]]
) -> dict[Eye, NDArray[np.float64]]:
    """Return the codes to show, 0..1, of leaks cancelled and then the gain undone."""
    done = cancel_crosstalk(models, LEAKS, image.left, image.right)
    codes: dict[Eye, NDArray[np.float64]] = {}
    for eye, light in (("left", done.left_linear), ("right", done.right_linear)):
        model = models.eye(eye)  # type: ignore[arg-type]  # one of two literals
        xyz = model.black_XYZ_cd_m2 + light @ model.primaries_XYZ_cd_m2.T
        codes[eye] = model.code(GAIN.corrected(xyz, gains[eye]))  # type: ignore[index]  # likewise
    return codes


@pytest.mark.parametrize("mode", ["side-by-side", "checkerboard", *nightly("top-bottom", "row-interleaved")])
def test_every_pixel_of_a_mode_is_the_nearest_code_at_its_place(
    egl: EglSurface, per_eye: EyeModels, random_stereo: Stereo, mode: str
) -> None:
    width, height = SIZE_PX
    image = random_stereo(height, width)
    with Presenter(egl, find_mode(mode), per_eye, lambda _: image, correction=BOTH) as presenter:
        presenter.show(Scene((Picture("a", OFFSET_PX),)))
        screens = {eye: presenter.eye_view(eye).astype(np.float64) for eye in EYES}
    corners: dict[Eye, tuple[int, int]] = {}
    gains = {}
    for eye in EYES:
        view_height, view_width, _ = screens[eye].shape
        left = (view_width - width) // 2 + OFFSET_PX[0]
        top = (view_height - height) // 2 + OFFSET_PX[1]
        corners[eye] = left, top
        x = VIEWS[mode][eye][0] + left + np.arange(width) + 0.5
        y = VIEWS[mode][eye][1] + top + np.arange(height) + 0.5
        gains[eye] = GAIN.gain(x[np.newaxis], y[:, np.newaxis])
    wanted = _sent(per_eye, image, gains)
    seen_px = 0
    for eye in EYES:
        left, top = corners[eye]
        shown = screens[eye][top : top + height, left : left + width]
        mine = (shown > 0).any(axis=-1)  # a pixel that is the other eye's is 0 in all channels
        seen_px += int(mine.sum())
        assert np.abs(shown - 255.0 * wanted[eye])[mine].max() <= 0.501
    share = 2 if VIEWS[mode]["left"] != VIEWS[mode]["right"] else 1
    assert seen_px > 0.95 * share * width * height


def test_a_squeezed_view_is_averaged_before_its_leaks_are_taken_off(
    egl: EglSurface, per_eye: EyeModels, random_stereo: Stereo
) -> None:
    width, height = SIZE_PX
    image = random_stereo(height, width)
    halves = [
        view.astype(np.float64).reshape(height, width // 2, 2, 3).mean(axis=2) for view in (image.left, image.right)
    ]
    with Presenter(egl, find_mode("side-by-side-half"), per_eye, lambda _: image, correction=BOTH) as presenter:
        presenter.show(Scene((Picture("a"),)))
        screens = {eye: presenter.eye_view(eye).astype(np.float64) for eye in EYES}
    left, top = (320 - width // 2) // 2, (480 - height) // 2
    x = 2.0 * (left + np.arange(width // 2)) + 1.0  # of the panel's 640 columns, over which each half is stretched
    gain = GAIN.gain(x[np.newaxis], top + np.arange(height)[:, np.newaxis] + 0.5)
    done = cancel_crosstalk(per_eye, LEAKS, *halves)
    for eye, light in (("left", done.left_linear), ("right", done.right_linear)):
        model = per_eye.eye(eye)  # type: ignore[arg-type]  # one of two literals
        xyz = model.black_XYZ_cd_m2 + light @ model.primaries_XYZ_cd_m2.T
        wanted = 255.0 * model.code(GAIN.corrected(xyz, gain))
        shown = screens[eye][top : top + height, left : left + width // 2]  # type: ignore[index]  # likewise
        assert np.abs(shown - wanted).max() <= 0.501


@pytest.mark.parametrize(
    ("leaks", "gain_map", "dithering", "mode", "passes"),
    [
        (EQUAL_LEAKS, None, None, "side-by-side", 1),
        (EQUAL_LEAKS, None, Dithering(), "side-by-side", 1),
        (EQUAL_LEAKS, None, Dithering("independent"), "side-by-side", 2),
        (LEAKS, None, None, "side-by-side", 2),
        (None, GAIN, None, "side-by-side", 2),  # the eyes' pictures stand apart on the panel
        (None, GAIN, None, "row-interleaved", 1),
        (EQUAL_LEAKS, GAIN, None, "side-by-side-half", 1),
    ],
)
def test_a_flat_picture_is_one_upload_and_a_second_pass_only_where_the_eyes_codes_differ(
    egl: EglSurface,
    same_models: EyeModels,
    random_stereo: Stereo,
    leaks: Crosstalk | None,
    gain_map: GainMap | None,
    dithering: Dithering | None,
    mode: str,
    passes: int,
) -> None:
    flat = StereoImage.flat(random_stereo(40, 60).left)
    correction = Correction(leaks, gain_map)
    with Presenter(
        egl, find_mode(mode), same_models, lambda _: flat, dithering=dithering, correction=correction
    ) as presenter:
        presenter.show(Scene((Picture("a"),)))
        assert presenter.counters.uploads == 1
        assert presenter.counters.colour_passes == passes
        assert presenter.counters.pixels_shaded == passes * 40 * 60


def test_a_stereo_picture_is_two_uploads_and_two_passes(
    egl: EglSurface, same_models: EyeModels, random_stereo: Stereo
) -> None:
    stereo = random_stereo(40, 60)
    with Presenter(
        egl, find_mode("side-by-side"), same_models, lambda _: stereo, correction=Correction(EQUAL_LEAKS)
    ) as presenter:
        presenter.show(Scene((Picture("a"),)))
        assert (presenter.counters.uploads, presenter.counters.colour_passes) == (2, 2)


def test_both_eyes_may_see_the_same_pixels_where_the_leaks_are_alike(
    egl: EglSurface, same_models: EyeModels, random_stereo: Stereo
) -> None:
    flat = StereoImage.flat(random_stereo(40, 60).left)
    scene = Scene((Picture("a"),))
    with Presenter(
        egl, find_mode("flat"), same_models, lambda _: flat, correction=Correction(EQUAL_LEAKS)
    ) as presenter:
        presenter.show(scene)
        assert presenter.eye_view("left").any()
    with (
        Presenter(egl, find_mode("flat"), same_models, lambda _: flat, correction=Correction(LEAKS)) as presenter,
        pytest.raises(PresentationError, match="same pixels"),
    ):
        presenter.show(scene)


def test_a_picture_is_made_for_each_place_only_where_the_panel_is_evened_out(
    egl: EglSurface, same_models: EyeModels, random_stereo: Stereo
) -> None:
    image = random_stereo(40, 60)
    scene = Scene((Picture("a", (-40, 0)), Picture("a", (40, 0))))
    for correction, decodes in ((BOTH, 2), (Correction(LEAKS), 1), (Correction(), 1)):
        with Presenter(
            egl, find_mode("side-by-side"), same_models, lambda _: image, correction=correction
        ) as presenter:
            presenter.show(scene)
            presenter.prefetch(scene)
            assert presenter.counters.decodes == decodes


def test_work_that_is_given_up_between_two_bands_leaves_nothing_on_the_card(
    egl: EglSurface, same_models: EyeModels, random_stereo: Stereo
) -> None:
    from runner.presenter.counters import Work
    from runner.presenter.view_codes import CompensatedCodes

    image = random_stereo(64, 64)
    made = []

    def upload(view: NDArray[np.float32]):  # type: ignore[no-untyped-def]  # a generator of the presenter's own type
        made.append(egl.context.texture((64, 64), 3, view.tobytes(), alignment=1, dtype="f4"))
        yield
        return made[-1]

    codes = CompensatedCodes(egl.context, same_models, find_mode("side-by-side"), Correction(LEAKS), Work())
    making = codes.make(image, upload, band_px=64 * 8)
    for _ in range(12):
        next(making)
    assert len(made) == 2
    making.close()
    assert all(type(texture.mglo).__name__ == "InvalidObject" for texture in made)
    codes.release()
