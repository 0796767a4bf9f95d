"""What cannot be compared is refused in one line, with exit status 2, and nothing is written."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest

from devices.camera import CameraModel, Exposure, write_camera
from stimuli.develop import CameraImage, write_camera_exr
from tests.stimuli.comparison.scenes import CHART, PLATE, RIG, SIZE, Cyclopean, chart, patch_XYZ, spots, written

Refused = Callable[..., str]

MATRIX = np.array([[60.0, 25.0, 15.0], [25.0, 80.0, 5.0], [1.0, 10.0, 120.0]])


@pytest.fixture
def refused(tmp_path: Path, cyclopean: Cyclopean, monkeypatch: pytest.MonkeyPatch) -> Refused:
    """Run the command asking for a page and an experiment; return its one line of complaint."""
    monkeypatch.chdir(tmp_path)

    def run(*words: object) -> str:
        before = sorted(tmp_path.rglob("*"))
        more: Sequence[object] = ("--rig", RIG, "-o", tmp_path / "out.html", "--experiment", "study")
        told = cyclopean("compare", *words, *more, expect=2)
        assert sorted(tmp_path.rglob("*")) == before
        assert told.stdout == ""
        lines = told.stderr.splitlines()
        assert len(lines) == 1, told.stderr
        return lines[0]

    return run


def camera_rgb(path: Path, exposure: Exposure | None) -> Path:
    rgb = (chart() @ np.linalg.inv(MATRIX).T).astype(np.float32)
    write_camera_exr(path, CameraImage(rgb, np.zeros(rgb.shape, dtype=np.bool_), exposure, path.name))
    return path


@pytest.mark.parametrize("name", ["b.png", "b.tif"])
@pytest.mark.parametrize("told", [(), ("--rendering-holds", "xyz")])
def test_eight_bits_are_no_light(tmp_path: Path, refused: Refused, name: str, told: tuple[str, ...]) -> None:
    from PIL import Image

    Image.fromarray(np.full((180, 240, 3), 120, np.uint8)).save(tmp_path / name)
    line = refused(written(tmp_path / "a.exr", spots()), tmp_path / name, "--regions", PLATE, *told)
    assert f"{name}: the rendering has 8 bits a channel" in line
    assert "OpenEXR" in line
    assert "holds xyz" not in line


def test_different_sizes_without_registration(tmp_path: Path, refused: Refused) -> None:
    files = written(tmp_path / "a.exr", spots()), written(tmp_path / "b.exr", spots(size=(200, 180)))
    line = refused(*files, "--regions", PLATE, "--register", "none")
    assert "240 × 180" in line
    assert "--register auto" in line


def test_a_region_beyond_what_was_rendered(tmp_path: Path, refused: Refused) -> None:
    files = written(tmp_path / "a.exr", spots()), written(tmp_path / "b.exr", spots(dx=40.0))
    regions = tmp_path / "r.yaml"
    text = "schema_version: 1\nregions:\n  - {kind: rectangle, name: rim, box: [170, 20, 60, 40]}\n"
    regions.write_text(text, encoding="utf-8")
    line = refused(*files, "--regions", regions)
    assert "'rim' lie beyond the rendering's edge" in line


@pytest.mark.nightly
def test_a_rendering_turned_round(tmp_path: Path, refused: Refused) -> None:
    picture = spots()
    files = written(tmp_path / "a.exr", picture), written(tmp_path / "b.exr", picture[::-1, ::-1])
    line = refused(*files, "--regions", PLATE)
    assert "the rendering is turned by" in line
    assert "180.0°" in line


def test_two_plates_with_nothing_in_common(tmp_path: Path, refused: Refused) -> None:
    files = written(tmp_path / "a.exr", spots()), written(tmp_path / "b.exr", spots(seed=1))
    line = refused(*files, "--regions", PLATE)
    assert "cannot be brought onto the photograph" in line
    assert "--register none" in line


def test_camera_rgb_without_a_camera_file(tmp_path: Path, refused: Refused) -> None:
    (tmp_path / "r.yaml").write_text(CHART, encoding="utf-8")
    photo = camera_rgb(tmp_path / "a.exr", Exposure(1 / 15, 8.0, 200.0))
    line = refused(photo, written(tmp_path / "b.exr", chart()), "--regions", tmp_path / "r.yaml")
    assert "a.exr: the photograph is camera RGB" in line
    assert "--camera" in line


@pytest.mark.parametrize(
    ("exposure", "message"),
    [
        (Exposure(1 / 2, 8.0, 200.0), "was taken at 0.5 s, f/8, ISO 200"),
        (None, "file has no exposure"),
    ],
)
def test_a_camera_file_of_another_exposure(
    tmp_path: Path,
    refused: Refused,
    exposure: Exposure | None,
    message: str,
) -> None:
    (tmp_path / "r.yaml").write_text(CHART, encoding="utf-8")
    model = CameraModel(MATRIX, np.ones(3), np.zeros(3), Exposure(1 / 15, 8.0, 200.0), form="affine")
    write_camera(model, tmp_path / "c.yaml")
    photo = camera_rgb(tmp_path / "a.exr", exposure)
    told = ("--regions", tmp_path / "r.yaml", "--camera", tmp_path / "c.yaml")
    line = refused(photo, written(tmp_path / "b.exr", chart()), *told)
    assert "a.exr" in line
    assert message in line


def test_a_pair_beside_a_single_picture(tmp_path: Path, refused: Refused) -> None:
    files = written(tmp_path / "a.exr", spots(), spots(dx=1.0)), written(tmp_path / "b.exr", spots())
    line = refused(*files, "--regions", PLATE)
    assert "a pair for two eyes" in line


def test_files_that_are_not_there_or_would_be_lost(tmp_path: Path, refused: Refused, cyclopean: Cyclopean) -> None:
    file = written(tmp_path / "a.exr", spots())
    assert "there is no such rendering" in refused(file, tmp_path / "none.exr", "--regions", PLATE)
    told = cyclopean("compare", file, file, "--regions", PLATE, "-o", file, expect=2)
    assert "the page is no .html file" in told.stderr
    told = cyclopean("compare", file, file, "--regions", PLATE, "--rig", RIG, "--experiment", "A B", expect=2)
    assert "an experiment cannot be called 'A B'" in told.stderr
    assert cyclopean("compare", file, file, "--regions", PLATE, "--experiment", "x", expect=2).stderr


@pytest.mark.nightly
def test_a_rendering_of_another_scale(tmp_path: Path, refused: Refused) -> None:
    large = spots(size=(480, 360), sd_px=1.8, amplitude=1200.0, count=900)
    small = large.reshape(180, 2, 240, 2, 3).mean(axis=(1, 3))
    files = written(tmp_path / "a.exr", small), written(tmp_path / "b.exr", large)
    line = refused(*files, "--regions", PLATE)
    assert "the rendering is 2 times as large as the photograph" in line


def test_a_region_outside(tmp_path: Path, refused: Refused) -> None:
    file = written(tmp_path / "a.exr", spots())
    regions = tmp_path / "r.yaml"
    text = "schema_version: 1\nregions:\n  - {kind: rectangle, name: rim, box: [200, 20, 60, 40]}\n"
    regions.write_text(text, encoding="utf-8")
    line = refused(file, file, "--regions", regions)
    assert f"{regions}:3:" in line
    assert "'rim'" in line
    assert "240 × 180" in line


@pytest.mark.nightly
@pytest.mark.parametrize("which", ["photograph", "rendering"])
def test_a_chart_upside_down(tmp_path: Path, refused: Refused, which: str) -> None:
    (tmp_path / "r.yaml").write_text(CHART, encoding="utf-8")
    upright = written(tmp_path / "a.exr", chart())
    turned = written(tmp_path / "b.exr", chart(patch_XYZ()[::-1]))
    files = (turned, upright) if which == "photograph" else (upright, turned)
    registering = "none" if which == "photograph" else "auto"
    line = refused(*files, "--regions", tmp_path / "r.yaml", "--register", registering)
    assert f"the chart 'chart' lies upside down in the {which}" in line


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_values_that_are_no_numbers(tmp_path: Path, refused: Refused, bad: float) -> None:
    import OpenImageIO as oiio

    picture = spots().copy()
    picture[7, 9, 1] = bad
    spec = oiio.ImageSpec(*SIZE, 3, "float")
    spec.channelnames = ("X", "Y", "Z")
    output = oiio.ImageOutput.create(str(tmp_path / "b.exr"))
    assert output is not None
    assert output.open(str(tmp_path / "b.exr"), spec)
    assert output.write_image(picture)
    output.close()
    line = refused(written(tmp_path / "a.exr", spots()), tmp_path / "b.exr", "--regions", PLATE)
    assert "b.exr: 1 pixel is not finite" in line
