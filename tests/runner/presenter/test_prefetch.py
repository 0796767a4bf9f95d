"""Pictures decoded in the background: never in the way, never twice, and their faults told where they are shown."""

from __future__ import annotations

import shutil
import subprocess
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from devices.display import EyeModels, read_display
from documents import Finding, InputError
from runner import Picture, Scene
from runner.presenter import Presenter, Surface, find_mode, open_surface
from runner.presenter.pictures import Decoder, PictureKey
from runner.presenter.presenter import PICTURE_BUDGET_BYTES
from runner.presenter.surfaces.egl import EglSurface
from runner.presenter.surfaces.windows import WindowSurface
from runner.scene import Text
from stimuli.pictures import StereoImage

Stereo = Callable[..., StereoImage]


def scene(name: str) -> Scene:
    return Scene((Picture(name), Text(name, (0, 100))))


class Slow:
    """A source of pictures that waits until it is let go, and says who asked."""

    def __init__(self, pictures: dict[str, StereoImage]) -> None:
        self.pictures = pictures
        self.let_go = threading.Event()
        self.asked: list[tuple[str, str]] = []

    def __call__(self, name: str) -> StereoImage:
        self.asked.append((name, threading.current_thread().name))
        assert self.let_go.wait(10.0)
        return self.pictures[name]


@pytest.fixture
def slow(random_stereo: Stereo) -> Slow:
    return Slow({name: random_stereo(20, 30, number) for number, name in enumerate("abcd")})


def test_prefetching_does_not_wait_and_showing_does(egl: EglSurface, slow: Slow, same_models: EyeModels) -> None:
    with Presenter(egl, find_mode("side-by-side"), same_models, slow) as presenter:
        presenter.show(Scene())
        presenter.prefetch(scene("a"))
        assert presenter.counters.uploads == 0
        threading.Timer(0.1, slow.let_go.set).start()
        presenter.show(scene("a"))
        assert slow.let_go.is_set()
        assert slow.asked == [("a", "decode_0")]
        work = presenter.counters
        assert (work.decodes, work.uploads, work.colour_passes, work.texts_rasterised) == (1, 2, 2, 1)
        codes = same_models.left.code(slow.pictures["a"].left) * 255.0
        shown = presenter.eye_view("left")[230:250, 145:175]
        assert np.abs(shown - codes).max() <= 0.501


def test_what_was_prefetched_for_a_scene_that_never_came_is_given_up(
    egl: EglSurface, slow: Slow, same_models: EyeModels
) -> None:
    with Presenter(egl, find_mode("side-by-side"), same_models, slow) as presenter:
        presenter.show(Scene())
        presenter.prefetch(scene("a"))
        while not slow.asked:
            time.sleep(0.001)
        presenter.prefetch(scene("b"))
        presenter.prefetch(scene("c"))
        slow.let_go.set()
        presenter.show(scene("d"))
        presenter.show(scene("c"))
    assert "b" not in {name for name, _ in slow.asked}
    assert [name for name, _ in slow.asked].count("c") == 1


def test_one_that_is_shown_before_its_turn_does_not_queue(egl: EglSurface, slow: Slow, same_models: EyeModels) -> None:
    with Presenter(egl, find_mode("side-by-side"), same_models, slow) as presenter:
        presenter.show(Scene())
        presenter.prefetch(Scene((Picture("a"), Picture("b"))))
        threading.Timer(0.1, slow.let_go.set).start()
        presenter.show(scene("b"))
        presenter.show(scene("a"))
    assert sorted(slow.asked) == [("a", "decode_0"), ("b", "MainThread")]


def test_a_fault_in_the_thread_is_told_where_the_picture_is_shown(
    egl: EglSurface, same_models: EyeModels, random_stereo: Stereo
) -> None:
    fault = InputError(Finding("not a picture", "plate.exr", remedy="write it again"))
    faults = [fault]

    def load(name: str) -> StereoImage:
        if faults:
            raise faults.pop()
        return random_stereo(20, 30)

    with Presenter(egl, find_mode("side-by-side"), same_models, load) as presenter:
        presenter.show(Scene())
        presenter.prefetch(scene("a"))
        with pytest.raises(InputError) as raised:
            presenter.show(scene("a"))
        assert raised.value is fault
        presenter.show(scene("a"))  # mended meanwhile
        assert presenter.counters.decodes == 1


def test_nan_is_found_in_the_thread_too(egl: EglSurface, same_models: EyeModels, random_stereo: Stereo) -> None:
    picture = random_stereo(20, 30)
    picture.left[2, 3, 0] = np.nan
    with Presenter(egl, find_mode("side-by-side"), same_models, lambda _: picture) as presenter:
        presenter.show(Scene())
        presenter.prefetch(scene("plate"))
        with pytest.raises(InputError, match="'plate', left view: 1 pixel is NaN"):
            presenter.show(scene("plate"))


def test_closing_waits_for_what_is_under_way(egl: EglSurface, slow: Slow, same_models: EyeModels) -> None:
    presenter = Presenter(egl, find_mode("side-by-side"), same_models, slow)
    presenter.show(Scene())
    presenter.prefetch(Scene((Picture("a"), Picture("b"))))
    while not slow.asked:
        time.sleep(0.001)
    threading.Timer(0.2, slow.let_go.set).start()
    presenter.close()
    assert slow.let_go.is_set()
    assert [name for name, _ in slow.asked] == ["a"]
    assert not [thread for thread in threading.enumerate() if thread.name.startswith("decode")]


