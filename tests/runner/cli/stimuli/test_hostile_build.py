"""Recipes and places made to do harm: pictures of no size or of all memory, outputs in the cache."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from documents import InputError
from runner.cli.main import group
from stimuli.build import cache_folder
from stimuli.pictures import StereoImage, write_exr

Build = Callable[..., str]


@pytest.fixture
def build(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Build:
    """Build a recipe of one picture with these steps; return the complaint. Nothing may be written but the cache."""
    monkeypatch.setenv("CYCLOPEAN_CACHE", str(tmp_path / "cache"))
    folder = tmp_path / "recipe"
    folder.mkdir()
    monkeypatch.chdir(folder)
    write_exr(folder / "a.exr", StereoImage.flat(np.full((12, 16, 3), 20, np.float32)))

    def run(steps: str, *more: str, pitch: str = "0.25") -> str:
        text = f"schema_version: 1\nkind: pictures\nstimuli: [{{name: a, file: a.exr{steps}}}]\n"
        (folder / "r.yaml").write_text(text, encoding="utf-8")
        before = sorted(folder.rglob("*"))
        words = ["stimuli", "build", "r.yaml", "--pixel-pitch-mm", pitch, *more]
        with pytest.raises(InputError) as caught:
            CliRunner().invoke(group, words, catch_exceptions=False)
        assert sorted(folder.rglob("*")) == before
        assert not list(tmp_path.rglob("manifest.json"))
        return str(caught.value)

    return run


@pytest.mark.parametrize(
    ("steps", "pitch"),
    [
        (", resample: {px_per_mm: 1.0e+11}", "0.25"),
        (", resample: {width_mm: 1.0e-11}", "0.25"),
        (", resample: {width_mm: 50}", "1e11"),
        (", resample: {width_mm: 4000}", "0.25"),
        (", resample: {width_mm: 1.0e+11}", "0.25"),
    ],
)
def test_sizes_of_no_pixel_and_of_all_memory_are_refused(build: Build, steps: str, pitch: str) -> None:
    told = build(steps, pitch=pitch)
    assert "pixels" in told


@pytest.mark.parametrize("below", ["", "new", "new/../other"])
def test_an_output_in_the_cache_is_refused(build: Build, below: str) -> None:
    assert "it lies in the cache of stimuli" in build("", "-o", str(cache_folder() / below))


def test_an_output_through_a_link_into_the_cache_is_refused(build: Build) -> None:
    cache_folder().mkdir(parents=True)
    Path("link").symlink_to(cache_folder())
    assert "it lies in the cache of stimuli" in build("", "-o", "link/new")


@pytest.mark.parametrize("output", ["x" * 300, "r.yaml", ".", "loop"])
def test_an_output_that_cannot_be_is_told(build: Build, output: str) -> None:
    Path("loop").symlink_to("loop")
    assert build("", "-o", output).startswith(f"{output}: ")
