"""The sparkle generator against the physics that it claims, and its fast paths against brute force."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.special import erf
from scipy.stats import norm

from devices.colour import XYZ_from_xyY
from devices.display import read_display
from stimuli.recipes import read_recipe
from stimuli.recipes.sparkle_plate import SparklePlateRecipe
from stimuli.sparkle import plate_light, scatter_flakes
from stimuli.sparkle.camera import expose, sensor_of, splat
from stimuli.sparkle.flakes import Flakes
from stimuli.sparkle.light import Colour, Light, Term
from stimuli.sparkle.optics import Sparkles, half_way, lobe_sd, refract, shade, transmittance, view_directions
from stimuli.sparkle.scene import Camera, Lamp, Plate
from stimuli.sparkle.studio import photograph, sparkle_map

ROOT = Path(__file__).parents[2]
NONE = np.zeros(0, np.int64)


@pytest.fixture(scope="module")
def gray() -> SparklePlateRecipe:
    recipe, _ = read_recipe(ROOT / "configs" / "stimuli" / "manitoba_gray.yaml")
    assert isinstance(recipe, SparklePlateRecipe)
    return recipe


@pytest.fixture(scope="module")
def plate(gray: SparklePlateRecipe) -> Plate:
    return replace(gray.plate.plate(), width_mm=30.0, height_mm=20.0)


@pytest.fixture(scope="module")
def lamp(gray: SparklePlateRecipe) -> Lamp:
    return gray.lamp


@pytest.fixture(scope="module")
def camera(gray: SparklePlateRecipe) -> Camera:
    return gray.camera


def one_flake(slope_x: float = 0.0, slope_y: float = 0.0) -> Flakes:
    numbers = (0.0, 0.0, 0.0, 0.02, slope_x, slope_y)
    return Flakes(*(np.array([number], dtype=np.float32) for number in numbers))


def sparkle_at(x_mm: float, y_mm: float) -> Sparkles:
    return Sparkles(*(np.array([number]) for number in (x_mm, y_mm, 1000.0, 3e-4, 1.0)))


def sd_of(plate: Plate, lamp: Lamp) -> float:
    return float(lobe_sd(plate, np.radians(lamp.angular_radius_deg), 0.02))


def light_of(luminance: NDArray[np.float32], plate: Plate, lamp: Lamp, camera: Camera) -> Light:
    """Return a map of sparkles on the plate's base."""
    bare = plate_light(
        replace(plate, flakes_per_mm2=0.0), [lamp], camera, "center", scatter_flakes(plate, 1).chosen(NONE)
    )
    x, y = lamp.chromaticity_xy or (0.0, 0.0)
    sparkles = Term(luminance, Colour((x / y, 1.0, (1 - x - y) / y)))
    return replace(bare, terms=(*bare.terms, sparkles))


# Flakes


def test_flakes_follow_their_distributions(plate: Plate) -> None:
    flakes = scatter_flakes(replace(plate, flakes_per_mm2=400.0), 3)
    n = len(flakes)
    assert n == pytest.approx(400 * 600, abs=5 * np.sqrt(400 * 600))
    assert np.abs(flakes.x_mm).max() <= 15
    assert np.abs(flakes.y_mm).max() <= 10
    assert flakes.x_mm.mean() == pytest.approx(0, abs=5 * 30 / np.sqrt(12 * n))
    assert flakes.slope_x.std() == pytest.approx(np.tan(np.radians(8)), rel=0.01)
    assert flakes.slope_y.std() == pytest.approx(np.tan(np.radians(8)), rel=0.01)
    assert flakes.diameter_mm.min() >= 0.008 * (1 - 1e-6)
    assert flakes.diameter_mm.max() <= 0.080 * (1 + 1e-6)
    # The bounds cut the lognormal's tails: the median is that of what is left.
    low, high = norm.cdf(np.log(np.array([8.0, 80.0]) / plate.flake_diameter_median_um) / plate.flake_diameter_spread)
    median_um = plate.flake_diameter_median_um * np.exp(plate.flake_diameter_spread * norm.ppf(0.5 * (low + high)))
    assert np.median(flakes.diameter_mm) == pytest.approx(median_um / 1000, rel=0.01)
    assert flakes.depth_mm.min() >= 0
    assert flakes.depth_mm.max() <= 0.040


# Optics


def test_refraction_obeys_snell() -> None:
    for zenith in (0.0, 30.0, 80.0):
        outside = np.array([np.sin(np.radians(zenith)), 0.0, np.cos(np.radians(zenith))])
        inside = refract(outside, 1.5)
        assert np.linalg.norm(inside) == pytest.approx(1.0)
        assert 1.5 * inside[0] == pytest.approx(outside[0])
    np.testing.assert_allclose(refract(outside, 1.0), outside)


