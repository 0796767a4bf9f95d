"""From millimetres on the screen to pixels in each eye's view."""

from __future__ import annotations

from devices.display.display_file import PanelSpec
from documents import Finding
from runner.blocks.layouts import PairLayout, SingleLayout
from runner.blocks.style import Style
from runner.errors import SessionError
from runner.protocol.parts import LayoutSpec

_QUESTION_BAND = 80.0  # units of Style
_ANSWER_BAND = 200.0
_LARGEST_PX = 1_000_000


def aperture_px(layout: LayoutSpec, panel: PanelSpec) -> tuple[int, int]:
    """Return the size (width, height) of what is shown of each picture."""
    width, height = (_px(size, panel) for size in layout.size_mm)
    if width < 1 or height < 1:
        raise SessionError(Finding(f"pictures of {width} x {height} px cannot be seen", remedy="sizes are in mm"))
    return width, height


def pair_layout(layout: LayoutSpec, panel: PanelSpec, style: Style, *, with_reference: bool = False) -> PairLayout:
    """Place two pictures and the question; a reference picture stands left of two in a column, above two in a row.

    Raises
    ------
    SessionError
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
    SessionError
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
        raise SessionError(Finding(what, remedy="make size_mm or gap_mm smaller"))
    return round(length_px)


def _refuse_if_too_large(what: str, wide: int, high: int, style: Style) -> None:
    if wide > style.view_px[0] or high > style.view_px[1]:
        view = f"{style.view_px[0]} x {style.view_px[1]} px"
        raise SessionError(
            Finding(
                f"{what}, with the words, need {wide} x {high} px, but an eye's view has {view}",
                remedy="make size_mm or gap_mm smaller, or change the arrangement",
            )
        )
