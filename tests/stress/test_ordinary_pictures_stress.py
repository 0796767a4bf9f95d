"""Pictures, recipes and OpenEXR of every kind at their edges: a picture comes back, or one clear finding."""

from __future__ import annotations

import itertools
import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any, get_args

import numpy as np
import OpenImageIO as oiio
import pytest
from numpy.typing import NDArray
from PIL import Image

from devices.colour import rgb_to_xyz_matrix, srgb_encoded
from documents import InputError
from stimuli.build import build_set
from stimuli.errors import StimulusError
from stimuli.pictures import (
    REC709,
    Packing,
    Region,
    StereoImage,
    find_pictures,
    read_exr,
    read_picture,
    write_exr,
)
from stimuli.pictures.colour_spaces import NAMED_SPACES, NamedSpace, named_encoding
from tests.kept import known
from tests.stimuli.pictures.exr_bytes import Part, decimated, floats, write_bytes
from tests.stress.memory import forget_peak, peak_kb

pytestmark = pytest.mark.stress


# Ordinary pictures to the edges: every format, depth and layout, files cut and changed at random, memory.

FORMATS = ("png8", "png16", "tif8", "tif16", "tif32", "webp8")


def codes_of(bits: int, shape: tuple[int, ...], seed: int = 0) -> NDArray[Any]:
    rng = np.random.default_rng(seed)
    if bits == 32:
        return rng.random(shape).astype(np.float32)
    return rng.integers(0, 2**bits, shape, dtype=np.uint8 if bits == 8 else np.uint16)


def save(folder: Path, kind: str, pixels: NDArray[Any]) -> Path:
    file = folder / f"a.{kind.rstrip('0123456789')}"
    if file.suffix == ".webp":
        Image.fromarray(pixels).save(file, lossless=True, exact=True)
        return file
    kind = "float" if pixels.dtype == np.float32 else str(pixels.dtype)
    spec = oiio.ImageSpec(pixels.shape[1], pixels.shape[0], pixels.shape[2], kind)
    spec.attribute("oiio:ColorSpace", "unknown")  # else OpenImageIO declares a PNG to be sRGB
    if pixels.shape[2] in (2, 4):
        spec.alpha_channel = pixels.shape[2] - 1
        spec.attribute("oiio:UnassociatedAlpha", 1)
    output = known(oiio.ImageOutput.create(str(file)))
    assert output.open(str(file), spec)
    assert output.write_image(pixels)
    output.close()
    return file


@pytest.mark.parametrize("kind", FORMATS)
@pytest.mark.parametrize("channels", [1, 2, 3, 4])
@pytest.mark.parametrize("space", NAMED_SPACES)
def test_every_format_depth_and_space(tmp_path: Path, kind: str, channels: int, space: NamedSpace) -> None:
    bits = int(kind.lstrip("abcdefghijklmnopqrstuvwxyz"))
    if kind == "webp8" and channels < 3:
        pytest.skip("WebP has three colours")
    pixels = codes_of(bits, (33, 47, channels))
    file = save(tmp_path, kind, pixels)
    image = read_picture(file, space, white_luminance_cd_m2=250, alpha_background_cd_m2=30)
    shares = pixels.astype(np.float64) / (1 if bits == 32 else 2**bits - 1)
    colours = shares[..., :3] if channels > 2 else np.repeat(shares[..., :1], 3, axis=-1)
    encoding = named_encoding(space)
    expected = encoding.xyz(colours.reshape(-1, 3)).reshape(33, 47, 3) * 250
    if channels in (2, 4):
        alpha = shares[..., -1:]
        expected = alpha * expected + (1 - alpha) * 30 * encoding.white
    np.testing.assert_allclose(image.left, expected, rtol=1e-6, atol=1e-7)


@pytest.mark.parametrize("packing", [packing for packing in get_args(Packing) if packing != "none"])
@pytest.mark.parametrize("orientation", range(1, 9))
def test_every_packing_turned_every_way(tmp_path: Path, packing: Packing, orientation: int) -> None:
    """Each eye's own grey comes out for that eye, however the camera was held."""
    from PIL import ImageOps

    across = packing.startswith("side-by-side")
    whole = np.zeros((64, 96, 3), np.uint8)
    first, second = (200, 80) if packing.endswith("crossed") else (80, 200)
    whole[:] = second
    if across:
        whole[:, :48] = first
    else:
        whole[:32] = first
    # Stored so that EXIF's turn brings it upright.
    back = {1: None, 2: 0, 3: 3, 4: 1, 5: 5, 6: 2, 7: 6, 8: 4}[orientation]
    stored = Image.fromarray(whole)
    if back is not None:
        stored = stored.transpose(Image.Transpose(back))
    exif = Image.Exif()
    exif[0x0112] = orientation
    stored.save(tmp_path / "a.png", exif=exif)
    upright = known(ImageOps.exif_transpose(Image.open(tmp_path / "a.png")))
    assert np.array_equal(np.asarray(upright), whole)
    image = read_picture(tmp_path / "a.png", "srgb", white_luminance_cd_m2=100, packing=packing)
    full = (96, 64) if "half" in packing else ((48, 64) if across else (96, 32))
    assert (image.width_px, image.height_px) == full
    for eye, grey in ((image.left, 80), (image.right, 200)):
        middle = eye[8:-8, 8:-8, 1] / 100
        assert np.allclose(255 * srgb_encoded(middle), grey, atol=0.01)


