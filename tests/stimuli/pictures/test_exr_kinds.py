"""OpenEXR beyond R, G, B on one window: grey, luminance and chroma, cropped views; and what is no view of a scene."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio
import pytest
from numpy.typing import NDArray

from devices.colour import rgb_to_xyz_matrix
from documents.arrays import Floats
from stimuli.comparison.pictures import what_it_holds
from stimuli.errors import StimulusError
from stimuli.pictures import REC709, Region, read_exr
from stimuli.pictures.exr_header import XYZ
from tests.stimuli.pictures.exr_bytes import Part, decimated, floats, strings, write_bytes

REC2020 = np.array([[0.708, 0.292], [0.170, 0.797], [0.131, 0.046], [0.3127, 0.3290]])
STEREO = ("multiView", "stringvector", strings("left", "right"))


def chromaticities(values: Floats) -> tuple[str, str, bytes]:
    return "chromaticities", "chromaticities", floats(*values.ravel())


def smooth(seed: int, shape: tuple[int, int] = (48, 64)) -> Floats:
    """Return R, G, B of slow changes, so that chroma of half the resolution loses next to nothing."""
    rng = np.random.default_rng(seed)
    y, x = np.mgrid[: shape[0], : shape[1]] / 64
    waves = [rng.uniform(0.5, 1) + 0.3 * np.sin(x * rng.uniform(1, 2) + y * rng.uniform(1, 2)) for _ in range(3)]
    return np.stack(waves, axis=-1)


def luminance_chroma(rgb: Floats, primaries: Floats, dtype: str = "<f4") -> dict[str, NDArray[Any]]:
    """Return Y, RY, BY as OpenEXR's technical introduction defines them."""
    luminance = rgb @ rgb_to_xyz_matrix(*primaries)[1]
    made = {"Y": luminance, "RY": (rgb[..., 0] - luminance) / luminance, "BY": (rgb[..., 2] - luminance) / luminance}
    return {name: values.astype(dtype) for name, values in made.items()}


def halved(channels: dict[str, NDArray[Any]], prefix: str = "") -> tuple[dict[str, NDArray[Any]], dict[str, int]]:
    """Return the channels with chroma at every second pixel, and the steps of these."""
    kept = {prefix + name: values if name == "Y" else decimated(values) for name, values in channels.items()}
    return kept, {prefix + "RY": 2, prefix + "BY": 2}


def light(rgb: Floats, primaries: Floats) -> Floats:
    return np.asarray(rgb @ rgb_to_xyz_matrix(*primaries).T)


@pytest.mark.parametrize("primaries", [REC709, REC2020], ids=["rec709", "rec2020"])
def test_luminance_and_chroma_of_half_resolution(tmp_path: Path, primaries: Floats) -> None:
    """With the luminance weights of the file's own chromaticities: Rec. 709's would miss green by up to 0.05."""
    rgb = smooth(1)
    channels, steps = halved(luminance_chroma(rgb, primaries, "<f2"))
    path = write_bytes(tmp_path / "a.exr", Part(channels, [chromaticities(primaries)], steps=steps))
    image = read_exr(path)
    assert image.is_flat
    # Half floats, of luminance, of chroma and of what is made of them; the interpolation's weights sum to 1.0002.
    np.testing.assert_allclose(image.left[8:-8, 8:-8], light(rgb, primaries)[8:-8, 8:-8], rtol=4e-3)
    assert oiio.get_int_attribute("openexr:core", 1) == 1
    part = read_exr(path, region=Region(5, 9, 20, 11))
    np.testing.assert_array_equal(part.left, image.left[9:20, 5:25])


def test_chroma_without_a_luminance_of_green_is_refused(tmp_path: Path) -> None:
    channels = {name: np.ones((2, 3), "<f4") for name in ("Y", "RY", "BY")}
    odd = np.array([[0.3, 0.6], [0.3, 0.0], [0.15, 0.06], [0.3, 0.3]])
    with pytest.raises(StimulusError, match="green"):
        read_exr(write_bytes(tmp_path / "a.exr", Part(channels, [chromaticities(odd)])))


