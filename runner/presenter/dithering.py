"""Dithering in a colour pass: which masks and how many codes, and the textures that `dither.glsl` reads.

What it computes, and why, is described in `devices.compensation.dither`, whose `tabled_dither_codes` is the shader's
twin.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, get_args

import numpy as np
from numpy.typing import NDArray

from devices.compensation import LEVELS_8_BITS, Masks, code_lights, load_mask, mask_shifts_px
from devices.display import Curve, Eye
from documents import Finding
from runner.presenter.depth import Bits, highest_code
from runner.presenter.errors import PresentationError

if TYPE_CHECKING:
    import moderngl

# 12 bits. A wider table need not fit into a texture of every driver.
MOST_LEVELS = 4095


@dataclass(frozen=True, slots=True)
class Dithering:
    """How codes are dithered.

    ``masks``: ``shared`` reads the same mask for both eyes, ``independent`` another for each. ``levels`` is the highest
    code, in 1..4095: 255 for 8 bits, 1023 for 10; None is that of the surface or colour pass.

    Raises
    ------
    PresentationError
        If there are no such masks, or levels is out of range.
    """

    masks: Masks = "shared"
    levels: int | None = None

    def __post_init__(self) -> None:
        if self.masks not in get_args(Masks):
            remedy = "choose one of " + ", ".join(f"'{name}'" for name in get_args(Masks))
            raise PresentationError(Finding(f"there are no dither masks '{self.masks}'", remedy=remedy))
        if not 1 <= self.highest_code <= MOST_LEVELS:
            remedy = f"give one in 1..{MOST_LEVELS}: 255 for 8 bits, 1023 for 10"
            raise PresentationError(Finding(f"the highest code to dither to is {self.levels}", remedy=remedy))

    @property
    def highest_code(self) -> int:
        """The code of full drive that is dithered to."""
        return LEVELS_8_BITS if self.levels is None else self.levels

    def on_surface(self, bits: Bits) -> Dithering:
        """Return the dithering to the codes of a surface of ``bits``.

        Raises
        ------
        PresentationError
            If other levels were asked for.
        """
        surface = highest_code(bits)
        if self.levels not in (None, surface):
            raise PresentationError(
                Finding(
                    f"codes dithered to 0..{self.levels} cannot be shown: the surface has {bits} bits, 0..{surface}",
                    remedy="leave the levels out, or open a surface of the bits that have them",
                )
            )
        return replace(self, levels=surface)

    @property
    def differs_by_eye(self) -> bool:
        """Whether the codes of one picture differ between the eyes, although their display models are the same."""
        return self.masks == "independent"

    def shifts_px(self, eye: Eye) -> tuple[tuple[int, int], ...]:
        """Return how far into the mask red, green and blue of ``eye`` start, (x, y) each."""
        return tuple((int(x_px), int(y_px)) for x_px, y_px in mask_shifts_px(eye, self.masks))

    def textures(self, context: moderngl.Context, curves: Sequence[Curve]) -> dict[str, moderngl.Texture]:
        """Return new textures by the names that the shader has for them: the light of the codes, and the mask."""
        lights = light_table(curves, self.highest_code)
        mask = load_mask()
        made = {
            "code_lights": context.texture((lights.shape[1], len(lights)), 1, lights.tobytes(), dtype="f4"),
            "dither_mask": context.texture(mask.shape, 1, mask.tobytes(), alignment=1, dtype="u2"),
        }
        for texture in made.values():
            texture.filter = (context.NEAREST, context.NEAREST)
        return made


def light_table(curves: Sequence[Curve], levels: int) -> NDArray[np.float32]:
    """Return the light of codes 0..levels of each curve, shape (curves, levels + 1): lift taken off, full light 1.

    It is what `devices.compensation.dither.dither_tables` holds of a display model, for curves that belong to none.
    """
    lights = [np.maximum(code_lights(curve, levels) - curve.lift, 0.0) / (1.0 - curve.lift) for curve in curves]
    return np.stack(lights).astype(np.float32)
