"""The sparkle generator against the physics that it claims, and its fast paths against brute force."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.special import erf
from scipy.stats import norm

from devices.colour import XYZ_from_xyY
from devices.display import read_display
from extensions.sparkle import SparklePlateRecipe, plate_light, scatter_flakes
from extensions.sparkle.camera import expose, sensor_of, splat
from extensions.sparkle.cull import LEAST_LOBE_SHARE, Tiles, lit, slope_circles, that_matter, tiles_of, whole
from extensions.sparkle.flakes import Flakes
from extensions.sparkle.lamplight import illuminance_lx, lamp_directions, most_illuminance_lx
from extensions.sparkle.light import Colour, LightTerm, PlateLight
from extensions.sparkle.optics import Sparkles, half_way, lobe_sd, refract, shade, transmittance, view_directions
from extensions.sparkle.scene import Camera, Lamp, Plate
from extensions.sparkle.studio import photograph, sparkle_map
from stimuli.recipes import read_recipe
from tests.threads import shared_and_alike

# The sparkle generator against the physics that it claims, and its fast paths against brute force.

ROOT = Path(__file__).parents[3]


@pytest.fixture(scope="module")
def gray() -> SparklePlateRecipe:
    recipe, _ = read_recipe(ROOT / "configs" / "stimuli" / "manitoba_gray.yaml")
    assert isinstance(recipe, SparklePlateRecipe)
    return recipe


@pytest.fixture(scope="module")
def sparkle_plate(gray: SparklePlateRecipe) -> Plate:
    return replace(gray.plate.plate(), width_mm=30.0, height_mm=20.0)


@pytest.fixture(scope="module")
def sparkle_lamp(gray: SparklePlateRecipe) -> Lamp:
    return gray.lamp


@pytest.fixture(scope="module")
def sparkle_camera(gray: SparklePlateRecipe) -> Camera:
    return gray.camera


def one_flake(slope_x: float = 0.0, slope_y: float = 0.0) -> Flakes:
    numbers = (0.0, 0.0, 0.0, 0.02, slope_x, slope_y)
    return Flakes(*(np.array([number], dtype=np.float32) for number in numbers))


def sd_of(sparkle_plate: Plate, sparkle_lamp: Lamp) -> float:
    return float(lobe_sd(sparkle_plate, np.radians(sparkle_lamp.angular_radius_deg), 0.02))


# Flakes


def test_flakes_follow_their_distributions(sparkle_plate: Plate) -> None:
    flakes = scatter_flakes(replace(sparkle_plate, flakes_per_mm2=400.0), 3)
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
    low, high = norm.cdf(
        np.log(np.array([8.0, 80.0]) / sparkle_plate.flake_diameter_median_um) / sparkle_plate.flake_diameter_spread
    )
    median_um = sparkle_plate.flake_diameter_median_um * np.exp(
        sparkle_plate.flake_diameter_spread * norm.ppf(0.5 * (low + high))
    )
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


def test_a_flake_gives_back_the_light_that_it_receives(sparkle_plate: Plate, sparkle_lamp: Lamp) -> None:
    """Integrate the luminance inside the coat over directions: it must be reflectance times illuminance."""
    index, tilted = sparkle_plate.coat_refractive_index, sparkle_lamp.model_copy(update={"zenith_deg": 25.0})
    incoming = refract(tilted.direction, index)
    mirror = np.array([-incoming[0], -incoming[1], incoming[2]])
    side = np.array([1.0, 0.0, 0.0])
    up = np.cross(mirror, side)
    step = 0.5 * sd_of(sparkle_plate, tilted)
    total = 0.0
    for a in np.arange(-14, 15) * step:
        for b in np.arange(-14, 15) * step:
            ray = mirror + a * side + b * up
            solid_angle = step**2 / np.linalg.norm(ray) ** 3
            ray = ray / np.linalg.norm(ray)
            out = np.array([index * ray[0], index * ray[1], 0.0])
            out[2] = np.sqrt(1.0 - out[0] ** 2 - out[1] ** 2)
            seen = shade(one_flake(), sparkle_plate, tilted, 1e6 * out)
            inside = float(seen.luminance_cd_m2[0]) * index**2 / transmittance(out[2], ray[2], index)
            total += float(inside * solid_angle)
    through = transmittance(tilted.direction[2], incoming[2], index)
    received = tilted.illuminance_lx * through / incoming[2]
    assert total == pytest.approx(sparkle_plate.flake_reflectance * received, rel=2e-3)


def test_a_flake_is_brightest_half_way(sparkle_plate: Plate, sparkle_lamp: Lamp, sparkle_camera: Camera) -> None:
    eye = sparkle_camera.position_mm("center")
    h = half_way(refract(view_directions(np.zeros(1), np.zeros(1), eye), 1.5), refract(sparkle_lamp.direction, 1.5))[0]
    best = shade(one_flake(h[0] / h[2], h[1] / h[2]), sparkle_plate, sparkle_lamp, eye)
    assert best.lobe_share[0] == pytest.approx(1.0, abs=1e-6)
    off = np.tan(np.arctan(h[1] / h[2]) + sd_of(sparkle_plate, sparkle_lamp))
    beside = shade(one_flake(0.0, off), sparkle_plate, sparkle_lamp, eye)
    assert beside.lobe_share[0] == pytest.approx(np.exp(-0.5), rel=1e-3)


def test_depth_moves_a_flake_between_the_eyes(sparkle_plate: Plate, sparkle_lamp: Lamp, sparkle_camera: Camera) -> None:
    deep = replace(one_flake(), depth_mm=np.array([0.3], np.float32))
    left, right = (
        shade(deep, sparkle_plate, sparkle_lamp, sparkle_camera.position_mm(eye)).x_mm[0] for eye in ("left", "right")
    )
    # Behind the surface: uncrossed, by depth × the difference of tangents inside the coat.
    sine = 32.5 / np.hypot(32.5, 700) / 1.5
    assert right - left == pytest.approx(2 * 0.3 * sine / np.sqrt(1 - sine**2), rel=1e-6)


# Lens


def splat_plain(sparkles: Sparkles, sparkle_plate: Plate, sparkle_camera: Camera) -> NDArray[np.float64]:
    """The slow obvious twin: every flake's Gaussian over every pixel."""
    columns, rows = sparkle_camera.grid_px(sparkle_plate)
    size = sparkle_plate.width_mm / columns, sparkle_plate.height_mm / rows
    image = np.zeros((rows, columns))
    for x, y, luminance, area in zip(
        sparkles.x_mm, sparkles.y_mm, sparkles.luminance_cd_m2, sparkles.area_mm2, strict=True
    ):
        across = (
            np.arange(columns + 1) - (x + sparkle_plate.width_mm / 2) / size[0]
        ) / sparkle_camera.point_spread_sd_px
        down = (np.arange(rows + 1) - (sparkle_plate.height_mm / 2 - y) / size[1]) / sparkle_camera.point_spread_sd_px
        shares = [np.diff(0.5 * (1 + erf(edges / np.sqrt(2)))) for edges in (down, across)]
        image += luminance * area / (size[0] * size[1]) * np.outer(*shares)
    return image


