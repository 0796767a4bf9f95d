"""A screen without a monitor, and where the real measurements lie."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def xvfb() -> Iterator[str]:
    """The name of an X display of 1920 × 1080 on a virtual screen, such as ``:99``."""
    if shutil.which("Xvfb") is None:
        pytest.skip("Xvfb is not installed (package xvfb)")
    read, write = os.pipe()
    screen = ["-screen", "0", "1920x1080x24", "-nolisten", "tcp", "-noreset"]
    server = subprocess.Popen(["Xvfb", "-displayfd", str(write), *screen], pass_fds=[write], stderr=subprocess.DEVNULL)
    os.close(write)
    try:
        with os.fdopen(read) as told:
            number = told.readline().strip()
        if not number:
            pytest.skip("Xvfb did not start")
        yield f":{number}"
    finally:
        server.terminate()
        server.wait()


DISPLAY = """\
schema_version: 1
panel: {{resolution_px: [{width}, {height}], pixel_pitch_mm: 0.25}}
modes:
  side-by-side:
    black_XYZ_cd_m2: [0.02, 0.02, 0.03]
    primaries_XYZ_cd_m2: {{red: [10.83, 5.62, 0.54], green: [9.67, 18.65, 1.63], blue: [5.68, 2.20, 29.18]}}
    curve: {{kind: gog, red: {{gamma: 2.1}}, green: {{gamma: 2.2}}, blue: {{gamma: 2.3}}}}
    source: made up for tests
  quad-buffered: {{same_as: side-by-side}}
"""
EXPERIMENT = """\
schema_version: 1
name: small
rig: rig.yaml
stimuli: recipe.yaml
question: Which is closer?
layout: {arrangement: vertical, size_mm: [20, 10], gap_mm: 5}
blocks:
  - {kind: instructions, text: Look at the two pictures.}
  - {kind: all_pairs, break_every: 4}
"""


@dataclass(frozen=True, slots=True)
class Study:
    """A small experiment of four pictures on disk, and simulated observers for it."""

    folder: Path

    @property
    def experiment(self) -> Path:
        """The experiment file."""
        return self.folder / "small.yaml"

    @property
    def observers(self) -> Path:
        """Simulated observers."""
        return self.folder / "observers.yaml"

    @property
    def results(self) -> Path:
        """Where sessions are to go."""
        return self.folder / "results"

    def edit(self, file: str, old: str, new: str) -> None:
        """Replace ``old``, which must be there, in one of the study's files."""
        path = self.folder / file
        text = path.read_text()
        assert old in text
        path.write_text(text.replace(old, new))


@pytest.fixture
def study(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Study:
    """Four pictures (two stereo, two flat), a display of 640 × 480, a rig, an experiment."""
    import numpy as np

    from stimuli.exr import write_exr
    from stimuli.stereo_image import StereoImage

    monkeypatch.setenv("CYCLOPEAN_CACHE", str(tmp_path / "cache"))
    rng = np.random.default_rng(4)
    names = ("one", "two", "three", "four")
    for index, name in enumerate(names):
        left, right = (rng.uniform(1, 20, (40, 80, 3)).astype(np.float32) for _ in range(2))
        write_exr(tmp_path / f"{name}.exr", StereoImage(left, right) if index < 2 else StereoImage.flat(left))
    pictures = "".join(f"  - {{name: {name}, file: {name}.exr}}\n" for name in names)
    (tmp_path / "recipe.yaml").write_text(f"schema_version: 1\nkind: pictures\nstimuli:\n{pictures}")
    (tmp_path / "display.yaml").write_text(DISPLAY.format(width=640, height=480))
    (tmp_path / "rig.yaml").write_text(
        "schema_version: 1\ndisplay: display.yaml\nmode: side-by-side\ndistance_mm: 700\n"
    )
    (tmp_path / "small.yaml").write_text(EXPERIMENT)
    scores = "".join(f"  {name}: {{score: {index + 1}}}\n" for index, name in enumerate(names))
    (tmp_path / "observers.yaml").write_text(f"schema_version: 1\nkind: bradley_terry\nstimuli:\n{scores}")
    return Study(tmp_path)
