"""Frame-sequential: the program itself shows the eyes in turn, a frame each, without a stereo driver."""

from __future__ import annotations

from typing import ClassVar

from runner.presenter.modes.mode import EyeArea, Mode
from runner.presenter.rectangle import Rectangle, Size


class FrameSequential(Mode):
    """The whole surface for each eye, the left eye's frame first and then in turn.

    A still scene is drawn again for every refresh, because only the program alternates; a frame that comes late leaves
    one eye's picture on for both, so such frames are counted. Glasses must be told which frame is whose: by a sync line
    or a photodiode on the screen.
    """

    name: ClassVar[str] = "frame-sequential"
    needs_stereo: ClassVar[bool] = False

    def unavailable(self, size_px: Size, *, stereo: bool, windows: int = 1) -> str | None:
        """Return None: every surface can."""
        return None

    def areas(self, size_px: Size, position_px: tuple[int, int] = (0, 0)) -> tuple[EyeArea, ...]:
        """Return the whole surface for each eye in its turn."""
        whole = Rectangle(0, 0, *size_px)
        return EyeArea(("left",), whole, turn=0), EyeArea(("right",), whole, turn=1)
