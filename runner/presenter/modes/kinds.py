"""The stereo modes: which pixels each eye sees, or how both eyes' views make one picture."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

from devices.compensation import Filter, Mixture, Rectangle, Size, channel_split, least_squares
from devices.display import EYES, Eye, EyeModels
from devices.errors import DeviceError
from runner.presenter.errors import PresentationError
from runner.presenter.modes.mode import EyeArea, Mode, SeenThrough, Weave
from runner.presenter.modes.options import Filters, refuse_options
from runner.presenter.surfaces.surface import Buffer


class Flat(Mode):
    """One area for both eyes. It shows flat pictures only: a picture of two views has no place in it."""

    name: ClassVar[str] = "flat"

    def areas(self, size_px: Size, position_px: tuple[int, int] = (0, 0)) -> tuple[EyeArea, ...]:
        """Return the whole surface, for both eyes."""
        return (EyeArea(Rectangle(0, 0, *size_px), eyes=("left", "right")),)


@dataclass(frozen=True)
class SideBySide(Mode):
    """Two halves of equal size; of an odd width, the column in the middle stays black.

    ``squeeze`` is how many columns and rows of a view share one of the signal, where the display stretches the halves.
    """

    name: str = "side-by-side"
    squeeze: tuple[int, int] = (1, 1)

    def unavailable(self, size_px: Size, *, stereo: bool, windows: int = 1) -> str | None:
        """Refuse a surface too narrow to halve."""
        return None if size_px[0] >= 2 else f"a surface {size_px[0]} px wide has no two halves"

    def areas(self, size_px: Size, position_px: tuple[int, int] = (0, 0)) -> tuple[EyeArea, ...]:
        """Return the left half and the right half."""
        width, height = size_px
        half = width // 2
        return (
            EyeArea(Rectangle(0, 0, half, height), self.squeeze, eyes=("left",)),
            EyeArea(Rectangle(width - half, 0, half, height), self.squeeze, eyes=("right",)),
        )


@dataclass(frozen=True)
class TopBottom(Mode):
    """Two halves of equal size; of an odd height, the row in the middle stays black; ``squeeze`` as side by side."""

    name: str = "top-bottom"
    squeeze: tuple[int, int] = (1, 1)

    def unavailable(self, size_px: Size, *, stereo: bool, windows: int = 1) -> str | None:
        """Refuse a surface too low to halve."""
        return None if size_px[1] >= 2 else f"a surface {size_px[1]} px high has no two halves"

    def areas(self, size_px: Size, position_px: tuple[int, int] = (0, 0)) -> tuple[EyeArea, ...]:
        """Return the upper half and the lower half."""
        width, height = size_px
        half = height // 2
        return (
            EyeArea(Rectangle(0, 0, width, half), self.squeeze, eyes=("left",)),
            EyeArea(Rectangle(0, height - half, width, half), self.squeeze, eyes=("right",)),
        )


_EVEN_ROWS = Weave(0, 1)


@dataclass(frozen=True)
class Interleaved(Mode):
    """The eyes share the surface pixel by pixel; ``left`` are the left eye's pixels of the panel.

    The panel's optics decide which eye sees which pixel, so parity counts from the panel's first pixel, not the
    window's: the left eye has even rows, even columns, or the squares whose row and column add to an even number.
    Neither view is filtered: an eye sees every second row, column or square of its picture at 1:1.
    """

    name: str = "row-interleaved"
    left: Weave = _EVEN_ROWS

    def unavailable(self, size_px: Size, *, stereo: bool, windows: int = 1) -> str | None:
        """Refuse a surface that has not a pixel for each eye."""
        width, height = size_px
        across, down = self.left.column_step, self.left.row_step
        enough = (across and width >= 2) or (down and height >= 2)
        return None if enough else f"a surface of {width} × {height} px has not a pixel for each eye"

    def areas(self, size_px: Size, position_px: tuple[int, int] = (0, 0)) -> tuple[EyeArea, ...]:
        """Return the whole surface for each eye, with the pixels of it that are that eye's."""
        whole = Rectangle(0, 0, *size_px)
        left = self.left.seen_from(position_px)
        return EyeArea(whole, eyes=("left",), weave=left), EyeArea(whole, eyes=("right",), weave=left.other())


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
        return EyeArea(whole, eyes=("left",), buffer=Buffer.BACK_LEFT), EyeArea(
            whole, eyes=("right",), buffer=Buffer.BACK_RIGHT
        )