def test_the_lens_spreads_light_as_the_plain_twin(sparkle_plate: Plate, sparkle_camera: Camera) -> None:
    small = replace(sparkle_plate, width_mm=3.0, height_mm=2.0)
    random = np.random.default_rng(1)
    n = 40
    sparkles = Sparkles(
        random.uniform(-1.6, 1.6, n),
        random.uniform(-1.1, 1.1, n),
        random.uniform(0, 1e4, n),
        np.full(n, 3e-4),
        np.ones(n),
    )
    slow = splat_plain(sparkles, small, sparkle_camera)
    for tile_px in (256, 7):
        image, visited = splat(sparkles, small, sparkle_camera, tile_px)
        np.testing.assert_allclose(image, slow, rtol=0, atol=3e-4 * slow.max())
        assert visited == 1 if tile_px == 256 else 10 < visited <= n


# Sensor


def test_below_the_full_well_the_sensor_is_exact(sparkle_camera: Camera, sparkle_lamp: Lamp) -> None:
    sensor = sensor_of(sparkle_camera)
    base = np.array([3.4, 3.5, 3.6])
    white = XYZ_from_xyY([*(sparkle_lamp.chromaticity_xy or ()), 1.0])
    sparkle = np.array([[0.0, 1.0, 40.0]], np.float32)

    def light(map_cd_m2: NDArray[np.float32]) -> PlateLight:
        terms = LightTerm(1.0, Colour(tuple(base.tolist()))), LightTerm(map_cd_m2, Colour(tuple(white.tolist())))
        return PlateLight(terms, (3, 1), (3.0, 1.0))

    fill = np.stack(expose(light(sparkle), 1 / 15, sensor), axis=-1)
    assert fill.max() < 1
    np.testing.assert_allclose(fill @ sensor.XYZ_from_raw.T * 15, base + sparkle[..., None] * white, rtol=1e-5)
    fill = np.stack(expose(light(sparkle * 1e6), 1 / 15, sensor), axis=-1)
    np.testing.assert_array_equal(fill[0, 1:], 1.0)


