"""The presenter at its edges: tiny, odd, huge, far too bright, and thousands of scenes."""

from __future__ import annotations

import ctypes
import os
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from devices.display import DisplayModel, EyeModels, ToneCurve
from runner import Picture, Scene
from runner.presenter import PresentationError, Presenter, find_mode
from runner.presenter.surfaces.egl import EglSurface
from runner.scene import Text
from stimuli.pictures import StereoImage
from tests.stress.memory import forget_peak, peak_kb

pytestmark = pytest.mark.stress

PRIMARIES = np.array([[10.83, 9.67, 5.68], [5.62, 18.65, 2.20], [0.54, 1.63, 29.18]])
Open = Callable[[tuple[int, int]], EglSurface]


def model(gamma: float = 2.4, black: float = 0.0, lift: float = 0.0) -> DisplayModel:
    curve = ToneCurve(1.0, 0.0, gamma, lift)
    return DisplayModel(black * np.array([0.95, 1.0, 1.2]), PRIMARIES, (curve, curve, curve))


MODEL = model()
BOTH = EyeModels(MODEL, MODEL)


@pytest.fixture
def open_egl() -> Iterator[Open]:
    """Open surfaces of any size, one after the other."""
    opened: list[EglSurface] = []

    def make(size_px: tuple[int, int]) -> EglSurface:
        while opened:
            opened.pop().close()
        try:
            opened.append(EglSurface(size_px))
        except PresentationError as error:
            pytest.skip(str(error))
        return opened[-1]

    yield make
    while opened:
        opened.pop().close()


def live_objects(surface: EglSurface) -> dict[str, int]:
    """Count the objects that exist; the names that are given out do not tell, because Mesa's only climb."""
    find = ctypes.CDLL("libEGL.so.1").eglGetProcAddress
    find.restype, find.argtypes = ctypes.c_void_p, [ctypes.c_char_p]
    count = {}
    texture = surface.context.texture((1, 1), 1)
    highest = 20 * texture.glo + 1000
    texture.release()
    for kind in ("Texture", "Framebuffer", "Program", "VertexArray"):
        exists = ctypes.CFUNCTYPE(ctypes.c_ubyte, ctypes.c_uint)(find(f"glIs{kind}".encode()))
        count[kind] = sum(exists(name) for name in range(1, highest))
    return count


def random_picture(height: int, width: int, seed: int = 0) -> StereoImage:
    codes = np.random.default_rng(seed).random((2, height, width, 3))
    return StereoImage(*MODEL.xyz(codes).astype(np.float32))


@pytest.mark.parametrize("surface_px", [(2, 1), (3, 3), (641, 479), (1920, 1080)])
@pytest.mark.parametrize("picture_px", [(1, 1), (1, 7), (3, 2), (333, 1), (1001, 1201), (4097, 3)])
def test_any_size_in_any_size_is_centred_by_floor_and_exact(
    open_egl: Open, surface_px: tuple[int, int], picture_px: tuple[int, int]
) -> None:
    width, height = picture_px
    picture = random_picture(height, width)
    surface = open_egl(surface_px)
    with Presenter(surface, find_mode("side-by-side"), BOTH, lambda _: picture) as presenter:
        presenter.show(Scene((Picture("a"),)))
        area_width, area_height = surface_px[0] // 2, surface_px[1]
        left, top = (area_width - width) // 2, (area_height - height) // 2
        for eye in ("left", "right"):
            expected = np.zeros((area_height, area_width, 3))
            codes = MODEL.code(picture.eye(eye)) * 255.0
            rows = slice(max(top, 0), min(top + height, area_height))
            columns = slice(max(left, 0), min(left + width, area_width))
            expected[rows, columns] = codes[
                rows.start - top : rows.stop - top, columns.start - left : columns.stop - left
            ]
            assert np.abs(presenter.eye_view(eye) - expected).max() <= 0.501


def test_light_far_beyond_the_panel_is_full_drive_or_black(open_egl: Open) -> None:
    values = np.array([1e30, -1e30, 3.4e38, -3.4e38, 1e-38, 1e-45, -1e-45, 0.0], np.float32)
    XYZ = np.repeat(values[:, np.newaxis], 3, axis=1)[np.newaxis]
    surface = open_egl((8, 1))
    with Presenter(surface, find_mode("flat"), BOTH, lambda _: StereoImage.flat(XYZ)) as presenter:
        presenter.show(Scene((Picture("a"),)))
        shown = presenter.capture()["screen"]
        assert np.abs(shown - MODEL.code(XYZ) * 255.0).max() <= 0.501
        assert (shown[0, 0] == 255).all()
        assert not shown[0, 1].any()


