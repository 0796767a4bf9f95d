"""The passes on displays drawn at random: curves that start and end anywhere, and leaks that add light or take it."""

from __future__ import annotations

from dataclasses import dataclass

import moderngl
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from devices.compensation import Correction, Crosstalk, GainMap, Mixture, cancel_crosstalk, check_leakage
from devices.display import EYES, Curve, DisplayModel, Eye, EyeModels, TableCurve, ToneCurve
from runner.presenter import ColourPass
from runner.presenter.colour_pass import MixedPass
from runner.presenter.compensated_pass import CompensatedPass
from runner.presenter.depth import Bits
from runner.presenter.surfaces.egl import EglSurface

pytestmark = pytest.mark.usefixtures("each_arithmetic")

Floats = NDArray[np.float64]
SIZE_PX = 96, 64
PRIMARIES = np.array([[40.0, 35, 18], [20, 70, 7], [2, 11, 95]])
# A driver compiles each shader again for the format of 10 bits.
BIT_DEPTHS = [8, pytest.param(10, marks=pytest.mark.stress)]
few = settings(max_examples=8, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])


@dataclass(frozen=True, slots=True)
class Drawn:
    """What is drawn at random: a display for each eye, leaks, evenness, a lift, and what is asked of it."""

    models: EyeModels
    crosstalk: Crosstalk
    gain_map: GainMap | None
    lift_share: float
    views: dict[Eye, NDArray[np.float32]]


def _curve(rng: np.random.Generator, tabled: bool) -> Curve:
    if tabled:
        codes = np.sort(np.concatenate([[0.0, 1.0], rng.uniform(0.02, 0.98, 9)]))
        light = (codes + 0.02 * np.sin(9.0 * codes) * codes * (1.0 - codes)) ** rng.uniform(1.6, 2.6)
        return TableCurve(tuple(codes), tuple(light))
    gain, offset = rng.uniform(0.7, 1.15), rng.uniform(-0.08, 0.25)
    return ToneCurve(gain, offset, rng.uniform(1.6, 2.9), rng.uniform(-0.004, 0.02) * (rng.random() < 0.5))


def _model(rng: np.random.Generator, tabled: bool) -> DisplayModel:
    curves = (_curve(rng, tabled), _curve(rng, tabled), _curve(rng, tabled))
    primaries = PRIMARIES * rng.uniform(0.85, 1.15, (3, 3)) * rng.uniform(0.2, 2.0)
    model = DisplayModel(rng.uniform(0.0, 0.004, 3) * primaries.sum(axis=1), primaries, curves)
    # Half of them in a lit room.
    return model.in_room(rng.uniform(0.0, 0.02, 3) * primaries.sum(axis=1)) if rng.random() < 0.5 else model


def _view(rng: np.random.Generator, model: DisplayModel) -> NDArray[np.float32]:
    """Colours of every code, of light far down, at the ends of the channels, and beyond them."""
    width, height = SIZE_PX
    codes = rng.random((height, width, 3))
    codes[rng.random(codes.shape) < 0.1] = 0.0
    codes[rng.random(codes.shape) < 0.1] = 1.0
    dark = rng.random((height, width)) < 0.3
    codes[dark] *= 10.0 ** rng.uniform(-3.0, 0.0, (int(dark.sum()), 1))
    xyz = model.xyz(codes)
    beyond = rng.random((height, width)) < 0.1
    xyz[beyond] *= rng.uniform(0.0, 1.5, (int(beyond.sum()), 3))
    return xyz.astype(np.float32)


def _leak(rng: np.random.Generator, into: DisplayModel, source: DisplayModel) -> Floats:
    """A matrix in XYZ: channels leak from −8 to 12 % of their light each, and a little into each other."""
    share = np.diag(rng.uniform(-0.08, 0.12, 3)) + rng.uniform(-0.01, 0.01, (3, 3))
    return np.asarray(into.primaries_XYZ_cd_m2 @ share @ source.linear_from_XYZ)


