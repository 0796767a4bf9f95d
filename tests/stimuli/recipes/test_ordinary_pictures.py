"""Ordinary pictures become absolute XYZ by their colour space, exactly, for the eyes that they are packed for."""

from __future__ import annotations

import json
import struct
from pathlib import Path
from typing import Any

import colour
import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image, ImageCms, ImageOps

from devices.characterise import thesis_display
from devices.colour import rgb_to_xyz_matrix, srgb_encoded
from devices.profiles import profile_of_model
from documents import InputError
from stimuli.build import StimulusSet, build_set
from stimuli.pictures import StereoImage
from stimuli.pictures.coded import decoded
from stimuli.pictures.colour_spaces import NAMED_SPACES, NamedSpace, named_encoding
from tests.stimuli.oiio_files import save_picture

Array = NDArray[Any]
WHITE = 80.0
SCIENCE = {
    "srgb": "sRGB",
    "display-p3": "Display P3",
    "adobe-rgb": "Adobe RGB (1998)",
    "rec2020": "ITU-R BT.2020",
}


@pytest.fixture(autouse=True)
def _cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CYCLOPEAN_CACHE", str(tmp_path / "cache"))


def pixels(seed: int = 0, size: tuple[int, int] = (12, 8), dtype: type = np.uint8) -> Array:
    width, height = size
    return np.random.default_rng(seed).integers(0, np.iinfo(dtype).max + 1, (height, width, 3), dtype=dtype)


def built(folder: Path, *stimuli: dict[str, Any], **more: Any) -> StimulusSet:
    shared = {"colour_space": "srgb", "white_luminance_cd_m2": WHITE} | more
    recipe = {"schema_version": 1, "kind": "pictures", **shared, "stimuli": list(stimuli)}
    for key in [key for key, value in recipe.items() if value is None]:
        del recipe[key]
    (folder / "recipe.yaml").write_text(json.dumps(recipe), encoding="utf-8")
    return build_set(folder / "recipe.yaml", 0.25)


def read(folder: Path, file: Path, **more: Any) -> StereoImage:
    return built(folder, {"name": "one", "file": file.name}, **more).load("one")


def complaint(folder: Path, file: Path, **more: Any) -> str:
    with pytest.raises(InputError) as error:
        read(folder, file, **more)
    assert not [path for path in (folder / "cache").glob("*.exr")]
    return str(error.value)


def srgb_xyz(codes: Array) -> Array:
    full = np.iinfo(codes.dtype).max
    light = colour.models.eotf_sRGB(codes / full)
    return np.asarray(light @ _SRGB.T) * WHITE


_SRGB = rgb_to_xyz_matrix((0.64, 0.33), (0.30, 0.60), (0.15, 0.06), (0.3127, 0.3290))


@pytest.mark.parametrize("kind", ["png8", "png16", "tiff8", "tiff16", "webp"])
def test_srgb_of_every_format_and_depth(tmp_path: Path, kind: str) -> None:
    codes = pixels(dtype=np.uint16 if kind.endswith("16") else np.uint8)
    file = tmp_path / f"a.{kind.rstrip('0123456789')}"
    if kind == "webp":
        Image.fromarray(codes).save(file, lossless=True)
    else:
        save_picture(file, codes, kind=str(codes.dtype))
    image = read(tmp_path, file)
    np.testing.assert_allclose(image.left, srgb_xyz(codes), rtol=1e-6, atol=1e-9)
    assert image.is_flat


