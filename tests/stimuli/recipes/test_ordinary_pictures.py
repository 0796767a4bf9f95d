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
from documents import InputError
from stimuli.build import StimulusSet, build_set, export_exr
from stimuli.pictures import Region, StereoImage
from stimuli.pictures.coded import decoded
from stimuli.pictures.colour_spaces import NAMED_SPACES, NamedSpace, named_encoding
from tests.kept import known
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
    np.testing.assert_allclose(read(tmp_path, file).left, srgb_xyz(np.asarray(known(turned))), rtol=1e-6, atol=1e-9)


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
    from extensions.profiles import profile_of_model

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


def test_jpeg_is_what_pillow_decodes(tmp_path: Path) -> None:
    file = tmp_path / "a.jpg"
    Image.fromarray(pixels(size=(40, 30))).save(file, quality=95)
    np.testing.assert_allclose(read(tmp_path, file).left, srgb_xyz(np.asarray(Image.open(file))), rtol=1e-6, atol=1e-9)


def test_a_float_tiff_of_codes_and_of_light(tmp_path: Path) -> None:
    values = np.random.default_rng(1).random((8, 12, 3)).astype(np.float32)
    file = save_picture(tmp_path / "a.tif", values)
    light = colour.models.eotf_sRGB(values.astype(np.float64))
    np.testing.assert_allclose(read(tmp_path, file).left, light @ _SRGB.T * WHITE, rtol=1e-6)
    np.testing.assert_allclose(read(tmp_path, file, colour_space="rec709").left, values @ _SRGB.T * WHITE, rtol=1e-6)
    np.testing.assert_allclose(
        read(tmp_path, file, colour_space="xyz", white_luminance_cd_m2=None).left, values, rtol=6e-4
    )


def test_grey_pictures_have_the_white_s_chromaticity(tmp_path: Path) -> None:
    grey = pixels()[..., 0]
    Image.fromarray(grey).save(tmp_path / "a.png")
    expected = srgb_xyz(np.repeat(grey[..., None], 3, axis=-1))
    np.testing.assert_allclose(read(tmp_path, tmp_path / "a.png").left, expected, rtol=1e-6, atol=1e-9)


def test_a_file_for_each_eye_mpo_and_jps(tmp_path: Path) -> None:
    left, right = pixels(1, (16, 16)), pixels(2, (16, 16))
    for name, codes in (("a_L.png", left), ("a_R.png", right)):
        Image.fromarray(codes).save(tmp_path / name)
    first, second = Image.fromarray(left), Image.fromarray(right)
    first.save(tmp_path / "b.mpo", save_all=True, append_images=[second], quality=95)
    Image.fromarray(np.hstack([right, left])).save(tmp_path / "c.jps", format="JPEG", quality=95)
    stimuli = built(
        tmp_path,
        {"name": "a", "left": "a_L.png", "right": "a_R.png"},
        {"name": "b", "file": "b.mpo"},
        {"name": "c", "file": "c.jps"},
        {"name": "d", "left": "a_L.png", "right": "a_R.png", "view": "flat", "flat_eye": "right"},
    )
    a, b, c, d = (stimuli.load(name) for name in stimuli.names)
    np.testing.assert_allclose(a.right, srgb_xyz(right), rtol=1e-6, atol=1e-9)
    with Image.open(tmp_path / "b.mpo") as mpo:
        mpo.seek(1)
        np.testing.assert_allclose(b.right, srgb_xyz(np.asarray(mpo)), rtol=1e-6, atol=1e-9)
    jps = np.asarray(Image.open(tmp_path / "c.jps"))
    np.testing.assert_allclose(c.left, srgb_xyz(jps[:, 16:]), rtol=1e-6, atol=1e-9)
    assert d.is_flat
    assert np.array_equal(d.left, a.right)
    assert stimuli.factors("a") == {"image": "a", "view": "stereo"}


def test_two_eyes_must_go_together(tmp_path: Path) -> None:
    from extensions.profiles import profile_of_model

    Image.fromarray(pixels()).save(tmp_path / "l.png")
    Image.fromarray(pixels(size=(12, 9))).save(tmp_path / "r.png")
    Image.fromarray(pixels()[..., 0]).save(tmp_path / "g.png")
    Image.fromarray(pixels()).save(tmp_path / "p.png", icc_profile=profile_of_model(thesis_display(), "d").data)
    for right, message in (("r.png", "'left' is 12 × 8, 'right' is 12 × 9"), ("g.png", "of different form")):
        with pytest.raises(InputError, match=message):
            built(tmp_path, {"name": "one", "left": "l.png", "right": right})
    with pytest.raises(InputError, match="stereo needs the views left and right"):
        built(tmp_path, {"name": "one", "file": "l.png", "view": "stereo"})
    with pytest.raises(InputError, match="name 'file', or a file for each eye"):
        built(tmp_path, {"name": "one", "left": "l.png"})
    with pytest.raises(InputError, match="both OpenEXR, or neither"):
        built(tmp_path, {"name": "one", "left": "l.png", "right": "r.exr"})


def test_openexr_takes_no_space_of_codes(tmp_path: Path) -> None:
    save_picture(tmp_path / "a.exr", np.ones((4, 6, 3), np.float32), kind="half")
    assert "OpenEXR holds linear light" in complaint(tmp_path, tmp_path / "a.exr")
    Image.fromarray(pixels()).save(tmp_path / "b.png")
    stimuli = built(
        tmp_path,
        {"name": "a", "file": "a.exr", "colour_space": "rec709", "white_luminance_cd_m2": 1},
        {"name": "b", "file": "b.png"},
        {"name": "c", "left": "a.exr", "right": "a.exr", "colour_space": "xyz", "white_luminance_cd_m2": 2},
    )
    assert stimuli.load("c").left[0, 0].tolist() == [2.0, 2.0, 2.0]


