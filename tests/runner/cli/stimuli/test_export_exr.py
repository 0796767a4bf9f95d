"""`stimuli build --export-exr` writes OpenEXR and a recipe that shows them, into a new folder only."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from stimuli.pictures import read_exr


def test_export(
    tmp_path: Path, cyclopean: Callable[..., subprocess.CompletedProcess[str]], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CYCLOPEAN_CACHE", str(tmp_path / "cache"))
    Image.fromarray(np.full((4, 6, 3), 255, np.uint8)).save(tmp_path / "a.jpg", quality=100)
    recipe = "schema_version: 1\nkind: pictures\ncolour_space: srgb\nwhite_luminance_cd_m2: 100\n"
    (tmp_path / "r.yaml").write_text(recipe + "stimuli: [{name: a, file: a.jpg}]\n", encoding="utf-8")
    command = ("stimuli", "build", tmp_path / "r.yaml", "--pixel-pitch-mm", 0.25, "--export-exr", tmp_path / "light")
    told = json.loads(cyclopean(*command, "--json").stdout)
    assert told["exported"] == str(tmp_path / "light")
    assert read_exr(tmp_path / "light" / "a.exr").left[0, 0, 1] == pytest.approx(100)
    before = (tmp_path / "light" / "a.exr").read_bytes()
    assert "there is something already" in cyclopean(*command, expect=2).stderr
    assert (tmp_path / "light" / "a.exr").read_bytes() == before
    again = ("stimuli", "build", tmp_path / "light" / "recipe.yaml", "--pixel-pitch-mm", 0.25)
    assert "1 stimulus, 1 of them made now" in cyclopean(*again).stdout
