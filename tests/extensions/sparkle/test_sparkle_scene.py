"""Scenes of sparkles: lamps, flakes, a base with flop, noise, an eye's optics, spectra, any observer."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar
from scipy.special import j1

from devices.colour import XYZ_from_xyY
from devices.readings import xyz_from_spectra
from documents import InputError
from extensions.sparkle import (
    SparklePlateRecipe,
    SparkleSeriesRecipe,
    Studio,
    plate_light,
    scatter_flakes,
    wavelengths_nm,
)
from extensions.sparkle.camera import eye_mtf, through_the_eye
from extensions.sparkle.flakes import Flakes
from extensions.sparkle.lamplight import angular_radius, illuminance_lx, lamp_directions
from extensions.sparkle.light import flop_luminance, gathered, matt_luminance
from extensions.sparkle.optics import DIFFRACTION_SD, half_way, lobe_sd, mirror, refract, shade, view_directions
from extensions.sparkle.scene import Clusters, Lamp, Noise, Plate, planck
from extensions.sparkle.studio import photograph
from stimuli.build import build_set
from stimuli.errors import StimulusError
from stimuli.pictures import read_exr
from stimuli.recipes import BuildContext, read_recipe

# Near lamps, small flakes, a base with flop, noise, an eye's optics, spectra: against plain physics.

ROOT = Path(__file__).parents[3]
CABIN = ROOT / "configs" / "stimuli" / "solux_cabin.yaml"
GRAY, _ = read_recipe(ROOT / "configs" / "stimuli" / "manitoba_gray.yaml")
assert isinstance(GRAY, SparklePlateRecipe)
PLATE = replace(GRAY.plate.plate(), width_mm=30.0, height_mm=20.0)
LAMP, CAMERA = GRAY.lamp, GRAY.camera
NEAR = LAMP.model_copy(update={"distance_mm": 300.0, "angular_radius_deg": 3.0, "beam_angle_deg": 36.0})
EYE = CAMERA.position_mm("left")
FLAKES = scatter_flakes(PLATE, 7)


def flakes_of(number: int, **changes: float) -> Flakes:
    values = {
        "x_mm": 0.0,
        "y_mm": 0.0,
        "depth_mm": 0.0,
        "diameter_mm": 0.02,
        "slope_x": 0.0,
        "slope_y": 0.15,
        **changes,
    }
    return Flakes(**{name: np.full(number, value, np.float32) for name, value in values.items()})


# Lamps


def test_a_near_lamp_lights_a_place_by_intensity_cosine_and_distance() -> None:
    position = NEAR.position_mm
    assert position is not None
    assert np.linalg.norm(position) == pytest.approx(300)
    x, y = np.array([0.0, 12.0]), np.array([0.0, -9.0])
    ray = position - np.array([12.0, -9.0, 0.0])
    distance = np.linalg.norm(ray)
    np.testing.assert_allclose(lamp_directions(NEAR, x, y)[1], ray / distance)
    # The intensity that gives the meter's reading in the middle, and what it falls to off the axis.
    intensity = NEAR.illuminance_lx * 300**2 / np.cos(np.radians(45))
    off_axis = np.arccos(ray @ position / distance / 300)
    power = np.log(0.5) / np.log(np.cos(np.radians(18)))
    got = illuminance_lx(NEAR, x, y)
    assert isinstance(got, np.ndarray)
    assert got[0] == pytest.approx(NEAR.illuminance_lx)
    assert got[1] == pytest.approx(intensity * np.cos(off_axis) ** power * ray[2] / distance**3)
    edge = 300 * np.tan(np.radians(18))  # at half the beam angle, seen square to the axis
    flat = NEAR.model_copy(update={"zenith_deg": 0.0})
    on, off = (float(np.ravel(illuminance_lx(flat, np.array([at]), np.zeros(1)))[0]) for at in (0.0, edge))
    assert off / on == pytest.approx(0.5 * np.cos(np.radians(18)) ** 3)
    radius = angular_radius(NEAR, x, y)
    assert isinstance(radius, np.ndarray)
    assert np.tan(radius[1]) * distance == pytest.approx(np.tan(np.radians(3)) * 300)


def test_a_lamp_of_finite_size_is_the_sum_of_its_points() -> None:
    """Flakes of all tilts under a disc, point by point, against the widened lobe."""
    lamp = NEAR.model_copy(update={"beam_angle_deg": None})
    position, x, y = lamp.position_mm, np.zeros(1), np.zeros(1)
    assert position is not None
    h = half_way(refract(view_directions(x, y, EYE), 1.5), refract(lamp_directions(lamp, x, y), 1.5))[0]
    angles = np.radians(np.linspace(-4, 4, 81))
    flakes = replace(
        flakes_of(81),
        slope_x=np.full(81, h[0] / h[2], np.float32),
        slope_y=np.tan(np.arctan(h[1] / h[2]) + angles).astype(np.float32),
    )
    whole = shade(flakes, PLATE, lamp, EYE).luminance_cd_m2
    side = np.cross(position / 300, [1.0, 0.0, 0.0])
    side /= np.linalg.norm(side)
    other = np.cross(side, position / 300)
    points = []
    for share in (np.arange(24) + 0.5) / 24:
        for turn in np.arange(24) * np.pi / 12:
            at = position + 300 * np.tan(np.radians(3)) * np.sqrt(share) * (np.cos(turn) * side + np.sin(turn) * other)
            distance = float(np.linalg.norm(at))
            point = lamp.model_copy(
                update={
                    "zenith_deg": float(np.degrees(np.arccos(at[2] / distance))),
                    "azimuth_deg": float(np.degrees(np.arctan2(at[1], at[0]))),
                    "distance_mm": distance,
                    "angular_radius_deg": 0.0,
                }
            )
            points.append(shade(flakes, PLATE, point, EYE).luminance_cd_m2)
    summed = np.mean(points, axis=0)
    # The lobe is widened as much in the plane of incidence as across; in truth a fifth less there.
    assert whole.sum() == pytest.approx(summed.sum(), rel=0.02)
    assert np.abs(whole - summed).max() < 0.02 * summed.max()
    pointlike = shade(flakes, PLATE, lamp.model_copy(update={"angular_radius_deg": 0.0}), EYE).luminance_cd_m2
    assert np.abs(pointlike - summed).max() > 0.1 * summed.max()


# Flakes


def test_diffraction_is_that_of_a_disc() -> None:
    """Fit a Gaussian to the Airy pattern: 0.42 wavelengths per diameter, halved for the flake's normal in the coat."""
    x = np.linspace(1e-6, 3.8317, 2000)
    airy = (2 * j1(x) / x) ** 2

    def misfit(sd: float) -> float:
        return float(np.sum((airy - np.exp(-((x / np.pi) ** 2) / (2 * sd**2))) ** 2))

    assert minimize_scalar(misfit, bounds=(0.2, 0.8), method="bounded").x == pytest.approx(DIFFRACTION_SD, rel=0.02)
    plate = replace(PLATE, lobe_sd_deg=1e-9, diffraction_nm=555.0)
    assert lobe_sd(plate, 0.0, 0.01) == pytest.approx(0.42 * 555e-9 / 10e-6 / (2 * 1.5))
    assert lobe_sd(PLATE, 0.0, 0.01) == np.radians(PLATE.lobe_sd_deg)


