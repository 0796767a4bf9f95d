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
from stimuli.sparkle import scatter_flakes
from stimuli.sparkle.cull import LEAST_LOBE_SHARE, lit, that_matter, tiles_of
from stimuli.sparkle.flakes import Flakes
from stimuli.sparkle.lamplight import illuminance_lx, lamp_directions
from stimuli.sparkle.optics import half_way, refract, shade, view_directions
from stimuli.sparkle.scene import Lamp, Plate
from stimuli.sparkle.studio import sparkle_map

ROOT = Path(__file__).parents[2]
RECIPE, _ = read_recipe(ROOT / "configs" / "stimuli" / "manitoba_gray.yaml")
assert isinstance(RECIPE, SparklePlateRecipe)
PLATE = replace(RECIPE.plate.plate(), width_mm=30.0, height_mm=20.0)
LAMP, CAMERA = RECIPE.lamp.lamp(), RECIPE.camera.camera()
NEAR = replace(LAMP, distance_mm=300.0, angular_radius_deg=4.0, beam_angle_deg=36.0)


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
    lamp = replace(LAMP, zenith_deg=zenith, azimuth_deg=azimuth, distance_mm=lamp_mm, angular_radius_deg=radius)
    camera = replace(CAMERA, resolution_px_per_mm=400 / width)
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


SPOT = replace(NEAR, distance_mm=120.0, beam_angle_deg=10.0, angular_radius_deg=1.0)


def test_no_flake_of_a_dark_tile_is_shaded_and_every_lit_one_as_without_a_beam() -> None:
    flakes, eye = scatter_flakes(PLATE, 1), CAMERA.position_mm("left")
    tiles = tiles_of(PLATE, CAMERA, 32)
    narrow = replace(SPOT, distance_mm=20.0)
    light = lit(tiles, narrow, LEAST_LOBE_SHARE)
    assert 0 < light.sum() < len(tiles)
    found = that_matter(flakes, PLATE, narrow, eye, tiles)
    everywhere = that_matter(flakes, PLATE, replace(narrow, beam_angle_deg=None), eye, tiles)
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
