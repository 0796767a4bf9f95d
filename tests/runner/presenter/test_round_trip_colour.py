"""The whole path in colours: asked XYZ, shader, 8-bit codes read back, forward model, ΔE00; per mode and eye."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from devices.colour import delta_e_2000, xyz_to_lab
from devices.display import EYES, read_display
from documents.arrays import Floats
from runner import Picture, Scene
from runner.presenter import MODES, Dithering, EyeArea, PresentationError, Presenter, open_surface
from stimuli.pictures import StereoImage
from tests.runner.families import by_family

ASUS = Path(__file__).parents[3] / "configs/displays/asus_vg248qe.yaml"
MODELS = read_display(ASUS).models("side-by-side")
SIZE_PX = (320, 240)
DITHERED_SIZE_PX = (640, 480)
PERIOD_PX = 64  # of the dither masks
# Each eye has pixels of its own, or both see all; an anaglyph's colours are those of its mixture (test_anaglyph.py).
NAMES = [name for name in MODES if name != "quad-buffered" and not name.startswith("anaglyph")]


def _view(area: EyeArea, seed: int, patch_px: int) -> NDArray[np.float32]:
    """Colours all over the gamut, each in a patch of the signal's pixels."""
    width, height = area.view_px
    # Codes away from the ends of the curves, which Table 3.6's two-digit gains let reach 0.98 to 1.08 of the light.
    codes = np.random.default_rng(seed).uniform(0.02, 0.93, (height, width, 3))
    across, down = (patch_px * pixels for pixels in area.squeeze)
    XYZ = MODELS.left.xyz(codes[: -(-height // down), : -(-width // across)]).astype(np.float32)
    return XYZ.repeat(down, 0).repeat(across, 1)[:height, :width]


def _shown(
    name: str, size_px: tuple[int, int], patch_px: int, dithering: Dithering | None
) -> list[tuple[Floats, Floats, NDArray[np.bool_]]]:
    """For each eye: what was asked of each of the signal's pixels, what its codes show, and which of them it sees."""
    mode = MODES[name]
    areas = mode.areas(size_px)
    left = _view(areas[0], 7, patch_px)
    image = StereoImage.flat(left) if len(areas) == 1 else StereoImage(left, _view(areas[-1], 8, patch_px))
    try:
        surface = open_surface("egl", size_px, windows=mode.windows)
    except PresentationError as error:
        pytest.skip(str(error))
    found = []
    with surface, Presenter(surface, mode, MODELS, lambda _: image, dithering=dithering) as presenter:
        presenter.show(Scene((Picture("a"),)))
        for eye in EYES:
            (area,) = (area for area in presenter.areas if eye in area.eyes)
            shown = MODELS.left.xyz(presenter.eye_view(eye) / 255)
            asked = image.eye(eye)[:: area.squeeze[1], :: area.squeeze[0]]
            mine = np.ones(shown.shape[:2], dtype=bool) if area.weave is None else area.weave.mask(*shown.shape[:2])
            found.append((asked.astype(np.float64), shown, mine))
    return found


def _difference(asked: Floats, shown: Floats) -> Floats:
    white = MODELS.left.white_XYZ_cd_m2
    return delta_e_2000(xyz_to_lab(asked, white), xyz_to_lab(shown, white))


@pytest.mark.promise("framebuffer")
@pytest.mark.parametrize("name", by_family(NAMES))
def test_eight_bits_cost_what_rounding_costs(name: str) -> None:
    """The thesis's display: mean ΔE00 at most 0.15, 95 % at most 0.35, for either eye."""
    for asked, shown, mine in _shown(name, SIZE_PX, 1, None):
        difference = _difference(asked[mine], shown[mine])
        assert len(difference) >= SIZE_PX[0] * SIZE_PX[1] / 4
        assert difference.mean() <= 0.15
        assert np.percentile(difference, 95) <= 0.35
        # Rounding cannot be avoided: were there none, the framebuffer would not be what was read.
        assert difference.mean() > 0.02


@pytest.mark.parametrize("name", by_family(NAMES))
def test_dithered_codes_show_the_mean_colour_over_a_period_of_the_mask(name: str) -> None:
    """Patches of one period: ΔE00 of their mean light at most 0.05, of those pixels that the eye sees."""
    patches = 0
    for asked, shown, mine in _shown(name, DITHERED_SIZE_PX, PERIOD_PX, Dithering()):
        wanted, means = [], []
        for top in range(0, shown.shape[0] - PERIOD_PX + 1, PERIOD_PX):
            for left in range(0, shown.shape[1] - PERIOD_PX + 1, PERIOD_PX):
                patch = slice(top, top + PERIOD_PX), slice(left, left + PERIOD_PX)
                seen = shown[patch][mine[patch]]
                assert (seen != seen[0]).any()
                wanted.append(asked[top, left])
                means.append(seen.mean(axis=0))
        assert (_difference(np.array(wanted), np.array(means)) <= 0.05).all()
        patches += len(means)
    assert patches >= 2 * 15