@pytest.mark.parametrize(
    ("share", "members", "radius_mm"),
    [
        (0.5, 12.0, 0.03),
        *(pytest.param(*one, marks=pytest.mark.nightly) for one in [(1.0, 30.0, 0.03), (0.5, 12.0, 3.0)]),
    ],
)
def test_clusters_are_as_dense_as_they_say(share: float, members: float, radius_mm: float) -> None:
    """Counts in cells vary by 1 + share · members if clusters are far smaller than a cell, less if they are wide."""
    plate = replace(PLATE, width_mm=300.0, height_mm=200.0, flakes_per_mm2=10.0)
    flakes = scatter_flakes(
        replace(plate, clusters=Clusters(share=share, flakes=members, radius_mm=radius_mm, tilt_sd_deg=6.0)), 3
    )
    apart = scatter_flakes(plate, 3)
    np.testing.assert_array_equal(flakes.diameter_mm, apart.diameter_mm)
    edges = (np.linspace(-100, 100, 101), np.linspace(-150, 150, 151))
    counts, before = (np.histogram2d(one.y_mm, one.x_mm, edges)[0] for one in (flakes, apart))
    assert counts.sum() == before.sum() == len(flakes)
    assert before.var() / before.mean() == pytest.approx(1.0, abs=0.05)
    dispersion = counts.var() / counts.mean()
    if radius_mm < 1:
        assert dispersion == pytest.approx(1 + share * members, rel=0.08)
    else:
        assert 1.05 < dispersion < 1.5
    # Each cluster tilts as a whole, on top of each flake's own tilt.
    n = round(share * len(flakes))
    own, together = np.tan(np.radians([plate.tilt_sd_deg, 6.0]))
    assert flakes.slope_x[:n].std() == pytest.approx(np.hypot(own, together), rel=0.03)
    if n < len(flakes):
        np.testing.assert_array_equal(flakes.slope_x[n:], apart.slope_x[n:])
    near = np.array_split(counts, 2)
    assert near[0].mean() == pytest.approx(near[1].mean(), rel=0.05)


