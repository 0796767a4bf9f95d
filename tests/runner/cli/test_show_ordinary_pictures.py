"""`show` and `compare` take PNG and JPEG, and say what to type where a file leaves out what makes light of it."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

Cyclopean = Callable[..., subprocess.CompletedProcess[str]]

# Primaries and curve of sRGB, 100 cd/m², no black: its own codes come back.
DISPLAY = """schema_version: 1
panel: {resolution_px: [64, 48], pixel_pitch_mm: 0.25, refresh_hz: 60, bits: 8}
modes:
  side-by-side-half: {same_as: side-by-side}
  flat: {same_as: side-by-side}
  side-by-side:
    black_XYZ_cd_m2: [0, 0, 0]
    primaries_XYZ_cd_m2:
      red: [41.239080, 21.263901, 1.933082]
      green: [35.758434, 71.516868, 11.919478]
      blue: [18.048079, 7.219232, 95.053215]
    curve: {kind: srgb}
    source: IEC 61966-2-1
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "display.yaml").write_text(DISPLAY, encoding="utf-8")
    return tmp_path


def codes(seed: int) -> NDArray[np.uint8]:
    return np.random.default_rng(seed).integers(0, 256, (20, 24, 3), dtype=np.uint8)


def shown(cyclopean: Cyclopean, folder: Path, *words: object) -> NDArray[np.uint8]:
    command = ("show", *words, "--display", folder / "display.yaml", "--mode", "side-by-side", "--headless")
    cyclopean(*command, "--screenshot", folder / "s.png", "--white-luminance", 100)
    return np.asarray(Image.open(folder / "s.png").convert("RGB"))


def test_show_gives_back_the_codes(folder: Path, cyclopean: Cyclopean) -> None:
    left, right = codes(1), codes(2)
    Image.fromarray(left).save(folder / "l.png")
    Image.fromarray(right).save(folder / "r.png")
    Image.fromarray(np.hstack([right, left])).save(folder / "both.png")
    for words in (
        (folder / "l.png", "--right", folder / "r.png"),
        (folder / "both.png", "--packing", "side-by-side-crossed"),
    ):
        screen = shown(cyclopean, folder, *words, "--colour-space", "srgb")
        assert np.array_equal(screen[14:34, 4:28], left)
        assert np.array_equal(screen[14:34, 36:60], right)


def test_show_says_what_to_type(folder: Path, cyclopean: Cyclopean) -> None:
    Image.fromarray(codes(1)).save(folder / "x.png")
    to = ("--display", folder / "display.yaml", "--headless", "--screenshot", folder / "s.png")
    told = cyclopean("show", folder / "x.png", *to, "--mode", "side-by-side", expect=2).stderr
    assert "--colour-space srgb" in told
    assert "--white-luminance 100" in told
    Image.fromarray(codes(1)).save(folder / "x_sbs.png")
    words = ("show", folder / "x_sbs.png", *to, "--mode", "flat", "--colour-space", "srgb", "--white-luminance", 100)
    assert "--flat-eye left" in cyclopean(*words, expect=2).stderr
    cyclopean(*words, "--flat-eye", "right")


def test_compare_png_and_jpeg(folder: Path, cyclopean: Cyclopean) -> None:
    y, x = np.mgrid[:120, :160]
    smooth = np.stack([x, y, 128 + 0 * x], axis=-1).astype(np.uint8)
    Image.fromarray(smooth).save(folder / "a.png")
    Image.fromarray(smooth).save(folder / "b.jpg", quality=100, subsampling=0)
    regions = "schema_version: 1\nwhite: d65\nregions: [{kind: rectangle, name: all, box: [10, 10, 100, 80]}]\n"
    (folder / "r.yaml").write_text(regions, encoding="utf-8")
    command = ("compare", folder / "a.png", folder / "b.jpg", "--regions", folder / "r.yaml", "--register", "none")
    told = cyclopean(*command, expect=2).stderr
    assert "add --colour-space srgb --picture-white 100" in told
    told = cyclopean(*command, "--colour-space", "srgb", expect=2).stderr
    assert "go together" in told
    light = ("--colour-space", "srgb", "--picture-white", 100, "--white-luminance", 100)
    found = json.loads(cyclopean(*command, *light, "--json", expect=None).stdout)
    assert found["photograph"]["said"] == ["8 bits of srgb, white at 100 cd/m²"]
    assert found["eyes"]["both"]["regions"]["mean_delta_e"] < 0.5
    assert found["photograph"]["steps"][0]["white_luminance_cd_m2"] == 100