def test_a_photograph_without_flakes_is_the_matt_base(
    sparkle_plate: Plate, sparkle_lamp: Lamp, sparkle_camera: Camera
) -> None:
    bare = replace(sparkle_plate, flakes_per_mm2=0.0)
    flakes = scatter_flakes(bare, 1)
    assert len(flakes) == 0
    light = plate_light(bare, [sparkle_lamp], sparkle_camera, "left", flakes)
    assert len(light.terms) == 1
    assert light.counts["tiles"] == 0
    picture = photograph(light, sparkle_camera, 1 / 8, 0.25)
    luminance = bare.base_reflectance * sparkle_lamp.illuminance_lx / np.pi
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


def test_the_eyes_are_mirror_images(sparkle_plate: Plate, sparkle_lamp: Lamp, sparkle_camera: Camera) -> None:
    """Mirror the plate left to right: with the lamp straight above, the left eye sees what the right one saw."""
    flakes = scatter_flakes(sparkle_plate, 5)
    mirrored = replace(flakes, x_mm=-flakes.x_mm, slope_x=-flakes.slope_x)
    left = sparkle_map(sparkle_plate, sparkle_lamp, sparkle_camera, "left", flakes).luminance_cd_m2
    right = sparkle_map(sparkle_plate, sparkle_lamp, sparkle_camera, "right", mirrored).luminance_cd_m2
    np.testing.assert_allclose(left, right[:, ::-1], rtol=1e-4, atol=1e-4)


def test_full_pixels_have_the_table_s_luminance(sparkle_camera: Camera) -> None:
    sensor = sensor_of(sparkle_camera)
    for exposure_s, luminance in ((1 / 15, 205.3), (1 / 8, 109.6), (1.0, 13.7)):
        full = sensor.XYZ_from_raw @ np.ones(3) / exposure_s
        assert full[1] == pytest.approx(luminance, rel=2e-3)


def test_a_longer_exposure_cuts_sparkles_and_leaves_the_base(
    sparkle_plate: Plate, sparkle_lamp: Lamp, sparkle_camera: Camera
) -> None:
    light = plate_light(sparkle_plate, [sparkle_lamp], sparkle_camera, "left", scatter_flakes(sparkle_plate, 4))
    short, long = (photograph(light, sparkle_camera, seconds, 0.25) for seconds in (1 / 15, 1.0))
    assert long.xyz_cd_m2[..., 1].max() <= 13.7 * 1.001 < short.xyz_cd_m2[..., 1].max()
    assert max(long.saturated_percent) > max(short.saturated_percent)
    np.testing.assert_allclose(np.median(long.xyz_cd_m2, (0, 1)), np.median(short.xyz_cd_m2, (0, 1)), rtol=1e-3)


# What culling and tiles skip, against brute force.

