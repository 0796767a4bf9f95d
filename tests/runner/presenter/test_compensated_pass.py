"""The compensated pass against its twins in NumPy: cancel_crosstalk, then the gain map, then the display model."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from devices.compensation import Correction, PixelGrid, cancel_crosstalk, dither_thresholds
from devices.compensation.dither import dither_tables, tabled_dither_codes
from devices.display import EYES, Crosstalk, DisplayModel, Eye, EyeModels, GainMap
from documents.arrays import Floats
from runner.presenter import Dithering
from runner.presenter.bands import to_the_end
from runner.presenter.code_pass import release_codes
from runner.presenter.compensated_pass import CORNER, CompensatedPass
from runner.presenter.depth import Bits
from runner.presenter.surfaces.egl import EglSurface
from tests.choice import nightly

View = NDArray[np.float32]
Ramps = Callable[[DisplayModel], View]
Make = Callable[..., DisplayModel]

LEAKS = Crosstalk(
    np.array([[0.05, 0.002, 0.0], [0.004, 0.04, 0.0], [0.0, 0.001, 0.06]]),
    np.array([[0.03, 0.0, 0.001], [0.0, 0.05, 0.002], [0.0, 0.0, 0.02]]),
)
WIDTH, HEIGHT = 160, 240
READINGS = np.array([[0.7, 0.8, 0.75], [0.9, 1.0, 0.95], [0.8, 1.1, 0.85]])
CELLS = GainMap(READINGS, (WIDTH, HEIGHT), "cells", "centre")
CORNERS = GainMap(READINGS, (WIDTH, HEIGHT), "corners", "minimum")
ONE_READING = GainMap(np.array([[3.0]]), (WIDTH, HEIGHT), "cells", "centre")
CORRECTIONS = {
    "crosstalk": Correction(LEAKS),
    "crosstalk, lifted": Correction(LEAKS, lift_share=0.07),
    "gain of cells": Correction(None, CELLS),
    "gain of corners": Correction(None, CORNERS),
    "gain of one reading": Correction(LEAKS, ONE_READING),
    "both": Correction(LEAKS, CELLS),
    "both, lifted": Correction(LEAKS, CORNERS, 0.03),
    "neither": Correction(),
}


def averaged(view: View, box: tuple[int, int]) -> Floats:
    """Return the mean of each box of ``box`` pixels, across and down, as simply as can be."""
    height, width, _ = view.shape
    across, down = box
    rows = [
        [view[y : y + down, x : x + across].astype(np.float64).mean(axis=(0, 1)) for x in range(0, width, across)]
        for y in range(0, height, down)
    ]
    return np.array(rows)


def sent_XYZ(
    models: EyeModels, correction: Correction, views: dict[Eye, Floats], places: PixelGrid = CORNER
) -> dict[Eye, Floats]:
    """Return what to ask of each eye's display model, in float64 on the processor."""
    sent = dict(views)
    if correction.crosstalk is not None:
        done = cancel_crosstalk(models, correction.crosstalk, views["left"], views["right"], correction.lift_share)
        lights: dict[Eye, Floats] = {"left": done.left_linear, "right": done.right_linear}
        for eye, light in lights.items():
            model = models.eye(eye)
            sent[eye] = model.black_XYZ_cd_m2 + light @ model.primaries_XYZ_cd_m2.T
    if correction.gain_map is not None:
        height, width, _ = views["left"].shape
        x = places.first_px[0] + places.step_px[0] * np.arange(width)
        y = places.first_px[1] + places.step_px[1] * np.arange(height)
        gain = correction.gain_map.gain(x[np.newaxis], y[:, np.newaxis])
        sent = {eye: correction.gain_map.corrected(xyz, gain) for eye, xyz in sent.items()}
    return sent


@pytest.fixture(params=["per eye", *nightly("same")])
def models(request: pytest.FixtureRequest, model: Make) -> EyeModels:
    """One display model for both eyes, or one for each, the right one dimmer and of another gamma."""
    left = model(2.4, 0.1)
    if request.param == "same":
        return EyeModels(left, left)
    other = model(1.9, 0.06, 2.0**-9)
    return EyeModels(left, DisplayModel(other.black_XYZ_cd_m2, 0.9 * other.primaries_XYZ_cd_m2, other.curves))


