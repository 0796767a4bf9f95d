"""A real window under Xvfb, with real key presses sent by xdotool."""

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
from runner.ports import WindowClosed
from runner.presenter import PresentationError, Presenter, find_mode, open_surface
from runner.presenter.surfaces.windows import WindowSurface
from runner.scene import Text
from stimuli.pictures import StereoImage
from tests.choice import nightly

pytestmark = pytest.mark.window


def test_keys_arrive_in_order_with_their_names_and_times(window: WindowSurface, do: Callable[..., None]) -> None:
    before_s = time.monotonic()
    do("key", "Up", "Down", "Left", "Right", "space", "Return", "KP_Enter", "a", "1", "F5", "Escape")
    names = ["up", "down", "left", "right", "space", "text  ", "enter", "enter"]
    names += ["a", "text a", "1", "text 1", "f5", "escape"]
    presses = [window.wait_key() for _ in names]
    assert [one.key for one in presses] == names
    times_s = [one.time_s for one in presses]
    assert times_s == sorted(times_s)
    assert before_s <= times_s[0] <= times_s[-1] <= time.monotonic()
    assert window.poll_keys() == ()


def test_a_key_held_down_is_one_press(window: WindowSurface) -> None:
    tool = shutil.which("xdotool")
    if tool is None:
        pytest.skip("xdotool is not installed (apt install xdotool)")
    subprocess.run([tool, "keydown", "b", "sleep", "1", "keyup", "b", "key", "c"], check=True, timeout=10)
    keys = [window.wait_key().key]
    while keys[-1] != "text c":
        keys.append(window.wait_key().key)
    repeats = keys.count("again b")
    assert repeats > 3
    assert keys == ["b", "text b", *["again b"] * repeats, "c", "text c"]


def test_closing_the_window_ends_the_waiting(window: WindowSurface) -> None:
    import glfw

    glfw.set_window_should_close(window._window, True)
    with pytest.raises(WindowClosed):
        window.wait_key()
    with pytest.raises(WindowClosed):
        window.poll_keys()


def test_what_another_window_covered_is_drawn_again(
    window: WindowSurface, do: Callable[..., None], same_models: EyeModels
) -> None:
    with Presenter(window, find_mode("side-by-side"), same_models, lambda name: pytest.fail(name)) as presenter:
        presenter.show(Scene((Text("Which is closer?"),)))
        window._on_refresh(None)
        do("key", "q")
        window.wait_key()
        assert presenter.counters.frames_redrawn == 1
        assert presenter.counters.frames_drawn == 1


def test_the_screen_shows_what_was_drawn(
    window: WindowSurface, x_screen: Callable[[], NDArray[np.uint8]], same_models: EyeModels
) -> None:
    """The pixels of the X server's root window are the captured codes: nothing between changes them."""
    with Presenter(window, find_mode("side-by-side"), same_models, lambda name: pytest.fail(name)) as presenter:
        presenter.show(Scene((Text("Which image is closer to the reference plate?", width_px=200),)))
        screen = x_screen()
        assert screen.any()
        np.testing.assert_array_equal(screen, presenter.capture()["screen"])


def test_stereo_that_the_driver_has_not_opens_a_plain_window(display: str) -> None:
    with WindowSurface((640, 480), stereo=True) as window:
        assert window.stereo == window.calls.has_stereo()
        assert window.facts.stereo == window.stereo


def test_a_second_window_is_refused(window: WindowSurface) -> None:
    with pytest.raises(PresentationError, match="a window is open already"):
        open_surface("window", (100, 100))
    assert window.poll_keys() == ()  # and the first goes on


def test_windows_and_offscreen_surfaces_follow_one_another(display: str, same_models: EyeModels) -> None:
    for backend in ("egl", "window", "null", "window", "egl", "null"):
        with (
            open_surface(backend, (640, 480)) as surface,
            Presenter(surface, find_mode("flat"), same_models, lambda name: pytest.fail(name)) as presenter,
        ):
            presenter.show(Scene((Text(backend),)))
            assert presenter.capture()["screen"].any()


def test_without_a_display_it_says_what_to_set(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    with pytest.raises(PresentationError, match=r"no window can be opened: .*set DISPLAY"):
        open_surface("window", (640, 480))


@pytest.mark.parametrize("backend", ["egl", "null"])
def test_nobody_can_press_a_key_where_there_is_no_window(backend: str) -> None:
    try:
        surface = open_surface(backend, (64, 48))
    except PresentationError as error:
        pytest.skip(str(error))
    with surface:
        assert surface.poll_keys() == ()
        with pytest.raises(WindowClosed):
            surface.wait_key()


# Interleaved modes in a real window: parity counts from the panel's first pixel, wherever the window stands.


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
