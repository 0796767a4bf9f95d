"""The colour pass of one eye where crosstalk is cancelled or the panel evened out: both views in XYZ to its codes."""

from __future__ import annotations

import moderngl
import numpy as np

from devices.compensation import Correction, PixelGrid, channel_crosstalk, squeezed_size
from devices.display import DisplayModel, Eye, EyeModels, GainMap
from documents.arrays import Floats
from runner.presenter.arithmetic import Real3x3, Reals
from runner.presenter.bands import InBands, to_the_end
from runner.presenter.code_pass import CodePass
from runner.presenter.colour_pass import channel_interaction
from runner.presenter.depth import Bits, CodeFormat
from runner.presenter.dithering import Dithering
from runner.presenter.shaders import Uniform

COST = 1  # plain colour passes more, about; see benchmarks/passes.py
INVERSIONS = 3
CORNER = PixelGrid((0.5, 0.5), (1, 1))  # the picture's corner is the panel's


class CompensatedPass:
    """The pass of ``eye``. Squeezing, dithering and bits are as in `ColourPass`.

    XYZ is averaged first where the signal is squeezed. Then follow, in `Arithmetic`, the steps of
    `devices.compensation.crosstalk_cancel.cancel_crosstalk`, then `devices.display.gain_map.GainMap.corrected`,
    then the codes.
    """

    def __init__(
        self,
        context: moderngl.Context,
        models: EyeModels,
        correction: Correction,
        eye: Eye,
        squeeze: tuple[int, int] = (1, 1),
        dithering: Dithering | None = None,
        bits: Bits = 8,
    ) -> None:
        self._squeeze = squeeze
        self._gain_map = correction.gain_map
        self._context = context
        gains = np.ones((1, 1)) if correction.gain_map is None else correction.gain_map.gains
        self._gains = _texture(context, gains[..., np.newaxis])
        models = models.normalised
        own, other = models.eye(eye), models.eye("right" if eye == "left" else "left")
        interaction = channel_interaction(own, other)
        # Where crosstalk is cancelled, channels are undone for both eyes, and again for what is clipped.
        self._cost = interaction.cost * (INVERSIONS if correction.crosstalk and interaction.files else 1) + COST
        self._pass = CodePass(
            context,
            "compensated_pass.frag",
            own.curves,
            ["own_XYZ", "other_XYZ", "gains", "reading_steps"],
            {
                "box": squeeze,
                "own_linear_from_XYZ": Real3x3(own.linear_from_XYZ),
                "dark_light": _dark_light(own),
                **_cancelling(models, correction, eye),
                **_evening(own, correction.gain_map),
                **interaction.uniforms,
            },
            dithering,
            eye,
            bits,
            [*interaction.files, "plvc_within.glsl" if interaction.files else "within.glsl", "mean_xyz.glsl"],
            interaction.tables,
        )

    def run(
        self,
        own_XYZ: moderngl.Texture,
        other_XYZ: moderngl.Texture,
        grid: PixelGrid = CORNER,
        dtype: CodeFormat | None = None,
    ) -> moderngl.Framebuffer:
        """Return a new framebuffer of the eye's codes, in formats as `ColourPass.run`; bottom row first.

        The two views have one size, and may be one texture. ``grid`` is where the codes stand on the panel; without
        a gain map it does not matter.

        Raises
        ------
        PresentationError
            If codes dithered to other levels than those of 8 or 10 bits are to be held in so many.
        """
        return to_the_end(self.running(own_XYZ, other_XYZ, grid, dtype))

    def running(
        self,
        own_XYZ: moderngl.Texture,
        other_XYZ: moderngl.Texture,
        grid: PixelGrid = CORNER,
        dtype: CodeFormat | None = None,
        band_px: int | None = None,
    ) -> InBands[moderngl.Framebuffer]:
        """Do as `run`, in bands that cost what ``band_px`` pixels of the picture cost in the plain colour pass."""
        across, down = self._squeeze
        band_codes = None if band_px is None else max(1, band_px // (self._cost * across * down))
        size_px = squeezed_size(own_XYZ.size, self._squeeze)
        # A texture, because bands of another picture may be drawn between two of this one: a uniform would be theirs.
        steps = _texture(self._context, _reading_steps(self._gain_map, grid))
        try:
            return (yield from self._pass.drawing([own_XYZ, other_XYZ, self._gains, steps], size_px, dtype, band_codes))
        finally:
            steps.release()

    def release(self) -> None:
        """Free the program and its tables."""
        self._pass.release()
        self._gains.release()


def _cancelling(models: EyeModels, correction: Correction, eye: Eye) -> dict[str, Uniform]:
    """Return the uniforms that take off what leaks from the other eye."""
    other = models.right if eye == "left" else models.left
    mix = channel_crosstalk(models, correction.crosstalk) if correction.crosstalk else None
    leak = np.zeros((3, 3)) if mix is None else mix.left if eye == "left" else mix.right
    unmixing = np.eye(6) if mix is None else mix.unmixing
    # Rows of what is sent to the other eye, columns of what each eye should see.
    rows = unmixing[3:] if eye == "left" else unmixing[:3]
    from_left, from_right = rows[:, :3], rows[:, 3:]
    from_own, from_other = (from_left, from_right) if eye == "left" else (from_right, from_left)
    return {
        "cancels": int(mix is not None),
        "lift_share": Reals(np.full(3, correction.lift_share)),
        "other_linear_from_XYZ": Real3x3(other.linear_from_XYZ),
        "other_dark_light": _dark_light(other),
        "other_from_own": Real3x3(from_own),
        "other_from_other": Real3x3(from_other),
        "leak": Real3x3(leak),
    }


def _dark_light(model: DisplayModel) -> Reals:
    """Return black and the room's light in units of the primaries."""
    return Reals(model.linear_from_XYZ @ model.dark_XYZ_cd_m2)


def _evening(own: DisplayModel, gain_map: GainMap | None) -> dict[str, Uniform]:
    """Return the uniforms that even the panel out, apart from where the picture stands."""
    return {
        "evens": int(gain_map is not None),
        "black_light": Reals(own.linear_from_XYZ @ own.black_XYZ_cd_m2),
        "delivered_share": Reals(np.array(1.0 if gain_map is None else gain_map.delivered_share)),
    }


def _reading_steps(gain_map: GainMap | None, grid: PixelGrid) -> Floats:
    """Return between which readings codes stand, as `GainMap.gain` finds it: of the top left one, and from one to the
    next; shape (1, 2, 2), the last axis across and down.
    """
    if gain_map is None:
        return np.zeros((1, 2, 2))
    rows, columns = gain_map.luminance.shape
    cells = gain_map.positions == "cells"
    per_px = (np.array([columns, rows]) - (0 if cells else 1)) / np.array(gain_map.resolution_px)
    first = np.array(grid.first_px) * per_px - (0.5 if cells else 0.0)
    return np.stack([first, np.array(grid.step_px) * per_px])[np.newaxis]


def _texture(context: moderngl.Context, numbers: Floats) -> moderngl.Texture:
    """Return a texture of ``numbers``, (rows, columns, components), each as two floats that add up to 48 bits of it."""
    high = numbers.astype(np.float32)
    parts = np.concatenate([high, (numbers - high).astype(np.float32)], axis=-1)
    rows, columns, components = parts.shape
    texture = context.texture((columns, rows), components, parts.tobytes(), dtype="f4")
    texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
    return texture
