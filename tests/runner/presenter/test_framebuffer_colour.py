"""What reaches the framebuffer against the float64 reference, on every surface and in every mode that it has."""

from __future__ import annotations

import struct
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from devices.display import EyeModels
from runner import Picture, Scene
from runner.presenter import Codes, PresentationError, Presenter, Surface, find_mode
from runner.presenter.screenshot import write_screenshot
from stimuli.pictures import StereoImage
from tests.runner.presenter.conftest import BACKENDS, AskedRamps, on_surfaces

DISPLAYS: dict[str, dict[str, float]] = {
    "gamma 1.6": {"gamma": 1.6},
    "gamma 2.2, black": {"gamma": 2.2, "black": 0.05},
    "gamma 2.4, black, lift": {"gamma": 2.4, "black": 0.05, "lift": 0.003},
    "gamma 2.8, black, lift, offset": {"gamma": 2.8, "black": 0.3, "lift": 0.01, "offset": -0.05},
    "gamma 2.8": {"gamma": 2.8},
}


IN_GAMUT_ROWS = slice(300, 360)  # random codes; the ramps dwell at black, and halfway codes all round one way


def assert_rounded(codes: Codes, reference: NDArray[np.float64]) -> None:
    """Every code within 0.501 of the reference, and the random ones no more than chance to either side."""
    assert codes.dtype == np.uint8
    error = codes - reference
    assert np.abs(error).max() <= 0.501
    assert np.abs(error[IN_GAMUT_ROWS].reshape(-1, 3).mean(axis=0)).max() < 0.02


@pytest.mark.promise("framebuffer")
@pytest.mark.parametrize(
    ("surface", "name"),
    on_surfaces(tuple(DISPLAYS), ("gamma 2.8, black, lift, offset",), BACKENDS),
    indirect=["surface"],
)
def test_every_pixel_is_the_rounded_reference_for_both_eyes(
    surface: Surface, name: str, ramps_on: Callable[..., AskedRamps]
) -> None:
    asked = ramps_on(**DISPLAYS[name])
    left, picture = asked.models.left, asked.picture
    scene = Scene((Picture("ramps"),))
    with Presenter(surface, find_mode("side-by-side"), asked.models, lambda _: picture) as presenter:
        presenter.show(scene)
        assert_rounded(presenter.eye_view("left"), asked.left * 255.0)
        assert_rounded(presenter.eye_view("right"), asked.right * 255.0)
    flat = StereoImage.flat(np.concatenate([picture.left, picture.right], axis=1))
    with Presenter(surface, find_mode("flat"), EyeModels(left, left), lambda _: flat) as presenter:
        presenter.show(scene)
        assert_rounded(presenter.capture()["screen"], np.concatenate([asked.left, asked.right_on_left], axis=1) * 255.0)
        assert presenter.counters.colour_passes == 1


def test_the_facts_say_how_it_was_shown(surface: Surface) -> None:
    facts = surface.facts
    assert facts.size_px == (640, 480)
    assert facts.renderer
    assert facts.gl_version
    assert facts.display_server == ("x11" if facts.backend == "window" else "none")


# Codes in PNG files: 8 bits as they are, 10 bits in the upper bits of 16.


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


def test_a_place_that_cannot_be_written_to_is_refused(tmp_path: Path) -> None:
    with pytest.raises(PresentationError, match="no such folder"):
        write_screenshot({"screen": np.zeros((2, 2, 3), np.uint16)}, tmp_path / "absent" / "shown.png")