def _views(models: EyeModels, colour_ramps: Ramps) -> dict[Eye, View]:
    """Return two views that meet each other in every order: dark and bright, in the gamut and beyond."""
    left = np.ascontiguousarray(colour_ramps(models.left)[::2, ::2])
    order = np.random.default_rng(5).permutation(left.reshape(-1, 3))
    return {"left": left, "right": order.reshape(left.shape)}


def _codes(
    egl: EglSurface,
    models: EyeModels,
    correction: Correction,
    views: dict[Eye, View],
    places: PixelGrid = CORNER,
    squeeze: tuple[int, int] = (1, 1),
    dithering: Dithering | None = None,
    bits: Bits = 8,
    band_px: int | None = None,
    dtype: str | None = None,
) -> dict[Eye, Floats]:
    """Return each eye's codes, 0..1, top row first."""
    context = egl.context
    textures = {
        eye: context.texture(view.shape[1::-1], 3, view.tobytes(), alignment=1, dtype="f4")
        for eye, view in views.items()
    }
    found: dict[Eye, Floats] = {}
    for eye, other in (EYES, EYES[::-1]):
        compensated = CompensatedPass(context, models, correction, eye, squeeze, dithering, bits)
        drawing = compensated.running(textures[eye], textures[other], places, dtype, band_px)  # type: ignore[arg-type]  # a str
        drawn = to_the_end(drawing)
        codes = np.frombuffer(drawn.read(components=3, dtype="f4", alignment=1), np.float32)
        found[eye] = codes.reshape(drawn.height, drawn.width, 3)[::-1].astype(np.float64)
        release_codes(drawn)
        compensated.release()
    for texture in textures.values():
        texture.release()
    return found


@pytest.mark.parametrize(
    ("name", "gamma"), [("both, lifted", 2.9), *nightly(("crosstalk", 1.6), ("both", 2.9), ("both, lifted", 1.6))]
)
def test_before_rounding_codes_are_those_of_float64(
    egl: EglSurface, model: Make, colour_ramps: Ramps, name: str, gamma: float
) -> None:
    display = model(gamma, 0.1)
    models = EyeModels(display, display)
    views = _views(models, colour_ramps)
    codes = _codes(egl, models, CORRECTIONS[name], views, dtype="f4")
    sent = sent_XYZ(models, CORRECTIONS[name], {eye: view.astype(np.float64) for eye, view in views.items()})
    for eye in EYES:
        error = 255.0 * (codes[eye] - display.code(sent[eye]))
        # The table's first cell, as in the tests of the colour pass.
        assert np.abs(error).max() < 4e-3
        assert abs(error.mean()) < 1e-4


@pytest.mark.parametrize(
    ("squeeze", "name"),
    [((2, 1), "both, lifted"), ((1, 2), "crosstalk"), *nightly(((3, 2), "both, lifted"), ((2, 1), "crosstalk"))],
)
def test_a_squeezed_signal_is_averaged_first(
    egl: EglSurface, models: EyeModels, colour_ramps: Ramps, squeeze: tuple[int, int], name: str
) -> None:
    views = {eye: view[:51, :77].copy() for eye, view in _views(models, colour_ramps).items()}  # boxes part empty
    places = PixelGrid((40.5, 30.0), squeeze)
    codes = _codes(egl, models, CORRECTIONS[name], views, places, squeeze)
    boxes = {eye: averaged(view, squeeze) for eye, view in views.items()}
    sent = sent_XYZ(models, CORRECTIONS[name], boxes, places)
    for eye in EYES:
        assert np.abs(codes[eye] - models.eye(eye).code(sent[eye])).max() * 255 <= 0.501


@pytest.mark.parametrize(
    "places",
    [*nightly(PixelGrid((0.5, 0.5), (1, 1)), PixelGrid((175.5, -30.5), (-1, 1))), PixelGrid((1.0, 250.0), (2, -2))],
)
@pytest.mark.parametrize("gain_map", [CELLS, CORNERS])
def test_the_gain_is_that_of_the_place_on_the_panel_and_beyond_it_that_of_the_edge(
    egl: EglSurface, models: EyeModels, colour_ramps: Ramps, places: PixelGrid, gain_map: GainMap
) -> None:
    views = _views(models, colour_ramps)
    correction = Correction(None, gain_map)
    codes = _codes(egl, models, correction, views, places)
    sent = sent_XYZ(models, correction, {eye: view.astype(np.float64) for eye, view in views.items()}, places)
    for eye in EYES:
        assert np.abs(codes[eye] - models.eye(eye).code(sent[eye])).max() * 255 <= 0.501


