"""The sparkle plate at full size, observers of spectra, and compiled loops against their twins."""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from devices.colour import delta_e_2000, delta_e_2000_of_xyz
from devices.colour_matching import (
    Departure,
    colorimetric_observer,
    cone_fundamentals,
    xyz_from_lms,
)
from devices.readings import sampling_error, xyz_from_spectra
from extensions.colour_observers import (
    STANDARD_DEVIATIONS,
    ScreenSpectra,
    individual_observer,
    individual_observers,
    observer_metamerism,
)
from extensions.sparkle import SparklePlateRecipe, plate_light, scatter_flakes
from extensions.sparkle.cull import that_matter, tiles_of
from extensions.sparkle.lamplight import illuminance_lx
from extensions.sparkle.optics import shade
from extensions.sparkle.scene import Noise
from extensions.sparkle.studio import photograph
from stimuli.align import warp
from stimuli.recipes import read_recipe
from tests.compiled_loops import not_in_numpy
from tests.stimuli.sparkle_measures.test_sparkle_measures import assert_like_the_twin, both, planted

pytestmark = pytest.mark.stress


# The sparkle plate at full size and at its edges: culled as brute force, and pictures that are light.

CONFIGS = Path(__file__).parents[2] / "configs" / "stimuli"


def recipe_of(name: str) -> SparklePlateRecipe:
    recipe, _ = read_recipe(CONFIGS / f"{name}.yaml")
    assert isinstance(recipe, SparklePlateRecipe)
    return recipe


def test_no_flake_that_matters_is_dropped_in_ten_thousand_scenes() -> None:
    recipe = recipe_of("manitoba_gray")
    random = np.random.default_rng(7)
    kept_of, flakes_of, dark_of = 0, 0, 0
    for _ in range(10_000):
        width = float(np.exp(random.uniform(np.log(0.5), np.log(600))))
        plate = replace(
            recipe.plate.plate(),
            width_mm=width,
            height_mm=width * float(random.uniform(0.2, 2)),
            lobe_sd_deg=float(np.exp(random.uniform(np.log(0.02), np.log(15)))),
            coat_refractive_index=float(random.uniform(1, 4)),
            tilt_sd_deg=float(random.uniform(1, 40)),
            diffraction_nm=555.0 if random.random() < 0.5 else None,
        )
        plate = replace(plate, flakes_per_mm2=500 / (plate.width_mm * plate.height_mm))
        lamp = recipe.lamp.model_copy(
            update={
                "zenith_deg": float(random.uniform(0, 89.9)),
                "azimuth_deg": float(random.uniform(0, 360)),
                "angular_radius_deg": float(random.uniform(0, 20)),
                "distance_mm": float(np.exp(random.uniform(np.log(10), np.log(5000))))
                if random.random() < 0.6
                else None,
                "beam_angle_deg": float(random.uniform(2, 120)) if random.random() < 0.5 else None,
            }
        )
        eye = np.array([random.uniform(-500, 500), random.uniform(-500, 500), np.exp(random.uniform(2, 8))])
        camera = recipe.camera.model_copy(update={"resolution_px_per_mm": 300 / width})
        flakes = scatter_flakes(plate, int(random.integers(1 << 30)))
        least_share = float(10.0 ** -random.uniform(1, 9))
        tiles = tiles_of(plate, camera, int(random.choice([8, 50, 256])))
        kept = that_matter(flakes, plate, lamp, eye, tiles, least_share)
        dropped = flakes.chosen(np.setdiff1d(np.arange(len(flakes)), kept))
        shares = shade(dropped, plate, lamp, eye).lobe_share
        # In tiles that a near lamp hardly lights, flakes are dropped for that: none gets that share of its light.
        x, y = dropped.x_mm.astype(np.float64), dropped.y_mm.astype(np.float64)
        light = np.broadcast_to(illuminance_lx(lamp, x, y), shares.shape) / lamp.illuminance_lx
        assert shares.size == 0 or np.minimum(shares, light).max() < least_share, (plate, lamp, eye)
        dark_of += int((shares >= least_share).sum())
        kept_of, flakes_of = kept_of + len(kept), flakes_of + len(flakes)
    assert 0.05 < kept_of / flakes_of < 0.9
    assert 0 < dark_of < kept_of


