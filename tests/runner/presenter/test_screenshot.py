"""Codes in PNG files: 8 bits as they are, 10 bits in the upper bits of 16."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from runner.presenter import Codes, PresentationError
from runner.presenter.screenshot import sixteen_bits, write_screenshot


def read_16_bits(file: Path) -> NDArray[np.uint16]:
    import OpenImageIO as oiio

    image = oiio.ImageBuf(str(file))
    assert image.spec().format == oiio.UINT16
    return np.asarray(image.get_pixels(oiio.UINT16))


def chunks(file: Path) -> list[bytes]:
    data, place, found = file.read_bytes(), 8, []
    while place < len(data):
        (length,) = struct.unpack(">I", data[place : place + 4])
        found.append(data[place + 4 : place + 8])
        place += 12 + length
    return found


def test_ten_bits_are_the_upper_ten_of_sixteen(tmp_path: Path) -> None:
    codes = np.random.default_rng(0).permutation(np.arange(1024 * 3) % 1024).reshape(32, 32, 3).astype(np.uint16)
    assert write_screenshot({"screen": codes}, tmp_path / "shown.png") == [tmp_path / "shown.png"]
    values = read_16_bits(tmp_path / "shown.png")
    np.testing.assert_array_equal(values >> 6, codes)
    # Full drive is full scale, and none is a step of 16 bits away from its share of it.
    assert values.max() == 65535
    assert np.abs(values - codes / 1023 * 65535).max() <= 1.0
    assert list(tmp_path.iterdir()) == [tmp_path / "shown.png"]


@pytest.mark.parametrize("codes", [np.full((4, 5, 3), 200, np.uint8), np.full((4, 5, 3), 200, np.uint16)])
def test_no_colour_space_is_claimed(tmp_path: Path, codes: Codes) -> None:
    write_screenshot({"left": codes, "right": codes}, tmp_path / "shown.png")
    for name in ("left", "right"):
        found = chunks(tmp_path / f"shown.{name}.png")
        assert found[0] == b"IHDR"
        assert not {b"sRGB", b"gAMA", b"cHRM", b"iCCP", b"cICP"} & set(found)


def test_eight_bits_are_the_codes(tmp_path: Path) -> None:
    codes = np.arange(256 * 3).reshape(16, 16, 3).astype(np.uint8)
    write_screenshot({"screen": codes}, tmp_path / "shown.png")
    with Image.open(tmp_path / "shown.png") as image:
        assert image.mode == "RGB"
        np.testing.assert_array_equal(np.asarray(image), codes)


def test_the_ends_of_the_scale() -> None:
    assert sixteen_bits(np.array([0, 1, 1023], np.uint16)).tolist() == [0, 64, 65535]


def test_a_place_that_cannot_be_written_to_is_refused(tmp_path: Path) -> None:
    with pytest.raises(PresentationError, match="no such folder"):
        write_screenshot({"screen": np.zeros((2, 2, 3), np.uint16)}, tmp_path / "absent" / "shown.png")