@pytest.mark.parametrize("name", NAMED_SPACES)
def test_named_spaces_against_colour_science(name: NamedSpace) -> None:
    encoding, space = named_encoding(name), colour.RGB_COLOURSPACES[SCIENCE[name]]
    primaries = np.array([*space.primaries, space.whitepoint])
    assert np.allclose(encoding.matrix, rgb_to_xyz_matrix(*primaries), rtol=0, atol=1e-12)
    codes = np.linspace(0, 1, 256)
    # Rec.2020 is shown by BT.1886, not by the inverse of the camera's curve.
    curve = codes**2.4 if name == "rec2020" else space.cctf_decoding(codes)
    np.testing.assert_allclose(encoding.curves[0](codes), curve, rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_the_table_is_its_plain_twin(dtype: type) -> None:
    codes = pixels(size=(100, 37), dtype=dtype)
    full = np.iinfo(dtype).max
    for name in NAMED_SPACES:
        encoding = named_encoding(name)
        fast = decoded(codes, encoding.tables(full + 1), encoding.matrix * WHITE)
        plain = encoding.xyz(codes.reshape(-1, 3) / full).reshape(codes.shape) * WHITE
        np.testing.assert_allclose(fast, plain, rtol=1e-6, atol=1e-9)


def test_codes_come_back_exactly(tmp_path: Path) -> None:
    """All greys and 10,000 random colours, through the cache: half floats would lose the dark channels of some."""
    colours = np.random.default_rng(2).integers(0, 256, (10_000, 3), dtype=np.uint8)
    greys = np.repeat(np.arange(256, dtype=np.uint8)[:, None], 3, axis=1)
    codes = np.concatenate([colours, greys])[None]
    Image.fromarray(codes).save(tmp_path / "a.png")
    xyz = read(tmp_path, tmp_path / "a.png").left.astype(np.float64) / WHITE
    back = np.rint(255 * srgb_encoded(np.clip(xyz @ np.linalg.inv(_SRGB).T, 0, 1)))
    assert np.array_equal(back, codes)


@pytest.mark.parametrize("orientation", [2, 6, 7])
@pytest.mark.parametrize("suffix", ["png", "tif"])
def test_exif_orientation(tmp_path: Path, orientation: int, suffix: str) -> None:
    codes, file = pixels(), tmp_path / f"a.{suffix}"
    exif = Image.Exif()
    exif[0x0112] = orientation
    if suffix == "png":
        Image.fromarray(codes).save(file, exif=exif)
        turned = ImageOps.exif_transpose(Image.open(file))
    else:
        save_picture(file, codes, kind="uint8", Orientation=orientation)
        Image.fromarray(codes).save(tmp_path / "b.png", exif=exif)
        turned = ImageOps.exif_transpose(Image.open(tmp_path / "b.png"))
    assert turned is not None
    np.testing.assert_allclose(read(tmp_path, file).left, srgb_xyz(np.asarray(turned)), rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize(
    ("packing", "crossed"),
    [("side-by-side", False), ("side-by-side-crossed", True), ("top-bottom", False), ("top-bottom-crossed", True)],
)
def test_packings(tmp_path: Path, packing: str, crossed: bool) -> None:
    left, right = pixels(1), pixels(2)
    pair = [right, left] if crossed else [left, right]
    Image.fromarray(np.concatenate(pair, axis=1 if "side" in packing else 0)).save(tmp_path / "a.png")
    image = built(tmp_path, {"name": "one", "file": "a.png", "packing": packing}).load("one")
    np.testing.assert_allclose(image.left, srgb_xyz(left), rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(image.right, srgb_xyz(right), rtol=1e-6, atol=1e-9)


def test_half_pictures_are_stretched_in_linear_light(tmp_path: Path) -> None:
    codes = np.zeros((8, 12, 3), np.uint8)
    codes[:, 3:6] = codes[:, 9:] = 255
    Image.fromarray(codes).save(tmp_path / "a_hsbs.png")
    image = read(tmp_path, tmp_path / "a_hsbs.png")
    assert (image.width_px, image.height_px) == (12, 8)
    across = image.left[0, :, 1] / WHITE
    assert np.allclose(across, across[::-1].max() - across[::-1], atol=1e-3)
    # Half the light where black and white meet; half the code would be 0.21.
    assert across.mean() == pytest.approx(0.5, abs=1e-3)
    Image.fromarray(codes.swapaxes(0, 1).copy()).save(tmp_path / "a_hou.png")
    tall = read(tmp_path, tmp_path / "a_hou.png")
    assert np.allclose(tall.left[..., 1], image.left[..., 1].T, atol=0.1)


def with_alpha(file: Path, alpha: int) -> Array:
    codes = pixels()
    codes[0, 0] = 255
    Image.fromarray(np.dstack([codes, np.full(codes.shape[:2], alpha, np.uint8)])).save(file)
    return codes


@pytest.mark.parametrize("suffix", ["png", "tif", "webp"])
def test_alpha(tmp_path: Path, suffix: str) -> None:
    file = tmp_path / f"a.{suffix}"
    if suffix == "webp":
        codes = pixels()
        whole = np.dstack([codes, np.full(codes.shape[:2], 51, np.uint8)])
        Image.fromarray(whole).save(file, lossless=True, exact=True)
    else:
        codes = with_alpha(file, 51)
    assert "partly transparent (alpha)" in complaint(tmp_path, file)
    image = read(tmp_path, file, alpha_background_cd_m2=20)
    grey = 20 * _SRGB.sum(axis=1)
    np.testing.assert_allclose(image.left, 0.2 * srgb_xyz(codes) + 0.8 * grey, rtol=1e-6)
    codes = with_alpha(tmp_path / "opaque.png", 255)
    np.testing.assert_allclose(read(tmp_path, tmp_path / "opaque.png").left, srgb_xyz(codes), rtol=1e-6, atol=1e-9)


def test_an_embedded_profile_of_matrix_and_curves(tmp_path: Path) -> None:
    model = thesis_display()
    data = profile_of_model(model, "display", kind="matrix").data
    codes = pixels()
    Image.fromarray(codes).save(tmp_path / "a.png", icc_profile=data)
    white = model.xyz(np.ones(3))[1]
    image = read(tmp_path, tmp_path / "a.png", colour_space=None, white_luminance_cd_m2=white)
    np.testing.assert_allclose(image.left, model.xyz(codes / 255), rtol=2e-3, atol=0.01)
    assert "an ICC profile of another colour space" in complaint(tmp_path, tmp_path / "a.png")


def test_a_profile_that_is_srgb_is_srgb(tmp_path: Path) -> None:
    data = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()
    Image.fromarray(pixels()).save(tmp_path / "a.png", icc_profile=data)
    for space in ("srgb", None, "icc"):
        image = read(tmp_path, tmp_path / "a.png", colour_space=space)
        np.testing.assert_allclose(image.left, srgb_xyz(pixels()), rtol=1e-6 if space != "icc" else 2e-3, atol=0.02)
    assert "adobe-rgb is asked for" in complaint(tmp_path, tmp_path / "a.png", colour_space="adobe-rgb")


def broken(name: str) -> Any:
    def make(folder: Path) -> Path:
        codes, path = Image.fromarray(pixels(size=(64, 64))), folder / name
        data = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()
        match path.stem:
            case "cmyk":
                codes.convert("CMYK").save(path)
            case "bit":
                codes.convert("1").save(path)
            case "palette":
                codes.quantize(16).save(path)
            case "animated":
                codes.save(path, save_all=True, append_images=[Image.new("RGB", (64, 64))])
            case "profile":
                codes.save(path, icc_profile=data[:200])
            case "lut":
                codes.save(path, icc_profile=data[:12] + b"prtrCMYK" + data[20:])
            case "cut":
                codes.save(folder / f"whole{path.suffix}")
                whole = (folder / f"whole{path.suffix}").read_bytes()
                path.write_bytes(whole[: len(whole) * 2 // 3])
            case "empty":
                path.write_bytes(b"")
            case "text":
                path.write_text("no picture", encoding="utf-8")
            case "wide":
                Image.new("RGB", (30_000, 4)).save(path)
            case "gif":
                codes.save(path)
        return path

    return make


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("cmyk.jpg", "CMYK"),
        ("bit.png", "1 bit a pixel"),
        ("palette.png", "a palette of at most 256 colours"),
        ("animated.png", "the picture is animated"),
        ("animated.tif", "more than one picture"),
        ("profile.png", "its ICC profile cannot be used"),
        ("lut.jpg", "the profile is of a printer"),
        ("cut.png", "cut short or damaged"),
        ("cut.jpg", "cut short or damaged"),
        ("cut.webp", "damaged"),
        ("cut.tif", "cut short or damaged"),
        ("empty.png", "the file is no picture"),
        ("text.jpg", "the file is no picture"),
        ("wide.png", "30000 × 4 pixels is too large"),
        ("gif.gif", "pictures of the kind .gif are not read"),
    ],
)
def test_each_wrong_picture_has_one_clear_message(tmp_path: Path, name: str, message: str) -> None:
    line = complaint(tmp_path, broken(name)(tmp_path))
    assert message in line
    assert name in line
    assert len(line.splitlines()) == 1


def test_what_is_not_stated_is_asked_for_at_once(tmp_path: Path) -> None:
    Image.fromarray(pixels()).save(tmp_path / "a.png")
    assert "write white_luminance_cd_m2: 100" in complaint(tmp_path, tmp_path / "a.png", white_luminance_cd_m2=None)
    assert "write colour_space: srgb" in complaint(tmp_path, tmp_path / "a.png", colour_space=None)
    assert "values of 8 bits are codes" in complaint(tmp_path, tmp_path / "a.png", colour_space="rec709")
    assert "it has no ICC profile" in complaint(tmp_path, tmp_path / "a.png", colour_space="icc")


def test_linear_png_and_hdr_png_are_refused(tmp_path: Path) -> None:
    from PIL.PngImagePlugin import PngInfo

    for chunk, content, message in (
        (b"gAMA", struct.pack(">I", 100_000), "gAMA states values to the power of 1"),
        (b"cICP", bytes([9, 16, 0, 1]), "cICP states primaries 9 and transfer 16"),
    ):
        info = PngInfo()
        info.add(chunk, content)
        Image.fromarray(pixels()).save(tmp_path / "a.png", pnginfo=info)
        assert message in complaint(tmp_path, tmp_path / "a.png")


def test_bands_are_named_where_codes_lie_far_apart(tmp_path: Path) -> None:
    grey = np.repeat(np.arange(256, dtype=np.uint8)[None, :, None], 3, axis=2)
    Image.fromarray(grey).save(tmp_path / "a.png")
    save_picture(tmp_path / "b.png", grey.astype(np.uint16) * 257, kind="uint16")

    def bands(file: str, **steps: Any) -> list[dict[str, Any]]:
        entry = built(tmp_path, {"name": "one", "file": file}, **steps).entry("one")
        return [step for step in entry["steps"] if step["step"] == "banding"]

    assert not bands("a.png")
    assert not bands("a.png", luminance={"scale": 1.2})
    assert not bands("b.png", luminance={"scale": 8})
    (step,) = bands("a.png", luminance={"scale": 4})
    assert "ΔE00 0.71" in step["said"][0]
