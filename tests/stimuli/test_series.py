"""Series of exposures of several plates: what they are called, and what makes one picture differ from another."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

import stimuli.sparkle.studio
from documents import InputError
from stimuli.build import build_set
from stimuli.pictures import StereoImage
from stimuli.recipes import read_recipe
from stimuli.recipes.build_context import BuildContext, MadePicture
from stimuli.recipes.sparkle_series import SparkleSeriesRecipe, plate_seed
from stimuli.sparkle import Studio

CONFIGS = Path(__file__).parents[2] / "configs"
FIVE = CONFIGS / "stimuli" / "exposure_series.yaml"
WHITE_XY = (0.3117, 0.3151)
PITCH_MM = 0.2768


def seen(made: MadePicture) -> StereoImage:
    """Return the picture in XYZ, as which a plate is made."""
    assert isinstance(made.image, StereoImage)
    return made.image


def make(recipe: SparkleSeriesRecipe) -> Iterator[MadePicture]:
    """Make all pictures of a recipe, for a display of `PITCH_MM`, and report to nobody."""
    context = BuildContext(Path(), {}, PITCH_MM, None, 0)
    return recipe.make(context, lambda doing, done, total: None, recipe.names())


def five(tmp_path: Path, size_mm: tuple[int, int] = (24, 16), **changes: Any) -> Path:
    """Write the recipe of the five paints, made small, with top-level values changed."""
    data: Any = yaml.safe_load(FIVE.read_text())
    data["plate"]["size_mm"] = list(size_mm)
    file = tmp_path / "recipe.yaml"
    file.write_text(yaml.safe_dump({**data, **changes}, sort_keys=False))
    return file


def series_recipe(path: Path) -> SparkleSeriesRecipe:
    recipe, _ = read_recipe(path)
    assert isinstance(recipe, SparkleSeriesRecipe)
    return recipe


@pytest.fixture(scope="module")
def recipe(tmp_path_factory: pytest.TempPathFactory) -> SparkleSeriesRecipe:
    return series_recipe(five(tmp_path_factory.mktemp("five")))


@pytest.fixture(scope="module")
def made(recipe: SparkleSeriesRecipe) -> dict[str, MadePicture]:
    return {one.name: one for one in make(recipe)}


def step(one: MadePicture, name: str) -> Any:
    (found,) = (step for step in one.steps if step["step"] == name)
    return found


# Names and factors


def test_the_thesis_s_ninety_pictures() -> None:
    factors = series_recipe(FIVE).factors()
    assert len(factors) == 90
    assert factors["HI-brighter-2.5"] == {"paint": "HI", "series": "brighter", "exposure_s": 2.5, "view": "stereo"}
    groups: dict[tuple[object, object], list[object]] = defaultdict(list)
    for one in factors.values():
        groups[one["paint"], one["series"]].append(one["exposure_s"])
    assert list(groups)[:4] == [("GM1", "base"), ("GM1", "brighter"), ("GM1", "grey"), ("GM2", "base")]
    assert len(groups) == 15
    assert all(exposures == [1.3, 1.6, 2.0, 2.5, 3.0, 4.0] for exposures in groups.values())


def test_what_is_made_is_called_as_foretold(recipe: SparkleSeriesRecipe, made: dict[str, MadePicture]) -> None:
    assert {name: one.factors for name, one in made.items()} == recipe.factors()
    assert all(re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9._-]*", name) for name in made)


def test_factors_of_the_other_kinds(tmp_path: Path) -> None:
    gray, _ = read_recipe(CONFIGS / "stimuli" / "manitoba_gray.yaml")
    factors = gray.factors()
    assert factors["1.2-flat"] == {
        "image": "1.2",
        "view": "flat",
        "exposure_s": pytest.approx(1 / 15),
        "luminance_scale": 0.51,
    }
    assert tuple(factors) == gray.names()
    file = tmp_path / "pictures.yaml"
    file.write_text(
        "schema_version: 1\nkind: pictures\nstimuli:\n"
        "  - {name: a, file: a.exr, factors: {paint: red, exposure_s: 2}}\n"
        "  - {name: b, file: b.exr, view: flat, flat_eye: left}\n"
    )
    pictures, _ = read_recipe(file)
    assert pictures.factors() == {
        "a": {"image": "a", "paint": "red", "exposure_s": 2},
        "b": {"image": "b", "view": "flat"},
    }


@pytest.mark.parametrize(
    ("factors", "message"),
    [
        ("{view: flat}", "set by the recipe"),
        ("{Paint: red}", "small letters"),
        ("{paint: true}", "'stimuli.1.factors.paint'"),
        ("{paint: ''}", "'stimuli.1.factors.paint'"),
    ],
)
def test_factors_that_cannot_be(tmp_path: Path, factors: str, message: str) -> None:
    file = tmp_path / "pictures.yaml"
    file.write_text(f"schema_version: 1\nkind: pictures\nstimuli:\n  - {{name: a, file: a.exr, factors: {factors}}}\n")
    with pytest.raises(InputError, match=rf"pictures\.yaml:4:\d+: .*{message}"):
        read_recipe(file)


# Light


def views(one: MadePicture) -> list[Any]:
    return [seen(one).left] if one.image.is_flat else [seen(one).left, seen(one).right]


def test_every_base_picture_has_the_target_luminance(recipe: SparkleSeriesRecipe, made: dict[str, MadePicture]) -> None:
    target = recipe.target_mean_luminance_cd_m2
    for name, one in made.items():
        scale = 1.33 if "brighter" in name else 1.0
        mean = np.mean([view[..., 1].mean(dtype=np.float64) for view in views(one)])
        assert mean == pytest.approx(target * scale, rel=1e-6), name


def test_one_factor_for_all_pixels_channels_and_eyes(recipe: SparkleSeriesRecipe, made: dict[str, MadePicture]) -> None:
    plate = recipe.plates[0]
    seed = plate_seed(recipe.seed, plate.name)
    studio = Studio(plate.over(recipe.plate), recipe.lamp, recipe.camera, seed, PITCH_MM)
    one = made["GM1-base-4"]
    factor = step(one, "adapt")["luminance_scale"]
    for photograph, shown in zip(studio.photographs("stereo", 4.0), views(one), strict=True):
        np.testing.assert_allclose(shown, factor * photograph.xyz_cd_m2, rtol=3e-7)


def test_grey_keeps_luminance_and_has_the_white_s_chromaticity(made: dict[str, MadePicture]) -> None:
    for name in made:
        if "-base-" in name:
            for base, grey in zip(views(made[name]), views(made[name.replace("base", "grey")]), strict=True):
                np.testing.assert_array_equal(grey[..., 1], base[..., 1])
                total = grey.sum(axis=-1, dtype=np.float64)
                np.testing.assert_allclose(grey[..., 0] / total, WHITE_XY[0], rtol=1e-6)
                np.testing.assert_allclose(grey[..., 1] / total, WHITE_XY[1], rtol=1e-6)


def test_the_longer_the_exposure_the_fuller_the_sensor_and_the_lower_the_contrast(made: dict[str, MadePicture]) -> None:
    """Figure 4.10: sparkles are cut, what lies between them is not."""
    for paint in ("GM1", "GM2", "HI", "BC", "BR"):
        series = [one for one in made.values() if (one.factors["paint"], one.factors["series"]) == (paint, "base")]
        assert [one.factors["exposure_s"] for one in series] == sorted(float(o.factors["exposure_s"]) for o in series)
        for eye in ("left", "right"):
            for channel in ("red", "green", "blue"):
                full = [step(one, "expose")["saturated_percent"][eye][channel] for one in series]
                assert all(shorter <= longer for shorter, longer in pairwise(full)), (paint, eye, channel)
                assert full[0] < full[-1], (paint, eye, channel)
        contrast = [float(seen(one).left[..., 1].max() / np.median(seen(one).left[..., 1])) for one in series]
        # Where no pixel is full, two exposures differ by the rounding of a float32.
        assert all(longer <= shorter * (1 + 1e-6) for shorter, longer in pairwise(contrast)), paint
        assert contrast[-1] < 0.8 * contrast[0], paint


# What is made, and how often


def test_each_viewpoint_is_rendered_once_and_each_exposure_developed_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    calls: dict[str, int] = {"plate_light": 0, "photograph": 0}
    for name in calls:
        real = getattr(stimuli.sparkle.studio, name)

        def counted(*args: Any, name: str = name, real: Any = real) -> Any:
            calls[name] += 1
            return real(*args)

        monkeypatch.setattr(stimuli.sparkle.studio, name, counted)
    recipe = series_recipe(five(tmp_path, (9, 6), exposures_s=[1.3, 4], views=["flat"]))
    flat = list(make(recipe))
    assert len(flat) == 5 * 3 * 2
    assert calls == {"plate_light": 5, "photograph": 5 * 2}
    assert all(one.image.is_flat and set(step(one, "render")["views"]) == {"center"} for one in flat)
    calls.update(plate_light=0, photograph=0)
    assert len(list(make(series_recipe(five(tmp_path, (9, 6), exposures_s=[1.3, 4]))))) == 30
    assert calls == {"plate_light": 5 * 2, "photograph": 5 * 2 * 2}


@pytest.mark.nightly
def test_equal_seeds_and_names_make_equal_plates_whatever_the_others(
    tmp_path: Path, recipe: SparkleSeriesRecipe, made: dict[str, MadePicture]
) -> None:
    data: Any = yaml.safe_load(FIVE.read_text())
    alone = five(tmp_path, plates=[data["plates"][3]], views=["flat", "stereo"])
    again = {one.name: one for one in make(series_recipe(alone))}
    for name in ("BC-base-1.3", "BC-grey-4"):
        np.testing.assert_array_equal(seen(again[f"{name}-stereo"]).right, seen(made[name]).right)
    other = series_recipe(five(tmp_path, plates=[data["plates"][3]], seed=2017))
    (first, *_) = make(other)
    assert not np.array_equal(seen(first).right, seen(made["BC-base-1.3"]).right)
    names = [plate.name for plate in recipe.plates]
    assert len({plate_seed(recipe.seed, name) for name in names}) == len(names)


@pytest.mark.nightly
def test_threads_make_the_same_pictures(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    data: Any = yaml.safe_load(FIVE.read_text())
    path = five(tmp_path, (9, 6), exposures_s=[1.3, 4], plates=data["plates"][:2])
    digests = []
    for jobs in (1, 3):
        monkeypatch.setenv("CYCLOPEAN_CACHE", str(tmp_path / f"cache{jobs}"))
        counted: list[int] = []

        def count(doing: str, done: int, total: int, counted: list[int] = counted) -> None:
            counted.append(done)

        made = build_set(path, PITCH_MM, count, jobs=jobs)
        assert made.names == series_recipe(path).names()
        assert counted == sorted(counted)
        assert counted[-1] == 12
        digests.append(made.digest)
    assert digests[0] == digests[1]


# What is refused


def test_parts_whose_names_meet(tmp_path: Path) -> None:
    path = five(tmp_path, plates=[{"name": "a"}, {"name": "a-b"}], series=[{"name": "c"}, {"name": "b-c"}])
    with pytest.raises(InputError, match="'a-b-c'"):
        read_recipe(path)


def test_too_many_pictures(tmp_path: Path) -> None:
    path = five(tmp_path, plates=[{"name": f"p{i}"} for i in range(60)])
    with pytest.raises(InputError, match="1080 pictures"):
        read_recipe(path)
