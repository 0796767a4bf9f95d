from __future__ import annotations

import json
from functools import partial
from pathlib import Path
from typing import Any

import click
import numpy as np
import pytest
from click.testing import CliRunner

from devices.camera import CameraModel, Exposure, write_camera
from documents import InputError
from runner.cli.main import group
from stimuli.develop import read_camera_image
from stimuli.develop.raw_files import DEFAULT_DEMOSAIC, DEMOSAICS
from stimuli.pictures import read_exr
from tests.invoked import invoked, printed_json
from tests.runner.cli.every_command import commands
from tests.stimuli.develop.dng import coded, exposure_tags, save_dng, smooth, write_dng

MATRIX = np.array([[60.0, 25.0, 15.0], [25.0, 80.0, 5.0], [1.0, 10.0, 120.0]])


@pytest.fixture
def camera(tmp_path: Path) -> Path:
    model = CameraModel(
        MATRIX, np.zeros(3), np.zeros(3), Exposure(1 / 15, 8.0, 200.0), (9.41, 60.0), name="test", source="made up"
    )
    write_camera(model, tmp_path / "camera.yaml")
    return tmp_path / "camera.yaml"


def photo(path: Path, time: tuple[int, int] = (1, 15)) -> Path:
    return write_dng(path, smooth(), black=(600,), white=15520, tags=exposure_tags(time, (8, 1), 200))


develop = partial(printed_json, "camera", "develop")


def findings(*arguments: object) -> list[Any]:
    result = invoked("camera", "develop", *arguments)
    assert isinstance(result.exception, InputError), result.output
    return list(result.exception.findings)


def test_a_raw_photograph_becomes_absolute_xyz(tmp_path: Path, camera: Path) -> None:
    (told,) = develop(photo(tmp_path / "a.dng"), "--camera", camera, "-o", tmp_path / "a.exr")
    truth = smooth() @ MATRIX.T
    xyz = read_exr(tmp_path / "a.exr").left
    np.testing.assert_allclose(xyz[4:-4, 4:-4], truth[4:-4, 4:-4], rtol=2e-3)
    assert told["mean_luminance_cd_m2"] == pytest.approx(truth[..., 1].mean(), rel=1e-3)
    assert told["above_safe_pixels"] == pytest.approx((truth[..., 1] > 60).sum(), abs=20)
    assert told["exposure_was_characterised"] is True
    assert json.loads((tmp_path / "a.steps.json").read_text(encoding="utf-8")) == told
    assert [step["step"] for step in told["steps"]] == [
        "read",
        "linearise",
        "demosaic",
        "rotate",
        "exposure",
        "camera_to_xyz",
    ]


def test_without_a_camera_file_it_stays_camera_rgb(tmp_path: Path) -> None:
    (told,) = develop(photo(tmp_path / "a.dng"), "--demosaic", "superpixel", "-o", tmp_path / "a.exr")
    assert (told["width_px"], told["height_px"]) == (32, 24)
    back = read_camera_image(tmp_path / "a.exr")
    np.testing.assert_array_equal(back.rgb, read_camera_image(tmp_path / "a.dng", demosaic="superpixel").rgb)
    assert back.exposure is not None
    assert back.exposure.f_number == 8.0


def test_many_go_into_a_folder_and_a_bad_one_stops_no_other(tmp_path: Path, camera: Path) -> None:
    good = [photo(tmp_path / f"{name}.dng") for name in ("a", "b")]
    cut = photo(tmp_path / "c.dng")
    cut.write_bytes(cut.read_bytes()[:2000])
    (finding,) = findings(*good, cut, "--camera", camera, "-o", tmp_path / "out")
    assert finding.file == str(cut)
    assert "cut short" in finding.message
    there = sorted(path.name for path in (tmp_path / "out").iterdir())
    assert there == ["a.exr", "a.steps.json", "b.exr", "b.steps.json"]


def test_the_table_tells_what_matters(tmp_path: Path, camera: Path) -> None:
    words = ["camera", "develop", str(photo(tmp_path / "a.dng", (1, 30))), "--camera", str(camera)]
    result = CliRunner().invoke(group, [*words, "-o", str(tmp_path / "a.exr")])
    assert result.exit_code == 0
    _, heads, cells, note = result.output.splitlines()[-4:]
    assert heads.split() == ["photograph", "size", "exposure", "saturated", "%", "mean", "max", "unsafe", "%", "<", "0"]
    assert cells.split()[:7] == ["a.dng", "64×48", "1/30", "f/8", "200", "0", "0"]
    assert note == "Note: a.dng: the camera file was not tested at this exposure."


def test_a_long_name_is_folded_and_numbers_stay_whole(tmp_path: Path, camera: Path) -> None:
    name = "manitoba_gray_left_2_of_6_one_thirtieth.dng"
    words = ["camera", "develop", str(photo(tmp_path / name)), "--camera", str(camera), "-o", str(tmp_path / "a.exr")]
    on_terminal = {"COLUMNS": "80", "FORCE_COLOR": "1", "TERM": "dumb"}
    result = CliRunner().invoke(group, words, env=on_terminal)
    assert result.exit_code == 0
    assert "1/15 f/8 200" in result.output
    assert "…" not in result.output
    lines = [line[:25].lstrip().split(" ")[0] for line in result.output.splitlines()]
    first = next(number for number, line in enumerate(lines) if line.startswith("manitoba"))
    assert "".join(lines[first:]).startswith(name)


