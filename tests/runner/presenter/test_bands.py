"""Pictures made in bands: code for code as in one go, whatever is drawn in between, and never long at a time."""

from __future__ import annotations

import shutil
import subprocess
import time
from collections.abc import Callable
from typing import Any

import moderngl
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from devices.display import DisplayModel, EyeModels
from runner import Picture, Scene
from runner.presenter import Buffer, ColourPass, Dithering, Presenter, find_mode
from runner.presenter.bands import BAND_PX, InBands, as_uploaded, bands, upload
from runner.presenter.code_pass import release_codes
from runner.presenter.colour_pass import MixedPass
from runner.presenter.counters import Work
from runner.presenter.surfaces.egl import EglSurface
from runner.presenter.surfaces.windows import WindowSurface
from runner.scene import Text
from stimuli.pictures import StereoImage
from tests.choice import nightly

Model = Callable[..., DisplayModel]
Random = Callable[..., NDArray[np.float32]]
SIZE_PX = (61, 47)  # bands and boxes of 2 leave something over


@given(
    width=st.integers(1, 5000), height=st.integers(1, 5000), band_px=st.one_of(st.none(), st.integers(1, 30_000_000))
)
def test_bands_take_every_row_once_and_hold_no_more_than_asked(width: int, height: int, band_px: int | None) -> None:
    found = list(bands((width, height), band_px))
    firsts = [first for first, _ in found]
    assert firsts == [0, *np.cumsum([rows for _, rows in found])[:-1].tolist()]
    assert sum(rows for _, rows in found) == height
    if band_px is None:
        assert len(found) == 1
    else:
        assert all(rows == 1 or 1 < rows <= band_px // width for _, rows in found)


def interrupted(surface: EglSurface, work: InBands[moderngl.Framebuffer]) -> tuple[bytes, int]:
    """Return what ``work`` draws and how often it paused; at each pause all that it had bound is taken away."""
    context, pauses = surface.context, 0
    while True:
        try:
            next(work)
        except StopIteration as done:
            codes: moderngl.Framebuffer = done.value
            drawn = codes.color_attachments[0].read()  # type: ignore[union-attr]  # a texture, not a renderbuffer
            release_codes(codes)
            return drawn, pauses
        pauses += 1
        other = context.texture((3, 3), 3, bytes(9 * 12), dtype="f4")
        for unit in range(6):
            other.use(unit)
        context.enable(moderngl.BLEND)
        surface.target(Buffer.BACK).viewport = (0, 0, 5, 5)
        surface.target(Buffer.BACK).clear(0.3, 0.2, 0.1)
        other.release()


@pytest.mark.parametrize("band_px", [*nightly(1, 61), 61 * 10, *nightly(61 * 46)])
@pytest.mark.parametrize("dithering", [*nightly(None), Dithering("independent")])
@pytest.mark.parametrize("bits", [8, *nightly(10)])
@pytest.mark.parametrize("kind", [*nightly("plain"), "squeezed across", "squeezed down", "mixed"])
def test_bands_change_no_code(
    egl: EglSurface, model: Model, random_XYZ: Random, band_px: int, dithering: Dithering | None, bits: Any, kind: str
) -> None:
    width, height = SIZE_PX
    context = egl.context
    left, right = (
        context.texture(SIZE_PX, 3, random_XYZ(height, width, seed), alignment=1, dtype="f4") for seed in (1, 2)
    )

    drawing: MixedPass | ColourPass
    if kind == "mixed":
        mixture = find_mode("anaglyph-red-cyan").mixture(EyeModels(model(2.2), model(2.2)))
        assert mixture is not None
        drawing = MixedPass(context, mixture, dithering, bits)
    else:
        squeeze = {"squeezed across": (2, 1), "squeezed down": (1, 2)}.get(kind, (1, 1))
        drawing = ColourPass(context, model(2.4, 0.1), squeeze, dithering, "right", bits)

    def run(taken_px: int | None) -> tuple[bytes, int]:
        if isinstance(drawing, MixedPass):
            return interrupted(egl, drawing.running(left, right, band_px=taken_px))
        return interrupted(egl, drawing.running(left, band_px=taken_px))

    at_once, none = run(None)
    in_bands, pauses = run(band_px)
    assert none == 0
    assert pauses > 0
    assert in_bands == at_once
    assert len(set(at_once)) > 100  # a picture, and not one colour
    drawing.release()
    left.release()
    right.release()


@pytest.mark.parametrize(("dtype", "band_px"), [(np.float16, 100), (np.float64, None), (np.float32, 1)])
def test_an_upload_in_bands_is_one_upload(egl: EglSurface, random_XYZ: Random, dtype: Any, band_px: int | None) -> None:
    work = Work()
    view = random_XYZ(47, 122).astype(dtype)[:, ::2]  # with gaps
    making = upload(egl.context, work, view, band_px)
    pauses = 0
    while True:
        try:
            next(making)
        except StopIteration as done:
            texture: moderngl.Texture = done.value
            break
        pauses += 1
        assert work.counters.uploads == 0
    assert pauses == {None: 0, 1: 46, 100: 46}[band_px]
    stored = np.float16 if dtype == np.float16 else np.float32
    held = np.frombuffer(texture.read(alignment=1), stored).reshape(47, 61, 3)
    np.testing.assert_array_equal(held, view.astype(stored))
    assert (work.counters.uploads, work.counters.bytes_uploaded) == (1, held.nbytes)
    texture.release()


def test_a_view_that_is_as_its_texture_holds_it_is_not_copied(random_XYZ: Random) -> None:
    view = random_XYZ(5, 7)
    half: Any = view.astype(np.float16)
    assert as_uploaded(view) is view
    assert as_uploaded(half) is half
    assert as_uploaded(view[:, ::2]).flags.c_contiguous
    assert as_uploaded(np.full((1, 1, 3), 1e300))[0, 0, 0] == np.inf


@pytest.mark.parametrize(
    "mode", ["side-by-side-half", "anaglyph-red-cyan", *nightly("side-by-side", "flat", "row-interleaved")]
)
def test_a_picture_made_between_events_is_the_same_and_counts_the_same(
    egl: EglSurface, same_models: EyeModels, random_XYZ: Random, mode: str
) -> None:
    rows = 3 * BAND_PX // 320
    view = random_XYZ(rows, 320)
    picture = StereoImage.flat(view) if mode == "flat" else StereoImage(view, random_XYZ(rows, 320, 9))
    captured, counted = [], []
    for prefetched in (False, True):
        with Presenter(egl, find_mode(mode), same_models, lambda _: picture) as presenter:
            presenter.show(Scene((Text("first"),)))
            if prefetched:
                presenter.prefetch(Scene((Picture("a"),)))
                steps = 0
                while not presenter.counters.colour_passes or presenter._pictures._making is not None:
                    assert egl.on_wake is not None
                    egl.on_wake()
                    presenter.redraw()
                    steps += presenter.counters.decodes
                assert steps >= 6
                before = presenter.counters
                presenter.show(Scene((Picture("a"),)))
                assert presenter.counters.uploads == before.uploads
            else:
                presenter.show(Scene((Picture("a"),)))
            captured.append(presenter.capture())
            work = presenter.counters
            counted.append((work.decodes, work.uploads, work.bytes_uploaded, work.colour_passes, work.pixels_shaded))
    assert counted[0] == counted[1]
    for name, codes in captured[0].items():
        np.testing.assert_array_equal(codes, captured[1][name])
        assert codes.any()


def test_what_is_needed_at_once_is_taken_up_where_the_bands_are(
    egl: EglSurface, same_models: EyeModels, random_stereo: Callable[..., StereoImage]
) -> None:
    picture = random_stereo(3 * BAND_PX // 320, 320)
    with Presenter(egl, find_mode("side-by-side"), same_models, lambda _: picture) as presenter:
        presenter.show(Scene())
        presenter.prefetch(Scene((Picture("a"),)))
        while not presenter.counters.colour_passes:  # the left view is done, the right one not yet
            assert egl.on_wake is not None
            egl.on_wake()
        presenter.show(Scene((Picture("a"),)))
        work = presenter.counters
        assert (work.decodes, work.uploads, work.colour_passes) == (1, 2, 2)
        codes = same_models.right.code(picture.right[-((480 - picture.height_px) // 2) :][:480]) * 255.0
        assert np.abs(presenter.eye_view("right") - codes).max() <= 0.501


@pytest.mark.nightly
@pytest.mark.window
def test_no_event_waits_for_a_whole_view(display: str, same_models: EyeModels, random_XYZ: Random) -> None:
    """The longest time without events is below a third of what uploading and transforming a view takes at once."""
    tool = shutil.which("xdotool")
    if tool is None:
        pytest.skip("xdotool is not installed (apt install xdotool)")
    pictures = {str(number): StereoImage.flat(random_XYZ(1000, 1000, number)) for number in range(6)}
    with (
        WindowSurface((640, 480)) as window,
        Presenter(window, find_mode("flat"), same_models, pictures.__getitem__) as presenter,
    ):
        context = window.context
        colour_pass = ColourPass(context, same_models.left)

        def at_once() -> float:
            before_s = time.perf_counter()
            texture = context.texture((1000, 1000), 3, pictures["0"].left, alignment=1, dtype="f4")
            codes = colour_pass.run(texture)
            context.finish()
            taken_s = time.perf_counter() - before_s
            release_codes(codes)
            texture.release()
            return taken_s

        presenter.show(Scene((Text("Which?"),)))
        blocks_s: dict[int, list[float]] = {}
        go_on = window.on_wake
        assert go_on is not None

        def timed() -> None:
            number = presenter.counters.colour_passes
            before_s = time.perf_counter()
            go_on()
            context.finish()  # what was put off counts too
            blocks_s.setdefault(number, []).append(time.perf_counter() - before_s)
            if number < presenter.counters.colour_passes == len(pictures):
                subprocess.run([tool, "key", "x"], check=True, timeout=10)

        at_once()
        window.on_wake = timed
        presenter.prefetch(Scene(tuple(Picture(name) for name in pictures)))
        assert window.wait_key().key == "x"
        whole_s = min(at_once() for _ in range(5))
        colour_pass.release()
    steps = {len(blocks) for blocks in blocks_s.values()}
    assert len(steps) == 1
    assert steps.pop() >= 2 * 1000 * 1000 // BAND_PX
    # On a busy machine any step may be long once; one that is long by itself is so in every picture.
    longest_s = max(min(same_step) for same_step in zip(*blocks_s.values(), strict=True))
    assert longest_s <= whole_s / 3.0
