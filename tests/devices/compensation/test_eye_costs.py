"""What one picture for both eyes costs each through its filter: against a pixel at a time, and by what must hold."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from PIL import Image

from devices.colour import delta_e_2000, xyz_to_lab
from devices.compensation.eye_costs import mixed_costs
from devices.display import DisplayModel, EyeModels, ToneCurve
from documents.arrays import Floats
from runner.cli.main import group
from runner.presenter import ModeOptions, find_mode
from stimuli.pictures import StereoImage, read_exr

Study = Any  # tests/conftest.py
PRIMARIES = np.array([[10.83, 9.67, 5.68], [5.62, 18.65, 2.20], [0.54, 1.63, 29.18]])
BLACK = np.array([0.03, 0.03, 0.04])
RED, CYAN = (0.90, 0.05, 0.02), (0.03, 0.75, 0.80)


def _model(black: Floats = BLACK, primaries: Floats = PRIMARIES) -> DisplayModel:
    # Table 3.6's red, which at full drive gives 0.98 of its light.
    return DisplayModel(black, primaries, (ToneCurve(0.969, 0.0218, 1.8132), ToneCurve(gamma=2.2), ToneCurve(gamma=2)))


def _picture(model: DisplayModel, seed: int = 0) -> StereoImage:
    light = np.random.default_rng(seed).uniform(-0.02, 1.1, (2, 5, 6, 3))
    left, right = np.maximum(model.black_XYZ_cd_m2 + light @ model.primaries_XYZ_cd_m2.T, 0.0).astype(np.float32)
    return StereoImage(left, right)


def _costs(models: EyeModels, image: StereoImage, **options: Any) -> Mapping[Any, dict[str, float]]:
    mixture = find_mode("anaglyph-red-cyan", ModeOptions.parse(options)).mixture(models)
    assert mixture is not None
    return mixed_costs(mixture, models, image.left, image.right, half=image.half)


def _slow(
    models: tuple[DisplayModel, DisplayModel], through: tuple[Floats, Floats], image: StereoImage
) -> tuple[Floats, Floats, Floats]:
    """Per eye and pixel: ΔE00 of the clip, ΔE00 of the projection; and per pixel and channel, whether it is clipped."""
    seen = [filtered @ model.primaries_XYZ_cd_m2 for filtered, model in zip(through, models, strict=True)]
    stacked = np.concatenate(seen)
    white = np.concatenate([model.primaries_XYZ_cd_m2.sum(axis=1) for model in models])
    full = np.linalg.lstsq(stacked, white, rcond=None)[0]
    clips, projections, outside = [], [], []
    for left, right in zip(image.left.reshape(-1, 3), image.right.reshape(-1, 3), strict=True):
        above = [asked - model.black_XYZ_cd_m2 for asked, model in zip((left, right), models, strict=True)]
        light = np.linalg.lstsq(stacked, np.concatenate(above), rcond=None)[0] / full
        curves = models[0].curves
        ends = np.array([[float(c.linear(code)) for c in curves] for code in (0.0, 1.0)])
        given = [float(c.linear(c.code(v))) for c, v in zip(curves, np.clip(light, *ends), strict=True)]
        clip, projection = [], []
        for asked, model, filtered in zip((left, right), models, through, strict=True):

            def eye(linear: Any, model: DisplayModel = model, filtered: Floats = filtered) -> Floats:
                return np.asarray(filtered @ (model.black_XYZ_cd_m2 + model.primaries_XYZ_cd_m2 @ np.asarray(linear)))

            eye_white = eye([1, 1, 1])
            wished = xyz_to_lab(np.maximum(eye(light), 0.0), eye_white)
            clip.append(delta_e_2000(wished, xyz_to_lab(eye(given), eye_white)))
            projection.append(delta_e_2000(xyz_to_lab(asked.astype(float), model.white_XYZ_cd_m2), wished))
        clips.append(clip)
        projections.append(projection)
        outside.append((light < ends[0] - 1e-6) | (light > ends[1] + 1e-6))
    return np.array(clips).T, np.array(projections).T, np.array(outside)


def _assert_alike(costs: Mapping[Any, dict[str, float]], slow: tuple[Floats, Floats, Floats]) -> None:
    clips, projections, outside = slow
    for cost, clip, projection in zip((costs["left"], costs["right"]), clips, projections, strict=True):
        assert cost["delta_e_00_mean"] == pytest.approx(clip.mean(), abs=2e-5)
        assert cost["delta_e_00_max"] == pytest.approx(clip.max(), abs=2e-4)
        assert cost["percent_noticed"] == pytest.approx(100 * (clip >= 1).mean(), abs=1e-3)
        assert cost["projection_delta_e_00_mean"] == pytest.approx(projection.mean(), abs=2e-5)
        assert cost["projection_delta_e_00_max"] == pytest.approx(projection.max(), abs=2e-4)
        assert cost["percent_any"] == pytest.approx(100 * outside.any(axis=1).mean(), abs=1e-3)
        assert cost["percent_green"] == pytest.approx(100 * outside[:, 1].mean(), abs=1e-3)
        assert clip.max() > 1 > clip.min()


def test_each_eye_s_costs_are_those_of_a_pixel_at_a_time() -> None:
    model = _model()
    image = _picture(model)
    inverse = np.linalg.inv(PRIMARIES)
    through = PRIMARIES @ np.diag(RED) @ inverse, PRIMARIES @ np.diag(CYAN) @ inverse
    _assert_alike(_costs(EyeModels(model, model), image), _slow((model, model), through, image))
    matrix = np.array([[0.8, 0.05, 0.0], [0.02, 0.5, 0.01], [0.0, 0.02, 0.1]])
    costs = _costs(EyeModels(model, model), image, left_filter=matrix.tolist())
    _assert_alike(costs, _slow((model, model), (matrix, through[1]), image))


def test_a_display_measured_through_each_filter_is_seen_as_it_was_measured() -> None:
    left, right = _model(BLACK * 0.3, PRIMARIES * np.array(RED)), _model(BLACK * 0.6, PRIMARIES * np.array(CYAN))
    image = StereoImage(_picture(left, 1).left, _picture(right, 2).right)
    costs = _costs(EyeModels(left, right), image)
    _assert_alike(costs, _slow((left, right), (np.eye(3), np.eye(3)), image))
    swapped = _costs(EyeModels(right, left), StereoImage(image.right, image.left), swap_eyes=True)
    assert swapped == {"left": pytest.approx(costs["right"]), "right": pytest.approx(costs["left"])}


@pytest.mark.parametrize("split", ["least-squares", "channels"])
def test_a_grey_of_both_eyes_costs_nothing(split: str) -> None:
    model = _model(np.zeros(3))
    grey = StereoImage.flat((np.linspace(0.05, 0.95, 20)[None, :, None] * model.white_XYZ_cd_m2).astype(np.float32))
    for cost in _costs(EyeModels(model, model), grey, anaglyph=split).values():
        assert cost["percent_any"] == cost["delta_e_00_max"] == cost["percent_noticed"] == 0.0
        assert cost["projection_delta_e_00_max"] < 1e-3


def test_what_a_filter_stops_is_no_cost_to_its_eye() -> None:
    """Too much green, which is clipped, behind a filter that passes red only."""
    model = _model(np.zeros(3))
    light = np.full((4, 5, 3), 0.4)
    light[0, :, 1] = 1.4
    image = StereoImage.flat((light @ PRIMARIES.T).astype(np.float32))
    costs = _costs(
        EyeModels(model, model), image, anaglyph="channels", left_filter=[0.9, 0, 0], right_filter=[0, 0.8, 0.8]
    )
    assert [costs[eye]["percent_green"] for eye in ("left", "right")] == [25.0, 25.0]
    assert costs["left"]["delta_e_00_max"] == costs["left"]["percent_noticed"] == 0.0
    assert costs["right"]["delta_e_00_max"] > 5.0
    assert costs["right"]["percent_noticed"] == 25.0


def _anaglyph(study: Study) -> None:
    study.edit("display.yaml", "side-by-side:", "anaglyph-red-cyan:")
    study.edit("display.yaml", "same_as: side-by-side", "same_as: anaglyph-red-cyan")
    study.edit("rig.yaml", "mode: side-by-side", "mode: anaglyph-red-cyan")
    # Less green: more is clipped.
    study.edit("display.yaml", "green: [9.67, 18.65, 1.63]", "green: [4.67, 9.65, 0.83]")


@pytest.mark.nightly
def test_preview_marks_what_is_clipped_of_the_one_picture(study: Study) -> None:
    _anaglyph(study)
    output = study.folder / "preview"
    done = CliRunner().invoke(group, ["preview", str(study.experiment), "-o", str(output), "--clipping"])
    assert done.exit_code == 0, done.output
    from devices.display import read_display
    from runner.protocol import read_experiment

    design = read_experiment(study.experiment)
    pairs = design.blocks("01")[1]
    (first, _second) = next(iter(pairs.steps())).scene.stimuli  # type: ignore[union-attr]  # an Ask or a Hold
    models = read_display(study.folder / "display.yaml").models("anaglyph-red-cyan")
    image = read_exr(study.folder / f"{first}.exr")
    clipped = _costs(models, image)["left"]["percent_any"] / 100 * 40 * 80
    for eye in ("left", "right"):
        codes = np.asarray(Image.open(Path(output) / f"block-02_screen-001_clipping_{eye}.png")).astype(int)
        assert codes.shape == (480, 640, 3)
        shown = codes[240 - 30 - 20 : 240 - 30 + 20, 320 - 40 : 320 + 40]
        marked = np.ptp(shown, axis=2) > 128
        assert clipped > 100
        assert marked.sum() == pytest.approx(clipped, abs=0.1)
        assert np.all(np.isin(shown[marked], (0, 255)))


def test_blocks_come_to_what_a_picture_at_once_does() -> None:
    models = EyeModels(_model(), _model())
    once = _picture(models.left)
    # Three blocks, whose edges fall within the picture that is repeated.
    many = StereoImage(*(np.tile(view, (15, 15, 1)) for view in (once.left, once.right)))
    small, large = _costs(models, once), _costs(models, many)
    for eye in ("left", "right"):
        assert large[eye] == pytest.approx(small[eye], abs=1.5e-5)  # a unit of the last place that is kept
        assert small[eye]["percent_noticed"] > 0.0


def test_the_unit_of_a_curve_changes_no_count() -> None:
    """Light from just full to 1e-5 of it beyond: what counts as outside is a part of a channel's own range."""
    counts = []
    for gain in (1.0, 4.0, 0.25):
        curve = ToneCurve(gain, gamma=2.0)
        model = DisplayModel(BLACK, PRIMARIES / gain**2, (curve, curve, curve))
        white = model.shown_white_XYZ_cd_m2 - BLACK
        asked = BLACK + np.linspace(1.0, 1.0 + 1e-5, 101)[:, np.newaxis] * white
        mixture = find_mode("anaglyph-red-cyan", ModeOptions.parse({})).mixture(EyeModels(model, model))
        assert mixture is not None
        costs = mixed_costs(mixture, EyeModels(model, model), asked[np.newaxis], asked[np.newaxis])
        counts.append({key: costs["left"][key] for key in ("percent_any", "percent_red", "percent_blue")})
    assert 20 < counts[0]["percent_any"] < 95
    assert counts[1] == counts[0] == counts[2]