# Eyes


@pytest.mark.nightly
def test_the_share_of_shared_sparkles_falls_with_the_base_as_the_lobe_says() -> None:
    """Gaussian lobes over slopes of nearly constant density correlate as exp(−d²/4σ²), d apart."""
    small = replace(PLATE, width_mm=4.0, height_mm=4.0, flakes_per_mm2=60_000.0, lobe_sd_deg=0.7)
    flakes, zero = scatter_flakes(small, 5), np.zeros(1)
    sd = lobe_sd(small, np.radians(LAMP.angular_radius_deg), 0.02)
    shared = []
    for base_mm in (0.0, 45.0, 90.0):
        eyes = [
            CAMERA.model_copy(update={"interpupillary_distance_mm": base_mm}).position_mm(eye)
            for eye in ("left", "right")
        ]
        one, other = (shade(flakes, small, LAMP, eye).lobe_share for eye in eyes)
        shared.append(float(np.sum(one * other) / np.sqrt(np.sum(one**2) * np.sum(other**2))))
        h = [half_way(refract(view_directions(zero, zero, eye), 1.5), refract(LAMP.direction, 1.5))[0] for eye in eyes]
        apart = np.linalg.norm(h[0] - h[1])
        assert shared[-1] == pytest.approx(float(np.exp(-(apart**2) / (4 * sd**2))), abs=0.02)
    assert shared[0] == 1.0
    assert np.all(np.diff(shared) < -0.03)
    assert shared[-1] < 0.5


# Base


@pytest.mark.parametrize("lamp", [LAMP, NEAR, NEAR.model_copy(update={"zenith_deg": 75.0, "beam_angle_deg": 20.0})])
def test_base_and_flop_in_each_pixel_against_the_formula(lamp: Lamp) -> None:
    plate = replace(PLATE, width_mm=200.0, height_mm=120.0, flop_reflectance=0.2, flop_lobe_sd_deg=6.0)
    camera = CAMERA.model_copy(update={"resolution_px_per_mm": 0.7})
    columns, rows = camera.grid_px(plate)
    x = ((np.arange(columns) + 0.5) / columns - 0.5) * 200
    y = (0.5 - (np.arange(rows) + 0.5) / rows) * 120
    places = tuple(np.ravel(one) for one in np.meshgrid(x, y))
    sd = np.radians(6.0)
    slow = mirror((places[0], places[1]), np.array([0.0, 0.0, 1.0]), 0.2, sd, plate, lamp, EYE).luminance_cd_m2
    fast = flop_luminance(plate, lamp, camera, EYE)
    assert isinstance(fast, np.ndarray)
    np.testing.assert_allclose(fast.ravel(), slow, atol=2e-4 * slow.max())
    matt = np.broadcast_to(matt_luminance(plate, lamp, camera), (rows, columns)).ravel()
    expected = np.broadcast_to(plate.base_reflectance * illuminance_lx(lamp, *places) / np.pi, matt.shape)
    np.testing.assert_allclose(matt, expected, atol=2e-4 * float(expected.max()))


