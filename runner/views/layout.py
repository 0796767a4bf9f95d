"""Where pictures and words stand in a trial: from millimetres on the screen to pixels in each eye's view.

A picture is shown through its aperture; the rest of a larger picture is not read, uploaded or shaded.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from devices.display import PanelSpec
from documents import Finding
from documents.yaml import FileModel, NotNegative, Positive
from runner.errors import SessionError
from runner.scene import Offset, Picture
from runner.views.field_types import Line
from runner.views.style import Style


class LayoutError(SessionError):
    """The experiment's layout does not fit an eye's view, or cannot be seen."""


NO_REFERENCE, PHYSICAL = "none", "physical"
SIZES_DIFFER = 1.05  # from a twentieth in length on, size goes with content


def size_ratio(sizes_px: Sequence[tuple[int, int]]) -> float:
    """Return how many times the largest of some pictures is as long as the smallest: the root of the areas' ratio."""
    areas = [width * height for width, height in sizes_px]
    return math.sqrt(max(areas) / min(areas))


class LayoutSpec(FileModel):
    """How a trial looks: ``size_mm`` is each picture's aperture (width, height) on the screen.

    ``reference`` is what pictures are judged against: ``none``, ``physical`` for a real thing beside the screen, or the
    name of a stimulus that is shown too.
    """

    arrangement: Literal["vertical", "horizontal"]
    """Whether two pictures stand one above the other or side by side."""
    size_mm: tuple[Positive, Positive]
    """Width and height of each picture on the screen, in mm."""
    gap_mm: NotNegative = 10.0
    """The gap between two pictures, in mm."""
    reference: Line = NO_REFERENCE
    """What pictures are compared with: none, physical for a real thing, or a stimulus shown too."""


@dataclass(frozen=True, slots=True)
class PairLayout:
    """Where two pictures and the question stand, and a reference picture if there is one."""

    arrangement: Literal["vertical", "horizontal"]
    first_px: Offset
    second_px: Offset
    aperture_px: tuple[int, int]
    question_px: Offset
    question_width_px: int
    reference_px: Offset | None = None

    @property
    def keys(self) -> dict[str, str]:
        """The arrow keys that choose the first and the second picture."""
        vertical = self.arrangement == "vertical"
        return {"up": "first", "down": "second"} if vertical else {"left": "first", "right": "second"}

    @property
    def position_names(self) -> tuple[str, str]:
        """What the first and the second place are called in the record."""
        return ("top", "bottom") if self.arrangement == "vertical" else ("left", "right")

    @property
    def places_px(self) -> tuple[Offset, ...]:
        """Where pictures are shown."""
        places = (self.first_px, self.second_px)
        return places if self.reference_px is None else (*places, self.reference_px)

    def reference(self, stimulus: str | None) -> tuple[Picture, ...]:
        """Return the reference picture in its place, or nothing."""
        if stimulus is None or self.reference_px is None:
            return ()
        return (Picture(stimulus, self.reference_px, self.aperture_px),)


@dataclass(frozen=True, slots=True)
class SingleLayout:
    """Where one picture and the words above it stand; ``below_px`` is the first free row under it."""

    picture_px: Offset
    aperture_px: tuple[int, int]
    question_px: Offset
    question_width_px: int
    below_px: int
    reference_px: Offset | None = None

    @property
    def places_px(self) -> tuple[Offset, ...]:
        """Where pictures are shown."""
        return (self.picture_px,) if self.reference_px is None else (self.picture_px, self.reference_px)

    def reference(self, stimulus: str | None) -> tuple[Picture, ...]:
        """Return the reference picture in its place, or nothing."""
        if stimulus is None or self.reference_px is None:
            return ()
        return (Picture(stimulus, self.reference_px, self.aperture_px),)


_QUESTION_BAND = 80.0  # units of Style
_ANSWER_BAND = 200.0
_LARGEST_PX = 1_000_000


