"""Part of a picture read: the same pixels as of the whole, and no more of the file than that."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from stimuli.errors import StimulusError
from stimuli.pictures import Region, StereoImage, read_exr, write_exr
from stimuli.pictures.exr_views import read_views
from tests.stimuli.oiio_files import save_parts


def write(path: Path, pixels: np.ndarray, compression: str = "zip", **how: Any) -> Path:
    """Write two views."""
    attributes = {
        "multiView": ("left", "right"),
        "compression": compression,
        "chromaticities": (1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1 / 3, 1 / 3),
    }
    return save_parts(path, [(attributes, [*"RGB", *(f"right.{name}" for name in "RGB")], pixels)], **how)


def noise(height: int, width: int, channels: int = 6) -> np.ndarray:
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
    path = write(tmp_path / "a.exr", noise(height, width), compression, **how)
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
    left, right = noise(60, 50, 3), noise(60, 50, 6)[..., 3:]
    write_exr(tmp_path / "a.exr", StereoImage.flat(left) if flat else StereoImage(left, right))
    part = read_exr(tmp_path / "a.exr", region=Region(7, 20, 30, 25))
    whole = read_exr(tmp_path / "a.exr")
    assert part.is_flat is flat
    np.testing.assert_array_equal(part.left, whole.left[20:45, 7:37])
    np.testing.assert_array_equal(part.right, whole.right[20:45, 7:37])


@pytest.mark.parametrize("tile_px", [None, (64, 64)])
def test_what_lies_outside_the_rows_is_not_read(tmp_path: Path, tile_px: tuple[int, int] | None) -> None:
    path = write(tmp_path / "a.exr", noise(512, 128), compression="none", tile_px=tile_px)
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
    path = write(tmp_path / "a.exr", noise(10, 12))
    with pytest.raises(StimulusError, match=r"a\.exr.*12 × 10 px and holds no") as raised:
        read_views(path, region)
    assert len(raised.value.findings) == 1


def test_views_stored_in_different_windows_have_one_region(tmp_path: Path) -> None:
    path = tmp_path / "a.exr"
    specs, left, right = [], noise(20, 30, 3), noise(21, 30, 3)
    for view, height in (("left", 20), ("right", 21)):
        spec = oiio.ImageSpec(30, height, 3, "float")
        spec.attribute("view", view)
        spec.full_width, spec.full_height = 30, 21
        specs.append(spec)
    output = oiio.ImageOutput.create(str(path))
    assert output is not None
    assert output.open(str(path), specs)
    assert output.write_image(left)
    assert output.open(str(path), specs[1], "AppendSubimage")
    assert output.write_image(right)
    assert output.close()
    image = read_exr(path, "xyz", region=Region(3, 16, 10, 5))
    np.testing.assert_array_equal(image.left, np.vstack([left[16:, 3:13], np.zeros((1, 10, 3))]))
    np.testing.assert_array_equal(image.right, right[16:, 3:13])
