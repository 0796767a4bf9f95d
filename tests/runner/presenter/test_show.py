"""`cyclopean show`: the exact codes in the PNG, and one line for every fault."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

import runner.presenter.show
from devices.colour import delta_e_2000, xyz_to_lab
from devices.display import read_display
from runner.presenter import show_picture
from runner.presenter.show import ShownPicture, ShowOptions
from stimuli.pictures import StereoImage, read_exr, write_exr
from tests.choice import nightly

ROOT = Path(__file__).parents[3]
ASUS = ROOT / "configs/displays/asus_vg248qe.yaml"
Run = Callable[..., subprocess.CompletedProcess[str]]


@pytest.fixture
def show(tmp_path: Path, cyclopean: Run, monkeypatch: pytest.MonkeyPatch) -> Run:
    """Run the command in a folder of its own."""
    monkeypatch.chdir(tmp_path)
    return partial(cyclopean, "show")


@pytest.fixture
def picture(tmp_path: Path, random_stereo: Callable[..., StereoImage]) -> Path:
    """A stereo picture of odd size, on disk."""
    file = tmp_path / "plate.exr"
    write_exr(file, random_stereo(301, 405))
    return file


def write_anything(file: Path, pixels: NDArray[np.float32]) -> None:
    """Write XYZ pixels as they are; our own writer would refuse NaN."""
    import OpenImageIO as oiio

    spec = oiio.ImageSpec(pixels.shape[1], pixels.shape[0], 3, "float")
    spec.channelnames = ("X", "Y", "Z")
    output = oiio.ImageOutput.create(str(file))
    assert output is not None
    assert output.open(str(file), spec)
    assert output.write_image(pixels)
    output.close()


def codes(file: Path) -> NDArray[np.uint8]:
    with Image.open(file) as image:
        assert image.mode == "RGB"
        assert "gamma" not in image.info
        assert "icc_profile" not in image.info
        return np.asarray(image)


@pytest.mark.parametrize("backend", ["egl", *nightly("null")])
def test_the_screenshot_holds_the_framebuffers_codes(show: Run, picture: Path, tmp_path: Path, backend: str) -> None:
    words = ("--display", ASUS, "--mode", "side-by-side", "--screenshot", "out.png", "--headless", "--backend", backend)
    done = show(picture, *words, expect=None)
    if backend == "null" and "libosmesa6" in done.stderr:
        pytest.skip(done.stderr.strip())
    assert done.returncode == 0, done.stderr
    screen = codes(tmp_path / "out.png")
    assert screen.shape == (1080, 1920, 3)
    model = read_display(ASUS).models("side-by-side").left
    image = read_exr(picture)
    top, left = (1080 - 301) // 2, (960 - 405) // 2
    for eye, corner in (("left", left), ("right", left + 960)):
        shown = screen[top : top + 301, corner : corner + 405]
        assert np.abs(shown - model.code(image.eye(eye)) * 255.0).max() <= 0.501  # type: ignore[arg-type]  # an eye
    assert int(screen.astype(bool).any(axis=2).sum()) <= 2 * 301 * 405
    assert "left eye: " in done.stdout
    assert "right eye: " in done.stdout


@pytest.mark.parametrize(
    ("panel", "asked", "bits"), [(10, (), 10), *nightly((10, ("--bits", "8"), 8), (12, (), 10), (8, (), 8))]
)
def test_bits_are_the_panel_s_unless_others_are_asked_for(
    show: Run, picture: Path, tmp_path: Path, panel: int, asked: tuple[str, ...], bits: int
) -> None:
    text = ASUS.read_text(encoding="utf-8")
    assert "bits: 8" in text
    assert "[1920, 1080]" in text
    small = text.replace("[1920, 1080]", "[640, 480]").replace("bits: 8", f"bits: {panel}")
    (tmp_path / "display.yaml").write_text(small, encoding="utf-8")
    common = [picture, "--display", "display.yaml", "--mode", "side-by-side", "--headless", "--json"]
    done = show(*common, "--screenshot", "out.png", *asked)
    assert json.loads(done.stdout)["surface"]["bits"] == bits
    assert "warning" not in done.stderr


def test_json_tells_the_clipping_of_each_eye(show: Run, tmp_path: Path) -> None:
    model = read_display(ASUS).models("side-by-side").left
    left = np.broadcast_to(model.white_XYZ_cd_m2 * 0.4, (10, 10, 3)).astype(np.float32)
    right = left.copy()
    right[:3] *= 10.0
    write_exr(tmp_path / "bright.exr", StereoImage(left, right))
    done = show(
        "bright.exr", "--display", ASUS, "--mode", "side-by-side", "--screenshot", "o.png", "--headless", "--json"
    )
    shown = json.loads(done.stdout)
    assert shown["clipping"]["left"]["percent_any"] == 0.0
    assert shown["clipping"]["right"]["percent_any"] == pytest.approx(30.0)
    assert shown["clipping"]["right"]["percent_above_full"] == pytest.approx(30.0)
    assert shown["clipping"]["left"]["delta_e_00_max"] == 0.0 < shown["clipping"]["right"]["delta_e_00_mean"]
    assert shown["screenshots"] == ["o.png"]
    assert shown["surface"]["size_px"] == [1920, 1080]


@pytest.mark.nightly
def test_a_window_waits_for_escape(show: Run, picture: Path, display: str) -> None:
    import shutil
    import time

    tool = shutil.which("xdotool")
    if tool is None:
        pytest.skip("xdotool is not installed (apt install xdotool)")
    command = [sys.executable, "-c", "from runner.cli.main import main; main()", "show", str(picture)]
    command += ["--display", str(ASUS), "--mode", "side-by-side"]
    with subprocess.Popen(
        command, env={**os.environ, "PYTHONPATH": str(ROOT)}, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        subprocess.run([tool, "search", "--sync", "--name", "cyclopean"], check=True, timeout=60, capture_output=True)
        time.sleep(1.0)
        subprocess.run([tool, "key", "space"], check=True, timeout=10)
        time.sleep(0.5)
        assert process.poll() is None
        subprocess.run([tool, "key", "Escape"], check=True, timeout=10)
        out, error = process.communicate(timeout=30)
    assert process.returncode == 0, error
    assert "no screen shows 1920 × 1080" in error
    assert "left eye" in out


REFUSED = [
    pytest.param(
        ["plate.exr", "--mode", "side-by-side", "--mode-option", "swap=1"], "did you mean 'swap_eyes'", id="option"
    ),
    pytest.param(["plate.exr", "--mode", "side-by-side", "--mode-option", "swap_eyes=["], "cannot be read", id="YAML"),
    pytest.param(["plate.exr", "--mode", "anaglyph"], "not characterised in the mode 'anaglyph'", id="absent mode"),
    pytest.param(["plate.exr", "--mode", "quad-buffered"], "GL_STEREO is false", id="no stereo"),
    pytest.param(["absent.exr", "--mode", "side-by-side"], "absent.exr", id="no file"),
    pytest.param(["broken.exr", "--mode", "side-by-side"], "broken.exr", id="no EXR"),
    pytest.param(["nan.exr", "--mode", "side-by-side"], "NaN in 2 pixels", id="NaN"),
]


@pytest.mark.parametrize(("arguments", "said"), REFUSED)
def test_every_fault_is_one_line_and_writes_nothing(
    show: Run, picture: Path, tmp_path: Path, arguments: list[str], said: str
) -> None:
    (tmp_path / "broken.exr").write_bytes(b"not a picture at all")
    with_nan = np.ones((20, 30, 3), np.float32)
    with_nan[5, 6:8] = np.nan
    write_anything(tmp_path / "nan.exr", with_nan)
    before = sorted(tmp_path.iterdir())
    done = show(*arguments, "--display", ASUS, "--headless", "--screenshot", "out.png", expect=2)
    assert said in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1
    assert done.stdout == ""
    assert sorted(tmp_path.iterdir()) == before


@pytest.mark.parametrize(
    ("screenshot", "said"),
    [("out.jpg", "end the name in .png"), ("absent/out.png", "no such folder"), (None, "add --screenshot")],
)
def test_a_screenshot_that_cannot_be_written_is_refused(
    show: Run, picture: Path, screenshot: str | None, said: str
) -> None:
    arguments = ["--screenshot", screenshot] if screenshot else []
    done = show(picture, "--display", ASUS, "--mode", "side-by-side", "--headless", *arguments, expect=2)
    assert said in done.stderr


@pytest.mark.shared_data
@pytest.mark.parametrize(
    ("name", "options"), [("Adjuster.exr", ["--colour-space", "rec709"]), ("chromaticities_XYZ.exr", [])]
)
def test_real_pictures_are_shown(show: Run, shared_data: Path, tmp_path: Path, name: str, options: list[str]) -> None:
    file = shared_data / "data/stereo" / name
    show(file, "--display", ASUS, "--mode", "side-by-side", "--screenshot", "o.png", "--headless", *options)
    screen = codes(tmp_path / "o.png")
    image = read_exr(file, "rec709" if options else None)
    model = read_display(ASUS).models("side-by-side").left
    place = (960 - image.width_px) // 2, (1080 - image.height_px) // 2
    shown = screen[place[1] : place[1] + image.height_px, place[0] : place[0] + image.width_px]
    assert np.abs(shown - model.code(image.left) * 255.0).max() <= 0.501


def test_a_leaking_display_s_crosstalk_is_cancelled(show: Run, tmp_path: Path) -> None:
    """The screenshot's codes, through the display model and the leak, are what was asked."""
    from devices.compensation.crosstalk_cancel import seen_XYZ

    display = tmp_path / "leaky.yaml"
    display.write_text(
        "schema_version: 1\npanel: {resolution_px: [64, 32], pixel_pitch_mm: 0.3}\nmodes:\n  side-by-side:\n"
        "    black_XYZ_cd_m2: [0, 0, 0]\n"
        "    primaries_XYZ_cd_m2: {red: [10.8, 5.6, 0.5], green: [9.7, 18.6, 1.6], blue: [5.7, 2.2, 29.2]}\n"
        "    curve: {kind: gamma, red: {gamma: 2.2}, green: {gamma: 2.2}, blue: {gamma: 2.2}}\n"
        "    crosstalk:\n      left: [[0.05, 0, 0], [0, 0.05, 0], [0, 0, 0.05]]\n"
        "      right: [[0.03, 0, 0], [0, 0.03, 0], [0, 0, 0.03]]\n"
    )
    file, picture = tmp_path / "picture.exr", tmp_path / "shown.png"
    loaded = read_display(display)
    models = loaded.models("side-by-side")
    shares = np.linspace(0.3, 0.8, 32, dtype=np.float32)[None, :, None] * np.ones((32, 1, 1), np.float32)
    white = models.left.white_XYZ_cd_m2.astype(np.float32)
    write_exr(file, StereoImage(shares * white, shares[:, ::-1] * white))
    words = (file, "--display", display, "--mode", "side-by-side", "--headless", "--screenshot", picture)
    done = show(*words)
    codes = np.asarray(Image.open(picture)) / 255
    seen = seen_XYZ(models, loaded.crosstalk("side-by-side"), codes[:, :32], codes[:, 32:])
    for light, asked in zip(seen, (shares * white, shares[:, ::-1] * white), strict=True):
        assert np.abs(light / asked - 1).max() < 0.02
    assert "left eye: crosstalk is cancelled" in done.stdout
    uncancelled = seen_XYZ(models, loaded.crosstalk("side-by-side"), models.left.code(shares * white), codes[:, 32:])
    assert np.abs(uncancelled[0] / (shares * white) - 1).max() > 0.04

    # A dark picture opposite white keeps a ghost, and the command says so, as a trial's record would.
    dark = np.full((32, 32, 3), 0.0005, np.float32) * white
    write_exr(file, StereoImage(dark, shares[:, ::-1] * white))
    said = show(*words).stdout
    assert "left eye: crosstalk cannot be cancelled at 100.00 %" in said
    assert "right eye: crosstalk is cancelled" in said
    told = show(*words, "--json")
    ghosts = json.loads(told.stdout)["crosstalk"]
    codes = np.asarray(Image.open(picture)) / 255
    light = seen_XYZ(models, loaded.crosstalk("side-by-side"), codes[:, :32], codes[:, 32:])[0]
    truth = delta_e_2000(xyz_to_lab(dark, white), xyz_to_lab(light, white))
    assert truth.mean() > 5.0
    assert ghosts["left"]["delta_e_00_mean"] == pytest.approx(truth.mean(), abs=0.05)
    assert ghosts["left"]["delta_e_00_max"] == pytest.approx(truth.max(), abs=0.1)
    assert ghosts["right"]["percent_negative"] == 0.0


