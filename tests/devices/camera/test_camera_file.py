"""Camera files: the shipped one, faults in them, and writing."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from devices.camera import CameraModel, Exposure, Form, read_camera, write_camera
from devices.camera.camera_file import format_camera
from devices.camera.camera_model import ExposureSet
from documents import InputError

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