@pytest.mark.parametrize("masks", [*nightly("shared"), "independent"])
def test_dithered_codes_are_those_of_the_twin(
    egl: EglSurface, models: EyeModels, colour_ramps: Ramps, masks: str
) -> None:
    views = _views(models, colour_ramps)
    dithering = Dithering(masks)  # type: ignore[arg-type]  # parametrize knows no literals
    codes = _codes(egl, models, CORRECTIONS["both"], views, dithering=dithering)
    sent = sent_XYZ(models, CORRECTIONS["both"], {eye: view.astype(np.float64) for eye, view in views.items()})
    for eye in EYES:
        model = models.eye(eye)
        height, width, _ = views[eye].shape
        thresholds = dither_thresholds(height, width, eye, masks)  # type: ignore[arg-type]  # one of its words
        twin = tabled_dither_codes(model, sent[eye], thresholds, dither_tables(model))
        shown = np.rint(codes[eye] * 255).astype(int)
        # A light may fall on either side of a threshold by its last bit.
        assert np.count_nonzero(shown != twin) <= 1e-4 * twin.size
        assert np.abs(shown - twin).max() <= 1


@pytest.mark.parametrize("squeeze", [*nightly(((1, 1),)), (2, 1)])
def test_bands_change_no_code(
    egl: EglSurface, models: EyeModels, colour_ramps: Ramps, squeeze: tuple[int, int]
) -> None:
    views = _views(models, colour_ramps)
    whole = _codes(egl, models, CORRECTIONS["both"], views, squeeze=squeeze, dithering=Dithering())
    sliced = _codes(egl, models, CORRECTIONS["both"], views, squeeze=squeeze, dithering=Dithering(), band_px=7000)
    for eye in EYES:
        assert np.array_equal(whole[eye], sliced[eye])


def test_bands_of_two_places_may_take_turns(egl: EglSurface, models: EyeModels, colour_ramps: Ramps) -> None:
    """A picture needed at once is finished between two bands of another: neither may see the other's place."""
    view = _views(models, colour_ramps)["left"]
    texture = egl.context.texture(view.shape[1::-1], 3, view.tobytes(), alignment=1, dtype="f4")
    compensated = CompensatedPass(egl.context, models, Correction(None, CELLS), "left")
    here, there = PixelGrid((0.5, 0.5), (1, 1)), PixelGrid((-75.5, 45.5), (1, 1))
    alone = [compensated.run(texture, texture, places) for places in (here, there)]
    drawing = compensated.running(texture, texture, here, band_px=7000)
    next(drawing)
    between = compensated.run(texture, texture, there)
    together = [to_the_end(drawing), between]
    assert alone[0].read() != alone[1].read()
    assert [drawn.read() for drawn in alone] == [drawn.read() for drawn in together]
    for drawn in (*alone, *together):
        release_codes(drawn)
    compensated.release()
    texture.release()


def test_gains_of_one_float_would_not_do_next_to_black(egl: EglSurface, model: Make) -> None:
    """A picture that asks for the dimmed black and next to nothing above it: what is left is the gain's last bits."""
    display = model(2.9, 0.25)
    models = EyeModels(display, display)
    gain = CELLS.gain(np.arange(WIDTH)[np.newaxis] + 0.5, np.arange(HEIGHT)[:, np.newaxis] + 0.5)
    light = 10.0 ** np.random.default_rng(1).uniform(-11.0, -6.0, (HEIGHT, WIDTH, 3))
    asked = gain[..., np.newaxis] * display.black_XYZ_cd_m2 + light @ display.primaries_XYZ_cd_m2.T
    view = asked.astype(np.float32)
    correction = Correction(None, CELLS)
    codes = _codes(egl, models, correction, {"left": view, "right": view}, dtype="f4")
    sent = sent_XYZ(models, correction, {eye: view.astype(np.float64) for eye in EYES})
    for eye in EYES:
        wanted = display.code(sent[eye])
        assert 0.3 < 255.0 * wanted.max() < 5.0
        assert np.abs(codes[eye] - wanted).max() * 255.0 < 4e-3