class FrameSequential(Mode):
    """The whole surface for each eye, the left eye's frame first and then in turn.

    A still scene is drawn again for every refresh, because only the program alternates; a frame that comes late leaves
    one eye's picture on for both, so such frames are counted. Glasses must know which eye a frame is for: by a sync
    line or a photodiode on the screen.
    """

    name: ClassVar[str] = "frame-sequential"

    def areas(self, size_px: Size, position_px: tuple[int, int] = (0, 0)) -> tuple[EyeArea, ...]:
        """Return the whole surface for each eye in its turn."""
        whole = Rectangle(0, 0, *size_px)
        return EyeArea(whole, eyes=("left",), turn=0), EyeArea(whole, eyes=("right",), turn=1)


class DualWindow(Mode):
    """The left eye's window and the right eye's, each whole: two projectors, two panels, a haploscope."""

    name: ClassVar[str] = "dual-window"
    windows: ClassVar[int] = 2

    def unavailable(self, size_px: Size, *, stereo: bool, windows: int = 1) -> str | None:
        """Refuse a surface of one window."""
        return None if windows == 2 else "this surface is one window, and each eye needs its own"

    def areas(self, size_px: Size, position_px: tuple[int, int] = (0, 0)) -> tuple[EyeArea, ...]:
        """Return each eye's window."""
        whole = Rectangle(0, 0, *size_px)
        return EyeArea(whole, eyes=("left",), buffer=Buffer.BACK_LEFT), EyeArea(
            whole, eyes=("right",), buffer=Buffer.BACK_RIGHT
        )


@dataclass(frozen=True)
class Anaglyph(Mode):
    """The whole surface for both eyes.

    The views are mixed by least squares (see `mixture`), or, on request, each channel is one eye's alone. With one
    characterisation for both eyes, measured without the filters, the shares of light that the filters pass are
    ``left_passes`` and ``right_passes``, unless the rig says better; measured through each filter, it needs none.
    """

    name: str = "anaglyph-red-cyan"
    left_channels: tuple[bool, bool, bool] = (True, False, False)
    # Shares of red, green and blue light. Round figures of what gel filters pass, not measurements of any.
    left_passes: tuple[float, float, float] = (0.90, 0.05, 0.02)
    right_passes: tuple[float, float, float] = (0.03, 0.75, 0.80)
    filters: Filters | None = None

    def areas(self, size_px: Size, position_px: tuple[int, int] = (0, 0)) -> tuple[EyeArea, ...]:
        """Return the whole surface, for both eyes."""
        return (EyeArea(Rectangle(0, 0, *size_px), eyes=("left", "right")),)

    def with_filters(self, filters: Filters) -> Mode:
        """Return the mode with ``filters``."""
        return replace(self, filters=filters)

    def mixture(self, models: EyeModels) -> Mixture:
        """Return how the two views make one.

        Raises
        ------
        PresentationError
            If filters are given though the characterisation was measured through them, or cannot make white.
        """
        filters = self.filters or Filters()
        per_eye = models.left is not models.right
        if per_eye and (filters.left is not None or filters.right is not None):
            why = "was characterised per eye, through its filters, and is given filters besides"
            raise refuse_options(self.name, why, "leave 'left_filter' and 'right_filter' out")
        through = self.seen_through(models)
        if filters.split_channels:
            return channel_split(models, self.left_channels, through.left, through.right)
        try:
            return least_squares(models, through.left, through.right)
        except DeviceError as error:
            finding = error.findings[0]
            raise PresentationError(f"the mode '{self.name}' cannot be shown: {finding}") from error

    def seen_through(self, models: EyeModels) -> SeenThrough:
        """Return the filters: measured with the display, as the rig states them, or the mode's round figures."""
        if models.left is not models.right:
            return SeenThrough(None, None)
        stated = self.filters or Filters()
        given: dict[Eye, Filter | None] = {"left": stated.left, "right": stated.right}
        assumed = tuple(eye for eye in EYES if given[eye] is None)
        return SeenThrough(stated.left or self.left_passes, stated.right or self.right_passes, assumed)
