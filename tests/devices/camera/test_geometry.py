"""Pixels per millimetre from sensor, lens and distance, and back."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from devices.camera import CameraGeometry, GeometryOptions, plan_geometry
from devices.camera.options import Lens, Origin
from devices.errors import DeviceError

SENSOR, PIXELS = (36.0, 24.0), (7360, 4912)


def test_the_thesis_s_numbers_as_printed() -> None:
    """Section 4.3.1: 50 mm at 70 cm on a full-frame sensor."""
    camera = CameraGeometry(SENSOR, PIXELS, 50.0, 700.0, lens="pinhole", sample_mm=(150.0, 100.0))
    assert [round(side / 10, 1) for side in camera.field_mm] == [50.4, 33.6]
    per_cm = [round(10 * number) for number in camera.pixels_per_mm]
    assert per_cm == [146, 146]
    # The size in pixels is that resolution times the plate's, both as printed.
    assert [15 * per_cm[0], 10 * per_cm[1]] == [2190, 1460]
    assert camera.sample_px == pytest.approx((2190, 1460), abs=2)
    across, down, _ = camera.field_of_view_deg
    assert 39.5 < across < 40  # "nearly 40 degrees"
    assert round(down) == 27
    assert [round(side, 1) for side in camera.pixel_um] == [68.5, 68.4]  # "any particle smaller than 68.5 μm"
    assert round(80 / camera.pixels_per_mm[0] / 10, 2) == 0.55  # Figure 4.2: 80 pixels are 0.55 cm


def test_a_focused_lens_images_larger_than_a_pinhole() -> None:
    thin = CameraGeometry(SENSOR, PIXELS, 50.0, 700.0)
    assert thin.magnification == pytest.approx(50 / 650, rel=1e-15)
    assert thin.pixels_per_mm[0] == pytest.approx(7360 / 36 / 13, rel=1e-15)
    # 1/f = 1/d + 1/d′
    assert 1 / thin.lens_distance_mm + 1 / thin.image_distance_mm == pytest.approx(1 / 50, rel=1e-15)
    # Far away it makes no difference.
    far = [CameraGeometry(SENSOR, PIXELS, 50.0, 1e7, lens=lens).magnification for lens in ("thin", "pinhole")]
    assert far[0] == pytest.approx(far[1], rel=1e-5)


def test_rays_through_the_lens_s_middle_meet_plane_and_sensor() -> None:
    """The slow way: a corner of the field, through the lens's middle, falls on the corner of the sensor."""
    for lens in ("thin", "pinhole"):
        camera = CameraGeometry(SENSOR, PIXELS, 105.0, 800.0, "sensor", lens)
        corner = np.array([*(0.5 * side for side in camera.field_mm), -camera.lens_distance_mm])
        landing = -corner[:2] * camera.image_distance_mm / camera.lens_distance_mm
        np.testing.assert_allclose(landing, [-18, -12], rtol=1e-12)
        assert camera.lens_distance_mm + camera.image_distance_mm == pytest.approx(800, rel=1e-12)
        angle = 2 * np.degrees(np.arctan2(np.hypot(*corner[:2]), camera.lens_distance_mm))
        assert camera.field_of_view_deg[2] == pytest.approx(angle, rel=1e-12)


cameras = {
    "width_mm": st.floats(1, 100),
    "columns": st.integers(1, 100_000),
    "focal_mm": st.floats(1, 2000),
    "times": st.floats(4.0001, 10_000),
    "origin": st.sampled_from(["lens", "sensor"]),
    "lens": st.sampled_from(["thin", "pinhole"]),
}


@given(**cameras)
def test_resolution_distance_and_focal_length_follow_from_each_other(
    width_mm: float, columns: int, focal_mm: float, times: float, origin: Origin, lens: Lens
) -> None:
    sensor, grid = (width_mm, 10.0), (columns, 100)
    camera = CameraGeometry(sensor, grid, focal_mm, times * focal_mm, origin, lens)
    wanted = camera.pixels_per_mm[0]
    asked = GeometryOptions(sensor, grid, px_per_mm=wanted, origin=origin, lens=lens)
    placed = plan_geometry(replace(asked, focal_mm=focal_mm))
    # At life size the distance from the sensor stands still, and rounding moves the magnification by its root.
    assert placed.distance_mm == pytest.approx(camera.distance_mm, rel=1e-9)
    with_lens = plan_geometry(replace(asked, distance_mm=camera.distance_mm))
    assert with_lens.focal_mm == pytest.approx(focal_mm, rel=1e-9)
    for found in (placed, with_lens):
        assert found.pixels_per_mm[0] == pytest.approx(wanted, rel=1e-6)
        assert found.field_mm[0] * found.pixels_per_mm[0] == pytest.approx(columns, rel=1e-12)
    assert all(isinstance(value, float | int | str | list) for value in camera.to_json().values())


def test_life_size_from_the_sensor_is_four_focal_lengths() -> None:
    camera = CameraGeometry(SENSOR, PIXELS, 105.0, 420.0, "sensor")
    assert camera.magnification == 1
    assert camera.lens_distance_mm == camera.image_distance_mm == 210
    found = plan_geometry(GeometryOptions(SENSOR, PIXELS, 105.0, None, 7360 / 36, "sensor"))
    assert found.distance_mm == pytest.approx(420)


@pytest.mark.parametrize(
    ("camera", "words"),
    [
        ({"focal_mm": 50.0, "distance_mm": 50.0}, "no image of a plane 50 mm from the lens"),
        ({"focal_mm": 105.0, "distance_mm": 400.0, "origin": "sensor"}, "it takes 4 × 105 = 420 mm"),
        ({"focal_mm": 50.0, "distance_mm": 40.0, "origin": "sensor", "lens": "pinhole"}, "40 mm from the sensor"),
        ({"focal_mm": 0.0, "distance_mm": 700.0}, "the focal length is 0 mm"),
        ({"focal_mm": 50.0, "distance_mm": float("nan")}, "the distance is nan mm"),
        ({"focal_mm": 50.0, "distance_mm": 700.0, "sensor_mm": (36.0, -24.0)}, "the sensor's height is -24 mm"),
        ({"focal_mm": 50.0, "distance_mm": 700.0, "size_px": (0, 10)}, "number of columns is 0"),
    ],
)
def test_what_gives_no_image_is_refused(camera: dict[str, object], words: str) -> None:
    with pytest.raises(DeviceError, match=words):
        CameraGeometry(**{"sensor_mm": SENSOR, "size_px": PIXELS, **camera})  # type: ignore[arg-type]


def test_a_resolution_that_cannot_be_asked_for_is_refused() -> None:
    for asked, words in (
        (GeometryOptions(SENSOR, PIXELS, px_per_mm=14.6), "two are needed"),
        (GeometryOptions(SENSOR, PIXELS, 50.0, None, -1.0), "the resolution is -1 pixels per mm"),
        (GeometryOptions(SENSOR, PIXELS, 50.0, None, 500.0, "sensor"), "larger than life"),
    ):
        with pytest.raises(DeviceError, match=words):
            plan_geometry(asked)