def test_chroma_of_half_resolution_in_two_views_is_refused_rightly(tmp_path: Path) -> None:
    left, steps = halved(luminance_chroma(smooth(5), REC709))
    right, more = halved(luminance_chroma(smooth(6), REC709), "right.")
    path = write_bytes(tmp_path / "a.exr", Part(left | right, [STEREO], steps=steps | more))
    with pytest.raises(StimulusError, match=r"right\.BY, right\.RY have") as error:
        read_exr(path, "rec709")
    assert "write R, G and B" in str(error.value)
    parts = [
        Part(left, [("view", "string", b"left")], steps=steps),
        Part(left, [("view", "string", b"right")], steps=steps),
    ]
    with pytest.raises(StimulusError, match="lower resolution"):
        read_exr(write_bytes(tmp_path / "b.exr", *parts), "rec709")


@pytest.mark.parametrize("primaries", [REC709, XYZ], ids=["rec709", "XYZ"])
def test_a_grey_stereo_pair(tmp_path: Path, primaries: Floats) -> None:
    """Luminance alone is R = G = B, the colour of the white that the file declares."""
    left, right = (smooth(seed)[..., 1].astype("<f2") for seed in (1, 2))
    path = write_bytes(tmp_path / "a.exr", Part({"Y": left, "right.Y": right}, [STEREO, chromaticities(primaries)]))
    image = read_exr(path)
    white = rgb_to_xyz_matrix(*primaries).sum(axis=1)
    for eye, luminance in ((image.left, left), (image.right, right)):
        np.testing.assert_allclose(eye, luminance.astype(np.float64)[..., None] * white, rtol=1e-6)
    part = read_exr(path, region=Region(3, 4, 5, 6))
    np.testing.assert_array_equal(part.right, image.right[4:10, 3:8])
    assert what_it_holds(path) == "xyz"


def test_cropped_views_lie_on_one_display_window(tmp_path: Path) -> None:
    """Also on a display window that does not begin at 0, in files with rows from the bottom up."""
    display = (-10, -4, 13, 11)
    windows = {"left": (-12, -2, 3, 9), "right": (1, -4, 13, 13)}
    expected = np.zeros((2, 16, 24))
    parts = []
    for number, (eye, (x0, y0, x1, y1)) in enumerate(windows.items()):
        grey = np.random.default_rng(number).uniform(1, 2, (y1 - y0 + 1, x1 - x0 + 1)).astype("<f4")
        attributes = [("view", "string", eye.encode()), chromaticities(REC709)]
        parts.append(Part({"Y": grey}, attributes, (x0, y0, x1, y1), display, decreasing=bool(number)))
        for row, column in np.ndindex(16, 24):
            y, x = row + display[1] - y0, column + display[0] - x0
            if 0 <= y < grey.shape[0] and 0 <= x < grey.shape[1]:
                expected[number, row, column] = grey[y, x]
    image = read_exr(write_bytes(tmp_path / "a.exr", *parts))
    np.testing.assert_allclose(image.left[..., 1], expected[0], rtol=1e-6)
    np.testing.assert_allclose(image.right[..., 1], expected[1], rtol=1e-6)
    part = read_exr(tmp_path / "a.exr", region=Region(2, 0, 10, 3))
    np.testing.assert_allclose(part.right[..., 1], expected[1, :3, 2:12], rtol=1e-6)


def rgb_part(*attributes: tuple[str, str, bytes], aspect: float = 1.0, prefix: str = "", shape: Any = (4, 6)) -> Part:
    return Part({prefix + name: np.ones(shape, "<f2") for name in "RGB"}, attributes, aspect=aspect)


@pytest.mark.parametrize(("envmap", "shape", "what"), [(1, (36, 6), "six faces"), (0, (4, 8), "panorama")])
def test_environment_maps_are_refused(tmp_path: Path, envmap: int, shape: tuple[int, int], what: str) -> None:
    path = write_bytes(tmp_path / "a.exr", rgb_part(("envmap", "envmap", bytes([envmap])), shape=shape))
    with pytest.raises(StimulusError, match=f"environment map, .*{what}.*render the view"):
        read_exr(path, "rec709")


@pytest.mark.parametrize(("aspect", "squares"), [(1.001, True), (1.5, False), (0.9, False)])
def test_pixels_that_are_not_square_are_refused(tmp_path: Path, aspect: float, squares: bool) -> None:
    path = write_bytes(tmp_path / "a.exr", rgb_part(aspect=aspect))
    if squares:
        assert read_exr(path, "rec709").width_px == 6
        return
    with pytest.raises(StimulusError, match=f"{aspect:g} times as wide as high") as error:
        read_exr(path, "rec709")
    assert f"--resize {100 * aspect:g}%x100%" in str(error.value)


