"""`cyclopean camera fit` from tables and photographs: files, page, JSON, and one line for each mistake."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import tifffile
from click.testing import CliRunner, Result

from devices.camera import Exposure, read_camera
from documents import InputError
from runner.cli.main import group
from tests.choice import nightly
from tests.extensions.photo.conftest import NAMES, RGB, XYZ, M, write_reference
from tests.pages import policy_of


def _table(path: Path, rgb: np.ndarray = RGB, rows: slice = slice(None)) -> Path:
    lines = [
        ",".join([*(repr(float(v)) for v in (*one, *other)), name])
        for one, other, name in zip(rgb[rows], XYZ[rows], NAMES[rows], strict=True)
    ]
    path.write_text("R,G,B,X,Y,Z,name\n" + "\n".join(lines) + "\n")
    return path


def _photo(path: Path, times: float = 1.0) -> Path:
    """Write the chart square on, patches of 60 pixels and gaps of 9, on black card and a grey table."""
    picture = np.full((420, 600, 3), [0.09, 0.14, 0.1])
    picture[60:365, 60:505] = 0.012
    for number, colour in enumerate(RGB):
        row, column = divmod(number, 6)
        top, left = 80 + 69 * row, 80 + 69 * column
        picture[top : top + 60, left : left + 60] = colour
    picture += 0.001 * np.random.default_rng(1).standard_normal(picture.shape)
    tifffile.imwrite(path, np.minimum(times * picture, 1.0).astype(np.float32), photometric="rgb")
    return path


def _fit(*words: object) -> Result:
    return CliRunner().invoke(group, ["camera", "fit", *(str(word) for word in words)])


def _told(*words: object) -> dict[str, object]:
    result = _fit(*words, "--json")
    assert result.exit_code == 0, (result.output, result.exception)
    told: dict[str, object] = json.loads(result.output)
    return told


@pytest.mark.parametrize(
    ("form", "loss"), [("linear", "xyz"), *nightly(("affine", "delta-e"), ("linear", "delta-e"), ("affine", "xyz"))]
)
def test_a_table_to_a_camera_file_and_a_page(
    tmp_path: Path, form: str, loss: str, request: pytest.FixtureRequest
) -> None:
    """Figures are drawn at night."""
    if (form, loss) == ("linear", "xyz"):
        request.getfixturevalue("undrawn")
    table, camera, page = _table(tmp_path / "chart.csv"), tmp_path / "camera.yaml", tmp_path / "out" / "page.html"
    result = _fit(
        table, "--exposure", "1/15,8,800", "--form", form, "--loss", loss, "--name", "D800 <one>", "-o", camera,
        "--report", page,
    )  # fmt: skip
    assert result.exit_code == 0, (result.output, result.exception)
    assert "0.00 ΔE00 on average" in result.output
    assert "1/15 s, f/8, ISO 800 (EV 9.91)" in result.output
    model = read_camera(camera)
    assert model.matrix == pytest.approx(M, abs=1e-7)
    assert model.exposure == Exposure(1 / 15, 8, 800)
    assert (model.name, model.form) == ("D800 <one>", form)
    assert model.safe_luminance_cd_m2 == pytest.approx((XYZ[:, 1].min(), XYZ[:, 1].max()))
    assert "24 of 24 patches" in model.source
    html = page.read_text(encoding="utf-8")
    assert policy_of(html)
    assert "D800 &lt;one&gt;" in html
    assert "<one>" not in html
    assert html.count("<svg") == 4
    assert all(name in html for name in NAMES)


def test_a_photograph_finds_its_chart(tmp_path: Path) -> None:
    photo, reference = _photo(tmp_path / "chart.tif"), write_reference(tmp_path / "reference.csv")
    told = _told(photo, "--reference", reference, "--linear", "--exposure", "1/15,8,800")
    assert np.array(told["matrix_XYZ_cd_m2"]) == pytest.approx(M, abs=0.5)  # noise of 0.001, some 900 pixels a patch
    chart = told["chart"]
    assert isinstance(chart, dict)
    assert chart["corners"] == "found"
    assert chart["way_round"] == "upright"
    assert np.array(chart["corners_px"]) == pytest.approx(np.array([[80, 80], [485, 80], [485, 347], [80, 347]]), abs=3)


def test_the_white_patch_alone_with_published_colours(tmp_path: Path) -> None:
    photo = _photo(tmp_path / "chart.tif")
    white = ",".join(str(value) for value in XYZ[18])
    told = _told(photo, "--white", white, "--linear")
    # The light of the made-up chart is D50, that of the published colours.
    assert np.array(told["matrix_XYZ_cd_m2"]) == pytest.approx(M, abs=1.0)


@pytest.mark.usefixtures("undrawn")
def test_several_exposures_go_into_the_camera_file(tmp_path: Path) -> None:
    lines = ["R,G,B,X,Y,Z,name,time_s,f_number,iso"]
    for times, light in ((1, 1.0), (2, 1.0), (4, 0.25)):
        for one, other, name in zip(RGB * times * light, XYZ * light, NAMES, strict=True):
            values = ",".join(repr(float(value)) for value in (*np.minimum(one, 1.0), *other))
            lines.append(f"{values},{name},{times}/15,8,800")
    (tmp_path / "sets.csv").write_text("\n".join(lines))
    told = _told(tmp_path / "sets.csv", "-o", tmp_path / "camera.yaml", "--report", tmp_path / "page.html")
    assert np.array(told["matrix_XYZ_cd_m2"]) == pytest.approx(M, abs=1e-7)
    model = read_camera(tmp_path / "camera.yaml")
    assert model.exposure == Exposure(1 / 15, 8, 800)
    assert [round(one.white_luminance_cd_m2 / XYZ[18, 1], 6) for one in model.exposure_sets] == [1.0, 0.25]
    assert model.tried_at(Exposure(4 / 15, 8, 800))


def test_a_camera_file_that_is_there_stays(tmp_path: Path) -> None:
    table, camera = _table(tmp_path / "chart.csv"), tmp_path / "camera.yaml"
    camera.write_text("mine")
    result = _fit(table, "-o", camera)
    assert isinstance(result.exception, InputError)
    assert "is there already" in str(result.exception)
    assert camera.read_text() == "mine"
    result = _fit(_table(tmp_path / "bytes.csv", RGB * 255), "-o", camera)
    assert "values reach" in str(result.exception), "what is wrong with the table comes first"
    assert _fit(table, "-o", camera, "--replace").exit_code == 0
    assert read_camera(camera).matrix == pytest.approx(M, abs=1e-7)


def test_what_goes_wrong_writes_nothing_and_says_one_thing(tmp_path: Path) -> None:
    reference = write_reference(tmp_path / "reference.csv")
    bright, dead, broken = RGB * 255, RGB * [1, 0, 1], RGB.copy()
    broken[3, 1] = np.nan
    wrong: dict[str, list[object]] = {
        "values reach": [_table(tmp_path / "bytes.csv", bright)],
        "green hardly changes": [_table(tmp_path / "dead.csv", dead)],
        "G is 'nan'": [_table(tmp_path / "nan.csv", broken)],
        "there are 4 patches": [_table(tmp_path / "four.csv", rows=slice(0, 4))],
        "pixels are saturated": [_photo(tmp_path / "white.tif", 100.0), "--reference", reference, "--linear"],
        "no such file": [tmp_path / "none.csv"],
        "the exposure is": [_table(tmp_path / "good.csv"), "--exposure", "fast"],
        "the black 0.9, 0.9, 0.9 is above": [_table(tmp_path / "good.csv"), "--black", "0.9,0.9,0.9"],
    }
    for words, command in wrong.items():
        output, page = tmp_path / "camera.yaml", tmp_path / "page.html"
        result = _fit(*command, "-o", output, "--report", page)
        assert isinstance(result.exception, InputError), (words, result.output, result.exception)
        assert len(result.exception.findings) == 1, words
        assert words in str(result.exception), str(result.exception)
        assert not output.exists()
        assert not page.exists()


@pytest.mark.parametrize(
    "words",
    [
        ["chart.csv", "--white", "1,2,3"],
        ["chart.nef"],
        ["chart.nef", "--reference", "a.csv", "--white", "1,2,3"],
        ["chart.nef", "--white", "1,2"],
        ["chart.nef", "--white", "1,2,3", "--corners", "1,2", "3", "4,5", "6,7"],
        ["chart.csv", "--black", "none"],
    ],
)
def test_mistakes_in_the_command(words: list[str]) -> None:
    result = _fit(*words)
    refused = isinstance(result.exception, InputError) and "no such file" not in str(result.exception)
    assert refused or result.exit_code == 2