# Optics and noise


def test_the_eye_s_transfer_as_published() -> None:
    """Watson 2013: 1 at 0, nothing beyond diffraction's limit, worse with wide pupils; one value by hand."""
    frequencies = np.array([0.0, 10.0, 30.0, 93.0, 200.0])
    narrow, wide = eye_mtf(frequencies, 3.0), eye_mtf(frequencies, 6.0)
    assert narrow[0] == wide[0] == 1.0
    assert narrow[-1] == 0.0
    assert np.all(narrow[1:3] > wide[1:3])
    first, limit = 21.95 - 5.512 * 3 + 0.3922 * 9, 3 * np.pi * 1e6 / (555 * 180)
    share = 10 / limit
    perfect = 2 / np.pi * (np.arccos(share) - share * np.sqrt(1 - share**2))
    assert narrow[1] == pytest.approx((1 + (10 / first) ** 2) ** -0.62 * np.sqrt(perfect))


def test_noise_is_off_unless_asked_for_and_as_large_as_it_says() -> None:
    bare = replace(PLATE, flakes_per_mm2=0.0)
    light = plate_light(bare, [LAMP], CAMERA, "left", FLAKES.chosen(np.zeros(0, np.int64)))
    noisy = CAMERA.model_copy(update={"noise": Noise(full_well_electrons=2000.0, read_noise_electrons=5.0)})
    quiet = photograph(light, CAMERA, 1 / 8, 1 / 14.6)
    same = photograph(light, CAMERA, 1 / 8, 1 / 14.6, (9,))
    np.testing.assert_array_equal(quiet.xyz_cd_m2, same.xyz_cd_m2)
    assert float(np.ptp(quiet.xyz_cd_m2[..., 1])) == 0.0
    one, again, other = (photograph(light, noisy, 1 / 8, 1 / 14.6, (seed,)) for seed in (1, 1, 2))
    np.testing.assert_array_equal(one.xyz_cd_m2, again.xyz_cd_m2)
    assert not np.array_equal(one.xyz_cd_m2, other.xyz_cd_m2)
    assert one.xyz_cd_m2[..., 1].mean() == pytest.approx(quiet.xyz_cd_m2[..., 1].mean(), rel=2e-3)
    from extensions.sparkle.camera import expose, sensor_of

    sensor = sensor_of(CAMERA)
    for clean, dirty in zip(expose(light, 0.125, sensor), expose(light, 0.125, sensor, noisy.noise), strict=True):
        electrons = float(clean[0, 0]) * 2000
        assert float(dirty.std()) * 2000 == pytest.approx(np.sqrt(electrons + 25), rel=0.02)
    full = photograph(light, noisy, 100.0, 0.25)
    assert full.saturated_percent == (100.0, 100.0, 100.0)
    dark = photograph(light, noisy, 1e-6, 1 / 14.6)
    assert dark.below_black_percent > 10
    assert dark.xyz_cd_m2.min() == 0


# Spectra


def cabin(**changes: Any) -> Any:
    data: Any = yaml.safe_load(CABIN.read_text())
    data["plate"]["size_mm"] = [30, 20]
    data["plate"]["flakes"]["per_mm2"] = 50
    return {**data, **changes}


def read(data: Any, tmp_path: Path) -> SparklePlateRecipe:
    file = tmp_path / "cabin.yaml"
    file.write_text(yaml.safe_dump(data, sort_keys=False))
    recipe, _ = read_recipe(file)
    assert isinstance(recipe, SparklePlateRecipe)
    return recipe


def bands_of(recipe: SparklePlateRecipe) -> tuple[NDArray[np.float64], NDArray[np.float32], Plate]:
    plate, camera = recipe.plate.plate(), recipe.camera
    lamps = [one for one in (recipe.lamp, *recipe.further_lamps)]
    light = plate_light(plate, lamps, camera, "left", scatter_flakes(plate, 1))
    return light.spectral(0.2768), photograph(light, camera, 1e-5, 0.2768).xyz_cd_m2, plate


