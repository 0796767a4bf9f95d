"""Contrast of sparkles over exposure, as thesis Figures 4.10 and 4.11 show it."""

from __future__ import annotations

import json
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from devices.display import DisplayModel, EyeModels, read_display
from documents import InputError
from extensions.sparkle import ContrastOverExposure, SparklePlateRecipe, Studio, contrast_over_exposure
from stimuli.errors import StimulusError
from stimuli.pictures import StereoImage
from stimuli.recipes import read_recipe
from tests.invoked import invoked

ROOT = Path(__file__).parents[3]
# Table 4.3: exposure and maximum luminance of Images 1.1, 2.1 and 3.1.
TABLE_4_3 = ((1 / 15, 205.3), (1 / 8, 104.7), (1.0, 15.65))
FULL_CD_S_M2, BASE_CD_M2 = 10.0, 3.0


@pytest.fixture(scope="module")
def exposures_models() -> EyeModels:
    return read_display(ROOT / "configs/displays/asus_vg248qe.yaml").models("quad-buffered")


def exposed(exposure_s: float, sparkles_cd_m2: NDArray[np.float64] | None = None) -> StereoImage:
    """A plate of 3 cd/m² with sparkles, on a sensor that holds 10 cd·s/m²."""
    luminance = np.full((192, 192), BASE_CD_M2)
    bright = np.full(36, 1e4) if sparkles_cd_m2 is None else sparkles_cd_m2
    at = 16 + 32 * np.arange(6)
    luminance[np.repeat(at, 6), np.tile(at, 6)] = bright
    luminance = np.minimum(luminance, FULL_CD_S_M2 / exposure_s)
    return StereoImage.flat(np.asarray(luminance[..., None] * [0.95, 1.0, 0.82], np.float32))


def over(*times: float, models: EyeModels | None = None, mean_cd_m2: float | None = None) -> ContrastOverExposure:
    return contrast_over_exposure([(f"{t:g}", t, exposed(t)) for t in times], models, mean_cd_m2=mean_cd_m2)


def test_a_full_sensor_s_contrast_is_its_capacity_over_exposure_and_background() -> None:
    found = over(1.0, 0.05, 0.2)
    assert [row.exposure_s for row in found.rows] == [0.05, 0.2, 1.0]
    assert found.sparkles == 36
    for row in found.rows:
        sparkle = FULL_CD_S_M2 / row.exposure_s
        assert row.as_photographed.contrast.value == pytest.approx(sparkle / BASE_CD_M2 - 1, rel=1e-6)
        assert row.max_cd_m2 == pytest.approx(sparkle, rel=1e-6)
        # Figure 4.10: bright pixels stay as they are, dark ones grow with the exposure.
        assert row.exposed_sparkle_cd_s_m2 == pytest.approx(FULL_CD_S_M2, rel=1e-6)
        assert row.exposed_background_cd_s_m2 == pytest.approx(BASE_CD_M2 * row.exposure_s, rel=1e-6)
        assert row.as_shown is None


def test_the_display_clips_what_the_short_exposure_has_kept(exposures_models: EyeModels) -> None:
    """Calibrated to one mean, short exposures lose on the display what they had before the long ones; long ones not."""
    found = over(0.05, 0.2, 2.0, models=exposures_models)
    shown = [row.as_shown.contrast.value for row in found.rows if row.as_shown is not None]
    photographed = [row.as_photographed.contrast.value for row in found.rows]
    assert shown[0] < 0.5 * photographed[0]
    assert shown[0] == pytest.approx(shown[1], rel=1e-6)  # both sparkles are beyond the display's brightest
    assert shown[2] == pytest.approx(photographed[2], rel=1e-6)
    # The slow way: the model's light of the model's code, pixel by pixel.
    model: DisplayModel = exposures_models.left
    sparkle, base = (
        model.xyz(model.code(np.array([0.95, 1.0, 0.82]) * luminance))[1] for luminance in (200.0, BASE_CD_M2)
    )
    assert shown[0] == pytest.approx(sparkle / base - 1, rel=1e-5)


def test_table_4_3_shows_a_full_sensor_and_the_plate_made_after_it_does_as_figures_4_10_and_4_11_say() -> None:
    held = [time * most for time, most in TABLE_4_3]
    # 13.7, 13.1 and 15.7 cd·s/m²: the brightest pixels hold the same while the exposure grows by 15.
    assert max(held) / min(held) < 1.2
    recipe, _ = read_recipe(ROOT / "configs/stimuli/manitoba_gray.yaml")
    assert isinstance(recipe, SparklePlateRecipe)
    plate = recipe.plate.model_copy(update={"size_mm": (30.0, 20.0)})
    studio = Studio(plate, recipe.lamp, recipe.camera, 1, 1 / recipe.camera.resolution_px_per_mm)
    pictures = []
    for time, _ in TABLE_4_3:
        (photograph,) = studio.photographs("flat", time)
        pictures.append((f"{time:.3g} s", time, StereoImage.flat(photograph.xyz_cd_m2)))
    rows = contrast_over_exposure(pictures).rows
    long = rows[-1]
    assert long.max_cd_m2 == pytest.approx(TABLE_4_3[-1][1], rel=0.2)
    contrasts = [row.as_photographed.contrast.value for row in rows]
    assert contrasts == sorted(contrasts, reverse=True)
    assert contrasts[-1] < 0.75 * contrasts[0]  # Figure 4.10: contrast falls as the exposure grows
    widths = [row.width_px for row in rows]
    assert widths[-1].value - widths[0].value > 5 * np.hypot(widths[0].se, widths[-1].se)  # Figure 4.11: wider
    background = [row.exposed_background_cd_s_m2 / row.exposure_s for row in rows]
    np.testing.assert_allclose(background, background[0], rtol=0.01)


