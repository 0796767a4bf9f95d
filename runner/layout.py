"""From millimetres on the screen to pixels in each eye's area."""

from __future__ import annotations

from devices.display_file import PanelSpec
from documents import Finding
from runner.blocks.all_pairs import PairLayout
from runner.errors import SessionError
from runner.protocol.schema import LayoutSpec

_QUESTION_BAND_PX = 80


def pair_layout(layout: LayoutSpec, panel: PanelSpec, area_px: tuple[int, int]) -> PairLayout:
    """Place two pictures and the question in an eye's area of ``area_px`` (width, height).

    Raises
    ------
    SessionError
        If they do not fit.
    """
    width, height = (round(size / panel.pixel_pitch_mm) for size in layout.size_mm)
    gap = round(layout.gap_mm / panel.pixel_pitch_mm)
    vertical = layout.arrangement == "vertical"
    step = (height if vertical else width) + gap
    half = step // 2
    first, second = ((0, -half), (0, step - half)) if vertical else ((-half, 0), (step - half, 0))
    extent = (width, step + height) if vertical else (step + width, height)
    top = first[1] - height // 2
    question_y = top - _QUESTION_BAND_PX // 2
    needed = (extent[0], max(extent[1], 2 * (_QUESTION_BAND_PX - top)))
    if needed[0] > area_px[0] or needed[1] > area_px[1]:
        raise SessionError(
            Finding(
                f"two pictures of {width} x {height} px in {layout.arrangement} arrangement, with the question, need "
                f"{needed[0]} x {needed[1]} px but an eye's area has {area_px[0]} x {area_px[1]} px",
                remedy="make size_mm or gap_mm smaller, or change the arrangement",
            )
        )
    return PairLayout(layout.arrangement, first, second, (width, height), (0, question_y), area_px[0] - 40)
