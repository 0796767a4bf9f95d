"""Where codes stand on the panel: where the presenter draws them, whatever the mode does to them."""

from __future__ import annotations

import numpy as np
import pytest

from devices.display import EYES, Eye
from runner.presenter import ModeOptions, find_mode

PANEL = (640, 480)


@pytest.mark.parametrize("eye", EYES)
@pytest.mark.parametrize("size_px", [(200, 100), (201, 99), (1, 1)])
@pytest.mark.parametrize(
    "options", [{}, {"left_mirror": "horizontal", "right_mirror": "both", "right_offset_px": [3, 5]}]
)
@pytest.mark.parametrize("mode", ["side-by-side", "top-bottom", "quad-buffered", "row-interleaved", "checkerboard"])
def test_unsqueezed_codes_stand_where_their_picture_does(
    mode: str, options: dict[str, object], size_px: tuple[int, int], eye: Eye
) -> None:
    view = find_mode(mode, ModeOptions.parse(options)).views(PANEL)[eye]
    grid = view.code_grid(size_px, (17, -40))
    assert grid == view.pixel_grid(size_px, (17, -40))
    place, _ = view.place(size_px, (17, -40))
    x, y = grid.axes(size_px)
    left, top = place.left + 0.5 + np.arange(size_px[0]), place.top + 0.5 + np.arange(size_px[1])
    assert np.array_equal(x, left[::-1] if view.mirror[0] else left)
    assert np.array_equal(y, top[::-1] if view.mirror[1] else top)


@pytest.mark.parametrize("offset_px", [(0, 0), (6, 0), (7, 0), (-7, 0)])
@pytest.mark.parametrize("width_px", [100, 101, 102])
def test_a_code_of_a_squeezed_signal_stands_amid_the_two_pixels_it_is_stretched_over(
    width_px: int, offset_px: tuple[int, int]
) -> None:
    """Within the pixel by which a signal of half the columns cannot say where an odd place is."""
    mode = find_mode("side-by-side-half")
    codes_px = -(-width_px // 2), 50
    for eye in EYES:
        view = mode.views(PANEL)[eye]
        grid = view.code_grid(codes_px, offset_px)
        x, y = view.pixel_grid((width_px, 50), offset_px).axes((width_px, 50))
        assert grid.step_px == (2, 1)
        assert grid.first_px[0] == int(grid.first_px[0])
        assert abs(grid.first_px[0] - x[:2].mean()) <= 2.0
        assert grid.first_px[1] == y[0]
    assert mode.views(PANEL)["left"].code_grid((50, 50), (0, 0)).first_px[0] == 640 / 2 - 50 + 1