def aperture_px(layout: LayoutSpec, panel: PanelSpec) -> tuple[int, int]:
    """Return the size (width, height) of what is shown of each picture."""
    width, height = (_px(size, panel) for size in layout.size_mm)
    if width < 1 or height < 1:
        raise LayoutError(Finding(f"pictures of {width} x {height} px cannot be seen", remedy="sizes are in mm"))
    return width, height


def pair_layout(layout: LayoutSpec, panel: PanelSpec, style: Style, *, with_reference: bool = False) -> PairLayout:
    """Place two pictures and the question; a reference picture stands left of two in a column, above two in a row.

    Raises
    ------
    LayoutError
        If they do not fit.
    """
    width, height = aperture_px(layout, panel)
    gap = _px(layout.gap_mm, panel)
    band = style.px(_QUESTION_BAND)
    vertical = layout.arrangement == "vertical"
    step = (height if vertical else width) + gap
    half = step // 2
    first, second = ((0, -half), (0, step - half)) if vertical else ((-half, 0), (step - half, 0))
    columns, rows = (1, 2) if vertical else (2, 1)
    reference: tuple[int, int] | None = None
    if with_reference:
        beside = (width if vertical else height) + gap
        shift = beside // 2
        if vertical:
            reference, columns = (shift - beside, 0), 2
            first, second = (shift, first[1]), (shift, second[1])
        else:
            reference, rows = (0, shift - beside), 2
            first, second = (first[0], shift), (second[0], shift)
    wide, high = columns * width + (columns - 1) * gap, rows * height + (rows - 1) * gap
    top = -(high // 2) if rows == 1 else min(place[1] for place in (first, second, reference or first)) - height // 2
    what = f"two pictures of {width} x {height} px in {layout.arrangement} arrangement"
    _refuse_if_too_large(what, wide, max(high, 2 * (band - top)), style)
    question = (0, top - band // 2)
    return PairLayout(
        layout.arrangement, first, second, (width, height), question, style.view_px[0] - style.px(40), reference
    )


def single_layout(layout: LayoutSpec, panel: PanelSpec, style: Style, *, with_reference: bool = False) -> SingleLayout:
    """Place one picture with words above and room for an answer below, and a reference picture left of it.

    Raises
    ------
    LayoutError
        If they do not fit.
    """
    width, height = aperture_px(layout, panel)
    gap = _px(layout.gap_mm, panel)
    above, below = style.px(_QUESTION_BAND), style.px(_ANSWER_BAND)
    step = width + gap
    shift = step // 2 if with_reference else 0
    wide = width + step if with_reference else width
    middle_y = (above - below) // 2
    high = height + above + below
    _refuse_if_too_large(f"a picture of {width} x {height} px with its scale", wide, high, style)
    top = middle_y - height // 2
    reference = (shift - step, middle_y) if with_reference else None
    question = (0, top - above // 2)
    width_px = style.view_px[0] - style.px(40)
    return SingleLayout((shift, middle_y), (width, height), question, width_px, top + height, reference)


def _px(length_mm: float, panel: PanelSpec) -> int:
    length_px = length_mm / panel.pixel_pitch_mm
    if length_px > _LARGEST_PX:
        what = f"{length_mm:g} mm are {length_px:g} pixels of {panel.pixel_pitch_mm:g} mm"
        raise LayoutError(Finding(what, remedy="make size_mm or gap_mm smaller"))
    return round(length_px)


def _refuse_if_too_large(what: str, wide: int, high: int, style: Style) -> None:
    room = style.room_px
    if wide > room[0] or high > room[1]:
        view = f"{room[0]} x {room[1]} px" + (" beside the progress" if room != style.view_px else "")
        smaller = "" if style.type_px is None else ", or write a smaller height_arcmin under style: text"
        raise LayoutError(
            Finding(
                f"{what}, with the words, need {wide} x {high} px, but an eye's view has {view}",
                remedy=f"make size_mm or gap_mm smaller, or change the arrangement{smaller}",
            )
        )
