"""A window for each eye: two contexts that share pictures, and what is said where there are not two monitors."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from devices.display import DisplayModel, EyeModels
from runner import Picture, Scene
from runner.presenter import ModeOptions, PresentationError, Presenter, find_mode, open_surface
from runner.presenter.surfaces.egl import EglSurface
from runner.scene import Text
from stimuli.pictures import StereoImage
from tests.choice import nightly

Stereo = Callable[..., StereoImage]
WIDTH, HEIGHT = 320, 240
SCENE = Scene((Picture("a"), Text("Which is closer?", (0, 60), width_px=200)))


@pytest.mark.window
@pytest.mark.parametrize("swapped", [*nightly(False), True])
def test_each_window_shows_its_eyes_rounded_reference(
    display: str,
    swapped: bool,
    model: Callable[..., DisplayModel],
    random_stereo: Stereo,
    x_screen: Callable[[], NDArray[np.uint8]],
) -> None:
    models = EyeModels(model(2.4, 0.05), model(1.9, 0.2))
    picture = random_stereo(HEIGHT, WIDTH)
    mode = find_mode("dual-window", ModeOptions(swap_eyes=swapped))
    with (
        open_surface("window", (WIDTH, HEIGHT), windowed=True, windows=mode.windows) as surface,
        Presenter(surface, mode, models, lambda _: picture) as presenter,
    ):
        presenter.show(Scene((Picture("a"),)))
        codes = [models.eye(eye).code(picture.eye(eye)) * 255.0 for eye in ("left", "right")]
        first, second = codes[::-1] if swapped else codes
        screen = x_screen()
        assert np.abs(screen[:HEIGHT, :WIDTH] - first).max() <= 0.501
        assert np.abs(screen[:HEIGHT, WIDTH:] - second).max() <= 0.501
        captured = presenter.capture()
        np.testing.assert_array_equal(captured["left"], screen[:HEIGHT, :WIDTH])
        np.testing.assert_array_equal(captured["right"], screen[:HEIGHT, WIDTH:])
        presenter.show(SCENE)
        captured = presenter.capture()
        np.testing.assert_array_equal(np.hstack([captured["left"], captured["right"]]), x_screen()[:HEIGHT])
        work = presenter.counters
    assert (work.uploads, work.colour_passes, work.frames_drawn) == (2, 2, 2)


@pytest.mark.window
def test_keys_come_from_either_window_and_others_can_be_opened_after_it(display: str, same_models: EyeModels) -> None:
    tool = shutil.which("xdotool")
    if tool is None:
        pytest.skip("xdotool is not installed (apt install xdotool)")
    with open_surface("window", (WIDTH, HEIGHT), windowed=True, windows=2) as surface:
        for title, key in (("cyclopean left", "a"), ("cyclopean right", "b")):
            found = subprocess.run([tool, "search", "--name", title], capture_output=True, check=True, timeout=10)
            window = found.stdout.split()[-1].decode()
            subprocess.run([tool, "windowfocus", "--sync", window, "key", key], check=True, timeout=10)
            assert surface.wait_key().key == key
            assert surface.wait_key().key == f"text {key}"
    with (
        open_surface("window", (640, 480)) as surface,
        Presenter(surface, find_mode("flat"), same_models, lambda name: pytest.fail(name)) as presenter,
    ):
        presenter.show(Scene((Text("after"),)))
        assert presenter.capture()["screen"].any()


@pytest.mark.window
def test_one_monitor_is_not_enough_and_it_says_which_there_are(display: str) -> None:
    with pytest.raises(PresentationError, match=r"two monitors of 640 × 480"):
        open_surface("window", (640, 480), windows=2)
    with open_surface("window", (640, 480)) as surface:  # and nothing was left open
        assert surface.windows == 1


def test_offscreen_each_eye_has_a_picture_of_its_own(
    model: Callable[..., DisplayModel], colour_ramps: Callable[[DisplayModel], NDArray[np.float32]]
) -> None:
    models = EyeModels(model(2.4, 0.05, 0.003), model(2.8, 0.3, 0.01, -0.05))
    picture = StereoImage(colour_ramps(models.left), colour_ramps(models.right))
    try:
        surface = EglSurface((320, 480), windows=2)
    except PresentationError as error:
        pytest.skip(str(error))
    with surface, Presenter(surface, find_mode("dual-window"), models, lambda _: picture) as presenter:
        presenter.show(Scene((Picture("a"),)))
        captured = presenter.capture()
        for eye in ("left", "right"):
            assert np.abs(captured[eye] - models.eye(eye).code(picture.eye(eye)) * 255.0).max() <= 0.501
            np.testing.assert_array_equal(presenter.eye_view(eye), captured[eye])


def test_one_window_is_refused(egl: EglSurface, same_models: EyeModels) -> None:
    with pytest.raises(PresentationError, match="this surface is one window"):
        Presenter(egl, find_mode("dual-window"), same_models, lambda name: pytest.fail(name))
