"""A stereo mode says which pixels each eye sees; nothing else in the presenter knows which mode it is."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from devices.compensation import Compensation, Correction, EyeView, Filter, Mixture, Rectangle, Size
from devices.display import EYES, Eye, EyeModels
from documents.text import JsonResult
from runner.presenter.modes.options import Filters, refuse_options
from runner.presenter.surfaces.surface import Buffer
from stimuli.pictures import Part, Region


@dataclass(frozen=True, slots=True)
class Weave:
    """The pixels (x, y), from the top left, whose ``column_step`` · x + ``row_step`` · y + ``start`` is even.

    Steps of (0, 1) weave rows, (1, 0) columns, (1, 1) a checkerboard. ``start`` is 0 or 1.
    """

    column_step: int
    row_step: int
    start: int = 0

    def other(self) -> Weave:
        """Return the pixels that are not in this one."""
        return Weave(self.column_step, self.row_step, 1 - self.start)

    def seen_from(self, position_px: tuple[int, int]) -> Weave:
        """Return the same pixels of the panel, counted from its pixel ``position_px``."""
        moved = self.column_step * position_px[0] + self.row_step * position_px[1]
        return Weave(self.column_step, self.row_step, (self.start + moved) % 2)

    def mask(self, height: int, width: int) -> NDArray[np.bool_]:
        """Return which of (height, width) pixels are in it."""
        rows, columns = np.ogrid[:height, :width]
        return np.asarray((self.column_step * columns + self.row_step * rows + self.start) % 2 == 0)


@dataclass(frozen=True, slots=True, kw_only=True)
class EyeArea(EyeView):
    """Pixels of one buffer, and the eyes that see them: one, or both where the two see the same pixels.

    ``weave`` says which of the rectangle's pixels are this eye's, all of them if None. ``turn`` is the frame that it is
    drawn in, where the eyes are shown in turn; ``sync_line`` is the blue part of the row that marks which eye's frame
    it is.
    """

    eyes: tuple[Eye, ...]
    buffer: Buffer = Buffer.BACK
    weave: Weave | None = None
    turn: int = 0
    sync_line: Rectangle | None = None

    @property
    def share(self) -> float:
        """Share of the rectangle's pixels that are this eye's."""
        return 1.0 if self.weave is None else 0.5


@dataclass(frozen=True, slots=True)
class SeenThrough(JsonResult):
    """The filters before the eyes: what each does to light, None where the display was measured through it.

    ``assumed`` are the eyes whose filter neither the rig states nor a measurement holds: round figures are taken.
    """

    left: Filter | None
    right: Filter | None
    assumed: tuple[Eye, ...] = ()

    def swapped(self) -> SeenThrough:
        """Return the filters, each before the other eye."""
        others: dict[Eye, Eye] = {"left": "right", "right": "left"}
        return SeenThrough(self.right, self.left, tuple(others[eye] for eye in self.assumed))


class Mode(Protocol):
    """One way to show two pictures.

    ``name`` is the mode's key in display files; ``needs_stereo`` says whether to ask the surface for a back buffer for
    each eye.
    """

    @property
    def name(self) -> str:
        """The registered name."""

    @property
    def needs_stereo(self) -> bool:
        """Whether it needs a right back buffer."""
        return False

    @property
    def windows(self) -> int:
        """How many windows it needs."""
        return 1

    def unavailable(self, size_px: Size, *, stereo: bool, windows: int = 1) -> str | None:
        """Say why a surface of ``size_px``, with a right back buffer or not, cannot show this mode; None if it can.

        ``windows`` is how many windows the surface has.
        """
        return None

    def areas(self, size_px: Size, position_px: tuple[int, int] = (0, 0)) -> tuple[EyeArea, ...]:
        """Return each eye's area of a surface of ``size_px`` whose top left pixel is the panel's ``position_px``."""

    def patch(self, size_px: Size) -> Rectangle | None:
        """Return the photodiode's square on a surface of ``size_px``, None if there is none."""
        return None

    def mixture(self, models: EyeModels) -> Mixture | None:
        """Return how the views of both eyes make one picture; None where each eye has pixels of its own."""
        return None

    def seen_through(self, models: EyeModels) -> SeenThrough | None:
        """Return the filters that change what the eyes see of one picture; None in a mode without such filters."""
        return None

    def views(self, panel_px: Size) -> dict[Eye, EyeView]:
        """Return where each eye's view lies on a panel of ``panel_px`` that the surface fills."""
        areas = self.areas(panel_px)
        return {eye: next(area for area in areas if eye in area.eyes) for eye in EYES}

    def compensation(self, models: EyeModels, panel_px: Size, correction: Correction) -> Compensation:
        """Return what ``correction`` does to pictures in this mode on a panel of ``panel_px``."""
        return Compensation(models, self.views(panel_px), self.mixture(models), correction)

    def with_filters(self, filters: Filters) -> Mode:
        """Return the mode with ``filters`` before the eyes; raise PresentationError if it has no use for them."""
        raise refuse_options(self.name, "has no filters", "leave the options of filters out")


def visible_part(aperture_px: tuple[int, int], area: EyeArea) -> Part | None:
    """Return which part of a picture is seen through an aperture of ``aperture_px`` (width, height); None for all.

    The part stands where it stood in the whole picture. A picture in the middle of an eye's view begins at
    (view - size) // 2, so that the part depends on the view's size by a pixel. A squeezed view shares pixels between
    columns or rows: there, pictures are read whole.
    """
    if area.squeeze != (1, 1):
        return None

    def part(size_px: tuple[int, int]) -> Region:
        width, height = (min(most, size) for most, size in zip(aperture_px, size_px, strict=True))
        left, top = (
            (view - kept) // 2 - (view - size) // 2
            for view, kept, size in zip(area.view_px, (width, height), size_px, strict=True)
        )
        return Region(left, top, width, height)

    return part
