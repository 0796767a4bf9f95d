"""`display patches` in a real window, with real keys."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

import pytest

pytestmark = pytest.mark.window

DISPLAY = "schema_version: 1\npanel: {resolution_px: [640, 480], pixel_pitch_mm: 0.25}\n"


def test_keys_go_on_back_and_stop(xvfb: str, tmp_path: Path) -> None:
    if shutil.which("xdotool") is None:
        pytest.skip("xdotool is not installed")
    (tmp_path / "display.yaml").write_text(DISPLAY)
    code = "from runner.cli.main import main; main()"
    command = [sys.executable, "-c", code, "display", "patches", str(tmp_path / "display.yaml"), "--mode",
               "row-interleaved", "--set", "grey", "--windowed", "-o", str(tmp_path / "shown.csv")]  # fmt: skip
    environment = {**os.environ, "DISPLAY": xvfb}
    environment.pop("WAYLAND_DISPLAY", None)
    process = subprocess.Popen(command, stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=environment)
    assert process.stderr is not None
    told: list[str] = []

    def until(shown: str) -> None:
        assert process.stderr is not None
        for line in process.stderr:
            told.append(line)
            if line.startswith(shown):
                return
        pytest.fail(f"'{shown}' was not told: {told}")

    try:
        until("1/39  black: 0 0 0")
        time.sleep(0.5)
        for key, shown in (("Right", "2/39"), ("Right", "3/39"), ("Left", "2/39"), ("Return", "3/39")):
            subprocess.run(["xdotool", "key", key], env=environment, check=True)
            until(shown)
        subprocess.run(["xdotool", "key", "Escape"], env=environment, check=True)
        _, said = process.communicate(timeout=20)
    finally:
        process.kill()
    assert process.returncode == 1
    assert "stopped after 3 of 39 patches" in said
    assert len((tmp_path / "shown.csv").read_text().splitlines()) == 3 + 3