def test_a_hundred_megapixels_and_no_more(tmp_path: Path) -> None:
    Image.new("L", (16_384, 6_103), 128).save(tmp_path / "most.png", compress_level=1)
    (found,) = find_pictures([tmp_path / "most.png"])
    assert found.size_px == (16_384, 6_103)
    for size in ((16_385, 100), (30_000, 4_000), (16_000, 16_000)):
        Image.new("1", size).convert("L").save(tmp_path / "more.png", compress_level=1)
        with pytest.raises(InputError, match="too large"):
            find_pictures([tmp_path / "more.png"])


def test_building_holds_one_picture_at_a_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Thirty pairs of 6 megapixels, each 144 MB as XYZ, in less than the room of one pair of XYZ: codes are held."""
    from stimuli.build import build_set

    monkeypatch.setenv("CYCLOPEAN_CACHE", str(tmp_path / "cache"))
    shape = (2000, 3000)
    base = Image.fromarray(codes_of(8, (200, 300, 3))).resize((shape[1], shape[0]))
    base.save(tmp_path / "p.jpg", quality=80)
    data = (tmp_path / "p.jpg").read_bytes()
    lines = ["schema_version: 1", "kind: pictures", "colour_space: srgb", "white_luminance_cd_m2: 100", "stimuli:"]
    for pair, eye in itertools.product(range(30), "LR"):
        (tmp_path / f"p{pair}_{eye}.jpg").write_bytes(data + f"{pair}{eye}".encode())
        if eye == "R":
            lines.append(f"  - {{name: p{pair}, left: p{pair}_L.jpg, right: p{pair}_R.jpg}}")
    (tmp_path / "recipe.yaml").write_text("\n".join(lines), encoding="utf-8")
    before_kb = forget_peak()
    build_set(tmp_path / "recipe.yaml", 0.25)
    assert (peak_kb() - before_kb) * 1024 < 2 * 3000 * 2000 * 3 * 4


# OpenEXR of every kind to the edges: sizes, windows and regions at random, files cut and changed; kept JPEG too.

DECLARED = ("chromaticities", "chromaticities", floats(*REC709.ravel()))
WEIGHTS = rgb_to_xyz_matrix(*REC709)[1]


def chroma_of(grey: NDArray[Any], red: float, blue: float) -> tuple[dict[str, NDArray[Any]], dict[str, int]]:
    """Return channels of one chroma everywhere, at every second pixel, and their steps."""
    half = decimated(np.ones_like(grey))
    return {"Y": grey, "RY": half * np.float16(red), "BY": half * np.float16(blue)}, {"RY": 2, "BY": 2}


@pytest.mark.parametrize("height", [2, 4, 26, 28, 54, 56])
def test_chroma_of_every_size(tmp_path: Path, height: int) -> None:
    """Of one chroma everywhere nothing is left to interpolate: R = (RY + 1) Y, and green by luminance, to a half float.

    The interpolation's weights sum to 1.0002.
    """
    rng = np.random.default_rng(height)
    for width in (2, 4, 12, 26, 28, 30, 56, 100):
        grey = rng.uniform(0.5, 2, (height, width)).astype("<f2")
        channels, steps = chroma_of(grey, 0.3, -0.25)
        image = read_exr(write_bytes(tmp_path / "a.exr", Part(channels, [DECLARED], steps=steps)))
        luminance = grey.astype(np.float64)
        red, blue = luminance * (1 + float(np.float16(0.3))), luminance * (1 + float(np.float16(-0.25)))
        green = (luminance - WEIGHTS[0] * red - WEIGHTS[2] * blue) / WEIGHTS[1]
        expected = np.stack([red, green, blue], axis=-1) @ rgb_to_xyz_matrix(*REC709).T
        np.testing.assert_allclose(image.left, expected, rtol=3e-3)


def test_windows_and_regions_at_random(tmp_path: Path) -> None:
    """Two views, each stored in a window of its own, on one display window anywhere: against pixel after pixel."""
    rng = np.random.default_rng(5)
    for _ in range(150):
        x, y = (int(value) for value in rng.integers(-40, 40, 2))
        width, height = (int(value) for value in rng.integers(1, 20, 2))
        display = (x, y, x + width - 1, y + height - 1)
        parts, expected = [], np.zeros((2, height, width))
        for eye, name in enumerate((b"left", b"right")):
            inside = x + int(rng.integers(width)), y + int(rng.integers(height))
            left, top = (int(at - rng.integers(0, 12)) for at in inside)
            right, bottom = (int(at + rng.integers(0, 12)) for at in inside)
            grey = rng.uniform(1, 2, (bottom - top + 1, right - left + 1)).astype("<f4")
            attributes = [("view", "string", name), DECLARED]
            parts.append(Part({"Y": grey}, attributes, (left, top, right, bottom), display, decreasing=bool(eye)))
            for row in range(max(top, y), min(bottom, y + height - 1) + 1):
                for column in range(max(left, x), min(right, x + width - 1) + 1):
                    expected[eye, row - y, column - x] = grey[row - top, column - left]
        image = read_exr(write_bytes(tmp_path / "a.exr", *parts))
        found = np.stack([image.left[..., 1], image.right[..., 1]])
        np.testing.assert_allclose(found, expected, rtol=1e-6)
        at = Region(int(rng.integers(width)), int(rng.integers(height)), 1, 1)
        at = Region(
            at.left, at.top, int(rng.integers(1, width - at.left + 1)), int(rng.integers(1, height - at.top + 1))
        )
        part = read_exr(tmp_path / "a.exr", region=at)
        np.testing.assert_array_equal(part.left, image.left[at.top : at.bottom, at.left : at.right])
        np.testing.assert_array_equal(part.right, image.right[at.top : at.bottom, at.left : at.right])


# Pictures and recipes at their edges: what comes back is a picture, or one clear finding.

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
    output = known(oiio.ImageOutput.create(str(tmp_path / "b.exr")))
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
