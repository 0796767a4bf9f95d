"""Raw files and pictures that harm: refused, and neither this process nor the next file is touched."""

from __future__ import annotations

import json
import os
import signal
import struct
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from devices.camera import Exposure, parse_exposure
from devices.errors import DeviceError
from stimuli.develop import CameraImage, libraw, write_camera_exr
from stimuli.develop import linear_files as reader
from stimuli.develop.libraw import read_by_libraw
from stimuli.develop.linear_files import STEPS_ATTRIBUTE, read_linear
from stimuli.develop.metadata import EXPOSURE_ATTRIBUTE, MOST_CHARACTERS, MOST_STEPS, earlier_steps, kept_exposure
from stimuli.develop.raw_files import read_raw
from stimuli.errors import StimulusError
from tests.stimuli.develop.dng import exposure_tags, save_dng, save_linear_dng, write_dng
from tests.stimuli.oiio_files import save_picture

# Pictures made to do harm: attributes that pass for this program's own, channels without end, absurd exposures.

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


# A raw file that LibRaw cannot bear is refused, and neither this process nor the next file is touched by it.

CODES = np.arange(24 * 32, dtype=np.uint16).reshape(24, 32) * 40


def patched(path: Path, tag: int, value: int, kind: int = 4) -> Path:
    """Write another value of a tag into the first directory of a little-endian TIFF file."""
    content = bytearray(path.read_bytes())
    (start,) = struct.unpack_from("<I", content, 4)
    for at in range(start + 2, start + 2 + 12 * struct.unpack_from("<H", content, start)[0], 12):
        if struct.unpack_from("<H", content, at)[0] == tag:
            struct.pack_into("<HII", content, at + 2, kind, 1, value)
    path.write_bytes(content)
    return path


def test_codes_and_facts_are_those_of_the_file(tmp_path: Path) -> None:
    content = read_by_libraw(save_dng(tmp_path / "a.dng", CODES, black=(600,), white=65000))
    np.testing.assert_array_equal(content.codes, CODES)
    assert (content.filters, content.white, content.stack) == ([[0, 1], [3, 2]], 65000, False)
    stack = read_by_libraw(save_linear_dng(tmp_path / "b.dng", np.dstack([CODES] * 3)))
    assert stack.stack
    np.testing.assert_array_equal(stack.codes[..., 1], CODES)


@pytest.mark.parametrize(
    ("width", "height", "compression", "message"),
    [
        (14_000, 14_000, 1, "cut short or damaged"),
        (14_000, 14_000, 7, "cut short or damaged"),
        (60_000, 60_000, 1, "photosites are beyond|cut short or damaged|cannot be read"),
        (2**31, 2**31, 7, "raw file"),
    ],
)
def test_what_a_header_asks_for_is_not_taken(
    tmp_path: Path, width: int, height: int, compression: int, message: str
) -> None:
    path = save_dng(tmp_path / "a.dng", CODES)
    for tag, value in ((256, width), (257, height), (278, height), (259, compression)):
        patched(path, tag, value)
    with pytest.raises(StimulusError, match=message):
        read_raw(path)


@pytest.mark.nightly
def test_a_process_that_was_killed_is_another_for_the_next_file(tmp_path: Path) -> None:
    path = save_dng(tmp_path / "a.dng", CODES)
    read_by_libraw(path)
    (idle, *_) = libraw._processes._idle
    os.kill(idle.pid, signal.SIGTERM if os.name == "nt" else signal.SIGKILL)
    np.testing.assert_array_equal(read_by_libraw(path).codes, CODES)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="each file has a process of its own")
def test_a_file_that_ends_its_process_is_refused_by_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    fatal = "import os; from stimuli.develop import raw_process as p; main = p.main; "
    fatal += "p.main = lambda path: os.abort() if 'fatal' in path else main(path); "
    monkeypatch.setattr(libraw, "_PROCESS", libraw._PROCESS.replace("from stimuli", f"{fatal}from stimuli", 1))
    monkeypatch.setattr(libraw, "_processes", processes := libraw._Processes())
    good = save_dng(tmp_path / "a.dng", CODES)
    bad = save_dng(tmp_path / "fatal.dng", CODES)
    try:
        for _ in range(2):
            with pytest.raises(StimulusError, match=r"fatal\.dng: the raw file is damaged: LibRaw ended"):
                read_by_libraw(bad)
            np.testing.assert_array_equal(read_by_libraw(good).codes, CODES)
        assert len(processes._idle) == 1
    finally:
        processes.close()


def test_threads_read_side_by_side(tmp_path: Path) -> None:
    paths = [save_dng(tmp_path / f"{n}.dng", CODES + np.uint16(n)) for n in range(6)]
    with ThreadPoolExecutor(3) as pool:
        contents = list(pool.map(read_by_libraw, paths))
    for n, content in enumerate(contents):
        np.testing.assert_array_equal(content.codes, CODES + np.uint16(n))


def test_a_filter_that_is_not_known_is_refused(tmp_path: Path) -> None:
    path = save_dng(tmp_path / "a.dng", CODES, pattern=(3, 5, 1, 2))
    with pytest.raises(StimulusError, match=r"colour filter|raw file"):
        read_raw(path)