@pytest.mark.parametrize("eyes", [("left", "right"), ("right",), ("Left", "Right", "Centre")])
def test_layers_named_as_eyes_without_multiview_are_refused(tmp_path: Path, eyes: tuple[str, ...]) -> None:
    """Else the channels without a prefix would be shown to both eyes, and nobody would notice."""
    channels = {f"{eye}.{name}": np.ones((4, 6), "<f2") for eye in eyes for name in "RGB"}
    channels |= {name: np.ones((4, 6), "<f2") for name in "RGB"}
    with pytest.raises(StimulusError, match=r"layers named .*right.*no attribute multiView"):
        read_exr(write_bytes(tmp_path / "a.exr", Part(channels)), "rec709")
    other = {name.replace("eft", "amp").replace("ight", "im"): values for name, values in channels.items()}
    if "Centre" not in eyes:
        assert read_exr(write_bytes(tmp_path / "b.exr", Part(other)), "rec709").is_flat


def interop(name: str) -> tuple[str, str, bytes]:
    return "colorInteropID", "string", name.encode()


def test_a_colour_interop_id_declares_the_light(tmp_path: Path) -> None:
    white = read_exr(write_bytes(tmp_path / "a.exr", rgb_part(interop("lin_rec2020_scene")))).left[0, 0]
    np.testing.assert_allclose(white, rgb_to_xyz_matrix(*REC2020).sum(axis=1), rtol=1e-6)
    both = rgb_part(interop("lin_rec709_scene"), chromaticities(REC709))
    assert read_exr(write_bytes(tmp_path / "b.exr", both)).left[0, 0, 1] == pytest.approx(1.0)
    assert read_exr(write_bytes(tmp_path / "c.exr", rgb_part(interop("lin_ciexyzd65_scene")))).left[0, 0, 2] == 1


@pytest.mark.parametrize(
    ("name", "more", "message"),
    [
        ("srgb_rec709_scene", [], "srgb_rec709_scene, and"),
        ("data", [], "no linear light"),
        ("lin_foo_scene", [], "lin_foo_scene, which is not known"),
        ("lin_ap1_scene", [chromaticities(REC709)], "lin_ap1_scene, and"),
    ],
)
def test_a_colour_interop_id_that_does_not_fit_is_refused(
    tmp_path: Path, name: str, more: list[tuple[str, str, bytes]], message: str
) -> None:
    path = write_bytes(tmp_path / "a.exr", rgb_part(interop(name), *more))
    with pytest.raises(StimulusError, match=message):
        read_exr(path, None if more else "rec709")
    if name == "lin_ap1_scene":
        path = write_bytes(tmp_path / "b.exr", rgb_part(interop(name)))
        with pytest.raises(StimulusError, match="not those of 'rec709'"):
            read_exr(path, "rec709")


@pytest.mark.parametrize(
    "odd",
    [
        np.zeros((4, 2)),
        np.array([[0.1, 0.1], [0.2, 0.2], [0.3, 0.3], [0.3, 0.3]]),
        np.array([[0.64, 0.33], [0.30, 0.60], [0.15, 0.06], [0.3, 0.0]]),
    ],
)
def test_chromaticities_of_no_display_are_refused(tmp_path: Path, odd: Floats) -> None:
    with pytest.raises(StimulusError) as error:
        read_exr(write_bytes(tmp_path / "a.exr", rgb_part(chromaticities(odd))))
    assert error.value.findings[0].remedy


def test_luminance_and_chroma_that_declare_nothing_are_rec709(tmp_path: Path) -> None:
    """As OpenEXR defines for the conversion; which light they are must still be said."""
    rgb = smooth(2)
    channels, steps = halved(luminance_chroma(rgb, REC709, "<f2"))
    path = write_bytes(tmp_path / "a.exr", Part(channels, steps=steps))
    with pytest.raises(StimulusError, match="does not declare its chromaticities"):
        read_exr(path)
    image = read_exr(path, "rec709")
    np.testing.assert_allclose(image.left[8:-8, 8:-8], light(rgb, REC709)[8:-8, 8:-8], rtol=4e-3)


