"""A driver of OpenGL 3.3 without doubles and without `precise` shows the same codes, in every mode."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from runner.presenter import MODES, PresentationError, find_mode
from runner.presenter.surfaces.egl import EglSurface
from tests.runner.presenter.every_mode import draw

SCRIPT = Path(__file__).with_name("every_mode.py")
# What Mesa's drivers are to leave out.
OPENGL_3_3 = {
    "MESA_EXTENSION_OVERRIDE": "-GL_ARB_gpu_shader_fp64 -GL_ARB_gpu_shader5",
    "MESA_GL_VERSION_OVERRIDE": "3.3",
    "MESA_GLSL_VERSION_OVERRIDE": "330",
}


def _draw_elsewhere(file: Path, environment: dict[str, str], words: Sequence[str]) -> str:
    done = subprocess.run(
        [sys.executable, str(SCRIPT), str(file), *words],
        env={**os.environ, **environment, "PYTHONPATH": os.pathsep.join(path for path in sys.path if path)},
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


@pytest.mark.nightly
@pytest.mark.parametrize("words", [(), pytest.param(("everything",), marks=pytest.mark.stress)])
def test_every_mode_needs_opengl_3_3_and_no_doubles(tmp_path: Path, words: Sequence[str]) -> None:
    try:
        EglSurface((16, 16)).close()
    except PresentationError as error:
        pytest.skip(str(error))
    doubles, arithmetic = draw(bool(words))
    if not arithmetic.startswith("doubles"):
        pytest.skip(f"this driver computes in {arithmetic}")
    drawn = {key.split()[0] for key in doubles}
    assert drawn == {name for name in MODES if not find_mode(name).needs_stereo}
    told = _draw_elsewhere(tmp_path / "codes.npz", OPENGL_3_3, words)
    if not told.startswith("two-floats"):
        pytest.skip(f"this driver is not Mesa's: OpenGL could not be taken from it; it computed in {told}")
    assert told == "two-floats-guarded: the driver has no 64-bit floats"
    with np.load(tmp_path / "codes.npz") as found:
        assert set(found) == set(doubles)
        for name, codes in doubles.items():
            off = np.abs(found[name].astype(int) - codes)
            assert codes.max() > 200, name
            # Where the light lies between two codes but for a thousandth, either is right.
            assert off.max() <= 1, name
            assert np.mean(off > 0) < 2e-3, name