RECIPE, _ = read_recipe(ROOT / "configs" / "stimuli" / "manitoba_gray.yaml")
assert isinstance(RECIPE, SparklePlateRecipe)
PLATE = replace(RECIPE.plate.plate(), width_mm=30.0, height_mm=20.0)
LAMP, CAMERA = RECIPE.lamp, RECIPE.camera
NEAR = LAMP.model_copy(update={"distance_mm": 300.0, "angular_radius_deg": 4.0, "beam_angle_deg": 36.0})


@pytest.mark.parametrize("lamp", [LAMP, NEAR], ids=["far", "near"])
@pytest.mark.parametrize("eye", ["left", pytest.param("right", marks=pytest.mark.nightly)])
def test_the_culled_render_equals_brute_force(lamp: Lamp, eye: str) -> None:
    flakes = scatter_flakes(PLATE, 9)
    base = PLATE.base_reflectance * lamp.illuminance_lx / np.pi
    fast = sparkle_map(PLATE, lamp, CAMERA, eye, flakes)
    slow = sparkle_map(PLATE, lamp, CAMERA, eye, flakes, cull=False)
    assert np.abs(fast.luminance_cd_m2 - slow.luminance_cd_m2).max() <= 1e-3 * base
    assert fast.luminance_cd_m2.mean() == pytest.approx(slow.luminance_cd_m2.mean(), rel=1e-4)
    assert (slow.shaded, slow.splatted) == (len(flakes), len(flakes))
    # The bound is tight: few are shaded in vain.
    assert fast.splatted < fast.shaded < (1.25 if lamp is LAMP else 1.6) * fast.splatted < 0.2 * len(flakes)


scenes = {
    "zenith": st.floats(0, 88),
    "azimuth": st.floats(0, 360),
    "lamp_mm": st.none() | st.floats(60, 3000),
    "radius": st.floats(0, 20),
    "distance": st.floats(60, 3000),
    "side": st.floats(-200, 200),
    "width": st.floats(1, 400),
    "lobe": st.floats(0.1, 8),
    "index": st.floats(1.0, 2.5),
    "diffraction": st.none() | st.floats(400, 700),
    "least_share": st.sampled_from([1e-2, 1e-4, 1e-6, 1e-8]),
    "tile_px": st.sampled_from([16, 64, 256]),
    "seed": st.integers(0, 1000),
}


@settings(max_examples=20, deadline=None)
@given(**scenes)
def test_no_flake_that_matters_is_dropped(
    zenith: float,
    azimuth: float,
    lamp_mm: float | None,
    radius: float,
    distance: float,
    side: float,
    width: float,
    lobe: float,
    index: float,
    diffraction: float | None,
    least_share: float,
    tile_px: int,
    seed: int,
) -> None:
    plate = replace(
        PLATE,
        width_mm=width,
        height_mm=0.7 * width,
        lobe_sd_deg=lobe,
        coat_refractive_index=index,
        tilt_sd_deg=15.0,
        flakes_per_mm2=8000 / (0.7 * width**2),
        diffraction_nm=diffraction,
    )
    lamp = LAMP.model_copy(
        update={"zenith_deg": zenith, "azimuth_deg": azimuth, "distance_mm": lamp_mm, "angular_radius_deg": radius}
    )
    camera = CAMERA.model_copy(update={"resolution_px_per_mm": 400 / width})
    eye = np.array([side, 0.0, distance])
    flakes = scatter_flakes(plate, seed)
    tiles = tiles_of(plate, camera, tile_px)
    kept = that_matter(flakes, plate, lamp, eye, tiles, least_share)
    assert np.all(np.diff(kept) > 0)
    dropped = flakes.chosen(np.setdiff1d(np.arange(len(flakes)), kept))
    shares = shade(dropped, plate, lamp, eye).lobe_share
    assert shares.size == 0 or shares.max() < least_share
    # And flakes put where the bound is tried hardest: half way between eye and lamp at each place, turned by a lobe's
    # reach in all directions, so that half of them matter by little and half of them do not.
    hard = at_the_edge(flakes, plate, lamp, eye, least_share)
    kept = that_matter(hard, plate, lamp, eye, tiles, least_share)
    dropped = hard.chosen(np.setdiff1d(np.arange(len(hard)), kept))
    shares = shade(dropped, plate, lamp, eye).lobe_share
    assert shares.size == 0 or shares.max() < least_share