def test_fresnel_at_the_normal_and_at_brewster_s_angle() -> None:
    assert transmittance(1.0, 1.0, 1.5) == pytest.approx(0.96)
    outside, inside = np.cos(np.arctan(1.5)), np.cos(np.arctan(1 / 1.5))
    across = (outside - 1.5 * inside) / (outside + 1.5 * inside)
    assert transmittance(outside, inside, 1.5) == pytest.approx(1 - across**2 / 2)
    assert transmittance(0.0, inside, 1.5) == pytest.approx(0.0)


def test_a_flake_gives_back_the_light_that_it_receives(plate: Plate, lamp: Lamp) -> None:
    """Integrate the luminance inside the coat over directions: it must be reflectance times illuminance."""
    index, tilted = plate.coat_refractive_index, lamp.model_copy(update={"zenith_deg": 25.0})
    incoming = refract(tilted.direction, index)
    mirror = np.array([-incoming[0], -incoming[1], incoming[2]])
    side = np.array([1.0, 0.0, 0.0])
    up = np.cross(mirror, side)
    step = 0.5 * sd_of(plate, tilted)
    total = 0.0
    for a in np.arange(-14, 15) * step:
        for b in np.arange(-14, 15) * step:
            ray = mirror + a * side + b * up
            solid_angle = step**2 / np.linalg.norm(ray) ** 3
            ray = ray / np.linalg.norm(ray)
            out = np.array([index * ray[0], index * ray[1], 0.0])
            out[2] = np.sqrt(1.0 - out[0] ** 2 - out[1] ** 2)
            seen = shade(one_flake(), plate, tilted, 1e6 * out)
            inside = float(seen.luminance_cd_m2[0]) * index**2 / transmittance(out[2], ray[2], index)
            total += float(inside * solid_angle)
    through = transmittance(tilted.direction[2], incoming[2], index)
    received = tilted.illuminance_lx * through / incoming[2]
    assert total == pytest.approx(plate.flake_reflectance * received, rel=2e-3)


def test_a_flake_is_brightest_half_way(plate: Plate, lamp: Lamp, camera: Camera) -> None:
    eye = camera.position_mm("center")
    h = half_way(refract(view_directions(np.zeros(1), np.zeros(1), eye), 1.5), refract(lamp.direction, 1.5))[0]
    best = shade(one_flake(h[0] / h[2], h[1] / h[2]), plate, lamp, eye)
    assert best.lobe_share[0] == pytest.approx(1.0, abs=1e-6)
    off = np.tan(np.arctan(h[1] / h[2]) + sd_of(plate, lamp))
    beside = shade(one_flake(0.0, off), plate, lamp, eye)
    assert beside.lobe_share[0] == pytest.approx(np.exp(-0.5), rel=1e-3)


def test_depth_moves_a_flake_between_the_eyes(plate: Plate, lamp: Lamp, camera: Camera) -> None:
    deep = replace(one_flake(), depth_mm=np.array([0.3], np.float32))
    left, right = (shade(deep, plate, lamp, camera.position_mm(eye)).x_mm[0] for eye in ("left", "right"))
    # Behind the surface: uncrossed, by depth × the difference of tangents inside the coat.
    sine = 32.5 / np.hypot(32.5, 700) / 1.5
    assert right - left == pytest.approx(2 * 0.3 * sine / np.sqrt(1 - sine**2), rel=1e-6)


# Lens


def splat_plain(sparkles: Sparkles, plate: Plate, camera: Camera) -> NDArray[np.float64]:
    """The slow obvious twin: every flake's Gaussian over every pixel."""
    columns, rows = camera.grid_px(plate)
    size = plate.width_mm / columns, plate.height_mm / rows
    image = np.zeros((rows, columns))
    for x, y, luminance, area in zip(
        sparkles.x_mm, sparkles.y_mm, sparkles.luminance_cd_m2, sparkles.area_mm2, strict=True
    ):
        across = (np.arange(columns + 1) - (x + plate.width_mm / 2) / size[0]) / camera.point_spread_sd_px
        down = (np.arange(rows + 1) - (plate.height_mm / 2 - y) / size[1]) / camera.point_spread_sd_px
        shares = [np.diff(0.5 * (1 + erf(edges / np.sqrt(2)))) for edges in (down, across)]
        image += luminance * area / (size[0] * size[1]) * np.outer(*shares)
    return image


