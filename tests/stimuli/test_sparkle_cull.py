"""What culling and tiles skip, against brute force."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from stimuli.recipes import read_recipe
from stimuli.recipes.sparkle_plate import SparklePlateRecipe
from stimuli.sparkle import plate_light, scatter_flakes
from stimuli.sparkle.cull import LEAST_LOBE_SHARE, Tiles, lit, slope_circles, that_matter, tiles_of, whole
from stimuli.sparkle.flakes import Flakes
from stimuli.sparkle.lamplight import illuminance_lx, lamp_directions, most_illuminance_lx
from stimuli.sparkle.optics import half_way, refract, shade, view_directions
from stimuli.sparkle.scene import Camera, Lamp, Plate
from stimuli.sparkle.studio import photograph, sparkle_map

ROOT = Path(__file__).parents[2]
RECIPE, _ = read_recipe(ROOT / "configs" / "stimuli" / "manitoba_gray.yaml")
assert isinstance(RECIPE, SparklePlateRecipe)
PLATE = replace(RECIPE.plate.plate(), width_mm=30.0, height_mm=20.0)
LAMP, CAMERA = RECIPE.lamp, RECIPE.camera
NEAR = LAMP.model_copy(update={"distance_mm": 300.0, "angular_radius_deg": 4.0, "beam_angle_deg": 36.0})


def mean_of(plate: Plate, camera: Camera, tile_px: int = 256) -> float:
    small = replace(plate, width_mm=60.0, height_mm=40.0)
    found = sparkle_map(small, LAMP, camera, "left", scatter_flakes(small, 3), tile_px=tile_px)
    return float(found.luminance_cd_m2.mean(dtype=np.float64))


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
    from stimuli.sparkle.lamplight import angular_radius
    from stimuli.sparkle.optics import lobe_sd

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


def test_the_error_follows_the_threshold() -> None:
    flakes = scatter_flakes(PLATE, 9)
    slow = sparkle_map(PLATE, LAMP, CAMERA, "left", flakes, cull=False).luminance_cd_m2
    work, errors = [], []
    for least_share in (1e-2, 1e-4, 1e-6, 1e-8):
        fast = sparkle_map(PLATE, LAMP, CAMERA, "left", flakes, least_share=least_share)
        work.append(fast.shaded)
        errors.append(float(np.abs(fast.luminance_cd_m2 - slow).max()) / float(slow.max()))
    assert work == sorted(work)
    assert errors == sorted(errors, reverse=True)
    # The share is of a lobe's peak, which no pixel of few flakes exceeds.
    assert all(error < 3 * share for error, share in zip(errors[:3], (1e-2, 1e-4, 1e-6), strict=True))


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


@settings(max_examples=100, deadline=None)
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
def test_the_size_of_pixels_and_tiles_does_not_change_the_mean_luminance() -> None:
    """The lens's spread stays as it is in millimetres, so that as much light leaves over the border."""
    usual = mean_of(PLATE, CAMERA)
    fine = CAMERA.model_copy(update={"resolution_px_per_mm": 29.2, "point_spread_sd_px": 2.0})
    coarse = CAMERA.model_copy(update={"resolution_px_per_mm": 7.3, "point_spread_sd_px": 0.5})
    assert mean_of(PLATE, fine) == pytest.approx(usual, rel=1e-3)
    assert mean_of(PLATE, coarse) == pytest.approx(usual, rel=1e-3)
    for tile_px in (128, 64, 33):
        assert mean_of(PLATE, CAMERA, tile_px) == pytest.approx(usual, rel=1e-6)


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


def test_equal_tiles_are_equal_values() -> None:
    assert tiles_of(PLATE, CAMERA) == Tiles(30.0, 20.0, 438, 292, 256)
