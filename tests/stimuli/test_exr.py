"""OpenEXR in and out: both multi-view layouts, declared and told colour spaces, and every way to be refused."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from devices.colour import rgb_to_xyz_matrix
from stimuli.errors import StimulusError
from stimuli.pictures import REC709, StereoImage, XYZImage, read_exr, read_exr_counted, write_exr
from stimuli.pictures.exr_views import read_views
from tests.stimuli.oiio_files import save_parts

XYZ = (1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1 / 3, 1 / 3)
RGB709 = tuple(float(number) for number in REC709.ravel())


def write_parts(
    path: Path,
    parts: Sequence[tuple[Mapping[str, Any], Sequence[str], XYZImage]],
    data_window_offset_px: tuple[int, int] = (0, 0),
    display_size_px: tuple[int, int] | None = None,
) -> Path:
    """Write parts of (attributes, channel names, pixels) with OpenImageIO directly."""
    specs = []
    for attributes, channels, pixels in parts:
        spec = oiio.ImageSpec(pixels.shape[1], pixels.shape[0], pixels.shape[2], "float")
        spec.channelnames = tuple(channels)
        spec.x, spec.y = data_window_offset_px
        spec.full_width, spec.full_height = display_size_px or (spec.width, spec.height)
        for key, value in attributes.items():
            if isinstance(value, str | float):
                spec.attribute(key, value)
            else:
                values = tuple(value)
                spec.attribute(key, f"{'string' if isinstance(values[0], str) else 'float'}[{len(values)}]", values)
        specs.append(spec)
    output = oiio.ImageOutput.create(str(path))
    assert output is not None
    assert output.open(str(path), specs if len(specs) > 1 else specs[0]), output.geterror()
    for index, (_, _, pixels) in enumerate(parts):
        if index:
            assert output.open(str(path), specs[index], "AppendSubimage"), output.geterror()
        assert output.write_image(pixels.astype(np.float32)), output.geterror()
    assert output.close()
    return path


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
    picture = oiio.ImageInput.open(str(tmp_path / "a.exr"))
    assert picture is not None
    spec = picture.spec()
    assert spec.getattribute("multiView") == ("left", "right")
    np.testing.assert_allclose(spec.getattribute("chromaticities"), XYZ, atol=1e-7)
    assert spec.getattribute("whiteLuminance") == 1.0
    assert spec.getattribute("compression") == "zip"
    assert spec.format == "half"
    assert spec.channelnames == ("R", "G", "B", "right.R", "right.G", "right.B")
    picture.close()


def test_a_multi_part_file_reads_like_a_single_part_one(tmp_path: Path) -> None:
    views = {"left": noise(seed=1), "right": noise(seed=2), "centre": noise(seed=3)}
    parts = [
        ({"view": name, "oiio:subimagename": name, "chromaticities": XYZ}, "RGB", pixels)
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
    save_parts(tmp_path / "a.exr", [({"multiView": ("right", "left"), "chromaticities": XYZ}, channels, pixels)])
    image = read_exr(tmp_path / "a.exr")
    np.testing.assert_array_equal(image.right, pixels[..., :3])
    np.testing.assert_array_equal(image.left, pixels[..., 3:])


def test_alpha_depth_and_layers_are_left_out(tmp_path: Path) -> None:
    pixels = noise((4, 6, 8))
    channels = ["R", "G", "B", "A", "Z", "diffuse.R", "diffuse.G", "diffuse.B"]
    image = read_exr(save_parts(tmp_path / "a.exr", [({"chromaticities": XYZ}, channels, pixels)]))
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
    told = read_exr(tmp_path / "a.exr", white_luminance_cd_m2=1.0)
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
        ({"view": "left", "chromaticities": XYZ, "oiio:subimagename": "left"}, "RGB", left),
        ({"view": "right", "chromaticities": XYZ, "oiio:subimagename": "right"}, "RGB", right),
    ]
    path = save_parts(tmp_path / "bad.exr", parts)
    with pytest.raises(StimulusError, match=rf"bad\.exr: in the view 'right' .*{message}"):
        read_exr(path)


def test_negative_light_can_be_clipped_and_is_counted(tmp_path: Path) -> None:
    pixels = noise()
    pixels[0, :3, 2] = -0.25
    path = save_parts(tmp_path / "a.exr", [({"chromaticities": XYZ}, "RGB", pixels)])
    reading = read_exr_counted(path, negative="clip")
    assert reading.clipped_pixels == 3
    np.testing.assert_array_equal(reading.image.left, np.maximum(pixels, 0))


def test_a_missing_eye_is_refused_but_flat_may_name_the_other(tmp_path: Path) -> None:
    pixels = noise()
    path = save_parts(tmp_path / "a.exr", [({"view": "left", "chromaticities": XYZ}, "RGB", pixels)])
    with pytest.raises(StimulusError, match="'left' has no 'right' beside it"):
        read_exr(path)
    with pytest.raises(StimulusError, match="no centre view"):
        read_exr(path, flat=True)
    assert read_exr(path, flat=True, flat_eye="left").is_flat


@pytest.mark.parametrize("offset", [(9, 0), (0, 9), (-9, 0), (0, -9), (6, 0), (0, -4)])
def test_a_data_window_off_the_display_window_is_refused(tmp_path: Path, offset: tuple[int, int]) -> None:
    part = ({"chromaticities": XYZ}, "RGB", noise((4, 6, 3)))
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
    part = ({"chromaticities": XYZ, **attributes}, channels, noise((3, 3, len(channels))))
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
    path = write_parts(tmp_path / "a.exr", [({"chromaticities": XYZ}, "RGB", np.full((2, 2, 3), np.nan))])
    with pytest.raises(StimulusError, match="4 pixels are not finite"):
        read_exr(path, negative="clip")


def test_overflow_in_conversion_is_refused(tmp_path: Path) -> None:
    part = ({"chromaticities": XYZ, "whiteLuminance": 1e10}, "RGB", np.full((2, 2, 3), 1e30))
    with pytest.raises(StimulusError, match="beyond single precision"):
        read_exr(write_parts(tmp_path / "a.exr", [part]))


@pytest.mark.parametrize("luminance", [0.0, -1.0, float("nan")])
def test_a_white_without_luminance_is_refused(tmp_path: Path, luminance: float) -> None:
    path = write_parts(tmp_path / "a.exr", [({"chromaticities": XYZ, "whiteLuminance": luminance}, "RGB", noise())])
    with pytest.raises(StimulusError, match="whiteLuminance"):
        read_exr(path)


def test_views_stored_in_different_windows_lie_on_one_display_window(tmp_path: Path) -> None:
    """As a compositor crops each view by itself to what is not black."""
    left, right = noise((4, 6, 3)), noise((4, 5, 3), 2)
    parts = [
        ({"view": "left", "chromaticities": XYZ, "oiio:subimagename": "left"}, "RGB", left),
        ({"view": "right", "chromaticities": XYZ, "oiio:subimagename": "right"}, "RGB", right),
    ]
    image = read_exr(write_parts(tmp_path / "a.exr", parts, (1, 1), display_size_px=(7, 6)))
    expected = np.zeros((2, 6, 7, 3), np.float32)
    expected[0, 1:5, 1:7], expected[1, 1:5, 1:6] = left, right
    np.testing.assert_array_equal(np.stack([image.left, image.right]), expected)


def test_a_data_window_is_placed_on_the_display_window(tmp_path: Path) -> None:
    pixels = noise((4, 6, 3))
    part = ({"chromaticities": XYZ}, "RGB", pixels)
    path = write_parts(tmp_path / "a.exr", [part], data_window_offset_px=(2, -1), display_size_px=(7, 5))
    image = read_exr(path)
    expected = np.zeros((5, 7, 3), np.float32)
    expected[0:3, 2:7] = pixels[1:4, 0:5]
    np.testing.assert_array_equal(image.left, expected)


@given(
    hnp.arrays(
        np.float32,
        hnp.array_shapes(min_dims=2, max_dims=2, max_side=9).map(lambda shape: (*shape, 3)),
        elements=st.floats(0, 65504, width=32),
    )
)
def test_any_half_range_picture_survives(tmp_path_factory: pytest.TempPathFactory, pixels: XYZImage) -> None:
    path = tmp_path_factory.mktemp("exr") / "a.exr"
    write_exr(path, StereoImage.flat(pixels))
    np.testing.assert_allclose(read_exr(path).left, pixels, rtol=2**-11, atol=2**-25)