def test_a_presenter_that_prefetches_nothing_starts_no_thread(
    egl: EglSurface, same_models: EyeModels, random_stereo: Stereo
) -> None:
    with Presenter(egl, find_mode("side-by-side"), same_models, lambda _: random_stereo(20, 30)) as presenter:
        presenter.prefetch(scene("a"))  # before the first scene: at once
        assert presenter.counters.uploads == 2
        presenter.show(scene("a"))
        assert not [thread for thread in threading.enumerate() if thread.name.startswith("decode")]


def test_taking_from_the_decoder_is_loading(slow: Slow) -> None:
    finished = threading.Event()
    decoder = Decoder(slow, 1000, finished.set)
    slow.let_go.set()
    assert decoder.ready() is None
    keys = {name: PictureKey(name) for name in "abc"}
    decoder.start([keys["a"], keys["b"]])
    assert finished.wait(5.0)
    assert decoder.ready() == keys["a"]
    for name in "bac":
        assert decoder.take(keys[name]) is slow.pictures[name]
    decoder.close()


@dataclass(frozen=True, eq=False, slots=True)
class Named(StereoImage):
    """A picture that something more is known of."""

    name: str


@pytest.mark.parametrize("flat", [False, True])
def test_pictures_leave_the_decoder_as_their_textures_hold_them(random_stereo: Stereo, flat: bool) -> None:
    wide = random_stereo(20, 30)
    doubles: Any = wide.right.astype(np.float64)
    left = wide.left[:, ::2]
    decoder = Decoder(lambda name: Named(left, left if flat else doubles[:, ::2], name), 1000)
    taken = decoder.take(PictureKey("a"))
    decoder.close()
    assert isinstance(taken, Named)
    assert taken.name == "a"
    assert taken.is_flat is flat
    for view, expected in ((taken.left, wide.left), (taken.right, wide.left if flat else wide.right)):
        assert view.dtype == np.float32
        assert view.flags.c_contiguous
        np.testing.assert_array_equal(view, expected[:, ::2])


@pytest.mark.window
def test_a_picture_is_uploaded_while_a_key_is_awaited(display: str, slow: Slow, same_models: EyeModels) -> None:
    tool = shutil.which("xdotool")
    if tool is None:
        pytest.skip("xdotool is not installed (apt install xdotool)")
    with (
        WindowSurface((640, 480)) as window,
        Presenter(window, find_mode("side-by-side"), same_models, slow) as presenter,
    ):
        presenter.show(Scene((Text("Which?"),)))
        presenter.prefetch(Scene((Picture("a"), Picture("b"))))
        threading.Timer(0.2, slow.let_go.set).start()
        later = threading.Timer(1.2, lambda: subprocess.run([tool, "key", "x"], check=True, timeout=10))
        later.start()
        before_s = time.thread_time()
        assert window.wait_key().key == "x"
        assert time.thread_time() - before_s < 0.3
        later.join()
        ready = presenter.counters
        assert (ready.decodes, ready.uploads, ready.colour_passes, ready.frames_drawn) == (2, 4, 4, 1)
        presenter.show(Scene((Picture("a"), Picture("b"))))
        assert presenter.counters.uploads == 4
        assert {thread for _, thread in slow.asked} == {"decode_0"}


# Pictures that are wanted later are made ready one by one between the events of a window, while there is room.


ASUS = Path(__file__).parents[3] / "configs/displays/asus_vg248qe.yaml"
SIDE = 8
NAMES = ("a", "b", "c", "d", "e", "f", "g")


def _scene(*names: str) -> Scene:
    return Scene(tuple(Picture(name) for name in names))


def _load(name: str) -> StereoImage:
    if name == "b":
        raise OSError("it cannot be read")
    return StereoImage.flat(np.full((SIDE, SIDE, 3), 5.0, np.float32))


def _wait_for_keys(surface: Surface, until: Callable[[], bool], most_s: float) -> bool:
    """Do what a window does while it waits for a key, until something has come true."""
    end_s = time.monotonic() + most_s
    while not until():
        if time.monotonic() > end_s:
            return False
        assert surface.on_wake is not None
        surface.on_wake()
        time.sleep(0.001)
    return True


@pytest.mark.parametrize("budget", [PICTURE_BUDGET_BYTES, 3 * SIDE * SIDE * 4])
def test_what_is_wanted_later_follows_what_comes_next(budget: int) -> None:
    display = read_display(ASUS)
    with (
        open_surface("egl", (64, 48)) as surface,
        Presenter(
            surface, find_mode("side-by-side"), display.models("side-by-side"), _load, picture_budget_bytes=budget
        ) as presenter,
    ):
        may = False
        presenter.show(_scene("a"))
        presenter.prefetch_later((_scene(name) for name in NAMES), lambda: may)
        presenter.prefetch(_scene("e"))
        assert _wait_for_keys(surface, lambda: presenter.counters.decodes == 2, 30.0)
        assert not _wait_for_keys(surface, lambda: presenter.counters.decodes > 2, 0.05)
        may = True
        # One cannot be read, and the others follow all the same; where there is no room they end with the first that
        # takes another's.
        last = 6 if budget == PICTURE_BUDGET_BYTES else 4
        assert _wait_for_keys(surface, lambda: presenter.counters.decodes == last, 30.0)
        assert not _wait_for_keys(surface, lambda: presenter.counters.decodes > last, 0.05)
        done = presenter.counters
        assert done.evictions == (0 if last == 6 else 1)
        presenter.show(_scene("e"))
        assert presenter.counters.uploads == done.uploads
