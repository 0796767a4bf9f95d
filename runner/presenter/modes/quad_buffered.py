"""Quad-buffered: a back buffer for each eye, which the driver shows in turn through shutter glasses."""

from __future__ import annotations

from typing import ClassVar

from runner.presenter.modes.mode import EyeArea, Mode
from runner.presenter.rectangle import Rectangle, Size
from runner.presenter.surfaces.surface import Buffer


class QuadBuffered(Mode):
    """The whole surface for each eye, drawn to GL_BACK_LEFT and GL_BACK_RIGHT."""

    name: ClassVar[str] = "quad-buffered"
    needs_stereo: ClassVar[bool] = True

    def unavailable(self, size_px: Size, *, stereo: bool, windows: int = 1) -> str | None:
        """Refuse a surface without a right back buffer."""
        return None if stereo else "the driver gives this surface no right back buffer (GL_STEREO is false)"

    def areas(self, size_px: Size, position_px: tuple[int, int] = (0, 0)) -> tuple[EyeArea, ...]:
        """Return each eye's back buffer."""
        whole = Rectangle(0, 0, *size_px)
        return EyeArea(("left",), whole, Buffer.BACK_LEFT), EyeArea(("right",), whole, Buffer.BACK_RIGHT)