def test_pictures_of_extreme_plates_are_light() -> None:
    recipe = recipe_of("solux_cabin")
    sizes = ((0.05, 0.05), (150.0, 0.1), (0.1, 150.0), (400.0, 300.0))
    for (width, height), zenith, distance in product(sizes, (0.0, 89.9), (10.0, 1e6, None)):
        plate = replace(
            recipe.plate.plate(), width_mm=width, height_mm=height, flakes_per_mm2=min(200.0, 3000 / (width * height))
        )
        lamp = recipe.lamp.model_copy(update={"zenith_deg": zenith, "distance_mm": distance, "beam_angle_deg": None})
        camera = recipe.camera.model_copy(
            update={
                "resolution_px_per_mm": 2.0,
                "pupil_mm": 3.0,
                "noise": Noise(full_well_electrons=1000.0, read_noise_electrons=20.0),
            }
        )
        light = plate_light(plate, [lamp], camera, "left", scatter_flakes(plate, 1))
        for exposure_s in (1e-6, 1.0, 1e5):
            picture = photograph(light, camera, exposure_s, 0.3)
            assert np.isfinite(picture.xyz_cd_m2).all()
            assert picture.xyz_cd_m2.min() >= 0
        assert np.isfinite(light.spectral(0.3)).all()


# Colorimetric observers pushed to their edges: every field and age, extreme persons, hostile spectra, many objects.

WAVES = np.arange(390.0, 781.0)


def test_every_field_and_age_gives_functions_of_light() -> None:
    before: np.ndarray | None = None
    for field in np.linspace(1, 10, 19):
        for age in np.linspace(20, 80, 31):
            observer = colorimetric_observer(f"CIE 2006 {field:g} age {age:g}")
            areas = observer.functions.sum(axis=0)
            assert observer.functions.min() >= 0
            np.testing.assert_allclose(areas, areas[1], rtol=1e-9)
            assert 683 <= observer.efficacy_lm_W < 740
            # A year or half a degree changes functions a little, never by a jump.
            if before is not None and age > 20:
                assert np.abs(observer.functions - before).max() < 0.09
            before = observer.functions


def test_the_nearest_locus_is_nearer_than_any_other_that_meets_the_conditions() -> None:
    rng = np.random.default_rng(1)
    for _ in range(40):
        field, age = rng.uniform(1, 10), rng.uniform(20, 80)
        matrix = xyz_from_lms(field, age)
        _, lms = cone_fundamentals(field, age)
        from devices.colour_matching.cie_2006_xyz import _reference_locus

        reference = _reference_locus(field)
        y, z = lms @ matrix[1], lms @ matrix[2]
        place = int(np.argmin((lms @ matrix[0]) / (lms @ matrix.sum(axis=0))))
        least = reference[:, 0].min()
        # The conditions leave one direction free: of the area, and of x where it is least.
        along = np.cross(lms.sum(axis=0), (1 - least) * lms[place])
        along /= np.linalg.norm(along)

        def miss(t: float) -> float:
            x = lms @ (matrix[0] + t * along)  # noqa: B023
            locus = np.stack([x, y, z], axis=1) / (x + y + z)[:, None]  # noqa: B023
            return float(((locus - reference) ** 2).sum())  # noqa: B023

        best = miss(0.0)
        assert all(miss(t) >= best - 1e-9 for t in (-0.1, -0.01, -1e-3, 1e-3, 0.01, 0.1))


def test_persons_six_deviations_out_are_still_observers() -> None:
    rng = np.random.default_rng(5)
    spread = np.array([getattr(STANDARD_DEVIATIONS, name) for name in Departure.__slots__])
    for _ in range(500):
        drawn = np.maximum(rng.uniform(-6, 6, 8) * spread, [-1] * 2 + [-0.99] * 3 + [-99] * 3)
        person = individual_observer("far", rng.uniform(1, 10), rng.uniform(20, 80), Departure(*drawn.tolist()))
        assert np.isfinite(person.functions).all()
        assert 0.5 < person.functions[:, 1].max() < 2


def test_the_stated_sampling_error_is_linear_and_vanishes_for_whole_nanometres() -> None:
    rng = np.random.default_rng(2)
    for _ in range(50):
        spacing = int(rng.integers(1, 21))
        waves = np.arange(380.0, 781.0, spacing)
        if waves[-1] < 700:
            continue
        spectra = rng.random((5, len(waves)))
        one = sampling_error(spectra, waves, "CIE 1964 10")
        assert sampling_error(1e6 * spectra, waves, "CIE 1964 10") == pytest.approx(one, rel=1e-9, abs=1e-14)
        assert one < 1e-12 if spacing == 1 else one > 0
        np.testing.assert_allclose(
            xyz_from_spectra(spectra.sum(axis=0), waves, "CIE 2015 2")[0],
            xyz_from_spectra(spectra, waves, "CIE 2015 2").sum(axis=0),
            rtol=1e-12,
        )


