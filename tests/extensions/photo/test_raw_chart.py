"""A chart photographed raw: characterised, and its light developed again, at its own exposure and at others."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner, Result
from numpy.typing import NDArray

from devices.camera import read_camera
from documents import InputError
from runner.cli.main import group
from stimuli.pictures import read_exr
from tests.extensions.photo.conftest import RGB, XYZ, M, write_reference
from tests.stimuli.develop.dng import coded, exposure_tags, save_dng

LEVELS: dict[str, Any] = {"black": (600,), "white": 15520}
PATCHES = [(slice(81 + 69 * row, 139 + 69 * row), slice(81 + 69 * column, 139 + 69 * column)) for row in range(4)
           for column in range(6)]  # fmt: skip


def _light() -> NDArray[np.float64]:
    """Return linear camera RGB of a chart on black card, on a grey table."""
    light = np.full((420, 600, 3), [0.09, 0.14, 0.1])
    light[60:365, 60:505] = [0.012, 0.016, 0.012]
    for place, colour in zip(PATCHES, RGB, strict=True):
        light[place] = colour
    return light


def _codes(light: NDArray[np.float64]) -> NDArray[np.uint16]:
    """Return what a sensor of 15,000 electrons and 4 electrons of read noise records."""
    codes = coded(light, **LEVELS).astype(float)
    noise = np.sqrt(np.maximum(codes - 600, 0) + 16) * np.random.default_rng(4).standard_normal(codes.shape)
    return np.asarray(np.clip(np.rint(codes + noise), 0, 15520).astype(np.uint16))


def _photo(path: Path, codes: NDArray[np.uint16], time: tuple[int, int] = (1, 15)) -> Path:
    return save_dng(path, codes, **LEVELS, tags=exposure_tags(time, (8, 1), 800))


def _run(*words: object) -> Result:
    return CliRunner().invoke(group, ["camera", *map(str, words)])


def _told(*words: object) -> Any:
    result = _run(*words, "--json")
    assert result.exit_code == 0, (result.output, result.exception)
    return json.loads(result.stdout)


def _patches(path: Path) -> NDArray[np.float64]:
    xyz = read_exr(path).left
    return np.array([xyz[place][8:-8, 8:-8].mean(axis=(0, 1), dtype=float) for place in PATCHES])


@pytest.fixture
def reference(tmp_path: Path) -> Path:
    return write_reference(tmp_path / "chart.csv")


def test_a_raw_chart_becomes_a_camera_file_and_its_light_comes_back(tmp_path: Path, reference: Path) -> None:
    chart = _photo(tmp_path / "chart.dng", _codes(_light()))
    fitted = _told("fit", chart, "--reference", reference, "-o", tmp_path / "camera.yaml")
    assert fitted["held_out_delta_e_2000"]["max"] < 0.5  # of photon noise: 700 photosites of each colour in a patch
    model = read_camera(tmp_path / "camera.yaml")
    np.testing.assert_allclose(model.matrix, M, atol=0.5)
    assert model.exposure is not None
    assert str(model.exposure) == "1/15 s, f/8, ISO 800"

    half = _photo(tmp_path / "half.dng", _codes(_light() / 2), (1, 30))
    told = _told("develop", chart, half, "--camera", tmp_path / "camera.yaml", "-o", tmp_path / "out")
    scales = [one["steps"][-1]["signal_beside_characterisation"] for one in told]
    assert scales == pytest.approx([1.0, 0.5], rel=1e-6)
    for name in ("chart.exr", "half.exr"):
        np.testing.assert_allclose(_patches(tmp_path / "out" / name), XYZ, rtol=5e-3, atol=0.05)


def test_a_dead_channel_is_named(tmp_path: Path, reference: Path) -> None:
    light = _light()
    light[..., 2] = 0.0
    result = _run("fit", _photo(tmp_path / "dead.dng", _codes(light)), "--reference", reference)
    assert isinstance(result.exception, InputError)
    (finding,) = result.exception.findings
    assert "blue channel" in finding.message