def test_a_sensor_that_is_full_early_is_noticed(tmp_path: Path) -> None:
    """Above 15000 of 15520 codes nothing more comes: the remark says so, and the code told marks them."""
    light = smooth()
    light[10:20, 10:30] = 1.5
    path = save_dng(tmp_path / "a.dng", np.minimum(coded(light, (600,), 15520), 15000), black=(600,), white=15520)
    (told,) = develop(path, "-o", tmp_path / "a.exr", "--demosaic", "bilinear")
    assert told["saturated_share"] == [0, 0, 0]
    assert told["said"] == [
        "200 photosites share the largest code, 15000, below 15520: if it is full there, give --saturated 15000"
    ]
    (told,) = develop(path, "-o", tmp_path / "b.exr", "--demosaic", "bilinear", "--saturated", 15000)
    assert told["saturated_share"][1] == pytest.approx(200 / 48 / 64, rel=0.3)
    assert told["said"] == []


def test_nothing_is_written_over_a_photograph(tmp_path: Path) -> None:
    first = develop(photo(tmp_path / "a.dng"), "-o", tmp_path / "a.exr")
    before = (tmp_path / "a.exr").read_bytes()
    for output in (tmp_path, tmp_path / "a.exr"):
        (finding,) = findings(tmp_path / "a.exr", "-o", output)
        assert "written over" in finding.message
    assert (tmp_path / "a.exr").read_bytes() == before
    assert first[0]["holds"] == "camera RGB"
    (tmp_path / "other").mkdir()
    twin = photo(tmp_path / "other" / "A.dng")
    for more, to, told in (
        ([twin], "out", "same file"),
        ([tmp_path / "a.dng"], "out", "twice"),
        ([twin], "b.exr", "name a folder"),
        ([], "b.png", "no .exr"),
    ):
        (finding,) = findings(tmp_path / "a.dng", *more, "-o", tmp_path / to)
        assert told in str(finding)


def test_faults_of_camera_and_exposure_are_told(tmp_path: Path, camera: Path) -> None:
    path = write_dng(tmp_path / "a.dng", smooth(), black=(600,), white=15520)
    (finding,) = findings(path, "--camera", camera, "-o", tmp_path / "a.exr")
    assert finding.file == str(path)
    assert "file has no exposure" in finding.message
    (finding,) = findings(path, "--exposure", "soon", "-o", tmp_path / "a.exr")
    assert "soon" in finding.message
    (finding,) = findings(path, "--camera", tmp_path / "none.yaml", "-o", tmp_path / "a.exr")
    assert finding.file == str(tmp_path / "none.yaml")
    assert not (tmp_path / "a.exr").exists()


def _sparkles() -> np.ndarray:
    """Return 96 × 96 pixels of linear camera RGB: coloured sparkles of 1 pixel standard deviation on a dark plate."""
    rng = np.random.default_rng(2)
    rows, columns = np.mgrid[:96, :96]
    light = np.full((96, 96, 3), 0.04) * [0.5, 1.0, 0.65]
    for _ in range(100):
        y, x = rng.uniform(8, 88, 2)
        spot = np.exp(-((rows - y) ** 2 + (columns - x) ** 2) / 2)
        light += 0.3 * rng.uniform(0.3, 1) * spot[..., None] * [0.5, 1.0, 0.65] * rng.uniform(0.6, 1.4, 3)
    return light


@pytest.mark.nightly
def test_unless_told_otherwise_sparkles_keep_their_light(tmp_path: Path, camera: Path) -> None:
    """The mean light is the plate's, and half the exposure gives half the signal: no choice of directions holds it."""
    tags = exposure_tags((1, 15), (8, 1), 200)
    truth = _sparkles() @ MATRIX.T
    write_dng(tmp_path / "a.dng", _sparkles(), black=(0,), white=65535, tags=tags)
    develop(tmp_path / "a.dng", "--camera", camera, "-o", tmp_path / "a.exr")
    xyz = read_exr(tmp_path / "a.exr").left
    np.testing.assert_allclose(xyz.mean(axis=(0, 1)), truth.mean(axis=(0, 1)), rtol=3e-3)
    write_dng(tmp_path / "b.dng", _sparkles() / 2, black=(0,), white=65535, tags=tags)
    whole, half = (read_camera_image(tmp_path / name).rgb for name in ("a.dng", "b.dng"))
    assert np.abs(whole - 2 * half).max() < 1e-4  # codes are rounded to 1.5e-5 of full scale


def test_the_command_s_default_is_the_library_s() -> None:
    (option,) = (one for one in dict(commands(group))["camera develop"].params if one.name == "demosaic")
    assert option.default == DEFAULT_DEMOSAIC
    assert isinstance(option.type, click.Choice)
    assert tuple(option.type.choices) == DEMOSAICS


def test_dark_frames_and_flat_fields_are_options(tmp_path: Path) -> None:
    even = np.full((48, 64, 3), 0.5)
    options = {"black": (600,), "white": 15520, "tags": exposure_tags((1, 15), (8, 1), 200)}
    write_dng(tmp_path / "dark.dng", np.zeros_like(even), **options)
    write_dng(tmp_path / "flat.dng", even, **options)
    words = ["--dark", tmp_path / "dark.dng", "--flat", tmp_path / "flat.dng", "-o", tmp_path / "a.exr"]
    (facts,) = develop(photo(tmp_path / "a.dng"), *words)
    assert [step["step"] for step in facts["steps"]][:4] == ["read", "linearise", "dark", "flat"]
    write_dng(tmp_path / "full.dng", 2.5 * even, **options)
    (finding,) = findings(tmp_path / "a.dng", "--flat", tmp_path / "full.dng", "-o", tmp_path / "new" / "b.exr")
    assert "flat field is saturated" in finding.message
    assert not (tmp_path / "new").exists()