@pytest.mark.parametrize(
    ("kind", "size"), [("exr", (371, 579)), ("png", (701, 100)), *nightly(("exr", (640, 480)), ("exr", (701, 100)))]
)
def test_of_a_large_picture_what_is_seen_is_read_and_looks_as_the_whole_does(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    random_stereo: Callable[..., StereoImage],
    size: tuple[int, int],
    kind: str,
) -> None:
    """On a display of 640 × 480, of which each view has half the width."""
    display = tmp_path / "small.yaml"
    display.write_text(ASUS.read_text(encoding="utf-8").replace("[1920, 1080]", "[640, 480]"), encoding="utf-8")
    width, height = size
    file = tmp_path / f"large.{kind}"
    if kind == "exr":
        write_exr(file, random_stereo(height, width))
        white: Mapping[str, object] = {}
    else:
        values = np.random.default_rng(2).integers(0, 256, (height, width, 3), dtype=np.uint8)
        Image.fromarray(values).save(file, compress_level=1)
        white = {"colour_space": "srgb", "white_luminance_cd_m2": 60.0}
    seen, shown = in_process(file, tmp_path / "seen.png", white, display)
    monkeypatch.setattr(runner.presenter.show, "_seen_part", lambda areas: None)
    whole, twin = in_process(file, tmp_path / "whole.png", white, display)
    assert seen.picture_px == whole.picture_px == whole.read_px == size
    assert seen.read_px == tuple(map(min, (320, 480), size))
    assert np.array_equal(shown, twin)
    assert seen.clipping.keys() == whole.clipping.keys()
    assert seen.work.bytes_uploaded < whole.work.bytes_uploaded


