"""Pictures and recipes at their edges: what comes back is a picture, or one clear finding."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest

from stimuli.build import build_set
from stimuli.errors import StimulusError
from stimuli.pictures import StereoImage, read_exr, write_exr

pytestmark = pytest.mark.stress
ROOT = Path(__file__).parents[2]


def refusal(path: Path) -> str:
    """Read the picture, which must be refused with one finding that names it, and return the finding."""
    with pytest.raises(StimulusError) as caught:
        read_exr(path)
    (finding,) = caught.value.findings
    assert finding.file == str(path)
    assert finding.remedy
    return finding.message


@pytest.mark.parametrize("size", [(1, 1), (1, 2), (2, 1), (1, 4001), (4001, 1), (3, 5), (17, 31), (257, 129)])
def test_odd_sizes_survive(tmp_path: Path, size: tuple[int, int]) -> None:
    source = np.random.default_rng(0).uniform(0, 100, (2, *size, 3)).astype(np.float32)
    write_exr(tmp_path / "a.exr", StereoImage(source[0], source[1]))
    back = read_exr(tmp_path / "a.exr")
    np.testing.assert_array_equal(back.left, source[0].astype(np.float16))
    np.testing.assert_array_equal(back.right, source[1].astype(np.float16))


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, -1e-30, -1.0, 65520.0, 1e30, 3e38])
def test_a_whole_picture_of_what_cannot_be(tmp_path: Path, value: float) -> None:
    pixels = np.full((3, 3, 3), value, np.float32)
    with pytest.raises(StimulusError, match="9 pixels"):
        write_exr(tmp_path / "a.exr", StereoImage.flat(pixels))
    spec = oiio.ImageSpec(3, 3, 3, "float")
    spec.attribute("chromaticities", "float[8]", (1, 0, 0, 1, 0, 0, 1 / 3, 1 / 3))
    output = oiio.ImageOutput.create(str(tmp_path / "b.exr"))
    assert output is not None
    assert output.open(str(tmp_path / "b.exr"), spec)
    assert output.write_image(pixels)
    assert output.close()
    if np.isfinite(value) and value > 0:
        np.testing.assert_array_equal(read_exr(tmp_path / "b.exr").left, pixels)
    else:
        assert "9 pixels" in refusal(tmp_path / "b.exr")


def test_every_cut_of_a_file_is_refused(tmp_path: Path) -> None:
    source = np.random.default_rng(0).uniform(0, 100, (2, 9, 7, 3)).astype(np.float32)
    write_exr(tmp_path / "whole.exr", StereoImage(source[0], source[1]))
    content = (tmp_path / "whole.exr").read_bytes()
    path = tmp_path / "cut.exr"
    for length in range(len(content)):
        path.write_bytes(content[:length])
        refusal(path)
    path.write_bytes(content)
    read_exr(path)


def test_a_build_that_is_killed_leaves_nothing_half_done(tmp_path: Path) -> None:
    recipe = ROOT / "configs" / "stimuli" / "manitoba_gray.yaml"
    environment = {**os.environ, "CYCLOPEAN_CACHE": str(tmp_path), "PYTHONPATH": str(ROOT)}
    program = (
        "from pathlib import Path; from stimuli.build.recipe_to_set import build_set;"
        f"print(build_set(Path({str(recipe)!r}), 0.2768).rendered)"
    )
    delays = random.Random(1)
    for _ in range(5):
        child = subprocess.Popen([sys.executable, "-c", program], env=environment, cwd=tmp_path)
        time.sleep(delays.uniform(0.3, 2.0))
        child.send_signal(signal.SIGKILL)
        child.wait()
        for folder in tmp_path.glob("[!.]*/"):
            assert (folder / "manifest.json").is_file()
    kept = len(list(tmp_path.glob(".*/*.json"))) - len(list(tmp_path.glob(".*/hashes.json")))
    done = bool(list(tmp_path.glob("[!.]*/manifest.json")))
    whole = subprocess.run(
        [sys.executable, "-c", program], env=environment, cwd=tmp_path, check=True, stdout=subprocess.PIPE, text=True
    )
    assert int(whole.stdout) == (0 if done else 10 - kept)
    assert [entry.name for entry in tmp_path.iterdir() if entry.is_dir() and entry.name.startswith(".")] == []


def test_a_build_of_two_threads_that_is_killed_goes_on_where_it_was(tmp_path: Path) -> None:
    recipe = ROOT / "configs" / "stimuli" / "exposure_series.yaml"
    environment = {**os.environ, "CYCLOPEAN_CACHE": str(tmp_path / "cache"), "PYTHONPATH": str(ROOT)}
    program = (
        "from pathlib import Path; from stimuli.build.recipe_to_set import build_set;"
        f"made = build_set(Path({str(recipe)!r}), 1.5, jobs=2); print(made.rendered, made.digest)"
    )
    command = [sys.executable, "-c", program]
    drawn, kept = random.Random(2), 0

    def records() -> int:
        return len(list((tmp_path / "cache").glob(".*/*.json")))

    for half in range(2):
        wanted = drawn.randint(40 * half + 5, 40 * half + 40)
        child = subprocess.Popen(command, env=environment)
        while records() < wanted:
            assert child.poll() is None, "it came to its end before it was killed"
            time.sleep(0.01)
        child.send_signal(signal.SIGKILL)
        child.wait()
        assert records() >= max(kept, wanted)
        kept = records()
    said = subprocess.run(command, env=environment, check=True, stdout=subprocess.PIPE, text=True).stdout.split()
    assert int(said[0]) == 90 - kept
    assert [folder.name for folder in (tmp_path / "cache").glob(".*/")] == []
    anew = {**environment, "CYCLOPEAN_CACHE": str(tmp_path / "other")}
    again = subprocess.run(command, env=anew, check=True, stdout=subprocess.PIPE, text=True).stdout.split()
    assert again == ["90", said[1]]


def test_two_builds_at_once_make_one_set(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    recipe = ROOT / "configs" / "stimuli" / "manitoba_gray.yaml"
    environment = {**os.environ, "CYCLOPEAN_CACHE": str(tmp_path), "PYTHONPATH": str(ROOT)}
    program = (
        "from pathlib import Path; from stimuli.build.recipe_to_set import build_set;"
        f"made = build_set(Path({str(recipe)!r}), 0.2768); print(made.rendered, made.digest)"
    )
    children = [
        subprocess.Popen([sys.executable, "-c", program], env=environment, stdout=subprocess.PIPE, text=True)
        for _ in range(3)
    ]
    said = [child.communicate()[0].split() for child in children]
    assert sorted(rendered for rendered, _ in said) == ["0", "0", "10"]
    assert len({digest for _, digest in said}) == 1
    monkeypatch.setenv("CYCLOPEAN_CACHE", str(tmp_path))
    assert build_set(recipe, 0.2768).rendered == 0


@pytest.mark.parametrize("pitch_mm", [0.1, 1.0, 40.0, 99.0, 1e4])
def test_any_display_s_pitch(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, pitch_mm: float) -> None:
    monkeypatch.setenv("CYCLOPEAN_CACHE", str(tmp_path))
    made = build_set(ROOT / "configs" / "stimuli" / "manitoba_gray.yaml", pitch_mm)
    image = made.load("1.1-flat")
    assert (image.width_px, image.height_px) == (max(1, round(150 / pitch_mm)), max(1, round(100 / pitch_mm)))


# Builds a pair of 36 megapixels, scaled, and shows the middle of it, and prints the peak of memory in MB after each.
LARGE = """
import os, re, sys
from pathlib import Path
from stimuli.build import build_set
from runner.presenter.show import ShowOptions, show_picture

