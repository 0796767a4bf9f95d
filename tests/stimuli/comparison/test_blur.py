"""A rendering that is the photograph but blurred: found where it lies, and failed for its blur."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from documents.arrays import Floats32
from stimuli.comparison import CompareOptions, Comparison, compare_pictures
from stimuli.comparison.registering import align
from stimuli.comparison.sharpness import blur_between
from stimuli.comparison.sparkles import SparkleArea
from stimuli.measures import ViewingConditions
from stimuli.pictures import RowFile
from tests.stimuli.comparison.scenes import PLATE, SIZE, coloured, few, spots, written


def blurred(picture: Floats32, sd_px: float) -> Floats32:
    return coloured(gaussian_filter(picture[..., 1].astype(np.float64), sd_px))


def noisy(picture: Floats32, share: float, seed: int = 3) -> Floats32:
    return np.asarray(picture * (1 + share * np.random.default_rng(seed).standard_normal(picture.shape)), np.float32)


@pytest.mark.parametrize("sd_px", [2.0, 8.0])
def test_a_blur_is_measured_by_its_size_and_way(sd_px: float) -> None:
    photo = spots(size=(400, 300), count=2500)
    soft = noisy(blurred(photo, sd_px), 0.01)[..., 1]
    assert blur_between(photo[..., 1], soft) == pytest.approx(sd_px, rel=0.06)
    assert blur_between(soft, photo[..., 1]) == pytest.approx(-sd_px, rel=0.06)


@pytest.mark.parametrize("share", [0.0, 0.5])
def test_noise_or_other_flakes_are_no_blur(share: float) -> None:
    photo, other = spots(size=(400, 300), count=2500), spots(size=(400, 300), count=2500, seed=9)
    assert blur_between(noisy(photo, share)[..., 1], photo[..., 1]) == 0.0
    assert blur_between(noisy(photo, share)[..., 1], other[..., 1]) == 0.0


@pytest.mark.parametrize(
    ("sd_px", "way"),
    [(2.0, "rendering"), pytest.param(8.0, "photograph", marks=pytest.mark.nightly)],
)
def test_a_blurred_picture_is_registered(sd_px: float, way: str) -> None:
    photo, moved = spots(size=(400, 300), count=2500), spots(3.3, -1.7, size=(400, 300), count=2500)
    pair = (photo, blurred(moved, sd_px)) if way == "rendering" else (blurred(photo, sd_px), moved)
    found = align(RowFile.of(pair[0]), RowFile.of(pair[1]), "auto")
    assert found.shift_px == pytest.approx((3.3, -1.7), abs=0.005 * sd_px**2)
    assert found.residual_px is not None
    assert found.residual_px < 0.15
    assert abs(found.blur_px) == pytest.approx(sd_px, rel=0.06)


def test_a_blurred_rendering_fails_for_its_blur(tmp_path: Path) -> None:
    photo = few()
    files = [written(tmp_path / name, one) for name, one in (("a.exr", photo), ("b.exr", blurred(photo, 4.0)))]
    result = compare_pictures(files[0], files[1], PLATE)
    assert result.verdict.decision == "not validated"
    assert any("sparkle density" in reason.sentence for reason in result.verdict.having("fails"))
    assert any("blurrier" in line and "4.0 px" in line for line in result.lines())
    same = compare_pictures(files[0], files[0], PLATE)
    assert same.verdict.decision == "validated"
    assert not any("blurrier" in line for line in same.lines())


@pytest.mark.nightly
@pytest.mark.parametrize("moved", [0.0, 0.4])
def test_pixels_of_a_blurred_plate_count(tmp_path: Path, moved: float) -> None:
    """Few of its sparkles lie on one of the photograph's, and its flakes are the same all the same."""
    photo, other = spots(size=SIZE, count=3300), spots(moved, size=SIZE, count=3300, seed=9)
    soft = blurred(spots(moved, size=SIZE, count=3300), 2.0)
    for name, picture in (("photo", photo), ("soft", soft), ("other", other)):
        written(tmp_path / f"{name}.exr", picture)
    options = CompareOptions(viewing=ViewingConditions(40.0))
    area, reasons = _plate(compare_pictures(tmp_path / "photo.exr", tmp_path / "soft.exr", PLATE, options))
    assert area.matched is None
    assert len(area.rendering.peaks) > 50
    assert area.correlation is not None
    assert area.correlation > 0.9
    assert not area.other_flakes
    assert any("as the eye resolves them" in reason for reason in reasons)
    options = CompareOptions(viewing=ViewingConditions(40.0), register="none")
    area, reasons = _plate(compare_pictures(tmp_path / "photo.exr", tmp_path / "other.exr", PLATE, options))
    assert area.correlation is not None
    assert abs(area.correlation) < 0.1
    assert area.other_flakes
    assert not any("as the eye resolves them" in reason for reason in reasons)


def _plate(result: Comparison) -> tuple[SparkleArea, list[str]]:
    (area,) = result.eyes["both"].sparkle
    return area, [reason.sentence for reason in result.verdict.having("fails")]
