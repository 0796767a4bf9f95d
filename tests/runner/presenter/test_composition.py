"""Every mode's framebuffer against a float64 reference put together here, slowly and in plain NumPy."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from devices.display import EYES, DisplayModel, Eye, EyeModels
from documents.arrays import Floats
from runner import Picture, Scene
from runner.presenter import MODES, Codes, ModeOptions, Presenter, Surface, find_mode
from runner.presenter.surfaces.egl import EglSurface
from runner.scene import Text
from stimuli.pictures import StereoImage
from tests.choice import nightly
from tests.runner.families import by_family
from tests.runner.presenter.conftest import on_surfaces

MakeModel = Callable[..., DisplayModel]
Ramps = Callable[[DisplayModel], NDArray[np.float32]]
Stereo = Callable[..., StereoImage]
WIDTH, HEIGHT = 640, 480
HALF_MODES = {"side-by-side-half": (2, 1), "top-bottom-half": (1, 2)}
WOVEN = {"row-interleaved": (0, 1), "column-interleaved": (1, 0), "checkerboard": (1, 1)}
PER_EYE = ("side-by-side", "top-bottom", *HALF_MODES, *WOVEN)


def area_px(mode: str, size_px: tuple[int, int] = (WIDTH, HEIGHT)) -> tuple[int, int]:
    """Width and height of each eye's area on the surface."""
    across, down = (2 if mode.startswith("side") else 1), (2 if mode.startswith("top") else 1)
    return size_px[0] // across, size_px[1] // down


def averaged(XYZ: NDArray[np.float32], box: tuple[int, int]) -> Floats:
    """Mean XYZ of each box; at an odd edge, the last box has fewer pixels."""
    mean = XYZ.astype(np.float64)
    for axis, length in ((1, box[0]), (0, box[1])):
        if length == 2:
            first, second = (np.take(mean, range(start, mean.shape[axis], 2), axis) for start in (0, 1))
            missing = np.take(first, range(second.shape[axis], first.shape[axis]), axis)
            mean = (first + np.concatenate([second, missing], axis)) / 2.0
    return mean


def view(
    size_px: tuple[int, int], codes: Floats, offset_px: tuple[int, int] = (0, 0), aperture_px: Any = None
) -> Floats:
    """One eye's area of black with a picture in it: put on a sheet large enough for both, then cut out."""
    width, height = size_px
    rows, columns = codes.shape[:2]
    overhang = (rows - height, columns - width, *(np.subtract(aperture_px, size_px) if aperture_px else ()))
    margin = max(0, *overhang) + max(map(abs, offset_px)) + 1
    sheet = np.zeros((height + 2 * margin, width + 2 * margin, 3))
    top, left = (height - rows) // 2 + offset_px[1] + margin, (width - columns) // 2 + offset_px[0] + margin
    sheet[top : top + rows, left : left + columns] = codes
    if aperture_px is not None:
        x, y = (width - aperture_px[0]) // 2 + offset_px[0], (height - aperture_px[1]) // 2 + offset_px[1]
        within = np.zeros(sheet.shape[:2], bool)
        within[y + margin : y + margin + aperture_px[1], x + margin : x + margin + aperture_px[0]] = True
        sheet[~within] = 0.0
    return sheet[margin : margin + height, margin : margin + width]


def compose(mode: str, views: dict[Eye, Floats], at: tuple[int, int] = (0, 0)) -> Floats:
    """Both eyes' areas as the mode puts them on a surface that stands ``at`` a pixel of the panel."""
    if mode.startswith("side-by-side"):
        return np.concatenate([views["left"], views["right"]], axis=1)
    if mode.startswith("top-bottom"):
        return np.concatenate([views["left"], views["right"]], axis=0)
    screen = views["left"].copy()
    x, y = np.meshgrid(np.arange(screen.shape[1]) + at[0], np.arange(screen.shape[0]) + at[1])
    odd = {"row-interleaved": y % 2 == 1, "column-interleaved": x % 2 == 1, "checkerboard": (x + y) % 2 == 1}[mode]
    screen[odd] = views["right"][odd]
    return screen


