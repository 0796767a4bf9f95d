"""The room of measures: the table, both eyes, pixels left out; SSIM and the signal-to-noise ratio on PU21's values."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from documents.pages import ShownAs
from stimuli.errors import StimulusError
from stimuli.measures import (
    PicturePair,
    ViewingConditions,
    measure_named,
    measure_names,
    measure_pairs,
    measure_pictures,
    measures_named,
    printed,
)
from stimuli.pictures import StereoImage
from tests.kept import known

# The room of measures: the table, both eyes, pixels left out, and what cannot be measured.

VIEWING = ViewingConditions(45.0, np.array([95.0, 100.0, 108.9]))
NAMES = ["delta-e-2000", "s-cielab", "pu-ssim", "pu-psnr"]


def picture(seed: int = 1) -> NDArray[np.float32]:
    return np.random.default_rng(seed).uniform(5.0, 60.0, (40, 50, 3)).astype(np.float32)


def stereo(left: NDArray[np.float32], right: NDArray[np.float32]) -> StereoImage:
    return StereoImage(left, right)


def test_pixels_that_do_not_count_change_nothing() -> None:
    one, other = picture(1), 1.05 * picture(1)
    counted = np.ones(one.shape[:2], dtype=bool)
    counted[:, 30:] = False
    spoilt = other.copy()
    spoilt[:, 30:] = 900.0
    plain = measure_pairs({"both": PicturePair(one, other, usable=counted)}, NAMES, VIEWING)
    planted = measure_pairs({"both": PicturePair(one, spoilt, usable=counted)}, NAMES, VIEWING)
    for name in NAMES:
        assert planted[name].eyes["both"].value == plain[name].eyes["both"].value
        errors = known(planted[name].eyes["both"].error_map)
        assert np.isnan(errors[:, 30:]).all()
    spoilt[:, 0] = 900.0
    found = measure_pairs({"both": PicturePair(one, spoilt, usable=counted)}, NAMES, VIEWING)
    assert found["delta-e-2000"].eyes["both"].value > 1.01 * plain["delta-e-2000"].eyes["both"].value


def test_an_unknown_measure_is_named() -> None:
    with pytest.raises(StimulusError, match="there is no measure 'flipp'"):
        measures_named(["flipp"])


def test_no_viewing_distance() -> None:
    with pytest.raises(StimulusError, match="--rig"):
        measure_pictures(picture(), picture(), NAMES, None)
    with pytest.raises(StimulusError, match="the white of the display is not known"):
        measure_pictures(picture(), picture(), NAMES, ViewingConditions(45.0))
    table = measure_pictures(picture(1), picture(2), "all", ViewingConditions(45.0))
    left = {row.measure.name for row in table.rows}
    assert left >= {"pu-ssim", "pu-psnr"}
    assert not left & {"delta-e-2000", "s-cielab", "flip", "hdr-flip"}
    assert table.remarks()[0].startswith("ΔE00 is left out: ")


def test_a_flat_picture_and_a_pair() -> None:
    with pytest.raises(StimulusError, match="a pair for two eyes"):
        measure_pictures(picture(), stereo(picture(), picture(2)), NAMES, VIEWING)


def test_sizes_that_differ() -> None:
    with pytest.raises(StimulusError, match=r"shapes \(40, 50, 3\) and \(39, 50, 3\)"):
        measure_pictures(picture(), picture()[1:], NAMES, VIEWING)


def test_light_that_is_no_number() -> None:
    spoilt = picture()
    spoilt[3, 4, 1] = np.nan
    with pytest.raises(StimulusError, match="the test picture of the left eye"):
        measure_pictures(stereo(picture(), picture(2)), stereo(spoilt, picture(2)), NAMES, VIEWING)


def test_pixels_that_are_usable_but_not_counted_stay_in_the_map() -> None:
    one, other = picture(1), 1.05 * picture(1)
    counted = np.zeros(one.shape[:2], dtype=bool)
    counted[10:30, 10:30] = True
    pair = PicturePair(one, other, counted=counted)
    found = measure_pairs({"both": pair}, ["delta-e-2000"], VIEWING)["delta-e-2000"].eyes["both"]
    assert np.isfinite(known(found.error_map)).all()
    assert found.value == pytest.approx(float(known(found.error_map)[counted].mean(dtype=np.float64)), rel=1e-12)


def test_flat_pictures_have_no_value_for_two_eyes() -> None:
    table = measure_pictures(picture(1), picture(2), ["delta-e-2000"], VIEWING)
    with pytest.raises(StimulusError, match="has no value for two eyes"):
        table.binocular("delta-e-2000")
    pair = measure_pictures(stereo(picture(1), picture(2)), stereo(picture(2), picture(1)), ["delta-e-2000"], VIEWING)
    assert pair.binocular("delta-e-2000") == pair["delta-e-2000"].binocular


@pytest.mark.parametrize(
    ("name", "package", "extra"), [("flip", "flip_evaluator", "measures"), ("cvvdp", "pycvvdp", "vdp")]
)
def test_a_measure_whose_package_is_missing(
    monkeypatch: pytest.MonkeyPatch, name: str, package: str, extra: str
) -> None:
    monkeypatch.setattr("stimuli.measures.measure.find_spec", lambda name: None)
    with pytest.raises(StimulusError, match=f"'{name}' needs the package {package}") as refused:
        measure_pictures(GREY, GREY, [name], ViewingConditions(45.0))
    assert f"pip install '.[{extra}]'" in str(refused.value)
    assert name in measure_names()
    assert name not in [measure.name for measure in measures_named(["all"])]


def test_the_table_that_is_told() -> None:
    table = measure_pictures(stereo(picture(1), picture(2)), stereo(picture(1), picture(3)), NAMES, VIEWING)
    told = table.told()
    assert [column.heading for column in told.columns[:4]] == ["Measure", "left", "right", "both eyes"]
    assert len(told.rows) == len(NAMES)
    assert told.rows[3][:2] == ("PU21-PSNR", ShownAs(float("inf"), "∞ dB"))
    assert [row[4] for row in told.rows] == ["lower", "lower", "higher", "higher"]


@pytest.mark.parametrize("density", [0.0, float("nan")])
def test_pixels_per_degree_that_cannot_be(density: float) -> None:
    with pytest.raises(StimulusError, match="pixels_per_degree"):
        measure_pictures(picture(), picture(), ["pu-psnr"], ViewingConditions(density, VIEWING.display_white_XYZ))


def test_a_value_beside_that_of_identical_pictures_does_not_look_like_it() -> None:
    ssim, flip = measure_named("pu-ssim"), measure_named("s-cielab")
    assert printed(1.0, ssim) == "1"
    assert printed(0.99998765, ssim) == "0.999988"
    assert printed(0.0, flip) == "0 ΔE"
    assert printed(0.0184321, flip) == "0.01843 ΔE"
    assert printed(float("inf"), measure_named("pu-psnr")) == "∞ dB"


def test_of_all_measures_one_that_cannot_take_the_pictures_is_left_out() -> None:
    narrow = picture(1)[:8]
    table = measure_pictures(narrow, 1.05 * narrow, ["all"], VIEWING)
    assert "pu-ssim" not in [row.measure.name for row in table.rows]
    assert "pu-psnr" in [row.measure.name for row in table.rows]
    assert any(remark.startswith("PU21-SSIM is left out: ") for remark in table.remarks())
    with pytest.raises(StimulusError, match="the window of SSIM"):
        measure_pictures(narrow, 1.05 * narrow, ["all", "pu-ssim"], VIEWING)
    assert measure_pictures(picture(1), picture(2), ["all"], VIEWING).left_out == ()


GREY = np.full((32, 32, 3), 40.0, dtype=np.float32)


def test_the_value_for_both_eyes_is_the_mean_of_each() -> None:
    one, other = picture(1), picture(2)
    row = measure_pictures(stereo(one, other), stereo(one, 1.1 * other), NAMES, VIEWING)["delta-e-2000"]
    assert row.eyes["left"].value == 0.0
    assert row.eyes["right"].value > 0.5
    assert row.binocular == pytest.approx(row.eyes["right"].value / 2, rel=1e-12)


def test_all_stands_for_those_that_are_installed() -> None:
    names = [measure.name for measure in measures_named(["s-cielab, all"])]
    assert names[:2] == ["s-cielab", "delta-e-2000"]
    assert len(names) == len(set(names))


def test_maps_are_kept_small_where_asked() -> None:
    row = measure_pairs({"both": PicturePair(picture(1), picture(2))}, ["delta-e-2000"], VIEWING, map_longest_px=25)
    small = known(row["delta-e-2000"].eyes["both"].error_map)
    assert small.shape == (20, 25)
    assert float(small.mean()) == pytest.approx(row["delta-e-2000"].eyes["both"].value, rel=1e-5)
