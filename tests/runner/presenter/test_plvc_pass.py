"""The colour pass on a display whose channels act on each other, read back on EGL, against float64."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from devices.compensation import cancel_crosstalk, dither_thresholds
from devices.compensation.dither import dither_tables, tabled_dither_codes
from devices.display import (
    Crosstalk,
    DisplayModel,
    EyeModels,
    Plvc,
    TableCurve,
    ToneCurve,
    code_tables,
    knotted_codes,
    table_codes,
)
from devices.errors import DeviceError
from documents.arrays import Floats
from runner.presenter import MODES, ColourPass, Dithering, PresentationError, find_mode
from runner.presenter.colour_pass import ChannelInteraction, channel_interaction
from runner.presenter.surfaces.egl import EglSurface
from tests.choice import nightly

pytestmark = pytest.mark.usefixtures("each_arithmetic")

PRIMARIES = np.array([[40.0, 35, 18], [20, 70, 7], [2, 11, 95]])


def plvc(seed: int = 1, black: float = 0.05, bend: float = 0.05, mixed: float = 0.02) -> Plvc:
    rng = np.random.default_rng(seed)
    x = np.linspace(0.0, 1.0, 17)
    red, green, blue = (TableCurve(tuple(x), tuple(x**gamma)) for gamma in (1.8, 2.2, 2.4))
    own = PRIMARIES.T[:, np.newaxis] * (1.0 + bend * rng.uniform(-1, 1, (3, 4, 3)))
    mixtures = mixed * rng.uniform(-1, 1, (10, 3)) * PRIMARIES.sum(axis=1)
    return Plvc(np.full(3, black), PRIMARIES, (red, green, blue), own, mixtures)


def upload(surface: EglSurface, XYZ: NDArray[np.float32]):  # type: ignore[no-untyped-def]  # moderngl's own types are not named
    height, width, _ = XYZ.shape
    return surface.context.texture((width, height), 3, XYZ.tobytes(), alignment=1, dtype="f4")


def read(codes, dtype: str = "f4") -> Floats:  # type: ignore[no-untyped-def]  # moderngl's own types are not named
    found = np.frombuffer(codes.read(components=3, dtype=dtype, alignment=1), np.float32 if dtype == "f4" else np.uint8)
    return found.reshape(codes.height, codes.width, 3)[::-1].astype(np.float64)


def picture(model: Plvc, seed: int = 2) -> NDArray[np.float32]:
    """Colours over the gamut, greys and single channels from 1e-7 cd/m² to full, and colours beyond it."""
    rng = np.random.default_rng(seed)
    T = np.concatenate([rng.uniform(0, 1, (3000, 3)), 10 ** rng.uniform(-9, 0, (3000, 3))])
    lone = 10 ** rng.uniform(-9, 0, (2000, 1)) * np.eye(3)[rng.integers(0, 3, 2000)]
    grey = np.geomspace(1e-9, 1, 1000)[:, np.newaxis] * np.ones(3)
    beyond = rng.uniform(-0.4, 1.4, (1000, 3))
    return model.xyz_of_linear(np.concatenate([T, lone, grey, beyond])).astype(np.float32).reshape(100, 100, 3)


@pytest.mark.parametrize(("seed", "black"), [(1, 0.05), *nightly((1, 0.0), (3, 0.05))])
def test_every_pixel_is_within_rounding_of_float64(egl: EglSurface, seed: int, black: float) -> None:
    model = plvc(seed, black)
    asked = picture(model)
    run = ColourPass(egl.context, model)
    expected = model.code(asked.astype(np.float64))
    texture = upload(egl, asked)
    assert np.abs(read(run.run(texture, "f4")) - expected).max() * 255 < 0.001
    assert np.abs(read(run.run(texture), "f1") - 255 * expected).max() <= 0.501


def test_below_a_cut_off_where_the_one_table_errs_by_codes(egl: EglSurface) -> None:
    x = np.linspace(0.0, 1.0, 14)
    light = np.where(x < 0.2, 1e-7 * x, np.maximum(x - 0.2, 0) ** 2.2 / 0.8**2.2 + 1e-7)
    curve = TableCurve(tuple(x), tuple(light / light[-1]))
    flat = plvc()
    model = Plvc(np.zeros(3), PRIMARIES, (curve, curve, curve), flat.XYZ_per_light_cd_m2, flat.mixtures_XYZ_cd_m2)
    greys = np.repeat(np.linspace(0, 1, 4000)[:, np.newaxis], 3, axis=1)
    asked = model.xyz(greys).astype(np.float32).reshape(40, 100, 3)
    expected = model.code(asked.astype(np.float64))
    texture = upload(egl, asked)
    assert np.abs(read(ColourPass(egl.context, model).run(texture), "f1") - 255 * expected).max() <= 0.501
    assert np.abs(table_codes(model, asked.astype(np.float64), code_tables(model)) - expected).max() * 255 > 1.0
    assert np.abs(knotted_codes(model, asked.astype(np.float64)) - expected).max() * 255 < 0.001


def test_the_other_models_have_the_one_table_and_nothing_else(egl: EglSurface) -> None:
    model = plvc()
    additive = DisplayModel(model.black_XYZ_cd_m2, model.primaries_XYZ_cd_m2, model.curves)
    assert not channel_interaction(additive).files
    gamma = ToneCurve(gamma=2.2)
    plain = DisplayModel(model.black_XYZ_cd_m2, model.primaries_XYZ_cd_m2, (gamma, gamma, gamma))
    assert channel_interaction(plain) == ChannelInteraction()
    for display, inverse in ((additive, "knots"), (plain, "code_table")):
        names = set(ColourPass(egl.context, display)._pass._program)
        assert {name for name in names if "plvc" in name or "knots" in name or "table" in name} == {inverse}
    assert any("plvc" in name for name in set(ColourPass(egl.context, model)._pass._program))


MIXING = tuple(name for name in MODES if name.startswith("anaglyph"))


@pytest.mark.parametrize("masks", [*nightly("shared"), "independent"])
def test_dithered_codes_are_those_of_the_twin_and_keep_the_mean_light(egl: EglSurface, masks: str) -> None:
    model = plvc()
    dithering = Dithering(masks)  # type: ignore[arg-type]  # one of its words
    run = ColourPass(egl.context, model, dithering=dithering)
    asked = np.broadcast_to(model.xyz([0.3, 0.21, 0.4]), (64, 64, 3)).astype(np.float32)
    shown = read(run.run(upload(egl, asked)), "f1")
    thresholds = dither_thresholds(64, 64, "left", masks)  # type: ignore[arg-type]  # one of its words
    twin = tabled_dither_codes(model, asked.astype(np.float64), thresholds, dither_tables(model))
    assert np.mean(shown != twin) < 1e-3
    np.testing.assert_allclose(model.xyz(shown / 255).mean(axis=(0, 1)), asked[0, 0], rtol=2e-4)


def leak(share: float) -> Crosstalk:
    return Crosstalk(share * np.eye(3), 0.7 * share * np.eye(3))


def test_cancelled_crosstalk_is_not_seen() -> None:
    model = plvc()
    models, crosstalk = EyeModels(model, model), leak(0.02)
    rng = np.random.default_rng(9)
    asked = [model.xyz(rng.uniform(0.3, 0.9, (500, 3))) for _ in range(2)]
    done = cancel_crosstalk(models, crosstalk, asked[0], asked[1])
    sent = [model.xyz(model.code(0.05 + light @ PRIMARIES.T)) for light in (done.left_linear, done.right_linear)]
    seen = crosstalk.seen(sent[0] - 0.05, sent[1] - 0.05)
    np.testing.assert_allclose(seen[0] + 0.05, asked[0], rtol=1e-9)
    np.testing.assert_allclose(seen[1] + 0.05, asked[1], rtol=1e-9)
    assert done.left.percent_negative == 0


def test_what_needs_channels_that_add_up_is_refused() -> None:
    model = plvc()
    models = EyeModels(model, model)
    for mode in MIXING:
        with pytest.raises(PresentationError, match="plvc"):
            find_mode(mode).mixture(models)
    with pytest.raises(DeviceError, match="black level"):
        cancel_crosstalk(models, leak(0.02), np.ones((2, 3)), np.ones((2, 3)), 0.1)