def at_the_edge(
    flakes: Flakes, plate: Plate, lamp: Lamp, eye: np.ndarray[tuple[int, ...], np.dtype[np.float64]], least_share: float
) -> Flakes:
    from extensions.sparkle.lamplight import angular_radius
    from extensions.sparkle.optics import lobe_sd

    x, y = flakes.x_mm.astype(np.float64), flakes.y_mm.astype(np.float64)
    index = plate.coat_refractive_index
    h = half_way(refract(view_directions(x, y, eye), index), refract(lamp_directions(lamp, x, y), index))
    sd = lobe_sd(plate, angular_radius(lamp, x, y), flakes.diameter_mm.astype(np.float64))
    angle = 2 * np.arcsin(np.minimum(1.0, 0.5 * sd * np.sqrt(-2 * np.log(least_share)) * np.ones(len(x)))) * 0.999
    side = np.cross(h, [0.3, 0.5, 0.0])
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    turn = np.linspace(0, 40 * np.pi, len(flakes))[:, None]
    axis = np.cos(turn) * side + np.sin(turn) * np.cross(h, side)
    normal = np.cos(angle)[:, None] * h + np.sin(angle)[:, None] * axis
    up = normal[:, 2] > 0.01
    assume(up.any())
    chosen = flakes.chosen(up)
    slopes = (normal[up, :2] / normal[up, 2:]).astype(np.float32)
    return replace(chosen, slope_x=slopes[:, 0], slope_y=slopes[:, 1])


SPOT = NEAR.model_copy(update={"distance_mm": 120.0, "beam_angle_deg": 10.0, "angular_radius_deg": 1.0})


def test_no_flake_of_a_dark_tile_is_shaded_and_every_lit_one_as_without_a_beam() -> None:
    flakes, eye = scatter_flakes(PLATE, 1), CAMERA.position_mm("left")
    tiles = tiles_of(PLATE, CAMERA, 32)
    narrow = SPOT.model_copy(update={"distance_mm": 20.0})
    light = lit(tiles, narrow, LEAST_LOBE_SHARE)
    assert 0 < light.sum() < len(tiles)
    found = that_matter(flakes, PLATE, narrow, eye, tiles)
    everywhere = that_matter(flakes, PLATE, narrow.model_copy(update={"beam_angle_deg": None}), eye, tiles)
    tile = tiles.of_places(flakes.x_mm[everywhere], flakes.y_mm[everywhere])
    np.testing.assert_array_equal(found, everywhere[light[tile]])
    # What is dropped gets less than a millionth of the light in the middle.
    dark = flakes.chosen(everywhere[~light[tile]])
    got = illuminance_lx(narrow, dark.x_mm.astype(np.float64), dark.y_mm.astype(np.float64))
    assert np.asarray(got).max() < LEAST_LOBE_SHARE * narrow.illuminance_lx


def test_work_grows_with_what_is_seen_and_not_with_what_is_there() -> None:
    """Flakes tilted away from all half-way directions are never shaded, however many there are."""
    numbers = (0.0, 0.0, 0.01, 0.02, 2.0, -2.0)
    away = Flakes(*(np.full(100_000, number, np.float32) for number in numbers))
    found = sparkle_map(PLATE, LAMP, CAMERA, "left", away)
    assert (found.flakes, found.shaded, found.splatted, found.tiles_visited) == (100_000, 0, 0, 0)
    assert not found.luminance_cd_m2.any()


# Energy


