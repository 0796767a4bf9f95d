"""The colour pass: a picture in XYZ to device codes, on the graphics card, once per picture and display model."""

from __future__ import annotations

import moderngl

from devices.display.display_file import Eye
from devices.display.model import DisplayModel
from runner.presenter.bands import InBands, to_the_end
from runner.presenter.code_pass import CodePass, by_columns, release_codes
from runner.presenter.depth import Bits, CodeFormat
from runner.presenter.dithering import Dithering
from runner.presenter.placing import squeezed_size
from runner.presenter.undoing import undoing

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
        undone = undoing(model)
        self._cost = undone.cost
        self._pass = CodePass(
            context,
            "colour_pass.frag",
            model.curves,
            ["picture_XYZ"],
            {
                "linear_from_XYZ": by_columns(model.linear_from_XYZ),
                "black_XYZ": tuple(model.black_XYZ_cd_m2.tolist()),
                "box": squeeze,
                **undone.uniforms,
            },
            dithering,
            eye,
            bits,
            undone.files,
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
