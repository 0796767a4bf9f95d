"""Patches on a GL with stereo visuals: each eye's back buffer holds exactly its codes."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.quad


def test_each_back_buffer_holds_exactly_its_codes() -> None:
    library = os.environ.get("STEREO_GL")
    if not library or shutil.which("xvfb-run") is None:
        pytest.skip("STEREO_GL does not name the folder of a GL with stereo visuals, or xvfb-run is missing")
    script = str(Path(__file__).with_name("fill_each_eye.py"))
    environment = {**os.environ, "LD_LIBRARY_PATH": library, "FORCE_STEREO": "1"}
    environment.pop("WAYLAND_DISPLAY", None)
    command = ["xvfb-run", "-a", "-s", "-screen 0 1920x1080x24", sys.executable, script]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout) == {
        "stereo": True,
        "wrong": {"quad-buffered": 0, "row-interleaved": 0, "flat": 0},
    }
