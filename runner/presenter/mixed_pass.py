"""The colour pass of both views at once: two pictures in XYZ to the codes of one, as a mixture says."""

from __future__ import annotations

import moderngl

from runner.presenter.bands import InBands, to_the_end
from runner.presenter.code_pass import CodePass, by_columns
from runner.presenter.depth import Bits, CodeFormat
from runner.presenter.dithering import Dithering
from runner.presenter.modes.mixture import Mixture


class MixedPass:
    """The colour pass for one mixture, to codes of ``bits``.

    With ``dithering``, codes are dithered. The eyes see different channels of one picture, and each channel has a piece
    of the mask for itself, so that the eyes' grain is unrelated whichever masks are asked for.
    """

    def __init__(
        self, context: moderngl.Context, mixture: Mixture, dithering: Dithering | None = None, bits: Bits = 8
    ) -> None:
        self._pass = CodePass(
            context,
            "mixed_pass.frag",
            mixture.curves,
            ["left_XYZ", "right_XYZ"],
            {
                "linear_from_left": by_columns(mixture.left),
                "linear_from_right": by_columns(mixture.right),
                "left_black": tuple(mixture.left_black_XYZ_cd_m2.tolist()),
                "right_black": tuple(mixture.right_black_XYZ_cd_m2.tolist()),
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
