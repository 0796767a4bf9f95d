"""How words, marks and scales look in an eye's view, at any resolution."""

from __future__ import annotations

from dataclasses import dataclass, field

from runner.ports import Target
from runner.presenter.scene import Box, Offset, Text


@dataclass(frozen=True, slots=True)
class Style:
    """Sizes for an eye's view of ``view_px`` (width, height).

    Lengths are given in units of ``unit_px`` pixels. A view of 960 x 1080 pixels, half of a full HD screen, has one
    pixel to the unit; larger views show the same picture larger. Places are from the middle of the view, x to the right
    and y down.
    """

    view_px: tuple[int, int] = (960, 1080)
    unit_px: float = field(init=False, compare=False, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "unit_px", min(self.view_px[0] / 960.0, self.view_px[1] / 1080.0))

    def px(self, units: float) -> int:
        """Return a length in whole pixels."""
        return round(units * self.unit_px)

    def place(self, x: float, y: float) -> Offset:
        """Return a place in whole pixels."""
        return self.px(x), self.px(y)

    def text(
        self, words: str, x: float = 0, y: float = 0, *, height: float = 24, width: float = 880, share: float = 0.4
    ) -> Text:
        """Return words centred on a place, in type of ``height``, wrapped at ``width``; ``share`` of white."""
        return Text(words, self.place(x, y), max(1, self.px(height)), self.px(width), share)

    def box(self, x: float, y: float, width: float, height: float, share: float = 0.4) -> Box:
        """Return a filled rectangle about a place, at least a pixel wide and high."""
        return Box(self.place(x, y), (max(1, self.px(width)), max(1, self.px(height))), share)

    def target(self, x: float, y: float, width: float, height: float) -> Target:
        """Return a rectangle to click about a place."""
        return Target(self.place(x, y), (self.px(width), self.px(height)))


FULL_HD_HALF = Style()
