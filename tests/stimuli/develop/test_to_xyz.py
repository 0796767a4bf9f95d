from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from devices.camera import CameraModel, Exposure
from devices.errors import DeviceError
from stimuli.develop import CameraImage, to_xyz
from stimuli.errors import StimulusError

MATRIX = np.array([[60.0, 25.0, 15.0], [25.0, 80.0, -5.0], [1.0, -10.0, 120.0]])
FITTED = Exposure(1 / 15, 8.0, 200.0)


def camera(form: str = "linear", **changes: object) -> CameraModel:
    options: dict[str, object] = {"exposure": FITTED, "safe_luminance_cd_m2": (9.41, 120.8), "name": "test", **changes}
    offset = np.array([0.1, 0.2, 0.3]) if form == "affine" else np.zeros(3)
    return CameraModel(MATRIX, offset, np.zeros(3), form=form, **options)  # type: ignore[arg-type]  # keywords by name


def picture(rgb: NDArray[np.floating], exposure: Exposure | None = FITTED) -> CameraImage:
    values = np.asarray(rgb, np.float32)
    return CameraImage(values, values >= 1, exposure, "photo.nef", ({"step": "read"},))


def test_known_light_comes_back_at_any_exposure() -> None:
    """The signal of a linear camera grows with time, ISO and aperture; the XYZ found stays the same."""
    rng = np.random.default_rng(0)
    light = rng.uniform(0.05, 0.2, (20, 30, 3))
    truth = light @ MATRIX.T
    for exposure in (FITTED, Exposure(4 / 15, 8.0, 200.0), Exposure(1 / 15, 4.0, 200.0), Exposure(1 / 15, 8.0, 800.0)):
        signal = light * exposure.relative_to(FITTED)
        found = to_xyz(picture(signal, exposure), camera())
        np.testing.assert_allclose(found.xyz, truth, rtol=2e-6, atol=1e-5)
        assert found.xyz.dtype == np.float32


def test_the_safe_zone_moves_with_the_exposure() -> None:
    grey = np.linspace(0.01, 0.999, 200)
    rgb = np.repeat(grey[None, :, None], 3, axis=2)
    found = to_xyz(picture(rgb), camera())
    luminance = grey * MATRIX[1].sum()
    assert found.below_safe == int((luminance < 9.41).sum()) > 0
    assert found.above_safe == 0
    double = to_xyz(picture(rgb, Exposure(2 / 15, 8.0, 200.0)), camera())
    assert double.below_safe == found.below_safe, "the same signal, half the light, half the zone"
    assert double.safe_cd_m2 == pytest.approx((9.41 / 2, 60.4))
    bright = to_xyz(picture(rgb * 1.5), camera())
    assert bright.above_safe == int((1.5 * luminance > 120.8).sum()) > 0
    none = to_xyz(picture(rgb), camera(safe_luminance_cd_m2=None))
    assert (none.below_safe, none.above_safe, none.safe_cd_m2) == (0, 0, None)


def test_what_falls_below_0_is_counted_or_refused() -> None:
    rgb = np.full((4, 5, 3), 0.2)
    rgb[1, 2] = (-0.01, -0.01, -0.01)
    rgb[2, 3] = (0.0, 0.5, 0.0)  # beyond the camera's gamut: Z is below 0
    found = to_xyz(picture(rgb), camera())
    assert found.clipped == 2
    assert found.lowest == pytest.approx(-5.0)
    assert found.xyz.min() == 0.0
    assert found.steps[-1]["negative_pixels_set_to_0"] == 2
    with pytest.raises(StimulusError, match="2 pixels have negative XYZ"):
        to_xyz(picture(rgb), camera(), negative="refuse")


def test_full_photosites_are_marked() -> None:
    rgb = np.full((4, 5, 3), 0.2)
    rgb[1, 2, 0] = rgb[3, 3, 2] = 1.0
    found = to_xyz(picture(rgb), camera())
    assert {tuple(place) for place in np.argwhere(found.saturated).tolist()} == {(1, 2), (3, 3)}
    assert found.steps[-1]["saturated_pixels"] == 2
    assert found.steps[0] == {"step": "read"}


def test_an_exposure_that_nobody_tells_is_refused() -> None:
    with pytest.raises(StimulusError, match=r"photo\.nef: .* no exposure"):
        to_xyz(picture(np.full((2, 2, 3), 0.2), None), camera())
    unknown = camera(exposure=None)
    assert to_xyz(picture(np.full((2, 2, 3), 0.2), None), unknown).xyz.shape == (2, 2, 3)


def test_an_affine_model_serves_its_own_exposure_alone() -> None:
    rgb = np.full((2, 2, 3), 0.2)
    assert to_xyz(picture(rgb), camera("affine")).xyz[0, 0, 1] == pytest.approx(20.2, rel=1e-6)
    with pytest.raises(DeviceError, match="affine"):
        to_xyz(picture(rgb, Exposure(1.0, 8.0, 200.0)), camera("affine"))
