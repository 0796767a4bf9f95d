"""Quad-buffered for real: a software GL whose visuals are stereo, under Xvfb. `make test-quad STEREO_GL=DIR/lib`."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from devices.display import DisplayModel, ToneCurve, read_display
from stimuli.pictures import StereoImage, read_exr, write_exr

ROOT = Path(__file__).parents[2]
ASUS = ROOT / "configs/displays/asus_vg248qe.yaml"
PRIMARIES = np.array([[10.83, 9.67, 5.68], [5.62, 18.65, 2.20], [0.54, 1.63, 29.18]])

pytestmark = pytest.mark.quad


def model(gamma: float, black: float, lift: float) -> DisplayModel:
    curve = ToneCurve(1.0, 0.0, gamma, lift)
    return DisplayModel(black * np.array([0.95, 1.0, 1.2]), PRIMARIES, (curve, curve, curve))


def ramps(display: DisplayModel, seed: int) -> NDArray[np.float32]:
    """XYZ (240, 320, 3): neutral and primary ramps from 1e-7 cd/m² to above white, then random colours."""
    rng = np.random.default_rng(seed)
    white = display.white_XYZ_cd_m2
    luminance = np.geomspace(1e-7, 2 * white[1], 30 * 320)[:, np.newaxis]
    primaries = [display.primaries_XYZ_cd_m2[:, channel] for channel in range(3)]
    parts = [white / white[1] * luminance]
    parts += [display.black_XYZ_cd_m2 + primary / primary[1] * luminance for primary in primaries]
    parts.append(display.xyz(rng.uniform(0.1, 1.0, (60 * 320, 3))))
    parts.append(rng.random((60 * 320, 3)) * 3 * white - white / 2)
    return np.concatenate(parts).reshape(240, 320, 3).astype(np.float32)


@pytest.fixture(scope="module")
def stereo_gl() -> dict[str, str]:
    """Return the environment in which libGL is the stereo one."""
    library = os.environ.get("STEREO_GL")
    if not library:
        pytest.skip("STEREO_GL does not name the lib folder of a GL with stereo visuals")
    if not (Path(library) / "libGL.so.1").exists():
        pytest.fail(f"there is no libGL.so.1 in {library}")
    if shutil.which("xvfb-run") is None:
        pytest.skip("xvfb-run is not installed (apt install xvfb)")
    return {**os.environ, "LD_LIBRARY_PATH": library, "FORCE_STEREO": "1", "PYTHONPATH": str(ROOT)}


def under_xvfb(arguments: list[str], environment: dict[str, str]) -> subprocess.CompletedProcess[str]:
    command = ["xvfb-run", "-a", "-s", "-screen 0 1920x1080x24", sys.executable, *arguments]
    return subprocess.run(command, env=environment, capture_output=True, text=True, timeout=300)


@pytest.fixture(scope="module")
def models() -> dict[str, DisplayModel]:
    """Return a different characterisation for each eye."""
    return {"left": model(2.2, 0.05, 0.0), "right": model(2.8, 0.2, 0.004)}


@pytest.fixture(scope="module")
def views(models: dict[str, DisplayModel]) -> dict[str, NDArray[np.float32]]:
    """Return what each eye is to see."""
    return {eye: ramps(display, seed) for seed, (eye, display) in enumerate(models.items())}


@pytest.fixture(scope="module")
def drawn(
    stereo_gl: dict[str, str],
    models: dict[str, DisplayModel],
    views: dict[str, NDArray[np.float32]],
    tmp_path_factory: pytest.TempPathFactory,
) -> dict[str, NDArray[np.uint8]]:
    """Return what both back buffers held."""
    folder = tmp_path_factory.mktemp("quad")
    given: dict[str, NDArray[np.generic]] = {}
    for eye, display in models.items():
        given[eye] = views[eye]
        given[f"{eye}_black"] = display.black_XYZ_cd_m2
        given[f"{eye}_primaries"] = display.primaries_XYZ_cd_m2
        curves = [curve for curve in display.curves if isinstance(curve, ToneCurve)]
        given[f"{eye}_curves"] = np.array([(c.gain, c.offset, c.gamma, c.lift) for c in curves])
    np.savez(folder / "in.npz", **given)  # type: ignore[arg-type]  # the stubs take a name for a flag
    script = str(Path(__file__).with_name("draw_each_eye.py"))
    done = under_xvfb([script, str(folder / "in.npz"), str(folder / "out.npz")], stereo_gl)
    assert done.returncode == 0, done.stderr
    with np.load(folder / "out.npz") as out:
        return {name: out[name] for name in out.files}


def test_the_surface_is_stereo(drawn: dict[str, NDArray[np.uint8]]) -> None:
    facts = json.loads(str(drawn["facts"]))
    assert facts["stereo"] is True
    assert facts["renderer"]


@pytest.mark.parametrize("eye", ["left", "right"])
def test_each_back_buffer_is_that_eyes_rounded_reference(
    eye: str,
    drawn: dict[str, NDArray[np.uint8]],
    models: dict[str, DisplayModel],
    views: dict[str, NDArray[np.float32]],
) -> None:
    error = drawn[eye] - models[eye].code(views[eye]) * 255.0
    assert np.abs(error).max() <= 0.501
    assert np.abs(error[120:180].reshape(-1, 3).mean(axis=0)).max() < 0.02


def test_the_eyes_are_not_swapped(
    drawn: dict[str, NDArray[np.uint8]], models: dict[str, DisplayModel], views: dict[str, NDArray[np.float32]]
) -> None:
    swapped = np.abs(drawn["left"] - models["right"].code(views["right"]) * 255.0)
    assert swapped.max() > 50


def test_words_stand_at_the_same_place_in_both_buffers(drawn: dict[str, NDArray[np.uint8]]) -> None:
    left, right = (drawn[f"words_{eye}"][..., 1] for eye in ("left", "right"))
    full_left, full_right = (view == view.max() for view in (left, right))  # the inks differ, the letters do not
    assert left.max() > 0
    assert 50 < np.count_nonzero(full_left) < left.size / 10
    assert (full_left & full_right).sum() > 0.9 * full_left.sum()


def test_swapped_eyes_and_their_lines_are_in_the_other_buffers(
    drawn: dict[str, NDArray[np.uint8]], models: dict[str, DisplayModel], views: dict[str, NDArray[np.float32]]
) -> None:
    for buffer, eye, blue_px in (("swapped_left", "right", 240), ("swapped_right", "left", 80)):
        error = drawn[buffer] - models[eye].code(views[eye]) * 255.0
        assert np.abs(error[:-1]).max() <= 0.501
        assert (drawn[buffer][-1, :blue_px] == (0, 0, 255)).all()
        assert not drawn[buffer][-1, blue_px:].any()


@pytest.mark.parametrize("mode", ["side-by-side", "row-interleaved", "checkerboard"])
def test_a_mode_with_one_picture_on_the_screen_draws_it_to_both_buffers(
    mode: str, drawn: dict[str, NDArray[np.uint8]]
) -> None:
    left, right = drawn[f"both_{mode}"]
    assert left.any()
    np.testing.assert_array_equal(left, right)


def test_show_writes_a_file_for_each_back_buffer(stereo_gl: dict[str, str], tmp_path: Path) -> None:
    display = read_display(ASUS).models("quad-buffered").left
    codes = np.random.default_rng(1).random((2, 101, 151, 3))
    write_exr(tmp_path / "a.exr", StereoImage(*display.xyz(codes).astype(np.float32)))
    arguments = ["-c", "from runner.cli.main import main; main()", "show", str(tmp_path / "a.exr")]
    arguments += ["--display", str(ASUS), "--mode", "quad-buffered", "--screenshot", str(tmp_path / "out.png")]
    done = under_xvfb(arguments, stereo_gl)
    assert done.returncode == 0, done.stderr
    image = read_exr(tmp_path / "a.exr")
    top, left = (1080 - 101) // 2, (1920 - 151) // 2
    for eye, view in (("left", image.left), ("right", image.right)):
        with Image.open(tmp_path / f"out.{eye}.png") as png:
            shown = np.asarray(png)
        assert shown.shape == (1080, 1920, 3)
        assert np.abs(shown[top : top + 101, left : left + 151] - display.code(view) * 255.0).max() <= 0.501
    assert not (tmp_path / "out.png").exists()
