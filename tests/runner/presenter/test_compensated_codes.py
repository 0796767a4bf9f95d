"""Compensated codes through the presenter: no more work than needed. Their values: test_corrected_pictures.py."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from devices.compensation import Correction
from devices.display import Crosstalk, EyeModels, GainMap
from runner import Picture, Scene
from runner.presenter import Dithering, PresentationError, Presenter, find_mode
from runner.presenter.surfaces.egl import EglSurface
from stimuli.pictures import StereoImage

pytestmark = pytest.mark.usefixtures("each_arithmetic")

Stereo = Callable[..., StereoImage]

LEAKS = Crosstalk(np.diag([0.05, 0.04, 0.06]), np.diag([0.03, 0.05, 0.02]))
EQUAL_LEAKS = Crosstalk(np.diag([0.05, 0.04, 0.06]), np.diag([0.05, 0.04, 0.06]))
GAIN = GainMap(np.array([[0.7, 0.8, 0.75], [0.9, 1.0, 0.95], [0.8, 1.1, 0.85]]), (640, 480), "cells", "centre")
BOTH = Correction(LEAKS, GAIN)


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
