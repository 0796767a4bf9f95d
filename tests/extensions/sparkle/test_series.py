"""Series of exposures of several plates: what they are called, and what makes one picture differ from another."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

import extensions.sparkle.studio
from devices.colour import xyz_to_lab
from documents import InputError
from extensions.sparkle import Studio
from extensions.sparkle.series_recipe import SparkleSeriesRecipe, plate_seed
from stimuli.build import build_set
from stimuli.errors import StimulusError
from stimuli.pictures import StereoImage
from stimuli.recipes import BuildContext, MadePicture, read_recipe
from tests.kept import known

CONFIGS = Path(__file__).parents[3] / "configs"
FIVE = CONFIGS / "stimuli" / "exposure_series.yaml"
WHITE_XY = (0.3117, 0.3151)
PITCH_MM = 0.2768


PRELIMINARY = CONFIGS / "stimuli" / "preliminary.yaml"


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


def test_factors_of_one_plate() -> None:
    gray, _ = read_recipe(CONFIGS / "stimuli" / "manitoba_gray.yaml")
    factors = gray.factors()
    assert factors["1.2-flat"] == {
        "image": "1.2",
        "view": "flat",
        "exposure_s": pytest.approx(1 / 15),
        "luminance_scale": 0.51,
    }
    assert tuple(factors) == gray.names()


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


# What is made, and how often


def test_each_viewpoint_is_rendered_once_and_each_exposure_developed_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    calls: dict[str, int] = {"plate_light": 0, "photograph": 0}
    for name in calls:
        real = getattr(extensions.sparkle.studio, name)

        def counted(*args: Any, name: str = name, real: Any = real) -> Any:
            calls[name] += 1
            return real(*args)

        monkeypatch.setattr(extensions.sparkle.studio, name, counted)
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


# What is refused


def test_parts_whose_names_meet(tmp_path: Path) -> None:
    path = five(tmp_path, plates=[{"name": "a"}, {"name": "a-b"}], series=[{"name": "c"}, {"name": "b-c"}])
    with pytest.raises(InputError, match="'a-b-c'"):
        read_recipe(path)


def test_too_many_pictures(tmp_path: Path) -> None:
    path = five(tmp_path, plates=[{"name": f"p{i}"} for i in range(60)])
    with pytest.raises(InputError, match="1080 pictures"):
        read_recipe(path)


def test_the_preliminary_test_s_pictures_are_stereo_and_flat() -> None:
    factors = series_recipe(PRELIMINARY).factors()
    assert list(factors)[:3] == ["GM1-base-1.3-stereo", "GM1-base-1.3-flat", "GM1-base-1.6-stereo"]
    assert [one["view"] for one in factors.values()] == ["stereo", "flat"] * 6


def test_the_paints_have_the_thesis_s_tints_and_one_is_matte(made: dict[str, MadePicture]) -> None:
    x, y = WHITE_XY
    white = np.array([x / y, 1.0, (1 - x - y) / y]) * 26.5
    lab = {
        paint: xyz_to_lab(seen(made[f"{paint}-base-2"]).left.mean(axis=(0, 1), dtype=np.float64), white)
        for paint in ("GM1", "GM2", "HI", "BC", "BR")
    }
    for green in ("GM1", "GM2", "HI"):
        assert lab[green][1] < -5, green
        assert lab[green][2] > 0, green
    hue = {paint: np.degrees(np.arctan2(one[2], one[1])) for paint, one in lab.items()}
    assert 90 < hue["HI"] < hue["GM1"] - 10, "HI is the brownish green"
    assert -30 < hue["BC"] < 45
    assert -120 < hue["BR"] < -60
    outstanding = {
        paint: float(np.percentile(luminance, 99.5) / np.median(luminance))
        for paint in lab
        for luminance in [seen(made[f"{paint}-base-1.3"]).left[..., 1]]
    }
    assert outstanding["GM2"] < 2 < 3 < min(value for paint, value in outstanding.items() if paint != "GM2")


def test_a_tinted_coat_tints_what_flakes_add(recipe: SparkleSeriesRecipe) -> None:
    named = recipe.plates[0]
    tint = known(named.flakes.chromaticity_xy)
    tinted = named.over(recipe.plate)
    clear = tinted.model_copy(update={"flakes": tinted.flakes.model_copy(update={"chromaticity_xy": None})})
    dark = {"base": tinted.base.model_copy(update={"reflectance": 0.0})}
    for plate, expected in ((tinted, tint), (clear, recipe.lamp.chromaticity_xy)):
        studio = Studio(plate.model_copy(update=dark), recipe.lamp, recipe.camera, 1, PITCH_MM)
        (photograph,) = studio.photographs("flat", 1e-3)
        assert photograph.saturated_percent == (0.0, 0.0, 0.0)
        total = photograph.xyz_cd_m2.sum(axis=(0, 1), dtype=np.float64)
        np.testing.assert_allclose(total[:2] / total.sum(), known(expected), rtol=1e-5)


def test_the_preliminary_test_shows_the_plate_of_the_five() -> None:
    both, one = series_recipe(FIVE), series_recipe(PRELIMINARY)
    assert (one.seed, one.lamp, one.camera) == (both.seed, both.lamp, both.camera)
    assert one.plates[0].over(one.plate) == both.plates[0].over(both.plate)
    assert one.plates[0].name == both.plates[0].name == "GM1"
    assert one.target_mean_luminance_cd_m2 == both.target_mean_luminance_cd_m2


@pytest.mark.nightly
def test_threads_make_the_same_pictures_and_stop_at_the_first_fault(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
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

    def stop(doing: str, done: int, total: int) -> None:
        if done >= 4:
            raise KeyboardInterrupt

    monkeypatch.setenv("CYCLOPEAN_CACHE", str(tmp_path / "cache"))
    with pytest.raises(KeyboardInterrupt):
        build_set(path, PITCH_MM, stop, jobs=3)
    kept = len(list((tmp_path / "cache").glob(".*/*.exr")))
    assert 4 <= kept < 12
    again = build_set(path, PITCH_MM, jobs=3)
    assert (again.rendered, again.digest) == (12 - kept, digests[0])


def test_the_second_build_touches_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CYCLOPEAN_CACHE", str(tmp_path / "cache"))
    path = five(tmp_path, (9, 6), exposures_s=[1.3, 4])
    told: list[tuple[str, int, int]] = []
    first = build_set(path, PITCH_MM, lambda *what: told.append(what))
    assert first.names == series_recipe(path).names()
    assert first.rendered == 30
    assert ("rendering GM1-base-1.3", 0, 30) in told
    assert told[-1] == ("done", 30, 30)
    before = {file: file.stat().st_mtime_ns for file in first.folder.iterdir()}
    told.clear()
    second = build_set(path, PITCH_MM, lambda *what: told.append(what))
    assert (second.rendered, second.digest, told) == (0, first.digest, [])
    assert {file: file.stat().st_mtime_ns for file in second.folder.iterdir()} == before
    assert second.factors("BR-grey-4") == {"paint": "BR", "series": "grey", "exposure_s": 4.0, "view": "stereo"}
    stored = second.load("BR-grey-4")
    assert stored.left[..., 1].mean(dtype=np.float64) == pytest.approx(
        second.entry("BR-grey-4")["statistics"]["eyes"]["left"]["mean_luminance_cd_m2"], rel=1e-4
    )
    assert [step["step"] for step in second.entry("BR-grey-4")["steps"]] == [
        "render",
        "expose",
        "resample",
        "adapt",
        "scale",
        "greyscale",
    ]


@pytest.mark.parametrize(
    ("observers", "recipe_file"),
    [("figure_4_14", "exposure_series"), ("preliminary", "preliminary"), ("paints", "paints")],
)
def test_the_made_up_observers_score_every_picture(observers: str, recipe_file: str) -> None:
    scored = yaml.safe_load((CONFIGS / "observers" / f"{observers}.yaml").read_text())["stimuli"]
    factors = series_recipe(CONFIGS / "stimuli" / f"{recipe_file}.yaml").factors()
    assert list(scored) == list(factors)
    best: dict[tuple[object, object], str] = {}
    for name, one in factors.items():
        group = (one["paint"], one["series"])
        if group not in best or scored[name]["score"] > scored[best[group]]["score"]:
            best[group] = name
    assert {factors[name]["exposure_s"] for name in best.values()} == {4.0}
    assert {factors[name]["view"] for name in best.values()} == {"stereo"}


def test_a_plate_without_light_is_named(tmp_path: Path) -> None:
    data: Any = yaml.safe_load(FIVE.read_text())
    recipe = series_recipe(five(tmp_path, lamp={**data["lamp"], "illuminance_lx": 0}))
    with pytest.raises(StimulusError, match="the plate 'GM1' sends no light"):
        next(make(recipe))
