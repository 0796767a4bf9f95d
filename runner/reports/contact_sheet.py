"""Contact sheets: the screens of a session, reduced, many on a page, for a look at all of them.

A tile shows what each eye would see, in the shape that the eye would see it in: squeezed views are stretched, and of
woven ones the other eye's pixels are filled with their neighbours. So its pixels are no device codes.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from devices.display import Eye
from documents.files import whole_file
from runner.presenter.lettering import write
from runner.presenter.modes.mode import EyeArea
from runner.presenter.surfaces.gl_calls import Codes

_TILE_PX = 544  # across
_GUTTER_PX = 4
# What a view is reduced to fit in: one of two side by side, and one by itself.
PAIR_PX = ((_TILE_PX - _GUTTER_PX) // 2, 306)
ALONE_PX = (_TILE_PX, 306)
COLUMNS = 4
ROWS = 12
_GAP_PX = 12
_LINE_PX = 18
_TYPE_PX = 13
_GROUND, _INK = (70, 70, 70), (235, 235, 235)


@dataclass(slots=True)
class Tile:
    """What both eyes see of a screen, reduced: one picture where they see the same."""

    views: tuple[Image.Image, ...]
    title: str
    places: list[str] = field(default_factory=list)

    @classmethod
    def of(cls, codes: Mapping[Eye, Codes], areas: Mapping[Eye, EyeArea], title: str) -> Tile:
        """Return a tile of the ``codes`` of each eye's view, which lies in its area."""
        left, right = codes["left"], codes["right"]
        alike = left is right or (left.shape == right.shape and bool(np.array_equal(left, right)))
        eyes: tuple[Eye, ...] = ("left",) if alike else ("left", "right")
        box_px = ALONE_PX if alike else PAIR_PX
        return cls(tuple(_reduced(codes[eye], areas[eye], box_px) for eye in eyes), title)

    @property
    def height_px(self) -> int:
        """How high it is with its words."""
        return max(view.height for view in self.views) + 2 * _LINE_PX

    def words(self) -> tuple[str, str]:
        """Return its title, and where in the session the screen comes."""
        shown, more = self.places[:3], len(self.places) - 3
        eyes = "both eyes" if len(self.views) == 1 else "left and right eye"
        return f"{self.title}, {eyes}", ", ".join(shown) + (f" and {more} more" if more > 0 else "")


def _reduced(codes: Codes, area: EyeArea, box_px: tuple[int, int]) -> Image.Image:
    eight = codes if codes.dtype == np.uint8 else (codes >> 2).astype(np.uint8)
    if area.weave is not None:
        mask = area.weave.mask(*eight.shape[:2])[:, :, None]
        eight = np.where(mask, eight, np.roll(eight, 1, axis=0 if area.weave.row_step else 1))
    across, down = area.view_px
    scale = min(box_px[0] / across, box_px[1] / down)
    size_px = max(1, round(scale * across)), max(1, round(scale * down))
    return Image.fromarray(eight).resize(size_px, Image.Resampling.LANCZOS, reducing_gap=3.0)


def write_sheets(tiles: list[Tile], folder: Path) -> list[Path]:
    """Write the tiles in order, as many as fit on a page, into ``sheet-1.png`` and so on, and return the files."""
    pages = [tiles[start : start + COLUMNS * ROWS] for start in range(0, len(tiles), COLUMNS * ROWS)]
    files = []
    for number, page in enumerate(pages, start=1):
        file = folder / f"sheet-{number}.png"
        with whole_file(file) as draft:
            _page(page).save(draft, format="PNG")
        files.append(file)
    return files


def _page(tiles: list[Tile]) -> Image.Image:
    rows = [tiles[start : start + COLUMNS] for start in range(0, len(tiles), COLUMNS)]
    tops = np.cumsum([_GAP_PX, *(max(tile.height_px for tile in row) + _GAP_PX for row in rows)])
    page = Image.new("RGB", (len(rows[0]) * (_TILE_PX + _GAP_PX) + _GAP_PX, int(tops[-1])), _GROUND)
    pen = ImageDraw.Draw(page)
    for row, top in zip(rows, map(int, tops), strict=False):
        for column, tile in enumerate(row):
            left = _GAP_PX + column * (_TILE_PX + _GAP_PX)
            for line, words in enumerate(tile.words()):
                write(pen, (left, top + line * _LINE_PX), words, _TYPE_PX, _INK)
            for place, view in enumerate(tile.views):
                page.paste(view, (left + place * (PAIR_PX[0] + _GUTTER_PX), top + 2 * _LINE_PX))
    return page