def peak_mb():
    # Not `resource`'s: that begins with the peak of the process that started this one.
    return int(re.search(r"VmHWM:\\s+([0-9]+) kB", Path("/proc/self/status").read_text())[1]) // 1024

folder, display = Path(sys.argv[1]), sys.argv[2]
os.environ["CYCLOPEAN_CACHE"] = str(folder / "cache")
options = ShowOptions(screenshot=folder / "out.png", backend="egl")
shown = show_picture(folder / "large.exr", display, "side-by-side", options)
print(*shown.picture_px, *shown.read_px, peak_mb())
built = build_set(folder / "large.yaml", 0.2768)
print(built.manifest["stimuli"][0]["statistics"]["eyes"]["right"]["max_luminance_cd_m2"], peak_mb())
"""


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="the peak of memory is read from /proc")
def test_a_pair_of_36_megapixels_is_shown_and_built_in_bands(tmp_path: Path) -> None:
    light = np.full((4912, 7360, 3), 8.0, np.float32)
    right = light.copy()
    right[4000, 5000] = 64.0
    write_exr(tmp_path / "large.exr", StereoImage(light, right))
    del light, right
    recipe = "schema_version: 1\nkind: pictures\nluminance: {scale: 0.5}\nstimuli: [{name: large, file: large.exr}]\n"
    (tmp_path / "large.yaml").write_text(recipe)
    words = [sys.executable, "-c", LARGE, str(tmp_path), str(ROOT / "configs/displays/asus_vg248qe.yaml")]
    shown, built = subprocess.run(words, cwd=ROOT, check=True, capture_output=True, text=True).stdout.splitlines()
    *sizes, shown_mb = map(int, shown.split())
    assert sizes == [7360, 4912, 960, 1080]
    most_cd_m2, built_mb = map(float, built.split())
    assert most_cd_m2 == 32.0
    assert shown_mb < 600  # either picture is 434 MB for each eye
    assert built_mb < 800