@pytest.mark.parametrize("primaries", [REC709, REC2020], ids=["rec709", "rec2020"])
def test_luminance_and_chroma_of_full_resolution_in_both_eyes(tmp_path: Path, primaries: Floats) -> None:
    pair = [smooth(3), smooth(4)]
    pair[1][5, 6] = 0.5  # grey: no chroma, exactly its luminance
    left, right = (luminance_chroma(rgb, primaries) for rgb in pair)
    channels = left | {f"right.{name}": values for name, values in right.items()}
    image = read_exr(write_bytes(tmp_path / "a.exr", Part(channels, [STEREO, chromaticities(primaries)])))
    for eye, rgb in zip((image.left, image.right), pair, strict=True):
        np.testing.assert_allclose(eye, light(rgb, primaries), rtol=2e-6)


def test_a_black_pixel_of_any_chroma_is_black(tmp_path: Path) -> None:
    channels = {name: np.zeros((2, 3), "<f4") for name in ("Y", "RY", "BY")}
    channels["RY"] += 7
    image = read_exr(write_bytes(tmp_path / "a.exr", Part(channels, [chromaticities(REC709)])))
    assert not image.left.any()


def test_colours_of_lower_resolution_are_refused_rightly(tmp_path: Path) -> None:
    rgb = smooth(1).astype("<f4")
    channels = {"R": decimated(rgb[..., 0]), "G": np.ascontiguousarray(rgb[..., 1]), "B": decimated(rgb[..., 2])}
    with pytest.raises(StimulusError, match=r"the channels R, B have a lower resolution|the channels B, R have"):
        read_exr(write_bytes(tmp_path / "a.exr", Part(channels, steps={"R": 2, "B": 2})), "rec709")


def test_grey_with_alpha_and_in_parts(tmp_path: Path) -> None:
    grey = smooth(1)[..., 0].astype("<f4")
    parts = [
        Part({"Y": grey * k, "A": np.ones_like(grey)}, [("view", "string", eye), chromaticities(REC709)])
        for k, eye in ((1, b"left"), (2, b"right"))
    ]
    image = read_exr(write_bytes(tmp_path / "a.exr", *parts))
    np.testing.assert_allclose(image.right, 2 * image.left, rtol=1e-6)
    np.testing.assert_allclose(image.left[..., 1], grey, rtol=1e-6)


def test_views_of_display_windows_that_differ_are_refused(tmp_path: Path) -> None:
    """By OpenEXR itself, whose parts share one display window."""
    grey = np.ones((4, 6), "<f4")
    parts = [
        Part({"Y": grey}, [("view", "string", eye), chromaticities(REC709)], display=(0, 0, 5, last))
        for eye, last in ((b"left", 3), (b"right", 4))
    ]
    with pytest.raises(StimulusError, match="cannot be read"):
        read_exr(write_bytes(tmp_path / "a.exr", *parts))


def test_neutrals_of_a_rendering_change_no_light(tmp_path: Path) -> None:
    """`adoptedNeutral` is for those who adapt a picture; XYZ are as they are."""
    plain = read_exr(write_bytes(tmp_path / "a.exr", rgb_part(chromaticities(REC709))))
    part = rgb_part(chromaticities(REC709), ("adoptedNeutral", "v2f", floats(0.45, 0.41)))
    np.testing.assert_array_equal(read_exr(write_bytes(tmp_path / "b.exr", part)).left, plain.left)


@pytest.mark.parametrize("tiles", [0, 16])
def test_of_a_mipmapped_picture_the_first_level_is_read(tmp_path: Path, tiles: int) -> None:
    pixels = np.random.default_rng(0).uniform(0, 9, (32, 48, 3)).astype(np.float32)
    source = oiio.ImageBuf(pixels)
    config = oiio.ImageSpec()
    config.attribute("maketx:filtername", "box")
    config.attribute("maketx:resize", 0)
    path = tmp_path / "a.exr"
    if tiles:
        config.tile_width = config.tile_height = tiles
    assert oiio.ImageBufAlgo.make_texture(oiio.MakeTxTexture, source, str(path), config), oiio.geterror()
    read = oiio.ImageInput.open(str(path))
    assert read is not None
    assert read.seek_subimage(0, 1)
    read.close()
    image = read_exr(path, "xyz")
    np.testing.assert_allclose(image.left, pixels, rtol=2**-10)
    np.testing.assert_array_equal(read_exr(path, "xyz", region=Region(7, 9, 20, 11)).left, image.left[9:20, 7:27])