def test_metamerism_does_not_depend_on_units_or_order() -> None:
    rng = np.random.default_rng(3)
    primaries = np.stack([np.exp(-(((WAVES - mid) / 20) ** 2)) for mid in (625, 535, 455)])
    black = np.full(len(WAVES), 1e-4)
    persons = individual_observers(25, 10.0)
    paints = {f"paint {n}": 0.1 + 0.2 * rng.random() + 0.1 * np.sin(WAVES / (40 + 5 * n)) for n in range(20)}
    match = colorimetric_observer("CIE 1964 10")
    lamp = 1 + 0.3 * np.cos(WAVES / 90)

    def found(light: np.ndarray, shapes: dict[str, np.ndarray], scale: float) -> np.ndarray:
        screen = ScreenSpectra(WAVES, scale * black, scale * primaries)
        return np.asarray(
            observer_metamerism(shapes, light, WAVES, screen, persons, matched_for=match).delta_e_00, dtype=float
        )

    first = found(lamp, paints, 1.0)
    np.testing.assert_allclose(found(1e-7 * lamp, paints, 1.0), first, atol=1e-7)
    np.testing.assert_allclose(found(lamp, paints, 1e-5), first, atol=1e-7)
    backwards = dict(reversed(paints.items()))
    np.testing.assert_allclose(found(lamp, backwards, 1.0)[::-1], first, atol=1e-9)


# Compiled loops against their twins in NumPy: five million pairs of colours, sparkles of every density, shifts.

COLOURS = 1_000_000
WHITE = np.array([96.4, 100.0, 82.5])


def lab_pairs(kind: str, rng: np.random.Generator) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Pairs of CIELAB: anywhere, near each other, opposite in hue, or with chroma from nothing to beyond colours."""
    first = rng.uniform([0, -130, -130], [110, 130, 130], (COLOURS, 3))
    if kind == "anywhere":
        return first, rng.permutation(first)
    if kind == "near":
        return first, first + rng.normal(0, 10.0 ** rng.uniform(-9, 1, (COLOURS, 1)), first.shape)
    if kind == "opposite":
        second = first * rng.uniform([0.9, -2, -2], [1.1, 0, 0], (COLOURS, 3))
        second[:, 2] = second[:, 1] * first[:, 2] / first[:, 1] * (1 + rng.normal(0, 1e-3, COLOURS))
        return first, second
    wide = 10.0 ** rng.uniform(-90, 55, (2, COLOURS, 1)) * [0, 1, 1] + [1, 0, 0]
    return first * wide[0], rng.permutation(first) * wide[1]


@pytest.mark.parametrize("kind", ["anywhere", "near", "opposite", "wide"])
def test_differences_of_lab(kind: str) -> None:
    first, second = lab_pairs(kind, np.random.default_rng(1))
    slow = delta_e_2000(first, second)
    with not_in_numpy("devices.colour.ciede2000_loops"):
        fast = delta_e_2000(first, second)
    np.testing.assert_allclose(fast, slow, rtol=1e-10, atol=1e-10)


def test_differences_of_xyz_from_the_dark_to_the_sun() -> None:
    rng = np.random.default_rng(2)
    first = 10.0 ** rng.uniform(-9, 9, (COLOURS, 1)) * rng.uniform(0.2, 1.0, (COLOURS, 3))
    second = first * (1 + rng.normal(0, 0.2, first.shape))
    slow = delta_e_2000_of_xyz(first, second, WHITE)
    with not_in_numpy("devices.colour.ciede2000_loops"):
        fast = delta_e_2000_of_xyz(first, second, WHITE)
    np.testing.assert_allclose(fast, slow, rtol=1e-10, atol=1e-10)


@pytest.mark.parametrize("seed", range(12))
def test_sparkles_of_every_density_and_width(seed: int) -> None:
    rng = np.random.default_rng(seed)
    count, size = int(10.0 ** rng.uniform(1, 3.5)), tuple(int(side) for side in rng.integers(150, 420, 2))
    places = rng.uniform(-3, np.array(size) + 3, (count, 2))
    light, width = 10.0 ** rng.uniform(1.5, 3.5, count), rng.uniform(0.4, 1.0 + 1.5 * rng.random(), count)
    assert_like_the_twin(*both(planted((size[0], size[1]), places, light, width, noise=rng.choice([0.0, 0.2, 1.0]))))


@pytest.mark.parametrize("seed", range(20))
def test_shifts_by_any_amount(seed: int) -> None:
    rng = np.random.default_rng(seed)
    light = rng.exponential(5.0, (*rng.integers(5, 200, 2), 3)).astype(np.float32)
    x, y = rng.uniform(-250, 250, 2) * rng.choice([1e-3, 0.1, 1.0], 2)
    matrix, size = np.array([[1.0, 0.0, x], [0.0, 1.0, y], [0.0, 0.0, 1.0]]), (int(rng.integers(1, 250)), 120)
    slow = warp(light, matrix, size)
    with not_in_numpy("stimuli.align.warping_loops"):
        fast = warp(light, matrix, size)
    np.testing.assert_allclose(fast.picture, slow.picture, rtol=0, atol=2e-6 * float(light.max()))