def test_bands_and_xyz_are_one_light(tmp_path: Path) -> None:
    bands, xyz, plate = bands_of(read(cabin(), tmp_path))
    assert bands.shape == (72, 108, 81)
    assert bands.min() >= 0
    assert plate.base_spectrum is not None
    np.testing.assert_allclose(
        xyz_from_spectra(bands.reshape(-1, 81), wavelengths_nm()).reshape(xyz.shape), xyz, rtol=1e-4, atol=1e-5
    )


def test_a_chromaticity_has_no_spectrum() -> None:
    light = plate_light(PLATE, [LAMP], CAMERA, "left", FLAKES)
    with pytest.raises(StimulusError, match="has no spectrum"):
        light.spectral(0.25)
    assert gathered([]) == ()


def test_a_lamp_far_enough_is_a_far_lamp() -> None:
    far = LAMP.model_copy(update={"distance_mm": 1e7})
    one, other = (shade(FLAKES, PLATE, lamp, EYE) for lamp in (LAMP, far))
    np.testing.assert_allclose(other.luminance_cd_m2, one.luminance_cd_m2, rtol=1e-3, atol=1e-9)
    np.testing.assert_allclose(matt_luminance(PLATE, far, CAMERA), matt_luminance(PLATE, LAMP, CAMERA), rtol=1e-5)


@pytest.mark.nightly
def test_lamps_add_up_and_equal_colours_share_a_map() -> None:
    second = NEAR.model_copy(update={"azimuth_deg": 30.0})
    tinted = second.model_copy(update={"chromaticity_xy": (0.31, 0.33)})
    for lamps, terms in (([LAMP, second], 3), ([LAMP, tinted], 4)):
        together = plate_light(PLATE, lamps, CAMERA, "left", FLAKES)
        alone = [photograph(plate_light(PLATE, [lamp], CAMERA, "left", FLAKES), CAMERA, 1e-4, 0.25) for lamp in lamps]
        assert together.counts["lamps"] == 2
        assert len(together.terms) == terms
        both = photograph(together, CAMERA, 1e-4, 0.25).xyz_cd_m2
        np.testing.assert_allclose(both, sum(one.xyz_cd_m2.astype(np.float64) for one in alone), rtol=2e-5)
    dark = plate_light(PLATE, [LAMP, NEAR.model_copy(update={"illuminance_lx": 0.0})], CAMERA, "left", FLAKES)
    assert dark.counts["lamps"] == 1


def test_small_flakes_scatter_wider_and_send_back_as_much() -> None:
    plate = replace(PLATE, diffraction_nm=555.0, lobe_sd_deg=0.3)
    slopes = np.tan(np.radians(np.linspace(-30, 60, 181))).astype(np.float32)
    grid_x, grid_y = (one.ravel() for one in np.meshgrid(slopes, slopes))
    widths = []
    for diameter_mm in (0.008, 0.08):
        flakes = replace(flakes_of(len(grid_x), diameter_mm=diameter_mm), slope_x=grid_x, slope_y=grid_y)
        widths.append(float(np.sum(shade(flakes, plate, LAMP, EYE).lobe_share > 0.5)))
        square = lobe_sd(plate, np.radians(LAMP.angular_radius_deg), diameter_mm) ** 2
        peak = shade(replace(flakes), plate, LAMP, EYE).luminance_cd_m2.max()
        widths.append(float(peak * square))
    assert widths[0] > 2 * widths[2]
    assert widths[1] == pytest.approx(widths[3], rel=0.2)


def test_a_rim_takes_from_a_flake_s_mirror_and_depth_from_its_light() -> None:
    plain = shade(flakes_of(1), PLATE, LAMP, EYE)
    rimmed = shade(flakes_of(1), replace(PLATE, flake_rim_um=1.0), LAMP, EYE)
    assert rimmed.area_mm2[0] == pytest.approx(plain.area_mm2[0] * 0.9**2, rel=1e-6)
    assert shade(flakes_of(1), replace(PLATE, flake_rim_um=10.0), LAMP, EYE).area_mm2[0] == pytest.approx(0, abs=1e-12)
    murky = replace(PLATE, coat_extinction_per_mm=8.0)
    surface, deep = (shade(flakes_of(1, depth_mm=depth), murky, LAMP, EYE).luminance_cd_m2[0] for depth in (0.0, 0.04))
    assert surface == pytest.approx(plain.luminance_cd_m2[0])
    view = refract(view_directions(np.zeros(1), np.zeros(1), EYE), 1.5)[0, 2]
    path_mm = 0.04 / view + 0.04 / refract(LAMP.direction, 1.5)[2]
    assert deep == pytest.approx(surface * np.exp(-8 * path_mm), rel=1e-5)


