"""Dual-window: a full-screen window for each eye, on two outputs of the graphics card."""

from __future__ import annotations

from typing import ClassVar

from runner.presenter.modes.mode import EyeArea, Mode
from runner.presenter.rectangle import Rectangle, Size
from runner.presenter.surfaces.surface import Buffer


class DualWindow(Mode):
    """The left eye's window and the right eye's, each whole: two projectors, two panels, a haploscope."""

    name: ClassVar[str] = "dual-window"
    needs_stereo: ClassVar[bool] = False
    windows: ClassVar[int] = 2

    def unavailable(self, size_px: Size, *, stereo: bool, windows: int = 1) -> str | None:
        """Refuse a surface of one window."""
        return None if windows == 2 else "this surface is one window, and each eye needs its own"

    def areas(self, size_px: Size, position_px: tuple[int, int] = (0, 0)) -> tuple[EyeArea, ...]:
        """Return each eye's window."""
        whole = Rectangle(0, 0, *size_px)
        return EyeArea(("left",), whole, Buffer.BACK_LEFT), EyeArea(("right",), whole, Buffer.BACK_RIGHT)
