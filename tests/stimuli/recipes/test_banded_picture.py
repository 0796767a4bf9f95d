"""A large picture made some rows at a time is, byte for byte, the one that is made at once."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import stimuli.recipes.banded_picture
from stimuli.build import StimulusSet, build_set
from stimuli.errors import StimulusError
from stimuli.pictures import StereoImage, exr_write, write_exr
from stimuli.recipes.banded_picture import BandedPicture
from tests.stimuli.oiio_files import save_parts

PITCH_MM = 0.2768
SCALED = "luminance: {scale: 0.7}\n"
SERIES = "series: [{name: dim, luminance_scale: 0.5}, {name: same}]\n"


@pytest.fixture
def build(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., tuple[StimulusSet, int]]:
    """Build a recipe in bands or at once, and return the set, and how many pictures were made in bands."""
    # Several bands of the small pictures here, each of one block of rows.
    monkeypatch.setattr(exr_write, "_BAND_PX", 1)
    monkeypatch.setattr(exr_write, "_BLOCK_ROWS", 16)
    saved: list[bool] = []
    save = BandedPicture.save

    def counted(picture: BandedPicture, path: Path, observer: str) -> bool:
        saved.append(save(picture, path, observer))
        return saved[-1]

    monkeypatch.setattr(BandedPicture, "save", counted)

    def make(recipe: str, least_px: int, entry: str = "") -> tuple[StimulusSet, int]:
        monkeypatch.setenv("CYCLOPEAN_CACHE", str(tmp_path / f"cache-{least_px}"))
        monkeypatch.setattr(stimuli.recipes.banded_picture, "LEAST_PX", least_px)
        file = tmp_path / "recipe.yaml"
        plate = f"{{name: plate, file: plate.exr{entry}}}"
        file.write_text(f"schema_version: 1\nkind: pictures\nstimuli: [{plate}]\n{recipe}")
        saved.clear()
        return build_set(file, PITCH_MM), sum(saved)

    return make


def _write(path: Path, pixels: np.ndarray[Any, np.dtype[np.float32]], how: Mapping[str, Any]) -> None:
    """Write channels of one view or two."""
    names = [*"RGB", *(["right.R", "right.G", "right.B"] if pixels.shape[2] == 6 else [])]
    more = {"multiView": ("left", "right")} if pixels.shape[2] == 6 else {}
    if how.get("alpha"):
        names.append("A")
        pixels = np.concatenate([pixels, np.ones([*pixels.shape[:2], 1], np.float32)], axis=-1)
    light = {"chromaticities": how.get("primaries", (1, 0, 0, 1, 0, 0, 1 / 3, 1 / 3))}
    white = {"whiteLuminance": how["white"]} if "white" in how else {}
    attributes = {**more, **light, **white, "compression": how.get("compression", "zip")}
    window = (0, 0, pixels.shape[1] + 3, pixels.shape[0] + 2) if how.get("window") else None
    tile_px = (32, 32) if how.get("tiles") else None
    save_parts(path, [(attributes, names, pixels)], how.get("kind", "half"), display_px=window, tile_px=tile_px)


def _light(views: int) -> np.ndarray[Any, np.dtype[np.float32]]:
    light = np.random.default_rng(3).uniform(0.001, 90, (75, 61, 3 * views)).astype(np.float32)
    light[3, 4] = 0.0
    return light


REC709 = (0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290)
IN_BANDS: dict[str, dict[str, Any]] = {
    "half": {},
    "float": {"kind": "float"},
    "with a white": {"white": 2.5},
    "Rec. 709": {"primaries": REC709, "white": 80.0},
    "with alpha": {"alpha": True},
    "rows in turn": {"compression": "piz"},
}
AT_ONCE: dict[str, dict[str, Any]] = {"tiles": {"tiles": True}, "a larger window": {"window": True}}


def _same(one: StimulusSet, other: StimulusSet) -> None:
    assert one.digest == other.digest
    assert one.manifest["stimuli"] == other.manifest["stimuli"]
    for name in one.names:
        assert one.path(name).read_bytes() == other.path(name).read_bytes()


@pytest.mark.parametrize(
    ("steps", "views"),
    [
        pytest.param("", 2, id="none-2", marks=pytest.mark.nightly),
        pytest.param(SCALED + SERIES, 1, id="scale and series-1"),
    ],
)
@pytest.mark.parametrize("how", [*IN_BANDS, *AT_ONCE])
def test_bands_make_the_same_file_and_manifest(
    tmp_path: Path, build: Callable[..., tuple[StimulusSet, int]], how: str, steps: str, views: int
) -> None:
    _write(tmp_path / "plate.exr", _light(views), (IN_BANDS | AT_ONCE)[how])
    banded, in_bands = build(steps, 1)
    plain, none = build(steps, 1 << 40)
    assert none == 0
    assert in_bands == (0 if how in AT_ONCE else len(plain.names))
    _same(banded, plain)


def test_our_own_exact_files_and_flat_versions(tmp_path: Path, build: Callable[..., tuple[StimulusSet, int]]) -> None:
    light = _light(2)
    write_exr(tmp_path / "plate.exr", StereoImage(light[..., :3].copy(), light[..., 3:].copy()), exact=True)
    for recipe in ("", SCALED):
        banded, in_bands = build(recipe, 1)
        plain, _ = build(recipe, 1 << 40)
        assert in_bands == 1
        _same(banded, plain)


@pytest.mark.parametrize("steps", ["", SCALED])
@pytest.mark.parametrize("value", [-1.0, float("nan"), -0.0])
def test_what_is_unusual_in_a_row_is_left_to_the_whole_picture(
    tmp_path: Path, build: Callable[..., tuple[StimulusSet, int]], value: float, steps: str
) -> None:
    light = _light(1)
    light[60, 7, 1] = value
    _write(tmp_path / "plate.exr", light, {"kind": "float"})
    found = []
    for least_px in (1, 1 << 40):
        try:
            found.append(build(steps, least_px)[0].manifest["stimuli"])
        except StimulusError as error:
            found.append(str(error).replace(f"cache-{least_px}", "cache"))
    assert found[0] == found[1]
    assert isinstance(found[0], str) == (value != 0.0)


@pytest.mark.parametrize(
    "steps", ["crop: {left_px: 1, top_px: 1, width_px: 9, height_px: 9}\n", "luminance: {mean_cd_m2: 9}\n"]
)
def test_other_steps_are_done_on_the_whole_picture(
    tmp_path: Path, build: Callable[..., tuple[StimulusSet, int]], steps: str
) -> None:
    _write(tmp_path / "plate.exr", _light(1), {})
    banded, in_bands = build(steps, 1)
    plain, _ = build(steps, 1 << 40)
    assert in_bands == 0
    _same(banded, plain)


def test_what_is_below_0_is_clipped_and_counted_as_in_the_whole(
    tmp_path: Path, build: Callable[..., tuple[StimulusSet, int]]
) -> None:
    light = _light(1)
    light[60, 7, 1] = -1.0
    _write(tmp_path / "plate.exr", light, {})
    banded, in_bands = build("", 1, ", negative: clip")
    plain, _ = build("", 1 << 40, ", negative: clip")
    assert in_bands == 0
    _same(banded, plain)
