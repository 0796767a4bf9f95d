"""Pictures made to do harm: attributes that pass for this program's own, channels without end, absurd exposures."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from devices.camera import Exposure, parse_exposure
from devices.errors import DeviceError
from stimuli.develop import CameraImage, write_camera_exr
from stimuli.develop import linear_files as reader
from stimuli.develop.linear_files import STEPS_ATTRIBUTE, read_linear
from stimuli.develop.metadata import EXPOSURE_ATTRIBUTE, MOST_CHARACTERS, MOST_STEPS, earlier_steps, kept_exposure
from stimuli.develop.raw_files import read_raw
from stimuli.errors import StimulusError
from tests.stimuli.develop.dng import exposure_tags, write_dng
from tests.stimuli.oiio_files import save_picture

READ = {"step": "read", "file": "a.nef", "kind": "raw", "sha256": "0" * 64}
LINEARISE = {"step": "linearise", "largest_code": 9, "photosites_at_largest_code": 1, "saturated_from": [9.0]}
EXPOSURE = {"step": "exposure", "time_s": 0.5, "f_number": 8.0, "iso": 100.0, "source": "told"}


def exr(path: Path, attributes: dict[str, Any], channels: int = 3) -> Path:
    names = (*"RGB", *(f"more{number}" for number in range(channels - 3)))
    return save_picture(path, np.full((8, 8, channels), 0.25, np.float32), names, **attributes)


def test_steps_as_they_are_written_are_kept() -> None:
    steps = [READ, LINEARISE, {"step": "demosaic", "method": "malvar"}, EXPOSURE]
    assert list(earlier_steps(json.dumps(steps))) == steps


@pytest.mark.parametrize(
    "kept",
    [
        "[" * 100_000,
        '[{"step": "read", "v": ' + "[" * 900 + "]" * 900 + "}]",
        json.dumps([READ] * (MOST_STEPS + 1)),
        json.dumps([READ | {"file": "x" * MOST_CHARACTERS}]),
        '[{"step": "read", "v": NaN}]',
        '[{"step": "read", "v": 1e999}]',
        '[{"step": "read", "v": 1' + "0" * 5000 + "}]",
        json.dumps([{"no": 1}]),
        json.dumps([{"step": ["read"]}]),
        json.dumps([{"step": "<script>"}]),
        json.dumps([READ, {"step": "tone_map"}]),
        json.dumps([READ | {"said": [5]}]),
        json.dumps([LINEARISE | {"saturated_from": []}]),
        json.dumps([EXPOSURE | {"iso": -1}]),
        "\x00",
        5,
        None,
    ],
)
def test_steps_that_this_program_never_wrote_are_not_believed(tmp_path: Path, kept: object) -> None:
    assert earlier_steps(kept) == ()
    if isinstance(kept, str) and "\x00" not in kept:
        image = read_linear(exr(tmp_path / "a.exr", {STEPS_ATTRIBUTE: kept}))
        assert [step["step"] for step in image.steps] == ["read", "scale"]
        json.dumps(image.steps, indent=1, allow_nan=False)


@pytest.mark.parametrize(
    "kept",
    [
        "[" * 100_000,
        '"999"',
        "[true, true, true]",
        "[1e300, 1e-300, 1]",
        "[0, 1, 1]",
    ],
)
def test_absurd_exposures_in_a_picture_are_none(tmp_path: Path, kept: str) -> None:
    assert kept_exposure(kept) is None
    assert read_linear(exr(tmp_path / "a.exr", {EXPOSURE_ATTRIBUTE: kept})).exposure is None


@pytest.mark.parametrize("text", ["1e-300,1e300", "1e300,1e-300,1e300", "1/15,8,1e13", "1e-13,8"])
def test_absurd_exposures_that_are_told_are_refused_by_name(text: str) -> None:
    with pytest.raises(DeviceError, match=r"'(time_s|f_number|iso)' of an exposure is .* \(1e-12 to 1e\+12"):
        parse_exposure(text)


def test_channels_without_end_are_refused_before_they_are_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = exr(tmp_path / "a.exr", {}, channels=40)
    assert isinstance(read_linear(path), CameraImage)
    monkeypatch.setattr(reader, "MAX_VALUES", 8 * 8 * 39)
    with pytest.raises(StimulusError, match="40 channels, more than 2496 values"):
        read_linear(path)


def test_what_a_raw_file_went_through_is_kept(tmp_path: Path) -> None:
    rgb = np.full((40, 48, 3), 0.3)
    tags = exposure_tags((1, 15), (8, 1), 800)
    image = read_raw(write_dng(tmp_path / "a.dng", rgb, black=(600,), white=65000, tags=tags))
    write_camera_exr(tmp_path / "a.exr", image)
    back = read_linear(tmp_path / "a.exr")
    assert len(image.steps) >= 5
    assert json.dumps(back.steps[: len(image.steps)]) == json.dumps(image.steps)


@pytest.mark.parametrize(
    "attributes",
    [
        {"ExposureTime": 1e-30, "FNumber": 8.0, "Exif:PhotographicSensitivity": 100},
        {"ExposureTime": 0.5, "FNumber": 1e30, "Exif:PhotographicSensitivity": 100},
    ],
)
def test_absurd_exposures_in_metadata_are_none(tmp_path: Path, attributes: dict[str, Any]) -> None:
    assert read_linear(exr(tmp_path / "a.exr", attributes)).exposure is None


def test_what_exposures_may_be_can_be_told() -> None:
    for time_s, f_number, iso in ((1e-12, 1e12, 1e12), (1e12, 1e-12, 1e-12)):
        exposure = Exposure(time_s, f_number, iso)
        assert np.isfinite([exposure.ev, exposure.light, exposure.relative_to(Exposure(1, 1))]).all()
        assert str(exposure)
