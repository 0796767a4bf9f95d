"""The whole path in colours: asked XYZ, shader, 8-bit codes read back, forward model, ΔE00."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from devices.colour import delta_e_2000, xyz_to_lab
from devices.display_file import read_display
from runner.presenter.presenter import Presenter
from runner.presenter.scene import Picture, Scene
from stimuli.stereo_image import StereoImage

ASUS = Path(__file__).parents[3] / "configs/displays/asus_vg248qe.yaml"


@pytest.mark.parametrize("mode", ["side-by-side", "top-bottom", "row-interleaved", "checkerboard"])
def test_eight_bits_cost_what_rounding_costs(make_presenter: Callable[..., Presenter], mode: str) -> None:
    """The thesis's display, colours all over its gamut: mean ΔE00 at most 0.15, 95 % at most 0.35."""
    models = read_display(ASUS).models("side-by-side")
    rng = np.random.default_rng(7)
    # Codes away from the ends of the curves, which Table 3.6's two-digit gains let reach 0.98 to 1.08 of the light.
    codes = rng.uniform(0.02, 0.93, (200, 300, 3))
    asked = models.left.xyz(codes).astype(np.float32)
    presenter = make_presenter({"a": StereoImage.flat(asked)}, mode, models)
    presenter.show(Scene((Picture("a"),)))
    view = presenter.eye_view("left")
    (area,) = (area for area in presenter.areas if "left" in area.eyes)
    top, left = (area.rectangle.height - 200) // 2, (area.rectangle.width - 300) // 2
    shown = models.left.xyz(view[top : top + 200, left : left + 300] / 255)
    rows, columns = np.mgrid[0:200, 0:300]
    mine = np.ones((200, 300), dtype=bool)
    if mode == "row-interleaved":
        mine = (rows + top) % 2 == 0
    elif mode == "checkerboard":
        mine = (rows + top + columns + left) % 2 == 0
    white = models.left.white_XYZ_cd_m2
    difference = delta_e_2000(xyz_to_lab(asked[mine], white), xyz_to_lab(shown[mine], white))
    assert difference.mean() <= 0.15
    assert np.percentile(difference, 95) <= 0.35
    # Rounding cannot be avoided: were there none, the framebuffer would not be what was read.
    assert difference.mean() > 0.02