def wanted_codes(mode: str, picture: StereoImage, models: EyeModels) -> dict[Eye, Floats]:
    """A picture's 8-bit codes for each eye, not rounded."""
    box = HALF_MODES.get(mode, (1, 1))
    return {eye: models.eye(eye).code(averaged(picture.eye(eye), box)) * 255.0 for eye in EYES}


def reference(
    mode: str,
    codes: dict[Eye, Floats],
    at: tuple[int, int] = (0, 0),
    size_px: tuple[int, int] = (WIDTH, HEIGHT),
    **place: Any,
) -> Floats:
    """The whole frame in 8-bit codes, not rounded."""
    return compose(mode, {eye: view(area_px(mode, size_px), codes[eye], **place) for eye in EYES}, at)


def full_ramps(colour_ramps: Ramps, display: DisplayModel, size_px: tuple[int, int]) -> NDArray[np.float32]:
    """The ramps, repeated until they fill ``size_px``."""
    ramps = colour_ramps(display)
    return np.tile(ramps, (-(-size_px[1] // 480), -(-size_px[0] // 320), 1))[: size_px[1], : size_px[0]]


@pytest.fixture(scope="module")
def ramps_in(model: MakeModel, colour_ramps: Ramps) -> Callable[[str], tuple[StereoImage, EyeModels, Floats]]:
    """Ramps that fill the screen in a mode, the models that show them, and the reference, made once for a mode."""

    @cache
    def make(mode: str) -> tuple[StereoImage, EyeModels, Floats]:
        models = EyeModels(model(2.4, 0.05, 0.003), model(2.8, 0.3, 0.01, -0.05))
        width, height = area_px(mode)
        across, down = HALF_MODES.get(mode, (1, 1))
        size_px = width * across, height * down
        picture = StereoImage(*(full_ramps(colour_ramps, models.eye(eye), size_px) for eye in EYES))
        return picture, models, reference(mode, wanted_codes(mode, picture, models))

    return make


@pytest.mark.parametrize(
    ("surface", "mode"), on_surfaces(PER_EYE, ("side-by-side-half", "checkerboard")), indirect=["surface"]
)
def test_every_pixel_is_the_rounded_reference(
    surface: Surface, mode: str, ramps_in: Callable[[str], tuple[StereoImage, EyeModels, Floats]]
) -> None:
    picture, models, expected = ramps_in(mode)
    with Presenter(surface, find_mode(mode), models, lambda _: picture) as presenter:
        presenter.show(Scene((Picture("ramps"),)))
        shown = presenter.capture()["screen"]
        work = presenter.counters
    error = shown - expected
    assert np.abs(error).max() <= 0.501
    assert np.abs(error.mean(axis=(0, 1))).max() < 0.1  # the ramps dwell at halfway codes, which round one way
    assert (work.frames_drawn, work.uploads, work.colour_passes) == (1, 2, 2)


@pytest.mark.parametrize("mode", by_family(PER_EYE))
@pytest.mark.parametrize("size_px", [(41, 31), (180, 130), *nightly(((1, 1),))])
def test_pictures_stand_where_the_reference_has_them(
    small_egl: EglSurface, mode: str, size_px: tuple[int, int], random_stereo: Stereo, same_models: EyeModels
) -> None:
    picture = random_stereo(size_px[1], size_px[0])
    across, down = HALF_MODES.get(mode, (1, 1))
    codes = wanted_codes(mode, picture, same_models)
    with Presenter(small_egl, find_mode(mode), same_models, lambda _: picture) as presenter:
        for offset_px, aperture_px in (((0, 0), None), ((14, -30), None), ((-14, 6), (24, 12))):
            presenter.show(Scene((Picture("a", offset_px, aperture_px),)))
            on_signal = (offset_px[0] // across, offset_px[1] // down)
            cut = aperture_px and (aperture_px[0] // across, aperture_px[1] // down)
            expected = reference(mode, codes, size_px=small_egl.size_px, offset_px=on_signal, aperture_px=cut)
            assert np.abs(presenter.capture()["screen"] - expected).max() <= 0.501


@pytest.mark.parametrize("mode", WOVEN)
@pytest.mark.parametrize("at", [(33, 12), *nightly(((0, 0),), ((1, 0),), ((0, 1),), ((7, 12),))])
def test_parity_counts_from_the_panels_first_pixel(
    small_egl: EglSurface, mode: str, at: tuple[int, int], random_stereo: Stereo, same_models: EyeModels
) -> None:
    small_egl.position_px = at
    picture = random_stereo(90, 120)
    with Presenter(small_egl, find_mode(mode), same_models, lambda _: picture) as presenter:
        presenter.show(Scene((Picture("a"),)))
        expected = reference(mode, wanted_codes(mode, picture, same_models), at, small_egl.size_px)
        assert np.abs(presenter.capture()["screen"] - expected).max() <= 0.501


@pytest.mark.parametrize("mode", by_family(PER_EYE))
def test_swapped_eyes_are_swapped_views(
    egl: EglSurface, mode: str, random_stereo: Stereo, same_models: EyeModels
) -> None:
    picture = random_stereo(100, 90)
    swapped = StereoImage(picture.right, picture.left)
    crossed = find_mode(mode, ModeOptions(swap_eyes=True))
    assert crossed.name == mode
    with Presenter(egl, crossed, same_models, lambda _: picture) as presenter:
        presenter.show(Scene((Picture("a", (3, 4)), Text("Which?", (0, 90), width_px=200))))
        shown, seen = presenter.capture()["screen"], {eye: presenter.eye_view(eye) for eye in EYES}
    with Presenter(egl, find_mode(mode), same_models, lambda _: swapped) as presenter:
        presenter.show(Scene((Picture("a", (3, 4)), Text("Which?", (0, 90), width_px=200))))
        np.testing.assert_array_equal(presenter.capture()["screen"], shown)
        np.testing.assert_array_equal(presenter.eye_view("left"), seen["right"])
        np.testing.assert_array_equal(presenter.eye_view("right"), seen["left"])


@pytest.mark.parametrize("mode", by_family(PER_EYE))
def test_each_eye_has_its_own_offset(egl: EglSurface, mode: str, random_stereo: Stereo, same_models: EyeModels) -> None:
    picture = random_stereo(64, 80)
    across, down = HALF_MODES.get(mode, (1, 1))
    moved = find_mode(mode, ModeOptions(left_offset_px=(6, -4), right_offset_px=(-10, 12)))
    with Presenter(egl, moved, same_models, lambda _: picture) as presenter:
        presenter.show(Scene((Picture("a", (2, 2)),)))
        shown = presenter.capture()["screen"]
    offsets: dict[Eye, tuple[int, int]] = {"left": (8, -2), "right": (-8, 14)}
    views: dict[Eye, Floats] = {}
    for eye, offset in offsets.items():
        codes = same_models.eye(eye).code(averaged(picture.eye(eye), (across, down))) * 255.0
        views[eye] = view(area_px(mode), codes, (offset[0] // across, offset[1] // down))
    assert np.abs(shown - compose(mode, views)).max() <= 0.501


@pytest.mark.parametrize("mirror", [(True, True), *nightly(((True, False),), ((False, True),))])
@pytest.mark.parametrize("mode", by_family(PER_EYE))
def test_a_mirrored_eye_sees_its_view_reversed_and_the_other_as_it_was(
    small_egl: EglSurface, mode: str, mirror: tuple[bool, bool], random_stereo: Stereo, same_models: EyeModels
) -> None:
    picture = random_stereo(45, 61)
    scene = Scene((Picture("a", (7, -8), (40, 30)), Text("Which?", (-5, 22), 16, width_px=70)))
    flips = (slice(None, None, -1) if mirror[1] else slice(None), slice(None, None, -1) if mirror[0] else slice(None))
    with Presenter(small_egl, find_mode(mode), same_models, lambda _: picture) as presenter:
        presenter.show(scene)
        plain = {eye: _whole_view(presenter, mode, eye) for eye in EYES}
    haploscope = find_mode(mode, ModeOptions(right_mirror=mirror))
    with Presenter(small_egl, haploscope, same_models, lambda _: picture) as presenter:
        presenter.show(scene)
        shown = presenter.capture()["screen"]
    views: dict[Eye, Any] = {"left": plain["left"], "right": plain["right"][flips]}
    np.testing.assert_array_equal(shown, compose(mode, views))


def _whole_view(presenter: Presenter, mode: str, eye: Eye) -> Codes:
    """One eye's view with every pixel of it: of a woven mode, drawn once on even pixels and once on odd ones."""
    if mode not in WOVEN:
        return presenter.eye_view(eye)
    column_step, _ = WOVEN[mode]
    first = presenter.eye_view(eye).copy()
    presenter.surface.position_px = (1, 0) if column_step else (0, 1)
    second = presenter.eye_view(eye)
    presenter.surface.position_px = (0, 0)
    return np.maximum(first, second)


@pytest.mark.parametrize("mode", by_family(MODES))
def test_words_have_no_parallax_in_any_mode(egl: EglSurface, mode: str, same_models: EyeModels) -> None:
    if find_mode(mode).unavailable(egl.size_px, stereo=False):
        pytest.skip("this surface has not what the mode needs; tests/quad has")
    scene = Scene((Text("Which is closer?", (11, -40), 24, 260),))
    with Presenter(egl, find_mode(mode), same_models, lambda name: pytest.fail(name)) as presenter:
        presenter.show(scene)
        left, right = (_whole_view(presenter, mode, eye) for eye in EYES)
        np.testing.assert_array_equal(left, right)
        rows, columns = np.nonzero(left.any(axis=2))
        across, down = HALF_MODES.get(mode, (1, 1))
        assert abs((columns.min() + columns.max()) / 2 - (left.shape[1] / 2 + 11 // across)) <= 2
        assert abs((rows.min() + rows.max()) / 2 - (left.shape[0] / 2 - 40 // down)) <= 4
        assert presenter.counters.texts_rasterised == 1


# Where codes stand on the panel: where the presenter draws them, whatever the mode does to them.


PANEL = (640, 480)


@pytest.mark.parametrize("eye", EYES)
@pytest.mark.parametrize("size_px", [(200, 100), (201, 99), (1, 1)])
@pytest.mark.parametrize(
    "options", [{}, {"left_mirror": "horizontal", "right_mirror": "both", "right_offset_px": [3, 5]}]
)
@pytest.mark.parametrize("mode", ["side-by-side", "top-bottom", "quad-buffered", "row-interleaved", "checkerboard"])
def test_unsqueezed_codes_stand_where_their_picture_does(
    mode: str, options: dict[str, object], size_px: tuple[int, int], eye: Eye
) -> None:
    view = find_mode(mode, ModeOptions.parse(options)).views(PANEL)[eye]
    grid = view.code_grid(size_px, (17, -40))
    assert grid == view.pixel_grid(size_px, (17, -40))
    place, _ = view.place(size_px, (17, -40))
    x, y = grid.axes(size_px)
    left, top = place.left + 0.5 + np.arange(size_px[0]), place.top + 0.5 + np.arange(size_px[1])
    assert np.array_equal(x, left[::-1] if view.mirror[0] else left)
    assert np.array_equal(y, top[::-1] if view.mirror[1] else top)


@pytest.mark.parametrize("offset_px", [(0, 0), (6, 0), (7, 0), (-7, 0)])
@pytest.mark.parametrize("width_px", [100, 101, 102])
def test_a_code_of_a_squeezed_signal_stands_amid_the_two_pixels_it_is_stretched_over(
    width_px: int, offset_px: tuple[int, int]
) -> None:
    """Within the pixel by which a signal of half the columns cannot say where an odd place is."""
    mode = find_mode("side-by-side-half")
    codes_px = -(-width_px // 2), 50
    for eye in EYES:
        view = mode.views(PANEL)[eye]
        grid = view.code_grid(codes_px, offset_px)
        x, y = view.pixel_grid((width_px, 50), offset_px).axes((width_px, 50))
        assert grid.step_px == (2, 1)
        assert grid.first_px[0] == int(grid.first_px[0])
        assert abs(grid.first_px[0] - x[:2].mean()) <= 2.0
        assert grid.first_px[1] == y[0]
    assert mode.views(PANEL)["left"].code_grid((50, 50), (0, 0)).first_px[0] == 640 / 2 - 50 + 1