def test_the_lens_spreads_light_as_the_plain_twin(plate: Plate, camera: Camera) -> None:
    small = replace(plate, width_mm=3.0, height_mm=2.0)
    random = np.random.default_rng(1)
    n = 40
    sparkles = Sparkles(
        random.uniform(-1.6, 1.6, n),
        random.uniform(-1.1, 1.1, n),
        random.uniform(0, 1e4, n),
        np.full(n, 3e-4),
        np.ones(n),
    )
    slow = splat_plain(sparkles, small, camera)
    for tile_px in (256, 7):
        image, visited = splat(sparkles, small, camera, tile_px)
        np.testing.assert_allclose(image, slow, rtol=0, atol=3e-4 * slow.max())
        assert visited == 1 if tile_px == 256 else 10 < visited <= n


# Sensor


def test_below_the_full_well_the_sensor_is_exact(camera: Camera, lamp: Lamp) -> None:
    sensor = sensor_of(camera)
    base = np.array([3.4, 3.5, 3.6])
    white = XYZ_from_xyY([*(lamp.chromaticity_xy or ()), 1.0])
    sparkle = np.array([[0.0, 1.0, 40.0]], np.float32)

    def light(map_cd_m2: NDArray[np.float32]) -> Light:
        terms = Term(1.0, Colour(tuple(base.tolist()))), Term(map_cd_m2, Colour(tuple(white.tolist())))
        return Light(terms, (3, 1), (3.0, 1.0))

    fill = np.stack(expose(light(sparkle), 1 / 15, sensor), axis=-1)
    assert fill.max() < 1
    np.testing.assert_allclose(fill @ sensor.XYZ_from_raw.T * 15, base + sparkle[..., None] * white, rtol=1e-5)
    fill = np.stack(expose(light(sparkle * 1e6), 1 / 15, sensor), axis=-1)
    np.testing.assert_array_equal(fill[0, 1:], 1.0)


def test_a_photograph_without_flakes_is_the_matt_base(plate: Plate, lamp: Lamp, camera: Camera) -> None:
    bare = replace(plate, flakes_per_mm2=0.0)
    flakes = scatter_flakes(bare, 1)
    assert len(flakes) == 0
    light = plate_light(bare, [lamp], camera, "left", flakes)
    assert len(light.terms) == 1
    assert light.counts["tiles"] == 0
    picture = photograph(light, camera, 1 / 8, 0.25)
    luminance = bare.base_reflectance * lamp.illuminance_lx / np.pi
    expected = XYZ_from_xyY([0.328, 0.338, luminance])
    assert picture.xyz_cd_m2.shape == (80, 120, 3)
    np.testing.assert_allclose(picture.xyz_cd_m2, np.broadcast_to(expected, (80, 120, 3)), rtol=1e-5)
    assert picture.saturated_percent == (0.0, 0.0, 0.0)


# The recipe as a whole


@pytest.mark.nightly
def test_the_grey_plate_clips_as_table_4_3_says(gray: SparklePlateRecipe) -> None:
    """The shares of clipped pixels are of the table's order: within a factor of three, and none where it has none."""
    plate, lamp, camera = gray.plate.plate(), gray.lamp, gray.camera
    model = read_display(ROOT / "configs" / "displays" / "asus_vg248qe.yaml").models("side-by-side").left
    light = plate_light(plate, [lamp], camera, "center", scatter_flakes(plate, gray.seed))
    table = {
        "1.1": (0.158, 0.034),
        "1.2": (0.039, 0.006),
        "2.1": (0.145, 0.028),
        "3.1": (0.009, 0.0),
        "3.2": (0.3, 0.0),
    }
    for stimulus in gray.stimuli:
        picture = photograph(light, camera, stimulus.exposure_s, 0.2768)
        clipping = model.clipping(picture.xyz_cd_m2 * stimulus.luminance_scale)
        red, green = table[stimulus.name]
        assert red / 3 < clipping.percent(clipping.red) < red * 3, stimulus.name
        assert green / 3 <= clipping.percent(clipping.green) <= green * 3, stimulus.name


def test_equal_seeds_scatter_equal_flakes(plate: Plate) -> None:
    one, same, other = scatter_flakes(plate, 1), scatter_flakes(plate, 1), scatter_flakes(plate, 2)
    np.testing.assert_array_equal(one.slope_x, same.slope_x)
    np.testing.assert_array_equal(one.diameter_mm, same.diameter_mm)
    assert len(one) != len(other) or not np.array_equal(one.x_mm, other.x_mm)


