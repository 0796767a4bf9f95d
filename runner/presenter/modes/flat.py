"""Flat: both eyes see the whole surface."""

from __future__ import annotations

from typing import ClassVar

from runner.presenter.modes.mode import EyeArea, Mode
from runner.presenter.rectangle import Rectangle, Size


class Flat(Mode):
    """One area for both eyes. It shows flat pictures only: a picture of two views has no place in it."""

    name: ClassVar[str] = "flat"
    needs_stereo: ClassVar[bool] = False

    def unavailable(self, size_px: Size, *, stereo: bool, windows: int = 1) -> str | None:
        """Return None: every surface can."""
        return None

    def areas(self, size_px: Size, position_px: tuple[int, int] = (0, 0)) -> tuple[EyeArea, ...]:
        """Return the whole surface, for both eyes."""
        return (EyeArea(("left", "right"), Rectangle(0, 0, *size_px)),)
