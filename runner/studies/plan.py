"""How large each picture of a study is shown: from the pictures' pixels, the panel and the stereo mode to a layout.

Pictures that fit are shown pixel for pixel; the others are made smaller until they fit, each by its own factor. Those
that are compared are brought to one size where that is asked: the area of the smallest.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

from devices.display import PanelSpec
from documents import Finding
from runner.presenter.modes.mode import Mode
from runner.views.layout import SIZES_DIFFER, LayoutError, LayoutSpec, pair_layout, single_layout, size_ratio
from runner.views.style import Style

Arrangement = Literal["horizontal", "vertical"]
Pixels = tuple[int, int]
GAP_MM = 10.0


@dataclass(frozen=True, slots=True)
class ShownSize:
    """A picture of ``size_px`` shown on ``shown_px`` pixels of an eye's view, width before height."""

    size_px: Pixels
    shown_px: Pixels

    @property
    def is_pixel_for_pixel(self) -> bool:
        """Whether the picture is shown as it is."""
        return self.size_px == self.shown_px


@dataclass(frozen=True, slots=True)
class SizePlan:
    """Where pictures stand and how large they are: two of them for pairs, in ``arrangement``, or a single one.

    ``window_px`` is the smallest window that holds all of them; ``view_px`` is an eye's whole view.
    """

    arrangement: Arrangement
    view_px: Pixels
    window_px: Pixels
    pixel_pitch_mm: float
    pictures: tuple[ShownSize, ...]
    brought_to_one_size: bool = False

    @property
    def window_mm(self) -> tuple[float, float]:
        """The window on the screen, with no more decimals than it takes to meet the pixels."""
        width, height = (_millimetres(length_px, self.pixel_pitch_mm) for length_px in self.window_px)
        return width, height

    @property
    def resampled(self) -> int:
        """How many pictures are not shown pixel for pixel."""
        return sum(not picture.is_pixel_for_pixel for picture in self.pictures)

    @property
    def sentence(self) -> str:
        """How large the pictures are shown, for people."""
        count = len(self.pictures)
        if self.brought_to_one_size:
            return "Pictures that are compared are brought to one size, the smallest's, in linear light."
        if not self.resampled:
            return "Every picture is shown pixel for pixel."
        times = [each.size_px[0] / each.shown_px[0] for each in self.pictures if not each.is_pixel_for_pixel]
        amount = f"{max(times):.3g} times" if max(times) - min(times) < 0.01 else f"up to {max(times):.3g} times"
        if self.resampled == count:
            return f"Every picture is made smaller to fit, {amount}, in linear light."
        which = f"{self.resampled} of {count} pictures {'is' if self.resampled == 1 else 'are'}"
        return f"{which} made smaller to fit, {amount}, in linear light; the others are shown pixel for pixel."

    def width_mm(self, number: int) -> float:
        """Return the width on the screen of picture ``number``, from 0."""
        return _millimetres(self.pictures[number].shown_px[0], self.pixel_pitch_mm)


def plan_sizes(
    sizes_px: Sequence[Pixels],
    mode: Mode,
    panel: PanelSpec,
    *,
    pairs: bool,
    with_reference: bool = False,
    fit: bool | None = False,
    compared: Sequence[Sequence[int]] = (),
) -> SizePlan:
    """Return the largest sizes, none above the pictures' own, at which an eye's view holds them with the words.

    Parameters
    ----------
    sizes_px
        Width and height of each picture, as one eye sees it.
    mode
        The stereo mode, which decides how large an eye's view is.
    panel
        The panel that is filled.
    pairs
        Whether two pictures are shown at a time, side by side or one above the other, whichever lets the picture that
        is made smallest be larger; otherwise a single one with room for an answer under it.
    with_reference
        Whether a reference picture stands beside them.
    fit
        Whether pictures that are compared are brought to the area of the smallest; None: where they would differ by
        more than 5 % in length.
    compared
        The numbers, from 0, of pictures that are compared with each other; without, all are.

    Returns
    -------
    SizePlan
        The layout, and the size of each picture.

    Raises
    ------
    LayoutError
        If the panel is too small for the words, or a picture too narrow to be made smaller.
    """
    view_px = mode.areas(panel.resolution_px)[0].view_px
    arrangements: tuple[Arrangement, ...] = ("horizontal", "vertical") if pairs else ("horizontal",)
    plans, without_room = [], []
    for arrangement in arrangements:
        most_px = _room_px(arrangement, panel, Style(view_px), pairs=pairs, with_reference=with_reference)
        try:
            shown = tuple(ShownSize(size, _fitted(size, most_px)) for size in sizes_px)
        except LayoutError as error:
            without_room.append(error)
            continue
        groups = compared or [range(len(shown))]
        apart = max(size_ratio([shown[number].shown_px for number in group]) for group in groups)
        one_size = fit is not False and apart > (SIZES_DIFFER if fit is None else 1.0)
        if one_size:
            fitted = {number: each for group in groups for number, each in _of_one_area(shown, group)}
            shown = tuple(fitted[number] for number in range(len(shown)))
        window = max(each.shown_px[0] for each in shown), max(each.shown_px[1] for each in shown)
        plans.append(SizePlan(arrangement, view_px, window, panel.pixel_pitch_mm, shown, one_size))
    if not plans:
        raise without_room[0]
    return max(plans, key=_least_share)