def test_with_a_base_of_zero_both_eyes_are_one_picture_rendered_once() -> None:
    assert isinstance(GRAY, SparklePlateRecipe)
    data = GRAY.model_dump()
    data["plate"]["size_mm"] = (30, 20)
    data["camera"]["interpupillary_distance_mm"] = 0.0
    recipe = SparklePlateRecipe.model_validate(data)
    studio = Studio(recipe.plate, recipe.lamp, recipe.camera, 1, 0.25)
    left, right = studio.photographs("stereo", 0.1)
    assert left is right
    assert studio.photographs("flat", 0.1) == (left,)
    render = studio.steps("stereo", 0.1)[0]
    assert render["places"] == 1
    apart = Studio(recipe.plate, recipe.lamp, GRAY.camera, 1, 0.25)
    left, right = apart.photographs("stereo", 0.1)
    assert not np.array_equal(left.xyz_cd_m2, right.xyz_cd_m2)
    assert apart.steps("stereo", 0.1)[0]["places"] == 2


def test_flop_darkens_with_the_angle_and_keeps_its_energy() -> None:
    """Tilt the lamp: what shines falls by its lobe, what is matt by nothing. Its light over all eyes is what it got."""
    plate = replace(PLATE, width_mm=2.0, height_mm=2.0, flop_reflectance=0.3, flop_lobe_sd_deg=8.0)
    seen = [
        float(np.mean(flop_luminance(plate, LAMP.model_copy(update={"zenith_deg": zenith}), CAMERA, EYE)))
        for zenith in (0.0, 20.0, 40.0, 60.0)
    ]
    assert np.all(np.diff(seen) < 0)
    assert seen[0] > 5 * seen[-1]
    assert flop_luminance(PLATE, LAMP, CAMERA, EYE) == 0.0
    # Inside the coat, over all directions: reflectance times the light that entered.
    lamp, total, step = LAMP.model_copy(update={"zenith_deg": 0.0}), 0.0, 0.02
    for a in np.arange(-1.6, 1.6, step):
        b = np.arange(-1.6, 1.6, step)
        solid = step**2 / (1 + a**2 + b**2) ** 1.5
        h = np.stack([np.full_like(b, a), b, np.ones_like(b)], axis=-1)
        ray = h / np.linalg.norm(h, axis=1, keepdims=True)
        cos = (ray + [0.0, 0.0, 1.0])[:, 2] / np.linalg.norm(ray + [0.0, 0.0, 1.0], axis=1)
        sd = np.radians(8.0)
        lobe = np.exp((cos - 1) / sd**2) / (2 * np.pi * sd**2)
        total += float(np.sum(lobe / (4 * cos) * solid))
    assert total == pytest.approx(1.0, rel=5e-3)
    straight = mirror((np.zeros(1), np.zeros(1)), np.array([0, 0, 1.0]), 0.3, sd, plate, lamp, np.array([0, 0, 700.0]))
    through = 0.96**2
    expected = 0.3 * LAMP.illuminance_lx * through / (2 * np.pi * sd**2) / 4 / 1.5**2
    assert straight.luminance_cd_m2[0] == pytest.approx(expected)


