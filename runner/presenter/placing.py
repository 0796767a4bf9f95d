"""Where an item of a scene falls on the surface, for one eye."""

from __future__ import annotations

from runner.presenter.modes.mode import EyeArea
from runner.presenter.rectangle import Rectangle, Size


def squeezed_size(size_px: Size, squeeze: tuple[int, int]) -> Size:
    """Return the size of what is left of a view of ``size_px``: a box at the edge may be part empty."""
    return -(-size_px[0] // squeeze[0]), -(-size_px[1] // squeeze[1])


def place_item(
    area: EyeArea, size_px: Size, offset_px: tuple[int, int], aperture_px: Size | None = None
) -> tuple[Rectangle, Rectangle]:
    """Return where an item stands on the surface and what of it is seen; it may be nothing.

    ``size_px`` counts pixels of the surface, so it is already squeezed. ``offset_px`` and ``aperture_px`` count pixels
    of the eye's view; in a squeezed view, the offset falls on the signal's pixel below it and the aperture takes every
    pixel that it touches.
    """
    across, down = area.squeeze
    moved = (offset_px[0] + area.offset_px[0]) // across, (offset_px[1] + area.offset_px[1]) // down
    whole = area.rectangle
    place = whole.centred(size_px, moved)
    shown = whole.intersection(place)
    if aperture_px is not None:
        shown = shown.intersection(whole.centred(squeezed_size(aperture_px, area.squeeze), moved))
    return place.mirrored_in(whole, area.mirror), shown.mirrored_in(whole, area.mirror)