@pytest.mark.nightly
def test_eyes_share_sparkles_as_their_half_way_directions_say(plate: Plate, lamp: Lamp, camera: Camera) -> None:
    """Gaussian lobes over slopes of nearly constant density correlate as exp(−d² / 4σ²)."""
    small = replace(plate, width_mm=4.0, height_mm=4.0, flakes_per_mm2=60_000.0)
    flakes = scatter_flakes(small, 5)
    left, right = (shade(flakes, small, lamp, camera.position_mm(eye)) for eye in ("left", "right"))
    one, other = left.lobe_share, right.lobe_share
    got = np.sum(one * other) / np.sqrt(np.sum(one**2) * np.sum(other**2))
    zero = np.zeros(1)
    h = [
        half_way(refract(view_directions(zero, zero, camera.position_mm(eye)), 1.5), refract(lamp.direction, 1.5))[0]
        for eye in ("left", "right")
    ]
    apart = np.arccos(h[0] @ h[1])
    assert got == pytest.approx(np.exp(-(apart**2) / (4 * sd_of(small, lamp) ** 2)), rel=0.03)


def test_without_a_distance_between_them_the_eyes_agree(plate: Plate, lamp: Lamp, camera: Camera) -> None:
    cyclops = camera.model_copy(update={"interpupillary_distance_mm": 0.0})
    flakes = scatter_flakes(plate, 5)
    maps = [sparkle_map(plate, lamp, cyclops, eye, flakes).luminance_cd_m2 for eye in ("left", "center", "right")]
    np.testing.assert_array_equal(maps[0], maps[1])
    np.testing.assert_array_equal(maps[0], maps[2])
    apart = sparkle_map(plate, lamp, camera, "left", flakes).luminance_cd_m2
    assert not np.array_equal(maps[0], apart)


def test_the_eyes_are_mirror_images(plate: Plate, lamp: Lamp, camera: Camera) -> None:
    """Mirror the plate left to right: with the lamp straight above, the left eye sees what the right one saw."""
    flakes = scatter_flakes(plate, 5)
    mirrored = replace(flakes, x_mm=-flakes.x_mm, slope_x=-flakes.slope_x)
    left = sparkle_map(plate, lamp, camera, "left", flakes).luminance_cd_m2
    right = sparkle_map(plate, lamp, camera, "right", mirrored).luminance_cd_m2
    np.testing.assert_allclose(left, right[:, ::-1], rtol=1e-4, atol=1e-4)


def test_the_lens_keeps_all_light_and_its_place(plate: Plate, camera: Camera) -> None:
    luminance, visited = splat(sparkle_at(2.5, 3.25), plate, camera, 16)
    assert visited == 1
    image = luminance.astype(np.float64)
    rows, columns = image.shape
    pixel = (plate.width_mm / columns) * (plate.height_mm / rows)
    assert image.sum() * pixel == pytest.approx(1000.0 * 3e-4, rel=1e-6)
    x = (image.sum(axis=0) @ (np.arange(columns) + 0.5)) / image.sum() * plate.width_mm / columns
    y = (image.sum(axis=1) @ (np.arange(rows) + 0.5)) / image.sum() * plate.height_mm / rows
    assert x - plate.width_mm / 2 == pytest.approx(2.5, abs=1e-3)
    assert plate.height_mm / 2 - y == pytest.approx(3.25, abs=1e-3)


def test_full_pixels_have_the_table_s_luminance(camera: Camera) -> None:
    sensor = sensor_of(camera)
    for exposure_s, luminance in ((1 / 15, 205.3), (1 / 8, 109.6), (1.0, 13.7)):
        full = sensor.XYZ_from_raw @ np.ones(3) / exposure_s
        assert full[1] == pytest.approx(luminance, rel=2e-3)


def test_a_longer_exposure_cuts_sparkles_and_leaves_the_base(plate: Plate, lamp: Lamp, camera: Camera) -> None:
    light = plate_light(plate, [lamp], camera, "left", scatter_flakes(plate, 4))
    short, long = (photograph(light, camera, seconds, 0.25) for seconds in (1 / 15, 1.0))
    assert long.xyz_cd_m2[..., 1].max() <= 13.7 * 1.001 < short.xyz_cd_m2[..., 1].max()
    assert max(long.saturated_percent) > max(short.saturated_percent)
    np.testing.assert_allclose(np.median(long.xyz_cd_m2, (0, 1)), np.median(short.xyz_cd_m2, (0, 1)), rtol=1e-3)


def test_a_photograph_never_has_negative_light(plate: Plate, lamp: Lamp, camera: Camera) -> None:
    """Between one full channel and three, the sensor's colours leave XYZ's positive octant only if the matrix does."""
    luminance = np.geomspace(1e-3, 1e6, 292 * 438, dtype=np.float32).reshape(292, 438)
    picture = photograph(light_of(luminance, plate, lamp, camera), camera, 1 / 15, 0.0685)
    assert picture.xyz_cd_m2.min() > 0