def in_process(
    file: Path, out: Path, more: Mapping[str, object], display: Path = ASUS
) -> tuple[ShownPicture, NDArray[np.uint8]]:
    options = ShowOptions(screenshot=out, headless=True, **more)  # type: ignore[arg-type]
    done = show_picture(file, display, "side-by-side", options)
    return done, np.concatenate([codes(Path(written)) for written in done.screenshots])


def test_a_moved_or_squeezed_view_reads_the_whole_picture(
    tmp_path: Path, random_stereo: Callable[..., StereoImage]
) -> None:
    file = tmp_path / "large.exr"
    write_exr(file, random_stereo(20, 1200))
    moved = {"mode_options": {"left_offset_px": [30, 0]}}
    assert in_process(file, tmp_path / "out.png", moved)[0].read_px == (1200, 20)


def test_what_the_filters_of_an_anaglyph_cost_is_said(show: Run, tmp_path: Path) -> None:
    text = ASUS.read_text(encoding="utf-8").replace("[1920, 1080]", "[64, 48]")
    (tmp_path / "display.yaml").write_text(text.replace("side-by-side:", "anaglyph-red-cyan:"), encoding="utf-8")
    model = read_display(ASUS).models("side-by-side").left
    red = np.broadcast_to(0.3 * model.primaries_XYZ_cd_m2[:, 0] + model.black_XYZ_cd_m2, (10, 10, 3)).astype(np.float32)
    write_exr(tmp_path / "red.exr", StereoImage(red, red))
    common = [
        "red.exr",
        "--display",
        "display.yaml",
        "--mode",
        "anaglyph-red-cyan",
        "--headless",
        "--screenshot",
        "o.png",
    ]
    cost = json.loads(show(*common, "--json").stdout)["clipping"]["right"]
    assert cost["projection_delta_e_00_mean"] > 10.0
    assert f"{cost['projection_delta_e_00_mean']:.3f} ΔE00" in show(*common).stdout