@st.composite
def displays(draw: st.DrawFn) -> Drawn:
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    tabled = draw(st.booleans())
    left = _model(rng, tabled)
    right = left if draw(st.booleans()) else _model(rng, tabled)
    gain_map = GainMap(rng.uniform(0.6, 1.2, (3, 4)), SIZE_PX, "cells", "centre") if draw(st.booleans()) else None
    return Drawn(
        EyeModels(left, right),
        Crosstalk(_leak(rng, left, right), _leak(rng, right, left)),
        gain_map,
        draw(st.sampled_from([0.0, 0.05])),
        {"left": _view(rng, left), "right": _view(rng, right)},
    )


def _texture(egl: EglSurface, view: NDArray[np.float32]) -> moderngl.Texture:
    return egl.context.texture(SIZE_PX, 3, view.tobytes(), alignment=1, dtype="f4")


def _read(target: moderngl.Framebuffer, bits: Bits) -> Floats:
    """The codes, 0..1, top row first."""
    width, height = SIZE_PX
    if bits == 8:
        codes = np.frombuffer(target.read(components=3, alignment=1), np.uint8).reshape(height, width, 3)[::-1]
        return codes / 255.0
    raw = np.frombuffer(target.read(components=3, alignment=1, dtype="f4"), np.float32)
    return np.rint(raw.reshape(height, width, 3)[::-1].astype(np.float64) * 1023.0) / 1023.0


@pytest.mark.parametrize("bits", BIT_DEPTHS)
@few
@given(displays())
def test_crosstalk_of_either_sign_is_cancelled_to_the_nearest_code(egl: EglSurface, bits: Bits, drawn: Drawn) -> None:
    models = drawn.models
    check_leakage(drawn.crosstalk, models.left.primaries_XYZ_cd_m2, models.right.primaries_XYZ_cd_m2)
    done = cancel_crosstalk(models, drawn.crosstalk, drawn.views["left"], drawn.views["right"], drawn.lift_share)
    correction = Correction(drawn.crosstalk, drawn.gain_map, drawn.lift_share)
    textures = {eye: _texture(egl, view) for eye, view in drawn.views.items()}
    for eye, other in (EYES, EYES[::-1]):
        model, light = models.eye(eye), done.left_linear if eye == "left" else done.right_linear
        sent = model.xyz_of_linear(light)
        if drawn.gain_map is not None:
            places = np.arange(SIZE_PX[0]) + 0.5, np.arange(SIZE_PX[1]) + 0.5
            sent = drawn.gain_map.corrected(sent, drawn.gain_map.over(*places), model.ambient_XYZ_cd_m2)
        compensated = CompensatedPass(egl.context, models, correction, eye, bits=bits)
        codes = _read(compensated.run(textures[eye], textures[other]), bits)
        assert np.abs(codes - model.code(sent)).max() * (2**bits - 1) <= 0.501


@pytest.mark.parametrize("bits", BIT_DEPTHS)
@few
@given(displays())
def test_plain_pictures_are_the_nearest_codes(egl: EglSurface, bits: Bits, drawn: Drawn) -> None:
    model, view = drawn.models.left, drawn.views["left"]
    codes = _read(ColourPass(egl.context, model, bits=bits).run(_texture(egl, view)), bits)
    assert np.abs(codes - model.code(view)).max() * (2**bits - 1) <= 0.501


@pytest.mark.parametrize("bits", BIT_DEPTHS)
@few
@given(displays())
def test_both_views_in_one_picture_are_the_nearest_codes(egl: EglSurface, bits: Bits, drawn: Drawn) -> None:
    models, unit = drawn.models, np.eye(3)
    share = np.array([[0.9], [0.2], [0.4]])
    parts = share * models.left.linear_from_XYZ, (1.0 - share) * models.right.linear_from_XYZ
    blacks = models.left.dark_XYZ_cd_m2, models.right.dark_XYZ_cd_m2
    mixture = Mixture(*parts, *blacks, models.left.curves, unit, unit)
    left, right = (_texture(egl, drawn.views[eye]) for eye in EYES)
    codes = _read(MixedPass(egl.context, mixture, bits=bits).run(left, right), bits)
    exact = mixture.code(drawn.views["left"], drawn.views["right"])
    assert np.abs(codes - exact).max() * (2**bits - 1) <= 0.501
