"""Ordinary pictures to the edges: every format, depth and layout, files cut and changed at random, memory."""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio
import pytest
from numpy.typing import NDArray
from PIL import Image

from devices.colour import srgb_encoded
from documents import InputError
from stimuli.pictures import PACKINGS, Packing, find_pictures, read_picture
from stimuli.pictures.colour_spaces import NAMED_SPACES, NamedSpace, named_encoding
from tests.stress.memory import forget_peak, peak_kb

pytestmark = pytest.mark.stress

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
    output = oiio.ImageOutput.create(str(file))
    assert output is not None
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


@pytest.mark.parametrize("packing", [packing for packing in PACKINGS if packing != "none"])
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
    upright = ImageOps.exif_transpose(Image.open(tmp_path / "a.png"))
    assert upright is not None
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
