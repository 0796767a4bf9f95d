"""The pixels of a built set that a display cannot show bright enough: large pictures are counted in bands of rows."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import stimuli.build.stimulus_set
import stimuli.pictures.exr_write
from devices.display import read_rig
from documents import counted_work
from stimuli.build import StimulusSet, build_set
from stimuli.build.report import saturated_percent
from stimuli.luminance.saturation import measure_saturation
from stimuli.pictures import StereoImage, write_exr
from stimuli.recipes import DisplaySetup

ROOT = Path(__file__).parents[3]
SETUP = DisplaySetup.of(read_rig(ROOT / "configs/rigs/asus_vg248qe_3dvision.yaml"))
SIZE_PX = 40, 700  # 700 rows are three bands of 256 at most


@pytest.fixture
def built(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> StimulusSet:
    """A stereo pair, a flat picture, and codes of one that no step changes."""
    monkeypatch.setenv("CYCLOPEAN_CACHE", str(tmp_path / "cache"))
    random = np.random.default_rng(3)
    width, height = SIZE_PX
    left, right = (1.1 * SETUP.models.left.xyz(random.random((2, height, width, 3)))).astype(np.float32)
    left[: height // 2] *= 0.1
    write_exr(tmp_path / "pair.exr", StereoImage(left, right))
    write_exr(tmp_path / "flat.exr", StereoImage.flat(right))
    Image.fromarray(random.integers(0, 256, (height, width, 3), dtype=np.uint8)).save(tmp_path / "codes.png")
    recipe = {
        "schema_version": 1,
        "kind": "pictures",
        "white_luminance_cd_m2": round(1.2 * float(SETUP.models.left.white_XYZ_cd_m2[1]), 3),
        "stimuli": [
            {"name": "pair", "file": "pair.exr"},
            {"name": "flat", "file": "flat.exr"},
            {"name": "codes", "file": "codes.png", "colour_space": "srgb"},
        ],
    }
    (tmp_path / "recipe.yaml").write_text(json.dumps(recipe), encoding="utf-8")
    return build_set(tmp_path / "recipe.yaml", 0.2768)


def test_bands_of_rows_are_counted_as_the_whole(built: StimulusSet, monkeypatch: pytest.MonkeyPatch) -> None:
    whole = {
        name: {
            eye: measure_saturation(image.eye(eye), SETUP.models.eye(eye), half=image.half).to_json()
            for eye in ("left", "right")
        }
        for name, image in ((name, built.load(name)) for name in built.names)
    }
    assert all(0 < each[eye]["any"] < 100 for each in whole.values() for eye in each)
    assert whole["pair"]["left"] != whole["pair"]["right"]
    monkeypatch.setattr(stimuli.build.stimulus_set, "LEAST_PX", SIZE_PX[0] * SIZE_PX[1])
    monkeypatch.setattr(stimuli.pictures.exr_write, "_BAND_PX", 1)
    assert [read().height_px for read in built.bands("codes")] == [256, 256, 188]
    with counted_work() as work:
        assert saturated_percent(built, SETUP) == whole
    assert (work["pictures_read"], work["parts_of_pictures_read"]) == (0, 6)
    with counted_work() as work:
        assert saturated_percent(built, SETUP) == whole
    assert not work["parts_of_pictures_read"]


def test_a_small_picture_is_read_once_and_whole(built: StimulusSet) -> None:
    with counted_work() as work:
        saturated_percent(built, SETUP)
    assert (work["pictures_read"], work["parts_of_pictures_read"]) == (2, 0)