def test_thousands_of_scenes_leave_no_objects_and_no_memory_behind(open_egl: Open) -> None:
    surface = open_egl((320, 240))
    with Presenter(
        surface,
        find_mode("side-by-side"),
        BOTH,
        lambda name: random_picture(120, 100, int(name)),
        picture_budget_bytes=20 * 2 * 120 * 100 * 4,
    ) as presenter:

        def trials(numbers: range) -> None:
            for number in numbers:
                presenter.show(Scene((Picture(str(number % 50)), Text(f"trial {number}", width_px=100))))

        trials(range(500))
        objects_before = live_objects(surface)
        memory_before = forget_peak()
        trials(range(500, 3000))
        objects_after = live_objects(surface)
        memory_after = peak_kb()
        assert presenter.counters.frames_drawn == 3000
        assert presenter.counters.evictions == presenter.counters.decodes - 20
        # Each text is new, and kept: 2500 of them are far below the 64 MB for words.
        assert objects_after == {**objects_before, "Texture": objects_before["Texture"] + 2500}
        assert memory_after - memory_before < 100_000  # kB


def _resident_bytes() -> int:
    """Return what this process holds in memory now (Linux)."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def test_a_session_far_larger_than_the_budget_runs(open_egl: Open) -> None:
    surface = open_egl((1920, 1080))
    codes = np.random.default_rng(1).random((1333, 2000, 3))
    picture = StereoImage.flat(MODEL.xyz(codes).astype(np.float32))
    threads: set[str] = set()

    def load(name: str) -> StereoImage:
        threads.add(threading.current_thread().name)
        return picture

    with Presenter(surface, find_mode("flat"), BOTH, load, picture_budget_bytes=256 << 20) as presenter:
        presenter.show(Scene())
        full_bytes = 0
        for number in range(200):
            presenter.prefetch(Scene((Picture(str(number)),)))
            presenter.show(Scene((Picture(str(number)),)))
            if number == 100:  # the budget has been full for long
                full_bytes = _resident_bytes()
        grown_bytes = _resident_bytes() - full_bytes
        work = presenter.counters
        held = (256 << 20) // (4 * 2000 * 1333)
        assert (work.frames_drawn, work.decodes, work.uploads, work.evictions) == (201, 200, 200, 200 - held)
        top, left = (1333 - 1080) // 2 + 1, (2000 - 1920) // 2
        expected = MODEL.code(picture.left[top : top + 1080, left : left + 1920]) * 255.0
        assert np.abs(presenter.capture()["screen"] - expected).max() <= 0.501
    assert "decode_0" in threads
    # 99 pictures more would be 1.1 GB of codes if any were kept; the driver frees what it held when it pleases.
    assert grown_bytes < 100e6


@pytest.mark.parametrize(
    "mode", ["side-by-side", "top-bottom-half", "checkerboard", "anaglyph-red-cyan", "frame-sequential"]
)
def test_a_presenter_gives_back_every_object(open_egl: Open, mode: str) -> None:
    surface = open_egl((200, 100))
    picture = random_picture(50, 50)
    objects_before = live_objects(surface)
    for number in range(30):
        with Presenter(surface, find_mode(mode), BOTH, lambda _: picture) as presenter:
            presenter.show(Scene((Picture("a"), Text(f"{number}"))))
            presenter.prefetch(Scene((Picture("b"), Picture("c"))))
            during = live_objects(surface)
    assert during["Texture"] > objects_before["Texture"]
    objects_after = live_objects(surface)
    assert objects_after.pop("Program") <= objects_before.pop("Program") + 1  # the last one in use goes later
    assert objects_after == objects_before


@pytest.mark.parametrize("mode", ["side-by-side", "side-by-side-half", "anaglyph-red-cyan"])
def test_a_picture_that_is_given_up_between_two_bands_leaves_nothing(open_egl: Open, mode: str) -> None:
    surface = open_egl((200, 100))
    picture = random_picture(400, 500)
    objects_before = live_objects(surface)
    for steps in range(1, 30):
        with Presenter(surface, find_mode(mode), BOTH, lambda _: picture) as presenter:
            presenter.show(Scene())
            presenter.prefetch(Scene((Picture("a"),)))
            go_on = surface.on_wake
            assert go_on is not None
            while not presenter.counters.decodes:
                go_on()
            for _ in range(steps):
                go_on()
            made = presenter.counters.colour_passes
    assert made == (1 if mode.startswith("anaglyph") else 2)  # in the end the steps were enough
    objects_after = live_objects(surface)
    assert objects_after.pop("Program") <= objects_before.pop("Program") + 1  # the last one in use goes later
    assert objects_after == objects_before