def test_the_eye_keeps_light_and_damps_a_grating_by_its_transfer() -> None:
    camera = CAMERA.model_copy(update={"pupil_mm": 4.0})
    point = np.zeros((401, 401), np.float32)
    point[200, 200] = 100.0
    spread = through_the_eye(point, camera)
    assert spread.sum(dtype=np.float64) == pytest.approx(100.0, rel=0.03)
    assert spread[200, 200] == spread.max() < 20
    np.testing.assert_allclose(spread, spread[::-1, ::-1], atol=1e-5)
    per_degree = 14.6 * 700 * np.tan(np.radians(1.0))
    x = np.arange(1784) / per_degree
    grating = np.broadcast_to(1 + np.cos(2 * np.pi * 12 * x), (400, 1784)).astype(np.float32)
    middle = through_the_eye(grating, camera)[200, 400:1384]
    contrast = (middle.max() - middle.min()) / (middle.max() + middle.min())
    assert contrast == pytest.approx(float(eye_mtf(np.array([12.0]), 4.0)[0]), rel=0.02)
    assert through_the_eye(grating, CAMERA) is grating
    seen = plate_light(PLATE, [LAMP], camera, "left", FLAKES).terms[-1].luminance_cd_m2
    plain = plate_light(PLATE, [LAMP], CAMERA, "left", FLAKES).terms[-1].luminance_cd_m2
    assert np.max(seen) < 0.5 * np.max(plain)


def test_a_spectral_base_follows_the_lamp_s_temperature(tmp_path: Path) -> None:
    """A lamp of 3000 K makes the same paint yellower; the base's radiance is lamp times reflectance in every band."""
    data = cabin(further_lamps=[])
    data["plate"]["flakes"]["per_mm2"] = 0
    del data["plate"]["base"]["flop"]
    chromaticity = []
    for kelvin in (3000, 4700):
        data["lamp"]["temperature_K"] = kelvin
        bands, xyz, plate = bands_of(read(data, tmp_path))
        mean = xyz.mean(axis=(0, 1))
        chromaticity.append(mean[0] / mean.sum())
        base = np.array(plate.base_spectrum)
        ratio = bands.mean(axis=(0, 1)) / (np.array(planck(kelvin)) * base)
        np.testing.assert_allclose(ratio, ratio[0], rtol=1e-6)
    assert chromaticity[0] > chromaticity[1] + 0.03


def test_planck_at_two_points() -> None:
    light = np.array(planck(4700))
    waves = wavelengths_nm()
    assert light[waves == 560] == 1
    peak = waves[np.argmax(light)]
    assert peak == pytest.approx(2.897771955e6 / 4700, abs=2.5)


# Sparkling plates for any colorimetric observer: one scene, whose spectra are summed by that observer's functions.

PLAIN, TEN, AGED = "CIE 1931 2", "CIE 2015 10", "CIE 2006 4 age 65"
PITCH_MM, SHORT_S = 0.2768, 1e-5
Recipe = SparklePlateRecipe | SparkleSeriesRecipe


def _read(name: str, folder: Path, change: dict[str, Any]) -> Recipe:
    data = yaml.safe_load((ROOT / f"configs/stimuli/{name}.yaml").read_text())
    data["plate"]["size_mm"] = [9, 6]
    data["plate"]["flakes"]["per_mm2"] = 50
    file = folder / f"{name}.yaml"
    file.write_text(yaml.safe_dump(data | change, sort_keys=False))
    recipe, _ = read_recipe(file)
    assert isinstance(recipe, Recipe)
    return recipe


def _cabin(folder: Path, **change: Any) -> SparklePlateRecipe:
    recipe = _read("solux_cabin", folder, change)
    assert isinstance(recipe, SparklePlateRecipe)
    return recipe


def _bands(recipe: SparklePlateRecipe, observer: str) -> NDArray[np.float64]:
    lamps = recipe.lamp, *recipe.further_lamps
    plate = recipe.plate.plate()
    light = plate_light(plate, lamps, recipe.camera, "left", scatter_flakes(plate, recipe.seed), observer)
    return light.spectral(PITCH_MM)


@pytest.mark.parametrize("observer", [AGED, pytest.param(TEN, marks=pytest.mark.nightly)])
def test_a_plate_is_the_sum_of_its_spectra_for_the_observer(tmp_path: Path, observer: str) -> None:
    recipe = _cabin(tmp_path)
    scene = recipe.plate, recipe.lamp, recipe.camera, recipe.seed, PITCH_MM, recipe.further_lamps
    seen = Studio(*scene, observer=observer).photographs("stereo", SHORT_S)[0].xyz_cd_m2
    bands = _bands(recipe, observer)
    np.testing.assert_allclose(bands, _bands(recipe, PLAIN), rtol=1e-12)  # the light does not depend on who looks
    truth = xyz_from_spectra(bands.reshape(-1, 81), wavelengths_nm(), observer).reshape(seen.shape)
    np.testing.assert_allclose(seen, truth, rtol=1e-4, atol=1e-5)
    plain = Studio(*scene).photographs("stereo", SHORT_S)[0].xyz_cd_m2
    assert np.abs(plain / seen - 1).max() > 0.01


