"""Camera models and files, tables of colours, and the geometry of lens and sensor."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from devices.camera import (
    CameraGeometry,
    CameraModel,
    Exposure,
    Form,
    GeometryOptions,
    plan_geometry,
    read_camera,
    read_correspondences,
    read_reference,
    write_camera,
)
from devices.camera.camera_file import format_camera
from devices.camera.camera_model import ExposureSet
from devices.camera.options import Lens, Origin
from devices.errors import DeviceError
from documents import InputError

# Camera RGB to XYZ and back, and what exposure does to it.

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


# Pixels per millimetre from sensor, lens and distance, and back.

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


# Camera files: the shipped one, faults in them, and writing.

D800 = Path(__file__).parents[3] / "configs" / "cameras" / "nikon_d800.yaml"
PLAIN = """\
schema_version: 1
form: linear
exposure: {time_s: 1/15, f_number: 8, iso: 800}
matrix_XYZ_cd_m2:
  X: [220, 37, 3]
  Y: [84, 146, -46]
  Z: [12, -35, 220]
"""


def test_the_shipped_camera_holds_what_the_thesis_says() -> None:
    camera = read_camera(D800)
    assert camera.exposure == Exposure(1 / 15, 8.0, 800.0)
    assert camera.safe_luminance_cd_m2 == (9.41, 120.8)
    assert [one.white_luminance_cd_m2 for one in camera.exposure_sets] == [132.32, 34.4, 14.82, 3.7]
    assert sum(len(one.exposures) for one in camera.exposure_sets) == 16  # "16 different exposure values"
    assert camera.tried_at(Exposure(0.4, 8.0, 800))
    assert not camera.tried_at(Exposure(1 / 250, 8.0, 800))


def test_the_shipped_matrix_is_libraws_scaled_by_iso_12232() -> None:
    from_XYZ = np.array([[0.7866, -0.2108, -0.0555], [-0.4869, 1.2483, 0.2681], [-0.1176, 0.2069, 0.7501]])
    daylight = np.array([0.95047, 1.0, 1.08883])
    saturating = 120 * 8**2 / (800 / 15) * daylight
    rgb = read_camera(D800).rgb(saturating)
    signal = from_XYZ @ daylight
    assert rgb == pytest.approx(signal / signal.max(), rel=2e-4)  # printed with five digits
    assert rgb.max() == pytest.approx(1, rel=2e-4)


@settings(max_examples=12, deadline=None)
@given(
    arrays(np.float64, (3, 3), elements=st.floats(-1, 1)),
    arrays(np.float64, 3, elements=st.floats(-1e-5, 1e-5)),
    st.sampled_from(["affine", "linear"]),
    st.text(st.characters(exclude_categories=["Cc", "Cs", "Cf"]), max_size=20),
)
def test_what_is_written_reads_back_bit_by_bit(
    tmp_path_factory: pytest.TempPathFactory, noise: np.ndarray, small: np.ndarray, form: Form, name: str
) -> None:
    model = CameraModel(
        100 * np.eye(3) + noise,
        small if form == "affine" else np.zeros(3),
        np.abs(small),
        Exposure(1 / 3, 5.6, 1e6),
        (1e-7, 1e12),
        form,
        name,
        f"{name}: '\"#",
        (ExposureSet(3.7, (Exposure(1.3, 8.0, 800), Exposure(1 / 3, 8.0, 800))),),
    )
    path = tmp_path_factory.mktemp("camera") / "camera.yaml"
    write_camera(model, path)
    back = read_camera(path)
    for part in ("matrix", "offset_XYZ", "black_rgb"):
        assert np.array_equal(getattr(back, part), getattr(model, part)), part
    for part in ("exposure", "safe_luminance_cd_m2", "form", "name", "source", "exposure_sets"):
        assert getattr(back, part) == getattr(model, part), part
    assert format_camera(back) == format_camera(model)
    assert [file.name for file in path.parent.iterdir()] == ["camera.yaml"]


@pytest.mark.parametrize(
    ("old", "new", "line", "words"),
    [
        ("time_s: 1/15", "time_s: 1/0", 3, "write seconds"),
        ("time_s: 1/15", "time_s: soon", 3, "write seconds"),
        ("iso: 800", "iso: -800", 3, "iso"),
        ("form: linear", "form: cubic", 2, "expected one of"),
        ("[12, -35, 220]", "[12, -35, .nan]", 7, "finite"),
        ("[12, -35, 220]", "[84, 146, -46]", None, "matrix has no inverse"),
        ("form:", "from:", 2, "form"),
    ],
)
def test_faults_are_named_with_their_file(tmp_path: Path, old: str, new: str, line: int | None, words: str) -> None:
    path = tmp_path / "camera.yaml"
    assert old in PLAIN
    path.write_text(PLAIN.replace(old, new))
    with pytest.raises(InputError, match=words) as caught:
        read_camera(path)
    assert all(finding.file == str(path) for finding in caught.value.findings)
    if line is not None:
        assert line in [finding.line for finding in caught.value.findings]


# Tables of colours: what is read, and what is refused at which place.

GOOD = "# source: made up\nR,G,B,X,Y,Z,name\n0.1,0.2,0.3,4,5,6,one\n0.2,0.4,0.999,7,8,9,two\n"


def _file(folder: Path, text: str | bytes) -> Path:
    path = folder / "chart.csv"
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return path


def test_a_table(tmp_path: Path) -> None:
    found = read_correspondences(_file(tmp_path, GOOD))
    assert found.rgb.tolist() == [[0.1, 0.2, 0.3], [0.2, 0.4, 0.999]]
    assert found.XYZ.tolist() == [[4, 5, 6], [7, 8, 9]]
    assert found.names == ("one", "two")
    assert found.saturated.tolist() == [[False] * 3, [False, False, True]]


def test_raw_values_with_their_range_and_columns_in_any_order(tmp_path: Path) -> None:
    text = "\ufeff# rgb: 0..16383\nX,Y,Z,note,red,green,blue\n4,5,6,a,0,8191.5,16383\n1,2,3,b,100,20,30\n"
    found = read_correspondences(_file(tmp_path, text))
    assert found.rgb[0] == pytest.approx([0, 0.5, 1])
    assert found.names == ("patch 1", "patch 2")


def test_rows_with_their_exposure(tmp_path: Path) -> None:
    text = "R,G,B,X,Y,Z,time_s,f_number,iso\n0.1,0.2,0.3,4,5,6,1/15,8,800\n0.2,0.4,0.9,7,8,9,1.3,5.6,400\n"
    assert read_correspondences(_file(tmp_path, text)).exposures == (Exposure(1 / 15, 8, 800), Exposure(1.3, 5.6, 400))
    plain = text.replace(",iso", "").replace(",800", "").replace(",400", "")
    assert read_correspondences(_file(tmp_path, plain)).exposures == (Exposure(1 / 15, 8), Exposure(1.3, 5.6))
    with pytest.raises(DeviceError, match=r"csv:2:7: the exposure is '1/0, 8, 800'"):
        read_correspondences(_file(tmp_path, text.replace("1/15", "1/0")))
    with pytest.raises(DeviceError, match="needs both time_s and f_number"):
        read_correspondences(_file(tmp_path, text.replace("f_number", "aperture")))


def test_a_reference_needs_no_camera(tmp_path: Path) -> None:
    found = read_reference(_file(tmp_path, "X,Y,Z,name\n4,5,6,one\n7,8,9,two\n"))
    assert found.names == ("one", "two")
    assert np.array_equal(found.XYZ, [[4, 5, 6], [7, 8, 9]])
    assert len(read_reference(_file(tmp_path, GOOD)).names) == 2


@pytest.mark.parametrize(
    ("text", "line", "column", "words"),
    [
        (GOOD.replace("0.3", "nan"), 3, 3, "B is 'nan'"),
        (GOOD.replace("0.3", "soon"), 3, 3, "B is 'soon'"),
        (GOOD.replace("7,8", "inf,8"), 4, 4, "X is 'inf'"),
        (GOOD.replace("4,5,6,one", "4,5"), 3, None, "5 fields, the header 7"),
        (GOOD.replace("R,G", "R,R"), 2, 2, "'R' stands twice"),
        (GOOD.replace("R,G", "R,Grn"), 2, None, "has no G"),
        ("R,G,B,X,Y,Z\n", None, None, "has no rows"),
        ("", None, None, "has no rows"),
        ("# rgb: 1..5\n" + GOOD, 1, None, "range of the camera's values"),
        (GOOD.replace("0.1,0.2,0.3", "25,51,76"), None, None, "values reach 76"),
        (b"R,G,B\xff", None, None, "not UTF-8"),
        (GOOD.replace("one", '"one'), 3, None, "not CSV"),
    ],
)
def test_faults_have_a_place(
    tmp_path: Path, text: str | bytes, line: int | None, column: int | None, words: str
) -> None:
    path = _file(tmp_path, text)
    with pytest.raises(DeviceError, match=words) as caught:
        read_correspondences(path)
    (finding,) = caught.value.findings
    assert (finding.file, finding.line, finding.column) == (str(path), line, column)


def test_a_reference_is_light(tmp_path: Path) -> None:
    with pytest.raises(DeviceError, match="must not be negative"):
        read_reference(_file(tmp_path, "X,Y,Z\n1,2,3\n1,-2,3\n"))
