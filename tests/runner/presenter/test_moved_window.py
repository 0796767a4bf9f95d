"""Interleaved modes in a real window: parity counts from the panel's first pixel, wherever the window stands."""

from __future__ import annotations

import shutil
import subprocess
import time
from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from devices.display import EyeModels
from runner import Picture, Scene
from runner.presenter import Presenter, find_mode
from runner.presenter.surfaces.windows import WindowSurface
from stimuli.pictures import StereoImage
from tests.choice import nightly

pytestmark = pytest.mark.window

WIDTH, HEIGHT = 200, 150
WEAVES = {"row-interleaved": (0, 1), "column-interleaved": (1, 0), "checkerboard": (1, 1)}


def move(window: WindowSurface, left: int, top: int) -> None:
    """Move the window as a person would, and let it hear of it."""
    import glfw

    tool = shutil.which("xdotool")
    if tool is None:
        pytest.skip("xdotool is not installed (apt install xdotool)")
    found = subprocess.run([tool, "search", "--name", "cyclopean"], capture_output=True, check=True, timeout=10)
    subprocess.run([tool, "windowmove", found.stdout.split()[-1].decode(), str(left), str(top)], check=True, timeout=10)
    until_s = time.monotonic() + 5.0
    while glfw.get_window_pos(window._window) != (left, top) and time.monotonic() < until_s:
        window.poll_keys()
        time.sleep(0.01)
    time.sleep(0.2)
    window.poll_keys()


@pytest.mark.parametrize("mode", [*nightly("row-interleaved", "column-interleaved"), "checkerboard"])
def test_a_moved_window_is_drawn_again_with_the_right_parity(
    display: str,
    mode: str,
    random_stereo: Callable[..., StereoImage],
    same_models: EyeModels,
    x_screen: Callable[[], NDArray[np.uint8]],
) -> None:
    picture = random_stereo(HEIGHT, WIDTH)
    codes = {eye: same_models.left.code(picture.eye(eye)) * 255.0 for eye in ("left", "right")}
    column_step, row_step = WEAVES[mode]
    with (
        WindowSurface((WIDTH, HEIGHT), windowed=True) as window,
        Presenter(window, find_mode(mode), same_models, lambda _: picture) as presenter,
    ):
        presenter.show(Scene((Picture("a"),)))
        for left, top in ((0, 0), (31, 40), (60, 17), (33, 21)):
            move(window, left, top)
            shown = x_screen()[top : top + HEIGHT, left : left + WIDTH]
            rows, columns = np.mgrid[top : top + HEIGHT, left : left + WIDTH]
            odd = (column_step * columns + row_step * rows) % 2 == 1
            expected = np.where(odd[..., np.newaxis], codes["right"], codes["left"])
            assert np.abs(shown - expected).max() <= 0.501, (left, top)
        work = presenter.counters
    assert work.frames_drawn == 1
    assert work.frames_redrawn >= 1
    assert (work.uploads, work.colour_passes) == (2, 2)


def test_a_mode_that_does_not_ask_where_it_stands_is_not_drawn_again(
    display: str, random_stereo: Callable[..., StereoImage], same_models: EyeModels
) -> None:
    picture = random_stereo(HEIGHT, WIDTH)
    with (
        WindowSurface((WIDTH, HEIGHT), windowed=True) as window,
        Presenter(window, find_mode("side-by-side"), same_models, lambda _: picture) as presenter,
    ):
        presenter.show(Scene((Picture("a"),)))
        presenter.surface.on_damage = None  # what the X server lost is another matter
        move(window, 31, 40)
        assert window.position_px == (31, 40)
        assert presenter.counters.frames_redrawn == 0