def _keys(recipe: Recipe, folder: Path) -> dict[str, str]:
    return {
        name: key for task in recipe.tasks(BuildContext(folder, {}, PITCH_MM, None, 2)) for name, key in task.items()
    }


@pytest.mark.parametrize("name", ["solux_cabin", "exposure_series"])
def test_pictures_in_the_cache_are_kept_apart_by_observer(tmp_path: Path, name: str) -> None:
    plain, same, ten, aged = (
        _keys(_read(name, tmp_path, change), tmp_path)
        for change in ({}, {"observer": "1931_2"}, {"observer": TEN}, {"observer": AGED})
    )
    assert plain == same
    assert len({*plain.values(), *ten.values(), *aged.values()}) == 3 * len(set(plain.values()))


def test_a_recipe_of_plates_is_built_for_its_observer(tmp_path: Path) -> None:
    short = {"stimuli": [{"name": "short", "exposure_s": SHORT_S}], "views": ["flat"]}
    recipe = _cabin(tmp_path, observer=TEN, **short)
    built = build_set(tmp_path / "solux_cabin.yaml", PITCH_MM)
    first = built.manifest["stimuli"][0]
    assert first["steps"][0]["observer"] == TEN
    seen = read_exr(built.path(built.names[0]), observer=TEN).left
    scene = recipe.plate, recipe.lamp, recipe.camera, recipe.seed, PITCH_MM, recipe.further_lamps
    alone = Studio(*scene, observer=TEN).photographs("flat", SHORT_S)[0].xyz_cd_m2
    np.testing.assert_allclose(seen, alone, rtol=1e-3, atol=1e-4)
    with pytest.raises(InputError, match="CIE 2015 10; CIE 1931 2 is wanted"):
        read_exr(built.path(built.names[0]))


def test_chromaticities_of_a_recipe_are_its_observers(tmp_path: Path) -> None:
    recipe = _read("manitoba_gray", tmp_path, {})
    assert isinstance(recipe, SparklePlateRecipe)
    scene = recipe.plate, recipe.lamp, recipe.camera, recipe.seed, PITCH_MM, recipe.further_lamps
    plain, ten = (Studio(*scene, observer=one).photographs("flat", 0.1)[0].xyz_cd_m2 for one in (PLAIN, TEN))
    np.testing.assert_array_equal(plain, ten)


def test_a_base_with_a_chromaticity_in_a_spectral_lamp_is_as_bright_as_that_lamp_to_the_observer(
    tmp_path: Path,
) -> None:
    recipe = _cabin(tmp_path, further_lamps=[])
    bare = replace(recipe.plate.plate(), base_chromaticity_xy=(0.4, 0.35), base_spectrum=None, flop_reflectance=0.0)
    flakes = scatter_flakes(bare, 1).chosen(np.zeros(0, np.int64))
    (term,) = plate_light(bare, [recipe.lamp], recipe.camera, "left", flakes, TEN).terms
    emitted = np.array(recipe.lamp.emitted)
    own = xyz_from_spectra(emitted, wavelengths_nm(), TEN)[0]
    brightness = own[1] / xyz_from_spectra(emitted, wavelengths_nm())[0, 1]
    np.testing.assert_allclose(term.colour.XYZ, XYZ_from_xyY([0.4, 0.35, brightness]), rtol=1e-12)
    plain = replace(bare, base_chromaticity_xy=None)
    (as_lit,) = plate_light(plain, [recipe.lamp], recipe.camera, "left", flakes, TEN).terms
    seen = np.array(as_lit.colour.XYZ)
    np.testing.assert_allclose(seen[:2] / seen.sum(), own[:2] / own.sum(), rtol=1e-12)
