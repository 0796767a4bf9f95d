"""Words and boxes as textures: drawn with Pillow once for each item, and a ramp of ink for each eye and brightness."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from devices.compensation import Mixture
from devices.display import DisplayModel, Eye, EyeModels
from runner.presenter.counters import Work
from runner.presenter.depth import Bits, highest_code
from runner.presenter.ground import Inks
from runner.presenter.lettering import coverage
from runner.presenter.modes.mode import Weave
from runner.presenter.surfaces.gl_calls import Codes
from runner.presenter.texture_cache import LruCache
from runner.scene import Box, Text


@dataclass(frozen=True, slots=True)
class Sheet:
    """A texture in a cache."""

    texture: moderngl.Texture
    size_bytes: int

    def release(self) -> None:
        """Free the texture."""
        self.texture.release()


def ink_codes(model: DisplayModel, luminance_share: float, bits: Bits = 8) -> Codes:
    """Return codes (256, 3) of 0 to 255 parts of an ink at ``luminance_share`` of the display's white.

    They are uint8 in 0..255 with 8 bits, uint16 in 0..1023 with 10.
    """
    light = np.linspace(0.0, luminance_share, 256)[:, np.newaxis] * model.white_XYZ_cd_m2
    return _rounded(model.code(light), bits)


def mixed_ink_codes(mixture: Mixture, models: EyeModels, luminance_share: float, bits: Bits = 8) -> Codes:
    """Return codes (256, 3) as `ink_codes`, for an ink that both eyes see in one picture."""
    light = np.linspace(0.0, luminance_share, 256)[:, np.newaxis]
    codes = mixture.code(light * models.left.white_XYZ_cd_m2, light * models.right.white_XYZ_cd_m2)
    return _rounded(codes, bits)


def _rounded(shares: NDArray[np.float64], bits: Bits) -> Codes:
    codes = np.floor(shares * highest_code(bits) + 0.5)
    return codes.astype(np.uint16) if bits == 10 else codes.astype(np.uint8)


def squeezed(coverage: NDArray[np.uint8], squeeze: tuple[int, int]) -> NDArray[np.uint8]:
    """Return the mean coverage of each box of ``squeeze`` pixels, across and down; beyond the edge it is 0."""
    across, down = squeeze
    height, width = coverage.shape
    padded = np.pad(coverage, ((0, -height % down), (0, -width % across))).astype(np.float64)
    boxes = padded.reshape(padded.shape[0] // down, down, padded.shape[1] // across, across)
    return np.asarray(np.floor(boxes.mean(axis=(1, 3)) + 0.5), dtype=np.uint8)


def woven(coverage: NDArray[np.uint8], weave: Weave) -> NDArray[np.uint8]:
    """Return the coverage, a pixel wider to each side, from which each eye may take every second pixel.

    Half of each pixel's ink goes to its neighbours, which the other eye sees. So both eyes see every stroke, be it one
    pixel thin, and equally much of it.
    """
    padded = np.pad(coverage, 2).astype(np.float64)
    rows, columns = (slice(1, -1), slice(None, -2), slice(2, None)), (slice(1, -1), slice(None, -2), slice(2, None))
    steps = ([(1, 0), (2, 0)] if weave.row_step else []) + ([(0, 1), (0, 2)] if weave.column_step else [])
    beside = sum(padded[rows[down], columns[across]] for down, across in steps) / len(steps)
    return np.asarray(np.floor(0.5 * (padded[1:-1, 1:-1] + beside) + 0.5), dtype=np.uint8)


class Words:
    """The textures of words and boxes, at zero parallax: both eyes share one coverage, each has its own ink.

    Where a mode squeezes the views or weaves them, a coverage is filtered first, so that an eye sees letters whole.
    """

    def __init__(
        self,
        context: moderngl.Context,
        models: EyeModels,
        work: Work,
        budget_bytes: int,
        squeeze: tuple[int, int] = (1, 1),
        mixture: Mixture | None = None,
        bits: Bits = 8,
        weave: Weave | None = None,
        inks: Inks | None = None,
    ) -> None:
        self._weave = weave
        self._by_ground = inks
        self._context = context
        self._models = models
        self._mixture = mixture
        self._work = work
        self._squeeze = squeeze
        self._bits = bits
        self._sheets: LruCache[tuple[str, int, int, Path | None], Sheet] = LruCache(budget_bytes)
        self._inks: LruCache[tuple[int | str, float], Sheet] = LruCache(1 << 20)
        self._whole: Sheet | None = None

    def coverage(self, item: Text | Box) -> Sheet | None:
        """Return the coverage of ``item``, top row first; None if there is nothing to see."""
        key: tuple[str, int, int, Path | None]
        if isinstance(item, Box):
            key = "", item.size_px[1], item.size_px[0], None  # no text has no words
            sheet = self._sheets.get(key, lambda: self._fill(item.size_px))
        elif item.words.strip():
            key = item.words, item.height_px, item.width_px, item.font
            sheet = self._sheets.get(key, lambda: self._rasterise(*key))
        else:
            return None
        self._sheets.trim({key})
        return sheet

    def ink(self, eye: Eye, luminance_share: float) -> moderngl.Texture:
        """Return the ramp of ink of ``luminance_share`` for ``eye``, 256 texels wide."""
        model, inks = self._models.eye(eye), self._by_ground
        key = (id(model) if inks is None else eye), luminance_share
        if inks is None:
            sheet = self._inks.get(key, lambda: self._ramp(self._ink_codes(model, luminance_share)))
        else:
            sheet = self._inks.get(key, lambda: self._floats(inks.ramp(eye, luminance_share)))
        self._inks.trim({key})
        return sheet.texture

    def whole(self) -> moderngl.Texture:
        """Return the coverage of a pixel that is all ink."""
        if self._whole is None:
            self._whole = self._sheet(np.full((1, 1), 255, np.uint8), 1)
        return self._whole.texture

    def release(self) -> None:
        """Free everything."""
        if self._whole is not None:
            self._whole.release()
            self._whole = None
        self._sheets.clear()
        self._inks.clear()

    def _ink_codes(self, model: DisplayModel, luminance_share: float) -> Codes:
        if self._mixture is None:
            return ink_codes(model, luminance_share, self._bits)
        return mixed_ink_codes(self._mixture, self._models, luminance_share, self._bits)

    def _rasterise(self, words: str, height_px: int, width_px: int, font: Path | None) -> Sheet:
        self._work.add(texts_rasterised=1)
        drawn = coverage(words, height_px, width_px, font)
        return self._sheet(self._filtered(drawn) if drawn is not None else np.zeros((1, 1), np.uint8), 1)

    def _fill(self, size_px: tuple[int, int]) -> Sheet:
        return self._sheet(self._filtered(np.full(size_px[::-1], 255, np.uint8)), 1)

    def _filtered(self, coverage: NDArray[np.uint8]) -> NDArray[np.uint8]:
        coverage = squeezed(coverage, self._squeeze)
        return coverage if self._weave is None else woven(coverage, self._weave)

    def _ramp(self, codes: Codes) -> Sheet:
        """Return the codes as a texture: bytes where 8 bits hold them, else floats, as 10 bits are blended from."""
        if codes.dtype == np.uint8:
            return self._sheet(codes[np.newaxis], 3)
        return self._floats(codes / highest_code(self._bits))

    def _floats(self, codes: NDArray[np.float64]) -> Sheet:
        return self._sheet(codes.astype(np.float32)[np.newaxis], 3, "f4")

    def _sheet(self, pixels: NDArray[Any], components: int, dtype: str = "f1") -> Sheet:
        height, width = pixels.shape[:2]
        texture = self._context.texture((width, height), components, pixels.tobytes(), alignment=1, dtype=dtype)
        texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
        return Sheet(texture, pixels.nbytes)
