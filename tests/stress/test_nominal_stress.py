"""Nominal displays at extremes: whites from moonlight to a searchlight, any black below, every kind, mode and depth."""

from __future__ import annotations

from typing import get_args

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from devices.display import EYES, DisplayModel, EyeModels, Nominal, NominalKind, ReportedMonitor, panel_of_monitor
from documents import InputError
from runner import Picture, Scene
from runner.presenter import MODES, Presenter, find_mode, open_surface
from runner.presenter.depth import Bits, highest_code
from stimuli.pictures import StereoImage

pytestmark = pytest.mark.stress

KINDS = get_args(NominalKind)
WHITES = (1e-4, 0.08, 80.0, 10_000.0, 1e7)
SHARES = (0.0, 1e-9, 0.001, 0.2, 0.99)
KEEPS = [n for n, m in MODES.items() if not m.needs_stereo and "half" not in n and "anaglyph" not in n]
MANY = settings(max_examples=500, suppress_health_check=list(HealthCheck), deadline=None)


def _codes(seed: int, highest: int) -> NDArray[np.int64]:
    """Return all grey levels and colours at random, (128, 128, 3)."""
    rng = np.random.default_rng(seed)
    colours = rng.integers(0, highest + 1, (128 * 128, 3))
    colours[: highest + 1] = np.arange(highest + 1)[:, np.newaxis]
    return colours.reshape(128, 128, 3)


def _same(
    shown: NDArray[np.integer], asked: NDArray[np.int64], kind: NominalKind, bits: Bits, model: DisplayModel
) -> bool:
    """Return whether codes are the same; of 10 bits a power curve's darkest, as far as a picture in float32 holds them.

    Code 1 of 1023 at a gamma of 2.2 is 2.4e-7 of white: beside a bright channel, what float32 rounds away. sRGB and
    Display P3 begin with a straight line, and are exact.
    """
    if bits == 8 or kind in ("srgb", "display-p3"):
        return np.array_equal(shown, asked)
    light = [model.curves[0].linear(codes / highest_code(bits)) for codes in (shown, asked)]
    off = shown != asked
    return bool(np.abs(light[0] - light[1])[off].max(initial=0.0) <= 2.0**-21 and off.mean() < 0.01)


@pytest.mark.parametrize("bits", [8, 10])
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("mode", KEEPS)
def test_every_code_of_every_kind_comes_back_in_every_mode(mode: str, kind: NominalKind, bits: Bits) -> None:
    highest = highest_code(bits)
    left, right = _codes(1, highest), _codes(2, highest)
    with open_surface("egl", (512, 256), windows=2, bits=bits) as surface:
        if surface.bits != bits:
            pytest.skip(f"the driver gives {surface.bits} bits")
        for white in WHITES:
            for share in SHARES:
                model = Nominal.of(kind, white, share * white).model()
                pictures = [model.xyz(codes / highest).astype(np.float32) for codes in (left, right)]
                image = StereoImage.flat(pictures[0]) if mode == "flat" else StereoImage(*pictures)
                load = {"codes": image}.__getitem__
                with Presenter(surface, find_mode(mode), EyeModels(model, model), load) as presenter:
                    presenter.show(Scene((Picture("codes"),)))
                    for eye in EYES:
                        area = next(area for area in presenter.areas if eye in area.eyes)
                        view = presenter.eye_view(eye)
                        mine = np.ones(view.shape[:2], bool)
                        if area.weave is not None:
                            mine = area.weave.mask(*view.shape[:2])
                        top, first = ((v - 128) // 2 for v in view.shape[:2])
                        inside = slice(top, top + 128), slice(first, first + 128)
                        asked = left if eye == "left" or mode == "flat" else right
                        assert _same(view[inside][mine[inside]], asked[mine[inside]], kind, bits, model)


@MANY
@given(
    kind=st.sampled_from(KINDS),
    white=st.floats(1e-6, 1e9),
    share=st.floats(0.0, 0.999999),
    code=st.tuples(*[st.floats(0.0, 1.0)] * 3),
)
def test_light_runs_from_black_to_white_and_codes_do_not_depend_on_black(
    kind: NominalKind, white: float, share: float, code: tuple[float, float, float]
) -> None:
    nominal = Nominal.of(kind, white, share * white)
    model, light = nominal.model(), nominal.light_model()
    assert light.shown_white_XYZ_cd_m2[1] == pytest.approx(white, rel=1e-9)
    assert light.shown_black_XYZ_cd_m2[1] == pytest.approx(share * white, rel=1e-9, abs=1e-12 * white)
    assert model.shown_white_XYZ_cd_m2[1] == pytest.approx(white, rel=1e-9)
    expected = nominal.black_XYZ_cd_m2 + (1 - share) * model.xyz(code)
    assert np.abs(light.xyz(code) - expected).max() <= 1e-9 * white
    # Where the curve is flat, as beside 0, many codes give one light.
    assert np.abs(model.xyz(model.code(model.xyz(code))) - model.xyz(code)).max() <= 1e-9 * white
    assert not model.clipping(model.xyz(code).astype(np.float32)).any_channel


@MANY
@given(
    size_px=st.tuples(st.integers(-1, 20_000), st.integers(-1, 20_000)),
    size_mm=st.tuples(st.integers(-1, 20_000), st.integers(-1, 20_000)),
    refresh_hz=st.sampled_from([None, 0.0, 23.976, 60.0, 480.0]),
)
def test_whatever_a_monitor_reports_gives_a_panel_or_one_clear_refusal(
    size_px: tuple[int, int], size_mm: tuple[int, int], refresh_hz: float | None
) -> None:
    try:
        panel = panel_of_monitor(ReportedMonitor("any", size_px, size_mm, refresh_hz))
    except InputError as error:
        (finding,) = error.findings
        assert "pixel_pitch_mm" in (finding.remedy or "")
        return
    assert panel.resolution_px == size_px
    widths = [mm / px for mm, px in zip(size_mm, size_px, strict=True)]
    assert 0.9 * min(widths) <= panel.pixel_pitch_mm <= 1.1 * max(widths)