def _of_one_area(shown: Sequence[ShownSize], group: Sequence[int]) -> Iterator[tuple[int, ShownSize]]:
    """Yield the pictures of a group at the area of its smallest, which every one of them has room for."""
    area = min(math.prod(shown[number].shown_px) for number in group)
    for number in group:
        width, height = shown[number].size_px
        across = max(1, round(math.sqrt(area * width / height)))
        smaller = across, max(1, round(across * height / width))
        is_smallest = math.prod(shown[number].shown_px) == area
        yield number, shown[number] if is_smallest else ShownSize((width, height), smaller)


def _room_px(arrangement: Arrangement, panel: PanelSpec, style: Style, *, pairs: bool, with_reference: bool) -> Pixels:
    """Return the largest width and height of windows that have room beside the words, 0 where none have."""

    def fits(width: int, height: int) -> bool:
        size_mm = width * panel.pixel_pitch_mm, height * panel.pixel_pitch_mm
        layout = LayoutSpec(arrangement=arrangement, size_mm=size_mm, gap_mm=GAP_MM)
        try:
            (pair_layout if pairs else single_layout)(layout, panel, style, with_reference=with_reference)
        except LayoutError:
            return False
        return True

    most = style.view_px
    return _largest(lambda width: fits(width, 1), most[0]), _largest(lambda height: fits(1, height), most[1])


def _largest(fits: Callable[[int], bool], most: int) -> int:
    """Return the largest length up to ``most`` that fits, 0 if none does."""
    fitting, beyond = 0, most + 1
    while beyond - fitting > 1:
        middle = (fitting + beyond) // 2
        fitting, beyond = (middle, beyond) if fits(middle) else (fitting, middle)
    return fitting


def _fitted(size_px: Pixels, most_px: Pixels) -> Pixels:
    """Return ``size_px``, or the largest size of its shape within ``most_px``; the height follows from the width.

    Of the widths that are smaller by a hundredth at most, that one is taken whose height comes nearest to whole pixels,
    so that no edge lies inside a pixel.

    Raises
    ------
    LayoutError
        If it would be less than a pixel wide.
    """
    width, height = size_px
    if width <= most_px[0] and height <= most_px[1]:
        return size_px
    if min(most_px) < 1:
        what = "an eye's view has no room for pictures beside the words"
        raise LayoutError(Finding(what, remedy="take a mode with a larger view, or a larger panel"))
    widest = min(most_px[0], most_px[1] * width // height)
    if widest < 1:
        message = f"a picture of {width} x {height} px that fits would be less than a pixel wide"
        raise LayoutError(Finding(message, remedy="crop it"))
    narrowest = max(1, widest - widest // 100)

    def beyond_whole(across: int) -> float:
        return abs(across * height / width - max(1, round(across * height / width)))

    fitted = min(range(widest, narrowest - 1, -1), key=lambda across: round(beyond_whole(across), 3))
    return fitted, max(1, round(fitted * height / width))


def _least_share(plan: SizePlan) -> float:
    return min(picture.shown_px[0] / picture.size_px[0] for picture in plan.pictures)


def _millimetres(length_px: int, pixel_pitch_mm: float) -> float:
    """Return the shortest number of millimetres that is so many pixels, within a hundredth of one."""
    exact = length_px * pixel_pitch_mm
    for decimals in range(12):
        if abs(round(exact, decimals) / pixel_pitch_mm - length_px) <= 0.01:
            return round(exact, decimals)
    return exact