def test_a_circle_holds_what_it_has_to_and_little_more() -> None:
    """The half-way direction itself, sampled in each tile, with a lobe next to nothing."""
    plate = replace(PLATE, width_mm=300.0, height_mm=200.0, lobe_sd_deg=1e-4)
    for lamp in (
        LAMP.model_copy(update={"angular_radius_deg": 0.0}),
        NEAR.model_copy(update={"angular_radius_deg": 0.0}),
    ):
        for tiles in (whole(plate), tiles_of(plate, CAMERA.model_copy(update={"resolution_px_per_mm": 2.0}), 50)):
            eye = CAMERA.position_mm("left")
            centres, radii = slope_circles(tiles, plate, lamp, eye, LEAST_LOBE_SHARE)
            x, y = (np.random.default_rng(1).uniform(-0.5, 0.5, (2, 200_000)).T * [300, 200]).T
            h = half_way(refract(view_directions(x, y, eye), 1.5), refract(lamp_directions(lamp, x, y), 1.5))
            slopes = h[:, :2] / h[:, 2:]
            tile = tiles.of_places(x.astype(np.float32), y.astype(np.float32))
            away = np.linalg.norm(slopes - centres[tile], axis=1) / radii[tile]
            assert 0.3 < away.max() <= 1.0


@pytest.mark.parametrize("tile_px", [1, 7, 64, 256, 10_000])
def test_tiles_cover_the_plate_once(tile_px: int) -> None:
    camera = CAMERA.model_copy(update={"resolution_px_per_mm": 3.3})
    tiles = tiles_of(PLATE, camera, tile_px)
    x, y, reach = tiles.middles_mm()
    assert len(tiles) == len(x) == len(reach) == tiles.columns * tiles.rows
    random = np.random.default_rng(2)
    px = random.uniform(-15, 15, 5000).astype(np.float32)
    py = random.uniform(-10, 10, 5000).astype(np.float32)
    tile = tiles.of_places(px, py)
    assert np.all(np.hypot(px - x[tile], py - y[tile]) <= reach[tile] * (1 + 1e-6))
    if tile_px == 64:
        assert len(np.unique(tile)) == len(tiles) == 4
    corners = tiles.of_places(np.array([-15, 15], np.float32), np.array([10, -10], np.float32))
    assert corners.tolist() == [0, len(tiles) - 1]


def test_tiles_without_content_are_not_visited() -> None:
    """Flakes that lie flat shine only where the lamp's mirror image stands: the other tiles are left alone."""
    calm = replace(PLATE, width_mm=150.0, height_mm=100.0, tilt_sd_deg=0.2, lobe_sd_deg=0.2, flakes_per_mm2=2.0)
    above = LAMP.model_copy(update={"zenith_deg": 4.0, "angular_radius_deg": 0.5})
    flakes = scatter_flakes(calm, 1)
    fast = sparkle_map(calm, above, CAMERA, "center", flakes)
    slow = sparkle_map(calm, above, CAMERA, "center", flakes, cull=False)
    assert 0 < fast.tiles_visited < 0.6 * fast.tiles
    assert slow.tiles_visited == slow.tiles == fast.tiles
    assert fast.shaded < 0.5 * len(flakes)
    np.testing.assert_allclose(
        fast.luminance_cd_m2, slow.luminance_cd_m2, atol=1e-5 * float(slow.luminance_cd_m2.max())
    )


@pytest.mark.nightly
@pytest.mark.parametrize("tile_px", [256, pytest.param(64, marks=pytest.mark.stress)])
def test_tiles_beyond_a_lamp_s_beam_are_dark_and_not_visited(tile_px: int) -> None:
    """A spot of 10° on a whole plate: most of it gets less than a millionth of the light in the middle."""
    wide = replace(PLATE, width_mm=300.0, height_mm=200.0, flakes_per_mm2=0.8, tilt_sd_deg=20.0)
    flakes = scatter_flakes(wide, 2)
    fast = sparkle_map(wide, SPOT, CAMERA, "left", flakes, tile_px=tile_px)
    slow = sparkle_map(wide, SPOT, CAMERA, "left", flakes, cull=False, tile_px=tile_px)
    assert 0 < fast.tiles_visited <= fast.tiles_lit < 0.5 * fast.tiles
    assert slow.tiles_lit == slow.tiles == fast.tiles
    peak = float(slow.luminance_cd_m2.max())
    assert float(np.abs(fast.luminance_cd_m2 - slow.luminance_cd_m2).max()) <= 3 * LEAST_LOBE_SHARE * peak
    # A beam that is not one lights all of it, and the same flakes matter as before.
    whole_plate = SPOT.model_copy(update={"beam_angle_deg": None})
    assert sparkle_map(wide, whole_plate, CAMERA, "left", flakes, tile_px=tile_px).tiles_lit == fast.tiles


