"""Colour passes: a picture in XYZ to device codes, on the graphics card, once for each picture and display model."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import moderngl
import numpy as np
from numpy.typing import NDArray

from devices.compensation import Mixture, squeezed_size
from devices.display import MIXTURES, MOST_STEPS, NODES, DisplayModel, Eye, Plvc, kernels_at_black
from runner.presenter.arithmetic import Real3x3, Reals
from runner.presenter.bands import InBands, to_the_end
from runner.presenter.code_pass import CodePass, release_codes
from runner.presenter.depth import Bits, CodeFormat
from runner.presenter.dithering import Dithering
from runner.presenter.shaders import Uniform

COST = 9
KNOTS_COST = 5
RESIDUAL_COST = 60


@dataclass(frozen=True, slots=True)
class ChannelInteraction:
    """``files`` stand between encoding and pass, with their ``uniforms``, and ``tables`` of (rows, texels, 4) numbers.

    ``cost``: times the plain colour pass, about; see benchmarks/passes.py.
    """

    files: tuple[str, ...] = ()
    uniforms: Mapping[str, Uniform] = field(default_factory=dict)
    tables: Mapping[str, NDArray[np.float32]] = field(default_factory=dict)
    cost: int = 1


def channel_interaction(own: DisplayModel, other: DisplayModel | None = None) -> ChannelInteraction:
    """Return what undoes how channels act on each other; no files if they do not.

    ``own`` is the model of the eye whose codes are made, ``other`` that of the other eye, where the pass knows of it.
    A model that adds up is one whose channels keep their colour and take nothing from each other.

    Raises
    ------
    DeviceError
        If a model cannot be interaction.
    """
    models = (own, other or own)
    if all(model.additive for model in models):
        return (
            ChannelInteraction(cost=KNOTS_COST) if any(curve.tabled for curve in own.curves) else ChannelInteraction()
        )
    terms = [_terms(model) for model in models]
    uniforms: dict[str, Uniform] = {
        "plvc_powers": Reals(np.concatenate([powers.reshape(-1, 3) for powers, _, _ in terms])),
        "plvc_mixtures": Reals(np.concatenate([mixtures for _, mixtures, _ in terms])),
        "plvc_steps": (terms[0][2], terms[1][2]),
    }
    if not any(isinstance(model, Plvc) and model.residual for model in models):
        return ChannelInteraction(("plvc.glsl", "plvc_alone.glsl"), uniforms, cost=COST)
    tables = {"plvc_residual": _residual_texels(models)}
    return ChannelInteraction(("plvc.glsl", "plvc_residual.glsl"), uniforms, tables, cost=RESIDUAL_COST)


def _residual_texels(models: tuple[DisplayModel, DisplayModel]) -> NDArray[np.float32]:
    """Return what plvc_residual.glsl reads: a row for each model, four texels for each knot, and then for black."""
    most = max(len(model.residual.knots) for model in models if isinstance(model, Plvc) and model.residual)
    texels = np.zeros((len(models), most + 1, 4, 4))
    for row, model in enumerate(models):
        if isinstance(model, Plvc) and (residual := model.residual):
            count = len(residual.knots)
            texels[row, :count, 0, :3] = residual.knots
            texels[row, :count, 2, :3] = model.residual_light
            texels[row, :count, 0, 3] = 1.0 / residual.width
            texels[row, most, 2, :3] = kernels_at_black(residual) @ model.residual_light
    texels[:, :, 1] = texels[:, :, 0] - texels[:, :, 0].astype(np.float32)
    texels[:, :, 3] = texels[:, :, 2] - texels[:, :, 2].astype(np.float32)
    return texels.reshape(len(models), -1, 4).astype(np.float32)


def _terms(model: DisplayModel) -> tuple[NDArray[np.float64], NDArray[np.float64], int]:
    """Return powers (3, 5, 3), mixtures (10, 3) and the steps to undo them."""
    powers, mixtures, steps = np.zeros((3, len(NODES) + 1, 3)), np.zeros((MIXTURES, 3)), 1
    powers[:, 0] = np.eye(3)
    if isinstance(model, Plvc):
        assert model.steps  # refuses what cannot be undone
        powers, mixtures, steps = model.powers, model.mixtures, MOST_STEPS
    return powers, mixtures, steps


__all__ = ["ColourPass", "release_codes"]


class ColourPass:
    """The colour pass for one display model (linear = M⁻¹(XYZ − black), then a table per channel).

    Where the model's channels do not add up, Newton's method undoes that in between; see `devices.display.plvc`.

    ``squeeze`` is how many pixels of the picture, across and down, share one pixel of the codes: their XYZ is averaged.
    With ``dithering``, codes are dithered by the masks of ``eye``; without, they are rounded. Codes have
    ``bits``, 8 or 10.
    """

    def __init__(
        self,
        context: moderngl.Context,
        model: DisplayModel,
        squeeze: tuple[int, int] = (1, 1),
        dithering: Dithering | None = None,
        eye: Eye = "left",
        bits: Bits = 8,
    ) -> None:
        self._squeeze = squeeze
        model = model.normalised
        interaction = channel_interaction(model)
        self._cost = interaction.cost
        self._pass = CodePass(
            context,
            "colour_pass.frag",
            model.curves,
            ["picture_XYZ"],
            {
                "linear_from_XYZ": Real3x3(model.linear_from_XYZ),
                "black_light": Reals(model.linear_from_XYZ @ model.dark_XYZ_cd_m2),
                "box": squeeze,
                **interaction.uniforms,
            },
            dithering,
            eye,
            bits,
            [*interaction.files, "mean_xyz.glsl"],
            interaction.tables,
        )

    def run(self, picture_XYZ: moderngl.Texture, dtype: CodeFormat | None = None) -> moderngl.Framebuffer:
        """Return a new framebuffer of the picture's codes: of the pass's bits, or as ``dtype`` says.

        ``f1`` has codes of 8 bits, ``rgb10_a2`` of 10, ``f4`` as computed.

        Dithered codes are those of `devices.compensation.dither.tabled_dither_codes`, k/levels in ``f4`` too. The
        framebuffer's
        texture has the bottom row first, as windows have, so that a frame can be copied straight from it.

        Raises
        ------
        PresentationError
            If codes dithered to other levels than those of 8 or 10 bits are to be held in so many.
        """
        return to_the_end(self.running(picture_XYZ, dtype))

    def running(
        self, picture_XYZ: moderngl.Texture, dtype: CodeFormat | None = None, band_px: int | None = None
    ) -> InBands[moderngl.Framebuffer]:
        """Do as `run`, in bands of about ``band_px`` pixels of the picture."""
        across, down = self._squeeze
        band_codes = None if band_px is None else max(1, band_px // (self._cost * across * down))
        return self._pass.drawing([picture_XYZ], squeezed_size(picture_XYZ.size, self._squeeze), dtype, band_codes)

    def release(self) -> None:
        """Free the program and its tables."""
        self._pass.release()


class MixedPass:
    """The colour pass for one mixture, to codes of ``bits``.

    With ``dithering``, codes are dithered. The eyes see different channels of one picture, and each channel has a piece
    of the mask for itself, so that the eyes' grain is unrelated whichever masks are asked for.
    """

    def __init__(
        self, context: moderngl.Context, mixture: Mixture, dithering: Dithering | None = None, bits: Bits = 8
    ) -> None:
        mixture = mixture.normalised
        self._pass = CodePass(
            context,
            "mixed_pass.frag",
            mixture.curves,
            ["left_XYZ", "right_XYZ"],
            {
                "linear_from_left": Real3x3(mixture.left),
                "linear_from_right": Real3x3(mixture.right),
                "black_light": Reals(
                    mixture.left @ mixture.left_black_XYZ_cd_m2 + mixture.right @ mixture.right_black_XYZ_cd_m2
                ),
            },
            dithering,
            bits=bits,
        )

    def run(
        self, left_XYZ: moderngl.Texture, right_XYZ: moderngl.Texture, dtype: CodeFormat | None = None
    ) -> moderngl.Framebuffer:
        """Return a new framebuffer of codes of two views of one size, in formats as `ColourPass.run`; bottom row first.

        Raises
        ------
        PresentationError
            If codes dithered to other levels than those of 8 or 10 bits are to be held in so many.
        """
        return to_the_end(self.running(left_XYZ, right_XYZ, dtype))

    def running(
        self,
        left_XYZ: moderngl.Texture,
        right_XYZ: moderngl.Texture,
        dtype: CodeFormat | None = None,
        band_px: int | None = None,
    ) -> InBands[moderngl.Framebuffer]:
        """Do as `run`, in bands of about ``band_px`` pixels of the picture."""
        return self._pass.drawing([left_XYZ, right_XYZ], left_XYZ.size, dtype, band_px)

    def release(self) -> None:
        """Free the program and its tables."""
        self._pass.release()
