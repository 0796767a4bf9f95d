"""How words, marks and scales look in an eye's view, at any resolution, in the interface's words."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

from runner.ports import Button
from runner.scene import Box, Offset, Scene, Text
from runner.views.interface import ENGLISH, Interface

Progress = Literal["none", "bar", "count"]
TYPE = 24.0  # size of the type of a question, in units
_PROGRESS_ROOM = 36.0


@dataclass(frozen=True, slots=True)
class Style:
    """Sizes for an eye's view of ``view_px`` (width, height), and the ``interface`` that blocks speak through.

    Lengths are given in units of ``unit_px`` pixels. A view of 960 x 1080 pixels, half of a full HD screen, has one
    pixel to the unit; larger views show the same picture larger. Places are from the middle of the view, x to the right
    and y down. ``type_px`` is the size of a question's type where it is not left to the view: all else keeps its
    proportion to it. ``font`` is the file of the study's own font, if it has one.
    """

    view_px: tuple[int, int] = (960, 1080)
    interface: Interface = ENGLISH
    progress: Progress = "none"
    type_px: float | None = None
    font: Path | None = None
    unit_px: float = field(init=False, compare=False, repr=False)

    def __post_init__(self) -> None:
        fitting = min(self.view_px[0] / 960.0, self.view_px[1] / 1080.0)
        object.__setattr__(self, "unit_px", fitting if self.type_px is None else self.type_px / TYPE)

    @property
    def width(self) -> float:
        """How wide the view is, in units."""
        return self.view_px[0] / self.unit_px

    @property
    def room_px(self) -> tuple[int, int]:
        """What of the view (width, height) the blocks may use, centred: all but the room for the progress."""
        kept = 0 if self.progress == "none" else 2 * self.px(_PROGRESS_ROOM)
        return self.view_px[0], self.view_px[1] - kept

    def say(self, name: str, **values: Any) -> str:
        """Return the interface's words called ``name``."""
        return self.interface.say(name, **values)

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
        width = min(width, self.width - 40)
        return self.text_at(words, self.place(x, y), height=height, width_px=self.px(width), share=share)

    def text_at(
        self, words: str, place_px: Offset, *, height: float = 24, width_px: int = 800, share: float = 0.4
    ) -> Text:
        """Return words centred on a place in pixels, wrapped at ``width_px``; else as `text` does."""
        return Text(words, place_px, max(1, self.px(height)), width_px, share, self.font)

    def box(self, x: float, y: float, width: float, height: float, share: float = 0.4) -> Box:
        """Return a filled rectangle about a place, at least a pixel wide and high."""
        return Box(self.place(x, y), (max(1, self.px(width)), max(1, self.px(height))), share)

    def target(self, x: float, y: float, width: float, height: float) -> Button:
        """Return a rectangle to click about a place."""
        return Button(self.place(x, y), (self.px(width), self.px(height)))

    def with_progress(self, scene: Scene, done: int, trials: int) -> Scene:
        """Return ``scene`` with how many of the session's ``trials`` are done, at the lower edge, if that is wanted."""
        if self.progress == "none" or not trials:
            return scene
        y = self.view_px[1] / 2 / self.unit_px - _PROGRESS_ROOM / 2
        if self.progress == "count":
            words = self.say("progress", done=min(done + 1, trials), all=trials)
            return replace(scene, items=(*scene.items, self.text(words, y=y, height=17, share=0.2)))
        whole = min(320.0, self.width - 40)
        part = whole * min(done, trials) / trials
        filled = (self.box((part - whole) / 2, y, part, 6, 0.3),) if part else ()
        return replace(scene, items=(*scene.items, self.box(0, y, whole, 6, 0.08), *filled))


FULL_HD_HALF = Style()