@settings(max_examples=30, deadline=None)
@given(
    zenith=st.floats(0, 88),
    azimuth=st.floats(0, 360),
    lamp_mm=st.floats(5, 3000),
    beam=st.none() | st.floats(1, 170),
    width=st.floats(1, 400),
    tile_px=st.sampled_from([16, 64, 256]),
)
def test_no_place_of_a_tile_gets_more_light_than_its_bound(
    zenith: float, azimuth: float, lamp_mm: float, beam: float | None, width: float, tile_px: int
) -> None:
    plate = replace(PLATE, width_mm=width, height_mm=0.7 * width)
    lamp = LAMP.model_copy(
        update={"zenith_deg": zenith, "azimuth_deg": azimuth, "distance_mm": lamp_mm, "beam_angle_deg": beam}
    )
    tiles = tiles_of(plate, CAMERA.model_copy(update={"resolution_px_per_mm": 200 / width}), tile_px)
    x, y = (0.5 * side * np.linspace(-1, 1, 81) for side in (plate.width_mm, plate.height_mm))
    places = [grid.ravel() for grid in np.meshgrid(x, y)]
    tile = tiles.of_places(places[0].astype(np.float32), places[1].astype(np.float32))
    middle_x, middle_y, reach = tiles.middles_mm()
    bound = most_illuminance_lx(lamp, middle_x, middle_y, reach * (1 + 1e-5))
    assert np.all(illuminance_lx(lamp, *places) <= bound[tile] * (1 + 1e-12))


def test_the_bound_of_light_is_tight_in_small_tiles() -> None:
    tiles = tiles_of(replace(PLATE, width_mm=150.0, height_mm=100.0), CAMERA, 8)
    x, y, reach = tiles.middles_mm()
    light = np.asarray(illuminance_lx(NEAR, x, y))
    assert np.all(light <= most_illuminance_lx(NEAR, x, y, reach))
    assert np.all(most_illuminance_lx(NEAR, x, y, reach) <= 1.05 * light)


@pytest.mark.nightly
@pytest.mark.parametrize(("pitch_mm", "tolerance"), [(0.25, 1e-5), (0.2768, 1e-3)])
def test_halving_the_display_s_pixels_does_not_change_the_mean_luminance(pitch_mm: float, tolerance: float) -> None:
    """The whole plate, the sensor not full; at the shipped display's pitch the plate's border cuts through pixels."""
    plate = replace(PLATE, width_mm=150.0, height_mm=100.0, flakes_per_mm2=20.0)
    light = plate_light(plate, [LAMP], CAMERA, "left", scatter_flakes(plate, 3))
    one, half = (
        float(photograph(light, CAMERA, 1e-4, pitch).xyz_cd_m2[..., 1].mean(dtype=np.float64))
        for pitch in (pitch_mm, pitch_mm / 2)
    )
    assert half == pytest.approx(one, rel=tolerance)


def test_tiles_change_no_pixel() -> None:
    flakes = scatter_flakes(PLATE, 9)
    usual = sparkle_map(PLATE, LAMP, CAMERA, "left", flakes).luminance_cd_m2
    for tile_px in (128, 37):
        again = sparkle_map(PLATE, LAMP, CAMERA, "left", flakes, tile_px=tile_px).luminance_cd_m2
        np.testing.assert_allclose(again, usual, rtol=1e-6, atol=1e-9)


def test_one_thread_or_several_give_the_same_bits(monkeypatch: pytest.MonkeyPatch) -> None:
    plate = replace(PLATE, width_mm=12.0, height_mm=9.0)
    scene = plate, LAMP, CAMERA, "left", scatter_flakes(plate, 1)
    shared_and_alike(lambda: sparkle_map(*scene, cull=False, tile_px=32).luminance_cd_m2, monkeypatch)


def test_equal_tiles_are_equal_values() -> None:
    assert tiles_of(PLATE, CAMERA) == Tiles(30.0, 20.0, 438, 292, 256)