def test_photographs_send_a_developed_picture_to_kind_pictures(tmp_path: Path) -> None:
    Image.fromarray(pixels()).save(tmp_path / "a.jpg")
    recipe = "{schema_version: 1, kind: photographs, stimuli: [{name: a, left: a.jpg, flat_eye: left}], views: [flat]}"
    (tmp_path / "r.yaml").write_text(recipe, encoding="utf-8")
    with pytest.raises(InputError, match="write kind: pictures in the recipe, with colour_space: srgb"):
        build_set(tmp_path / "r.yaml", 0.25)


def test_exported_pictures_read_back_as_the_same_pixels(tmp_path: Path) -> None:
    for name, seed in (("a_L.png", 1), ("a_R.png", 2)):
        Image.fromarray(pixels(seed)).save(tmp_path / name)
    whole = np.dstack([pixels(3), np.full((8, 12), 100, np.uint8)])
    Image.fromarray(whole).save(tmp_path / "alpha.png")
    first = built(
        tmp_path,
        {"name": "a", "left": "a_L.png", "right": "a_R.png", "factors": {"paint": "red", "number": 2}},
        {"name": "alpha", "file": "alpha.png"},
        {"name": "small", "file": "a_L.png", "resample": {"width_mm": 1.5}},
        alpha_background_cd_m2=10,
    )
    export_exr(first, tmp_path / "light")
    again = build_set(tmp_path / "light" / "recipe.yaml", 0.25)
    assert again.names == first.names
    for name in first.names:
        assert dict(again.factors(name)) == {**first.factors(name), "image": name}
        one, other = first.load(name), again.load(name)
        assert np.array_equal(one.left, other.left)
        assert np.array_equal(one.right, other.right)
        assert one.is_flat == other.is_flat


def test_codes_that_were_damaged_are_made_again(tmp_path: Path) -> None:
    codes = pixels(size=(50, 40))
    Image.fromarray(codes).save(tmp_path / "a.png")
    stimuli = built(tmp_path, {"name": "one", "file": "a.png"})
    whole = stimuli.path("one").read_bytes()
    stimuli.path("one").write_bytes(whole[:-10] + bytes(10))
    with pytest.raises(InputError, match="its checksum differs"):
        stimuli.load("one")
    stimuli.path("one").write_bytes(whole[:-10])
    with pytest.raises(InputError, match="the picture is damaged"):
        stimuli.load("one")
    again = built(tmp_path, {"name": "one", "file": "a.png"})
    assert (again.rendered, again.digest) == (1, stimuli.digest)
    np.testing.assert_allclose(again.load("one").left, srgb_xyz(codes), rtol=1e-6, atol=1e-9)


def test_a_region_of_codes_is_read_as_a_part_of_the_whole(tmp_path: Path) -> None:
    Image.fromarray(pixels(size=(50, 40))).save(tmp_path / "a.png")
    stimuli = built(tmp_path, {"name": "one", "file": "a.png"})
    part = stimuli.load("one", lambda size: Region(5, 3, size[0] - 20, 7))
    np.testing.assert_allclose(part.left, stimuli.load("one").left[3:10, 5:35], rtol=1e-6)


def test_check_finds_what_headers_show(tmp_path: Path) -> None:
    from runner.check import check_file

    Image.fromarray(pixels()).save(tmp_path / "a.png")
    Image.fromarray(pixels(size=(13, 8))).save(tmp_path / "odd_sbs.png")
    Image.fromarray(pixels()).convert("CMYK").save(tmp_path / "c.jpg")
    stimuli = [
        {"name": "one", "file": "a.png", "view": "stereo"},
        {"name": "two", "left": "a.png", "right": "odd_sbs.png"},
        {"name": "three", "file": "c.jpg"},
        {"name": "four", "file": "odd_sbs.png"},
        {"name": "five", "file": "odd_sbs.png", "packing": "none"},
    ]
    recipe = {"schema_version": 1, "kind": "pictures", "colour_space": "srgb", "white_luminance_cd_m2": 80}
    (tmp_path / "r.yaml").write_text(json.dumps({**recipe, "stimuli": stimuli}), encoding="utf-8")
    messages = [finding.message for finding in check_file(tmp_path / "r.yaml").errors]
    assert [message[:30] for message in messages] == [
        "the picture has one view, and ",
        "the views differ in size: 'lef",
        "the picture is CMYK, inks for ",
        "its 13 columns cannot be divid",
    ]


def test_packing_none_shows_the_whole_picture(tmp_path: Path) -> None:
    codes = pixels(size=(13, 8))
    Image.fromarray(codes).save(tmp_path / "odd_sbs.png")
    image = built(tmp_path, {"name": "one", "file": "odd_sbs.png", "packing": "none"}).load("one")
    np.testing.assert_allclose(image.left, srgb_xyz(codes), rtol=1e-6, atol=1e-9)
    first = Image.fromarray(pixels(1, (16, 16)))
    first.save(tmp_path / "b.mpo", save_all=True, append_images=[Image.fromarray(pixels(2, (16, 16)))])
    assert built(tmp_path, {"name": "one", "file": "b.mpo", "packing": "none"}).load("one").is_flat