@pytest.mark.parametrize(
    ("pictures", "words"),
    [
        ([], "there is none"),
        ([("a", 1.0, exposed(1.0)), ("b", 1.0, exposed(1.0))], "there is one"),
        ([("a", 1.0, exposed(1.0)), ("b", 0.0, exposed(1.0))], "no time above 0 s"),
        ([("a", 1.0, exposed(1.0)), ("b", 2.0, StereoImage.flat(np.ones((9, 8, 3), np.float32)))], "8 × 9 px and 192"),
        ([("a", t, StereoImage.flat(np.ones((64, 64, 3), np.float32))) for t in (1.0, 2.0)], "'a', the shortest"),
    ],
)
def test_what_gives_no_series_is_refused(pictures: list[tuple[str, float, StereoImage]], words: str) -> None:
    with pytest.raises(StimulusError, match=words):
        contrast_over_exposure(pictures)


def test_where_nothing_is_full_contrast_stays() -> None:
    some = np.linspace(10, 30, 36)
    found = contrast_over_exposure([(str(t), t, exposed(t, some)) for t in (0.01, 0.1, 0.3)])
    contrasts = [row.as_photographed.contrast for row in found.rows]
    assert [one.value for one in contrasts] == pytest.approx([float(np.mean(some / BASE_CD_M2 - 1))] * 3, rel=1e-6)
    weber = some / BASE_CD_M2 - 1
    assert contrasts[0].se == pytest.approx(float(weber.std(ddof=1) / 6), rel=1e-5)


def test_pictures_are_brought_to_one_mean_which_leaves_contrast_as_it_is() -> None:
    plain, calibrated = over(0.05, 1.0), over(0.05, 1.0, mean_cd_m2=5.0)
    for before, after in zip(plain.rows, calibrated.rows, strict=True):
        assert after.mean_cd_m2 == pytest.approx(5, rel=1e-6)
        assert after.factor == pytest.approx(5 / before.mean_cd_m2, rel=1e-6)
        assert after.as_photographed.contrast.value == pytest.approx(before.as_photographed.contrast.value, rel=1e-5)
        assert after.exposed_background_cd_s_m2 == pytest.approx(before.exposed_background_cd_s_m2, rel=1e-5)


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CYCLOPEAN_CACHE", str(tmp_path / "cache"))


@pytest.fixture
def recipe(tmp_path: Path) -> Path:
    text = (ROOT / "configs/stimuli/manitoba_gray.yaml").read_text(encoding="utf-8")
    small = tmp_path / "small.yaml"
    small.write_text(text.replace("size_mm: [150, 100]", "size_mm: [15, 10]"), encoding="utf-8")
    return small


run = partial(invoked, "stimuli", "contrast")


@pytest.mark.nightly
def test_the_stereo_pictures_that_were_not_scaled_are_measured(recipe: Path, tmp_path: Path) -> None:
    figure = tmp_path / "contrast.svg"
    rig = ROOT / "configs/rigs/asus_vg248qe_3dvision.yaml"
    result = run(recipe, "--rig", rig, "-o", figure)
    assert result.exit_code == 0, result.output
    lines = result.output.splitlines()
    assert [line.split()[0] for line in lines[1:4]] == ["1.1-stereo", "2.1-stereo", "3.1-stereo"]
    assert all("on the display" in line for line in lines[1:4])
    svg = figure.read_text()
    assert "1/15" in svg
    assert "on the display" in svg
    assert "mathdefault" not in svg
    found = json.loads(run(recipe, "--rig", rig, "--json", "--mean", 5).output)
    assert [row["mean_luminance_cd_m2"] for row in found["exposures"]] == pytest.approx([5, 5, 5], rel=1e-5)
    assert found["exposures"][0]["as_shown"]["weber_contrast"]["value"] > 1
    assert run(recipe, "--pixel-pitch-mm", 0.2768, "-o", tmp_path / "contrast.pdf").exit_code == 0
    assert (tmp_path / "contrast.pdf").read_bytes().startswith(b"%PDF")


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--stimuli", "1.1-stereo,2.1-sterio"), "there is no stimulus '2.1-sterio'"),
        (("--stimuli", "1.1-stereo,1.1-flat"), "'1.1-stereo' and '1.1-flat' have one exposure, 0.0666667 s"),
        (("--stimuli", "1.1-stereo"), "two exposures or more; there is one"),
        (("-o", "contrast.png"), "the figure is no .svg or .pdf file"),
    ],
)
def test_wrong_input_is_named(recipe: Path, words: tuple[str, ...], message: str) -> None:
    result = run(recipe, "--pixel-pitch-mm", 0.2768, *words)
    assert isinstance(result.exception, InputError)
    assert message in str(result.exception)
