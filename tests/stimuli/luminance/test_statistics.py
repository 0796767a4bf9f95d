"""The columns of Table 4.3 against plain calculation."""

from __future__ import annotations

import csv
import json
import math
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from devices.display import EyeModels, read_display
from stimuli.luminance import factor_to, picture_statistics, scaled_picture
from stimuli.luminance.statistics import DynamicRange, _ends, _mean_and_deviation
from stimuli.pictures import StereoImage
from stimuli.sparkle import PixelScale, Threshold

DISPLAY = Path(__file__).parents[3] / "configs" / "displays" / "asus_vg248qe.yaml"


@pytest.fixture(scope="module")
def models() -> EyeModels:
    return read_display(DISPLAY).models("quad-buffered")


@pytest.fixture(scope="module")
def pair() -> StereoImage:
    random = np.random.default_rng(7)
    grain = random.uniform(2, 3, (2, 120, 160, 1)) * np.array([0.95, 1.0, 1.05])
    for eye, count in enumerate((9, 5)):
        places = 12 + 24 * np.arange(count)
        grain[eye, places % 110 + 3, places % 150 + 3] = [38, 40, 42]
    left, right = grain.astype(np.float32)
    return StereoImage(left, right)


def test_statistics_equal_plain_calculation(pair: StereoImage, models: EyeModels) -> None:
    told = picture_statistics(pair, models, exposure_s=1 / 15, luminance_scale=0.51, threshold=Threshold())
    assert (told.exposure_s, told.luminance_scale) == (1 / 15, 0.51)
    for eye, xyz, count in (("left", pair.left, 9), ("right", pair.right, 5)):
        one = told.eyes["left" if eye == "left" else "right"]
        light = xyz[..., 1].astype(np.float64)
        assert one.mean_cd_m2 == pytest.approx(light.mean(), rel=1e-12)
        assert one.max_cd_m2 == light.max() == 40
        assert one.rms_contrast == pytest.approx(light.std() / light.mean(), rel=1e-9)
        assert one.dynamic_range.ratio == pytest.approx(light.max() / light.min())
        assert (one.robust_range.low_cd_m2, one.robust_range.high_cd_m2) == tuple(
            np.percentile(light, [0.1, 99.9], method="nearest")
        )
        assert one.robust_range.high_cd_m2 < 3.1
        assert one.saturated is not None
        assert one.saturated.any_channel == count
        assert one.sparkles is not None
        assert one.sparkles.count.value == count
        assert one.sparkles.contrast.value == pytest.approx(40 / np.median(light) - 1, rel=0.02)


def test_a_flat_picture_is_looked_at_once(pair: StereoImage, models: EyeModels) -> None:
    told = picture_statistics(StereoImage.flat(pair.left), models)
    assert told.eyes["left"] is told.eyes["right"]
    assert told.eyes["left"].sparkles is None


def test_the_manifest_holds_no_infinity(models: EyeModels) -> None:
    dark = np.zeros((20, 20, 3), np.float32)
    told = picture_statistics(StereoImage.flat(dark), models, threshold=Threshold(0, 1), scale=PixelScale(10, 50))
    text = json.dumps(told.to_json(), allow_nan=False)
    assert json.loads(text)["eyes"]["left"]["dynamic_range"]["stops"] == 0
    dark[3, 4] = 1
    told = picture_statistics(StereoImage.flat(dark), models)
    assert told.to_json()["eyes"]["left"]["dynamic_range"]["stops"] is None
    assert told.eyes["left"].dynamic_range.ratio == math.inf


@pytest.mark.parametrize("size", [1, 63, 64, 501, 12345])
@pytest.mark.parametrize("kind", ["random", "even", "steps", "rising", "one sample of it the most"])
def test_the_ends_are_those_of_all_values_sorted(size: int, kind: str) -> None:
    rng = np.random.default_rng(size)
    values = {
        "random": rng.random(size) ** 3,
        "even": np.full(size, 2.5),
        "steps": rng.integers(0, 3, size),
        "rising": np.arange(size),
        "one sample of it the most": np.where(np.arange(size) == (size - 1) // 64 * 64, size, np.arange(size)),
    }[kind].astype(np.float32)
    low, high = np.percentile(values, (0.1, 99.9), method="nearest")
    assert _ends(values) == (values.min(), low, high, values.max())


@pytest.mark.parametrize("shape", [(1, 1), (31, 7), (32, 9), (100, 257)])
@pytest.mark.parametrize("offset", [0.0, 1e4])
def test_mean_and_deviation_in_one_pass(shape: tuple[int, int], offset: float) -> None:
    """As two passes give them, also of small differences on much light; of equal values nothing is left over."""
    values = (offset + np.random.default_rng(3).random(shape)).astype(np.float32)
    mean, deviation = _mean_and_deviation(values)
    assert mean == pytest.approx(values.mean(dtype=np.float64), rel=1e-12)
    assert deviation == pytest.approx(values.std(dtype=np.float64), rel=1e-9)
    tenth = np.float32(0.1)
    assert _mean_and_deviation(np.full(shape, tenth)) == (float(tenth), 0.0)


def test_contrasts_and_ranges_do_not_depend_on_the_factor(pair: StereoImage) -> None:
    one = picture_statistics(pair, threshold=Threshold()).eyes["right"]
    two = picture_statistics(scaled_picture(pair, 0.37), threshold=Threshold()).eyes["right"]
    assert two.rms_contrast == pytest.approx(one.rms_contrast, rel=1e-6)
    assert two.robust_range.ratio == pytest.approx(one.robust_range.ratio, rel=1e-6)
    assert one.sparkles is not None
    assert two.sparkles is not None
    assert two.sparkles.contrast.value == pytest.approx(one.sparkles.contrast.value, rel=1e-5)


def test_ten_stops() -> None:
    assert DynamicRange(0.1, 102.4).to_json()["stops"] == pytest.approx(10)
    assert DynamicRange(0.1, 100.0).to_json()["log10"] == pytest.approx(3)


@pytest.mark.shared_data
def test_what_of_table_4_3_can_be_recomputed(shared_data: Path) -> None:
    """Factors and maxima; exposures and shares of saturated pixels are of photographs that are not published."""
    with (shared_data / "reference/table_4_3_images.csv").open(encoding="utf-8") as file:
        rows = {row["image"]: row for row in csv.DictReader(file)}
    most = {name: float(row["max_luminance_cd_m2"]) for name, row in rows.items()}
    used = {name: float(row["luminance_scale"]) for name, row in rows.items()}
    assert factor_to(most["1.1"], most["2.1"]) == pytest.approx(used["1.2"], abs=0.005)
    assert factor_to(most["3.1"], most["2.1"]) == pytest.approx(6.7, abs=0.05)
    assert most["1.1"] * used["1.2"] == pytest.approx(most["1.2"], abs=0.05)
    # 27.857 is printed as 27.85: the factor has two digits after its point.
    assert most["3.1"] * used["3.2"] == pytest.approx(most["3.2"], abs=0.01)
    assert float(rows["3.2"]["saturated_red_percent"]) == 0.3
    assert max(float(row["saturated_red_percent"]) for row in rows.values()) == 0.3
    # Were the same pixels full in all, luminance times exposure would be the same.
    full_well = [most[name] * float(Fraction(rows[name]["exposure_s"])) for name in ("1.1", "2.1", "3.1")]
    assert full_well == pytest.approx([13.69, 13.09, 15.65], abs=0.005)
