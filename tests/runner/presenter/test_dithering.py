"""Dithered codes on the graphics card: the twin's, code for code; the mean light kept; exact codes left alone."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, Literal

import moderngl
import numpy as np
import pytest
from numpy.typing import NDArray

from devices.compensation import Masks, channel_split, dither_thresholds
from devices.compensation.dither import dither_tables, tabled_dither_codes
from devices.display import EYES, DisplayModel, Eye, EyeModels, read_display
from documents.arrays import Floats
from runner.presenter import ColourPass, Dithering, PresentationError
from runner.presenter.colour_pass import MixedPass
from runner.presenter.dithering import light_table
from runner.presenter.surfaces.egl import EglSurface
from tests.choice import nightly

pytestmark = pytest.mark.usefixtures("each_arithmetic")

Codes = NDArray[np.int64]
Views = NDArray[np.float32]

ASUS = Path(__file__).parents[3] / "configs/displays/asus_vg248qe.yaml"
ACROSS = 16  # tiles of one mask period each
# The gap between a code's share of the light and the mask's threshold, below which float32 may tip the choice.
TIE = 1e-6
READ_BY: tuple[tuple[Eye, Masks], ...] = (("left", "shared"), ("left", "independent"), ("right", "independent"))
EIGHT_BITS: tuple[Literal["f1", "f4"], ...] = ("f1", "f4")


@pytest.fixture(scope="module")
def thesis() -> DisplayModel:
    return read_display(ASUS).models("side-by-side").left


def upload(context: moderngl.Context, XYZ: Views) -> moderngl.Texture:
    height, width, _ = XYZ.shape
    return context.texture((width, height), 3, np.ascontiguousarray(XYZ), alignment=1, dtype="f4")


def read(codes: moderngl.Framebuffer, dtype: Literal["f1", "f4"], levels: int) -> Codes:
    """Whole codes 0..levels, top row first; each float must be one."""
    data = codes.read(components=3, dtype=dtype, alignment=1)
    shape = codes.height, codes.width, 3
    if dtype == "f1":
        bytes_up = np.frombuffer(data, np.uint8).reshape(shape)
        return np.asarray(bytes_up[::-1], dtype=np.int64)
    shares = np.frombuffer(data, np.float32).reshape(shape)[::-1]
    whole = np.asarray(np.rint(shares * np.float32(levels)), dtype=np.int64)
    assert np.array_equal(shares, whole.astype(np.float32) / np.float32(levels))
    return whole


def dithered(
    egl: EglSurface,
    model: DisplayModel,
    XYZ: Views,
    dithering: Dithering | None = None,
    *,
    eye: Eye = "left",
    dtype: Literal["f1", "f4"] = "f1",
    **options: Any,
) -> Codes:
    dithering = dithering or Dithering()
    colour_pass = ColourPass(egl.context, model, dithering=dithering, eye=eye, **options)
    return read(colour_pass.run(upload(egl.context, XYZ), dtype), dtype, dithering.highest_code)


def ties(
    model: DisplayModel, XYZ: NDArray[Any], thresholds: Floats, shown: Codes, twin: Codes, levels: int
) -> tuple[int, int]:
    """Count codes where the two differ, and those among them where the share is within TIE of the threshold."""
    model = model.normalised
    lights = light_table(model.curves, levels).astype(np.float64)
    lift = np.array([curve.lift for curve in model.curves])
    rows, columns, channels = np.nonzero(shown != twin)
    linear = np.clip(model.linear(XYZ[rows, columns]), 0.0, 1.0)
    light = np.maximum((linear - lift) / (1.0 - lift), 0.0).astype(np.float32).astype(np.float64)
    lower = np.minimum(shown, twin)[rows, columns, channels]
    low, high = lights[channels, lower], lights[channels, lower + 1]
    gap = (light[np.arange(len(rows)), channels] - low) / (high - low) - thresholds[rows, columns, channels]
    return len(rows), int(np.count_nonzero(np.abs(gap) <= TIE))


def tiles(colours: Floats) -> Views:
    """A picture of constant patches, a mask period each, for colours (n, 3); the rest of the last row is black."""
    down = -(-len(colours) // ACROSS)
    filled = np.zeros((down * ACROSS, 3), np.float32)
    filled[: len(colours)] = colours
    return np.repeat(np.repeat(filled.reshape(down, ACROSS, 3), 64, axis=0), 64, axis=1)


def patches(codes: Codes, count: int) -> Codes:
    """The codes of each patch, shape (count, 4096, 3)."""
    return codes.reshape(-1, 64, ACROSS, 64, 3).swapaxes(1, 2).reshape(-1, 4096, 3)[:count]


@pytest.fixture(scope="module")
def twins_of(
    model: Callable[..., DisplayModel], colour_ramps: Callable[[DisplayModel], Views]
) -> Callable[..., tuple[DisplayModel, Views, list[tuple[Floats, Codes]]]]:
    """A display of (gamma, black, lift, offset), ramps, and thresholds and codes by `READ_BY`, made once."""

    @cache
    def make(levels: int, **display: float) -> tuple[DisplayModel, Views, list[tuple[Floats, Codes]]]:
        made = model(**display)
        XYZ = colour_ramps(made)[:, :307]  # no whole number of mask periods
        tables = dither_tables(made, levels)
        height, width, _ = XYZ.shape
        thresholds = [dither_thresholds(height, width, eye, masks) for eye, masks in READ_BY]
        return made, XYZ, [(each, tabled_dither_codes(made, XYZ, each, tables)) for each in thresholds]

    return make


@pytest.mark.parametrize("levels", [255, *nightly(1023)])
@pytest.mark.parametrize(
    "display",
    [
        pytest.param({"gamma": 1.6}, id="gamma 1.6", marks=pytest.mark.nightly),
        pytest.param({"gamma": 2.2, "black": 0.25, "lift": 2.0**-8}, id="2.2, lift", marks=pytest.mark.nightly),
        pytest.param({"gamma": 2.8, "black": 0.3, "lift": 0.01, "offset": -0.05}, id="gamma 2.8, black, lift, offset"),
    ],
)
def test_the_framebuffer_holds_the_twin_s_codes(
    egl: EglSurface,
    twins_of: Callable[..., tuple[DisplayModel, Views, list[tuple[Floats, Codes]]]],
    display: dict[str, float],
    levels: int,
) -> None:
    made, XYZ, twins = twins_of(levels, **display)
    for (eye, masks), (thresholds, twin) in zip(READ_BY, twins, strict=True):
        for dtype in EIGHT_BITS if levels == 255 else EIGHT_BITS[1:]:
            shown = dithered(egl, made, XYZ, Dithering(masks, levels), eye=eye, dtype=dtype)
            different, tied = ties(made, XYZ, thresholds, shown, twin, levels)
            assert different == tied
            assert different <= 2  # of 442 080; llvmpipe has none
        assert np.ptp(twin) > 0.9 * levels


@pytest.mark.parametrize("gamma", [*nightly(2.9), 8.0])
def test_the_light_of_codes_decides_where_the_code_table_errs(
    egl: EglSurface, model: Callable[..., DisplayModel], gamma: float
) -> None:
    """At 12 bits and hardly any light, the table puts codes across a boundary: above it at gamma 2.9, below it at 8."""
    made = model(gamma)
    light = np.geomspace(1e-9, 1e-6, 512 * 512)
    XYZ = (light[:, None] * made.white_XYZ_cd_m2).reshape(512, 512, 3).astype(np.float32)
    thresholds = dither_thresholds(512, 512)
    twin = tabled_dither_codes(made, XYZ, thresholds, dither_tables(made, 4095))
    shown = dithered(egl, made, XYZ, Dithering(levels=4095), dtype="f4")
    different, tied = ties(made, XYZ, thresholds, shown, twin, 4095)
    assert different == tied <= 4


def test_an_exact_code_is_that_code_at_every_pixel(egl: EglSurface, thesis: DisplayModel) -> None:
    """Each channel takes all 256 codes, in unrelated order."""
    rng = np.random.default_rng(9)
    codes = np.stack([rng.permutation(256), rng.permutation(256), rng.permutation(256)], axis=1)
    for eye in EYES:
        shown = dithered(egl, thesis, tiles(thesis.xyz(codes / 255)), Dithering("independent"), eye=eye)
        assert np.array_equal(patches(shown, 256), np.broadcast_to(codes[:, None], (256, 4096, 3)))


@pytest.mark.parametrize(("masks", "same"), [("shared", True), ("independent", False)])
def test_a_flat_picture_is_the_same_for_both_eyes_if_they_share_masks(
    egl: EglSurface, thesis: DisplayModel, random_XYZ: Callable[..., Views], masks: Masks, same: bool
) -> None:
    XYZ = random_XYZ(90, 150)
    left, right = (dithered(egl, thesis, XYZ, Dithering(masks), eye=eye) for eye in EYES)
    assert np.array_equal(left, right) == same
    assert np.abs(left - right).max() <= 1
    assert Dithering(masks).differs_by_eye == (not same)


@pytest.mark.parametrize("squeeze", [(2, 1), *nightly(((1, 2),))])
def test_a_squeezed_view_is_dithered_on_the_signal_s_pixels(
    egl: EglSurface,
    model: Callable[..., DisplayModel],
    random_XYZ: Callable[..., Views],
    squeeze: tuple[int, int],
) -> None:
    across, down = squeeze
    XYZ = random_XYZ(96, 140).astype(np.float64)
    height, width = 96 // down, 140 // across
    halves = XYZ.reshape(height, down, width, across, 3).mean(axis=(1, 3))
    thresholds = dither_thresholds(height, width)
    twin = tabled_dither_codes(model(), halves, thresholds, dither_tables(model()))
    shown = dithered(egl, model(), XYZ.astype(np.float32), squeeze=squeeze)
    different, tied = ties(model(), halves, thresholds, shown, twin, 255)
    assert different == tied <= 1


def test_a_mixture_of_both_views_is_dithered(
    egl: EglSurface, model: Callable[..., DisplayModel], random_XYZ: Callable[..., Views]
) -> None:
    left_model, right_model = model(2.2, 0.1), model(2.4, 0.1)
    mixture = channel_split(EyeModels(left_model, right_model), (True, False, False))
    left, right = random_XYZ(100, 130, 1) + np.float32(0.1), random_XYZ(100, 130, 2) + np.float32(0.1)
    mixed_pass = MixedPass(egl.context, mixture, Dithering())
    shown = read(mixed_pass.run(upload(egl.context, left), upload(egl.context, right)), "f1", 255)
    # A display whose XYZ is its linear light.
    plain = DisplayModel(np.zeros(3), np.eye(3), mixture.curves)
    linear = (left - mixture.left_black_XYZ_cd_m2) @ mixture.left.T
    linear += (right - mixture.right_black_XYZ_cd_m2) @ mixture.right.T
    thresholds = dither_thresholds(100, 130)
    twin = tabled_dither_codes(plain, linear, thresholds, dither_tables(plain))
    different, tied = ties(plain, linear, thresholds, shown, twin, 255)
    assert different == tied <= 1
    rounded = MixedPass(egl.context, mixture)
    plain_codes = read(rounded.run(upload(egl.context, left), upload(egl.context, right)), "f1", 255)
    assert np.abs(shown - plain_codes).max() == 1


def test_other_levels_do_not_fit_into_eight_bits(egl: EglSurface, thesis: DisplayModel) -> None:
    with pytest.raises(PresentationError, match=r"0\.\.1023 cannot be held"):
        dithered(egl, thesis, tiles(np.zeros((1, 3))), Dithering(levels=1023))


@pytest.mark.parametrize("levels", [0, 4096])
def test_levels_beyond_twelve_bits_are_refused(levels: int) -> None:
    with pytest.raises(PresentationError, match=f"is {levels}"):
        Dithering(levels=levels)


def test_unknown_masks_are_refused() -> None:
    with pytest.raises(PresentationError, match=r"no dither masks 'both' .*'shared', 'independent'"):
        Dithering("both")  # type: ignore[arg-type]  # wrong on purpose


@pytest.mark.parametrize("levels", [1, 255, 4095])
def test_the_light_of_codes_is_the_reference_s(model: Callable[..., DisplayModel], levels: int) -> None:
    display = model(2.4, 0.1, 0.003, -0.02)
    curves = display.normalised.curves
    assert np.array_equal(light_table(curves, levels), dither_tables(display, levels).lights)


def test_the_largest_table_is_right_to_its_last_code(egl: EglSurface, model: Callable[..., DisplayModel]) -> None:
    display = model(2.2)
    XYZ = np.broadcast_to(display.white_XYZ_cd_m2, (4, 4, 3)).astype(np.float32) * np.float32(1.001)
    assert np.all(dithered(egl, display, XYZ, Dithering(levels=4095), dtype="f4") == 4095)
