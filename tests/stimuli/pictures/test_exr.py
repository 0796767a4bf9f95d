"""OpenEXR in and out, whole and in part: views, windows, colour spaces, and every way to be refused."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from devices.colour import rgb_to_xyz_matrix
from documents.arrays import Floats
from stimuli.comparison.pictures import what_it_holds
from stimuli.errors import StimulusError
from stimuli.pictures import REC709, Decoding, Region, StereoImage, XYZImage, read_exr, read_exr_counted, write_exr
from stimuli.pictures.exr_header import XYZ
from stimuli.pictures.exr_views import read_views
from tests.kept import known
from tests.stimuli.oiio_files import save_parts
from tests.stimuli.pictures.exr_bytes import Part, decimated, floats, strings, write_bytes

# OpenEXR in and out: both multi-view layouts, declared and told colour spaces, and every way to be refused.

EXR_XYZ = (1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1 / 3, 1 / 3)
RGB709 = tuple(float(number) for number in REC709.ravel())


def noise(shape: tuple[int, ...] = (5, 7, 3), seed: int = 1) -> XYZImage:
    return np.random.default_rng(seed).uniform(0.0, 50.0, shape).astype(np.float32)


@pytest.mark.parametrize("flat", [True, False])
def test_a_written_picture_reads_back_to_half_precision(tmp_path: Path, flat: bool) -> None:
    image = StereoImage.flat(noise()) if flat else StereoImage(noise(seed=1), noise(seed=2))
    write_exr(tmp_path / "a.exr", image)
    back = read_exr(tmp_path / "a.exr")
    assert back.is_flat == flat
    for eye in ("left", "right"):
        np.testing.assert_array_equal(back.eye(eye), image.eye(eye).astype(np.float16))
    assert list(read_views(tmp_path / "a.exr")) == (["center"] if flat else ["left", "right"])
    assert [file.name for file in tmp_path.iterdir()] == ["a.exr"]


def test_what_is_written_declares_absolute_xyz_losslessly(tmp_path: Path) -> None:
    write_exr(tmp_path / "a.exr", StereoImage(noise(seed=1), noise(seed=2)))
    picture = known(oiio.ImageInput.open(str(tmp_path / "a.exr")))
    spec = picture.spec()
    assert spec.getattribute("multiView") == ("left", "right")
    np.testing.assert_allclose(spec.getattribute("chromaticities"), EXR_XYZ, atol=1e-7)
    assert spec.getattribute("whiteLuminance") == 1.0
    assert spec.getattribute("compression") == "zip"
    assert spec.format == "half"
    assert spec.channelnames == ("R", "G", "B", "right.R", "right.G", "right.B")
    picture.close()


def test_a_multi_part_file_reads_like_a_single_part_one(tmp_path: Path) -> None:
    views = {"left": noise(seed=1), "right": noise(seed=2), "centre": noise(seed=3)}
    parts = [
        ({"view": name, "oiio:subimagename": name, "chromaticities": EXR_XYZ}, "RGB", pixels)
        for name, pixels in views.items()
    ]
    image = read_exr(save_parts(tmp_path / "parts.exr", parts))
    np.testing.assert_array_equal(image.left, views["left"])
    np.testing.assert_array_equal(image.right, views["right"])
    flat = read_exr(tmp_path / "parts.exr", flat=True)
    assert flat.is_flat
    np.testing.assert_array_equal(flat.left, views["centre"])


def test_unprefixed_channels_belong_to_the_first_view(tmp_path: Path) -> None:
    pixels = noise((4, 6, 6))
    channels = ["R", "G", "B", "left.R", "left.G", "left.B"]
    save_parts(tmp_path / "a.exr", [({"multiView": ("right", "left"), "chromaticities": EXR_XYZ}, channels, pixels)])
    image = read_exr(tmp_path / "a.exr")
    np.testing.assert_array_equal(image.right, pixels[..., :3])
    np.testing.assert_array_equal(image.left, pixels[..., 3:])


def test_alpha_depth_and_layers_are_left_out(tmp_path: Path) -> None:
    pixels = noise((4, 6, 8))
    channels = ["R", "G", "B", "A", "Z", "diffuse.R", "diffuse.G", "diffuse.B"]
    image = read_exr(save_parts(tmp_path / "a.exr", [({"chromaticities": EXR_XYZ}, channels, pixels)]))
    assert image.is_flat
    np.testing.assert_array_equal(image.left, pixels[..., :3])


def test_channels_named_xyz_declare_themselves(tmp_path: Path) -> None:
    pixels = noise()
    image = read_exr(save_parts(tmp_path / "a.exr", [({}, "XYZ", pixels)]))
    np.testing.assert_array_equal(image.left, pixels)


def test_declared_primaries_and_white_luminance_are_honoured(tmp_path: Path) -> None:
    pixels = noise()
    part = ({"chromaticities": RGB709, "whiteLuminance": 26.5}, "RGB", pixels)
    image = read_exr(save_parts(tmp_path / "a.exr", [part]))
    expected = 26.5 * pixels.astype(np.float64) @ rgb_to_xyz_matrix(*REC709).T
    np.testing.assert_allclose(image.left, expected, rtol=1e-6)
    told = read_exr(tmp_path / "a.exr", Decoding(white_luminance_cd_m2=1.0))
    np.testing.assert_allclose(told.left, expected / 26.5, rtol=1e-6)


def test_a_picture_that_declares_nothing_must_be_told(tmp_path: Path) -> None:
    pixels = noise()
    path = save_parts(tmp_path / "a.exr", [({}, "RGB", pixels)])
    for space in (None, "declared"):
        with pytest.raises(StimulusError, match=r"a\.exr.*does not declare .*rec709"):
            read_exr(path, space)
    np.testing.assert_array_equal(read_exr(path, "xyz").left, pixels)
    np.testing.assert_allclose(
        read_exr(path, "rec709").left, pixels.astype(np.float64) @ rgb_to_xyz_matrix(*REC709).T, rtol=1e-6
    )


def test_a_recipe_cannot_contradict_the_file(tmp_path: Path) -> None:
    path = save_parts(tmp_path / "a.exr", [({"chromaticities": RGB709}, "RGB", noise())])
    with pytest.raises(StimulusError, match="not those of 'xyz'"):
        read_exr(path, "xyz")
    read_exr(path, "rec709")


@pytest.mark.parametrize(
    ("value", "message"),
    [(np.nan, r"2 pixels are not finite: NaN in 2 pixels \(G 2\)"), (-np.inf, "infinity in 2"), (-1e-3, "negative")],
)
def test_light_that_cannot_be_is_refused_with_view_and_count(tmp_path: Path, value: float, message: str) -> None:
    left, right = noise(seed=1), noise(seed=2)
    right[1, 2:4, 1] = value
    parts = [
        ({"view": "left", "chromaticities": EXR_XYZ, "oiio:subimagename": "left"}, "RGB", left),
        ({"view": "right", "chromaticities": EXR_XYZ, "oiio:subimagename": "right"}, "RGB", right),
    ]
    path = save_parts(tmp_path / "bad.exr", parts)
    with pytest.raises(StimulusError, match=rf"bad\.exr: in the view 'right' .*{message}"):
        read_exr(path)


def test_negative_light_can_be_clipped_and_is_counted(tmp_path: Path) -> None:
    pixels = noise()
    pixels[0, :3, 2] = -0.25
    path = save_parts(tmp_path / "a.exr", [({"chromaticities": EXR_XYZ}, "RGB", pixels)])
    reading = read_exr_counted(path, Decoding(negative="clip"))
    assert reading.clipped_pixels == 3
    np.testing.assert_array_equal(reading.image.left, np.maximum(pixels, 0))


def test_a_missing_eye_is_refused_but_flat_may_name_the_other(tmp_path: Path) -> None:
    pixels = noise()
    path = save_parts(tmp_path / "a.exr", [({"view": "left", "chromaticities": EXR_XYZ}, "RGB", pixels)])
    with pytest.raises(StimulusError, match="'left' has no 'right' beside it"):
        read_exr(path)
    with pytest.raises(StimulusError, match="no centre view"):
        read_exr(path, flat=True)
    assert read_exr(path, flat=True, flat_eye="left").is_flat


@pytest.mark.parametrize("offset", [(9, 0), (0, 9), (-9, 0), (0, -9), (6, 0), (0, -4)])
def test_a_data_window_off_the_display_window_is_refused(tmp_path: Path, offset: tuple[int, int]) -> None:
    part = ({"chromaticities": EXR_XYZ}, "RGB", noise((4, 6, 3)))
    path = save_parts(tmp_path / "a.exr", [part], corner_px=offset, display_px=(0, 0, 6, 4))
    with pytest.raises(StimulusError, match="stores nothing of its display window"):
        read_exr(path)


@pytest.mark.parametrize(
    ("channels", "attributes", "message"),
    [
        ("RGB", {"chromaticities": (0.6, 0.3, 0.3)}, "'chromaticities' does not hold 8 numbers"),
        ("RGB", {"whiteLuminance": "bright"}, "'whiteLuminance' does not hold 1 numbers"),
        (["Y", "Z"], {}, "no view has the channels"),
        (["Y", "RY"], {}, "no view has the channels"),
        ("RG", {}, "no view has the channels"),
        (["R", "G", "B", "right.R"], {"multiView": ("left", "right")}, "'right' lacks"),
        (["R", "G", "B"], {"multiView": ("left", "left")}, "lists a view twice"),
        (["R", "G", "B"], {"view": "top"}, "only the views 'top'"),
    ],
)
def test_views_that_cannot_be_made_out_are_refused(
    tmp_path: Path, channels: Sequence[str], attributes: dict[str, object], message: str
) -> None:
    part = ({"chromaticities": EXR_XYZ, **attributes}, channels, noise((3, 3, len(channels))))
    with pytest.raises(StimulusError, match=message):
        read_exr(save_parts(tmp_path / "a.exr", [part]))


def test_a_missing_file_a_folder_and_another_format_are_refused(tmp_path: Path) -> None:
    with pytest.raises(StimulusError, match=r"gone\.exr: there is no such picture"):
        read_exr(tmp_path / "gone.exr")
    with pytest.raises(StimulusError, match="this is a folder, not a file"):
        read_exr(tmp_path)
    png = oiio.ImageBuf(oiio.ImageSpec(2, 2, 3, "uint8"))
    assert png.write(str(tmp_path / "a.png"))
    with pytest.raises(StimulusError, match="not OpenEXR"):
        read_exr(tmp_path / "a.png")


@pytest.mark.parametrize("value", [np.nan, np.inf, -1e-6, 65520.0, 1e30])
def test_what_half_floats_cannot_hold_is_not_written(tmp_path: Path, value: float) -> None:
    pixels = noise()
    pixels[2, 3, 0] = value
    with pytest.raises(StimulusError, match="'center' 1 pixel is not within"):
        write_exr(tmp_path / "a.exr", StereoImage.flat(pixels))
    assert list(tmp_path.iterdir()) == []


def test_a_folder_that_is_not_there_is_one_clear_error(tmp_path: Path) -> None:
    with pytest.raises(StimulusError, match="cannot be written"):
        write_exr(tmp_path / "none" / "a.exr", StereoImage.flat(noise()))


@pytest.mark.shared_data
def test_a_real_three_view_photograph(shared_data: Path) -> None:
    path = shared_data / "data/stereo/Adjuster.exr"
    assert list(read_views(path)) == ["center", "left", "right"]
    image = read_exr(path, "rec709")
    assert (image.height_px, image.width_px, image.is_flat) == (678, 775, False)
    raw = np.asarray(oiio.ImageBuf(str(path)).get_pixels(oiio.FLOAT), dtype=np.float64)
    np.testing.assert_allclose(image.right, raw[..., 6:9] @ rgb_to_xyz_matrix(*REC709).T, rtol=1e-5, atol=1e-8)
    assert read_exr(path, "rec709", flat=True).is_flat
    with pytest.raises(StimulusError, match="does not declare"):
        read_exr(path)


@pytest.mark.shared_data
def test_a_real_xyz_picture(shared_data: Path) -> None:
    path = shared_data / "data/stereo/chromaticities_XYZ.exr"
    image = read_exr(path)
    assert (image.height_px, image.width_px, image.is_flat) == (406, 610, True)
    np.testing.assert_array_equal(image.left, oiio.ImageBuf(str(path)).get_pixels(oiio.FLOAT))


def test_equal_pictures_make_equal_files(tmp_path: Path) -> None:
    for name in ("a", "b"):
        write_exr(tmp_path / f"{name}.exr", StereoImage.flat(noise()))
    assert (tmp_path / "a.exr").read_bytes() == (tmp_path / "b.exr").read_bytes()


def test_clipping_does_not_let_nan_through(tmp_path: Path) -> None:
    path = save_parts(tmp_path / "a.exr", [({"chromaticities": EXR_XYZ}, "RGB", np.full((2, 2, 3), np.nan))])
    with pytest.raises(StimulusError, match="4 pixels are not finite"):
        read_exr(path, Decoding(negative="clip"))


def test_overflow_in_conversion_is_refused(tmp_path: Path) -> None:
    part = ({"chromaticities": EXR_XYZ, "whiteLuminance": 1e10}, "RGB", np.full((2, 2, 3), 1e30))
    with pytest.raises(StimulusError, match="beyond single precision"):
        read_exr(save_parts(tmp_path / "a.exr", [part]))


@pytest.mark.parametrize("luminance", [0.0, -1.0, float("nan")])
def test_a_white_without_luminance_is_refused(tmp_path: Path, luminance: float) -> None:
    path = save_parts(tmp_path / "a.exr", [({"chromaticities": EXR_XYZ, "whiteLuminance": luminance}, "RGB", noise())])
    with pytest.raises(StimulusError, match="whiteLuminance"):
        read_exr(path)


# Part of a picture read: the same pixels as of the whole, and no more of the file than that.
def write(path: Path, pixels: np.ndarray, compression: str = "zip", **how: Any) -> Path:
    """Write two views."""
    attributes = {
        "multiView": ("left", "right"),
        "compression": compression,
        "chromaticities": (1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1 / 3, 1 / 3),
    }
    return save_parts(path, [(attributes, [*"RGB", *(f"right.{name}" for name in "RGB")], pixels)], **how)


def region_noise(height: int, width: int, channels: int = 6) -> np.ndarray:
    return np.random.default_rng(3).uniform(0.0, 50.0, (height, width, channels)).astype(np.float32)


@settings(max_examples=30, suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
@given(data=st.data())
def test_a_region_is_the_same_as_a_crop_of_the_whole(tmp_path: Path, data: st.DataObject) -> None:
    whole = st.integers(1, 70)
    height, width, rows, columns = (data.draw(whole) for _ in range(4))
    display = Region(data.draw(st.integers(-9, 9)), data.draw(st.integers(-9, 9)), columns, rows)
    # The data window touches the display window, and may stick out of it or leave some of it black.
    left = display.left + data.draw(st.integers(1 - width, columns - 1))
    top = display.top + data.draw(st.integers(1 - height, rows - 1))
    tile_px = data.draw(st.sampled_from([None, (16, 16), (32, 16), (16, 64)]))
    compression = data.draw(st.sampled_from(["none", "zips", "zip", "piz"]))
    window = (display.left, display.top, columns, rows)
    how = {"corner_px": (left, top), "display_px": window, "tile_px": tile_px}
    path = write(tmp_path / "a.exr", region_noise(height, width), compression, **how)
    first_column, first_row = data.draw(st.integers(0, columns - 1)), data.draw(st.integers(0, rows - 1))
    region = Region(
        first_column,
        first_row,
        data.draw(st.integers(1, columns - first_column)),
        data.draw(st.integers(1, rows - first_row)),
    )
    whole_views, views = read_views(path), read_views(path, region)
    assert list(views) == list(whole_views) == ["left", "right"]
    for name, view in views.items():
        cropped = whole_views[name].pixels[region.top : region.bottom, region.left : region.right]
        np.testing.assert_array_equal(view.pixels, cropped)
        assert view.size_px == whole_views[name].size_px == (columns, rows)
        assert view.data_window_px == whole_views[name].data_window_px


@pytest.mark.parametrize("flat", [False, True])
def test_a_picture_of_a_region_is_a_crop_of_the_picture(tmp_path: Path, flat: bool) -> None:
    left, right = region_noise(60, 50, 3), region_noise(60, 50, 6)[..., 3:]
    write_exr(tmp_path / "a.exr", StereoImage.flat(left) if flat else StereoImage(left, right))
    part = read_exr(tmp_path / "a.exr", region=Region(7, 20, 30, 25))
    whole = read_exr(tmp_path / "a.exr")
    assert part.is_flat is flat
    np.testing.assert_array_equal(part.left, whole.left[20:45, 7:37])
    np.testing.assert_array_equal(part.right, whole.right[20:45, 7:37])


@pytest.mark.parametrize("tile_px", [None, (64, 64)])
def test_what_lies_outside_the_rows_is_not_read(tmp_path: Path, tile_px: tuple[int, int] | None) -> None:
    path = write(tmp_path / "a.exr", region_noise(512, 128), compression="none", tile_px=tile_px)
    expected = read_views(path)["right"].pixels[:60, 5:105]
    content = path.read_bytes()
    path.write_bytes(content[: len(content) // 2])
    with pytest.raises(StimulusError, match="damaged"):
        read_views(path)
    with pytest.raises(StimulusError, match="damaged"):
        read_views(path, Region(5, 400, 100, 60))
    np.testing.assert_array_equal(read_views(path, Region(5, 0, 100, 60))["right"].pixels, expected)


@pytest.mark.parametrize(
    "region",
    [Region(-1, 0, 5, 5), Region(0, 6, 5, 5), Region(0, 0, 13, 5), Region(3, 3, 0, 5), Region(3, 3, 5, -1)],
)
def test_a_region_that_is_not_of_the_picture_is_refused(tmp_path: Path, region: Region) -> None:
    path = write(tmp_path / "a.exr", region_noise(10, 12))
    with pytest.raises(StimulusError, match=r"a\.exr.*12 × 10 px and holds no") as raised:
        read_views(path, region)
    assert len(raised.value.findings) == 1


# OpenEXR beyond R, G, B on one window: grey, luminance and chroma, cropped views; and what is no view of a scene.

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
    read = known(oiio.ImageInput.open(str(path)))
    assert read.seek_subimage(0, 1)
    read.close()
    image = read_exr(path, "xyz")
    np.testing.assert_allclose(image.left, pixels, rtol=2**-10)
    np.testing.assert_array_equal(read_exr(path, "xyz", region=Region(7, 9, 20, 11)).left, image.left[9:20, 7:27])
