"""Camera RGB to XYZ and back, and what exposure does to it."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from devices.camera import CameraModel, Exposure
from devices.errors import DeviceError

M = np.array([[220.0, 37.0, 3.0], [84.0, 146.0, -46.0], [12.0, -35.0, 220.0]])
AT = Exposure(1 / 15, 8.0, 800)
LINEAR = CameraModel(M, np.zeros(3), np.array([0.01, 0.02, 0.0]), AT, (9.41, 120.8), "linear", "the camera")
AFFINE = CameraModel(M, np.array([1.0, 2.0, 3.0]), np.zeros(3), AT, None, "affine", "the camera")


def test_expression_4_1_written_out() -> None:
    R, G, B = 0.3, 0.5, 0.2
    X, Y, Z = AFFINE.xyz([R, G, B])
    assert pytest.approx(220.0 * R + 37.0 * G + 3.0 * B + 1.0, abs=1e-12) == X
    assert pytest.approx(84.0 * R + 146.0 * G - 46.0 * B + 2.0, abs=1e-12) == Y
    assert pytest.approx(12.0 * R - 35.0 * G + 220.0 * B + 3.0, abs=1e-12) == Z


def test_black_is_subtracted_before_the_matrix() -> None:
    assert LINEAR.xyz(LINEAR.black_rgb) == pytest.approx(np.zeros(3), abs=1e-12)
    assert LINEAR.xyz(LINEAR.black_rgb, Exposure(1.0, 8.0, 800)) == pytest.approx(np.zeros(3), abs=1e-12)


@given(st.floats(1e-3, 1e3))
def test_the_light_is_the_same_whatever_the_exposure(times: float) -> None:
    """A longer exposure gives more signal for the same light, and so the same XYZ."""
    other = Exposure(AT.time_s * times, AT.f_number, AT.iso)
    xyz = np.array([[20.0, 30.0, 25.0], [1.0, 0.5, 2.0]])
    signal = LINEAR.rgb(xyz, AT) - LINEAR.black_rgb
    assert LINEAR.rgb(xyz, other) == pytest.approx(times * signal + LINEAR.black_rgb, rel=2.1e-3)
    assert LINEAR.xyz(LINEAR.rgb(xyz, other), other) == pytest.approx(xyz, rel=1e-10)


def test_an_affine_model_serves_its_own_exposure_alone() -> None:
    assert AFFINE.xyz([0.1, 0.2, 0.3], Exposure(0.0667, 8.0, 800)) == pytest.approx(AFFINE.xyz([0.1, 0.2, 0.3]))
    for ask in (AFFINE.xyz, AFFINE.rgb):
        with pytest.raises(DeviceError, match=r"fitted at 1/15 s.*taken at 1/30 s") as caught:
            ask([0.1, 0.2, 0.3], Exposure(1 / 30, 8.0, 800))
        assert len(caught.value.findings) == 1


def test_a_model_of_unknown_exposure_is_not_guessed_at() -> None:
    unknown = CameraModel(M, np.zeros(3), np.zeros(3))
    assert unknown.xyz([0.1, 0.2, 0.3]) == pytest.approx(M @ [0.1, 0.2, 0.3])
    with pytest.raises(DeviceError, match="does not say its exposure"):
        unknown.xyz([0.1, 0.2, 0.3], AT)


def test_pictures_keep_shape_and_kind_and_agree_with_a_loop() -> None:
    rng = np.random.default_rng(1)
    picture = rng.uniform(-0.01, 1.0, (260, 300, 3)).astype(np.float32)  # more than a block
    xyz = AFFINE.xyz(picture)
    assert xyz.shape == picture.shape
    assert xyz.dtype == np.float32
    for row, column in ((0, 0), (131, 17), (259, 299)):
        slow = M @ picture[row, column].astype(np.float64) + AFFINE.offset_XYZ
        assert xyz[row, column] == pytest.approx(slow, rel=1e-6)
    assert AFFINE.xyz(picture.astype(np.float64)).dtype == np.float64
    assert AFFINE.xyz(np.zeros((0, 3))).shape == (0, 3)
    with pytest.raises(DeviceError, match="three numbers"):
        AFFINE.xyz(np.zeros((4, 4)))


def test_what_lies_outside_the_safe_zone() -> None:
    xyz = np.array([[1.0, 9.40, 1.0], [1.0, 9.42, 1.0], [1.0, 120.9, 1.0]])
    below, above = LINEAR.unsafe(xyz)
    assert below.tolist() == [True, False, False]
    assert above.tolist() == [False, False, True]
    # Half the exposure: the same signals stand for twice the luminance.
    assert LINEAR.safe_luminance(Exposure(1 / 30, 8.0, 800)) == pytest.approx((18.82, 241.6))
    below, above = AFFINE.unsafe(xyz)
    assert not below.any()
    assert not above.any()


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"matrix": np.full((3, 3), np.nan)}, "'matrix'"),
        ({"matrix": np.ones((3, 3))}, "matrix has no inverse"),
        ({"matrix": np.ones((3, 4))}, r"shape \(3, 3\)"),
        ({"offset_XYZ": np.ones(3)}, "linear camera model has an offset"),
        ({"safe_luminance_cd_m2": (120.0, 9.0)}, "safe luminance zone"),
    ],
)
def test_what_is_no_camera(changed: dict[str, object], words: str) -> None:
    parts: dict[str, object] = {"matrix": M, "offset_XYZ": np.zeros(3), "black_rgb": np.zeros(3), "exposure": AT}
    with pytest.raises(DeviceError, match=words):
        CameraModel(**(parts | changed))  # type: ignore[arg-type]  # one part is wrong on purpose
