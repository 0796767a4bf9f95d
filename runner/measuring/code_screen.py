"""A screen of nothing but device codes: each eye's pixels of a stereo mode filled with exactly the codes asked.

While a person is asked to do something, words stand over it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from devices.compensation import Rectangle, Size
from devices.display import Eye
from devices.errors import MeasuringError
from devices.readings import CodeTriple, Patch, PatchEye, ShownPatch
from runner.measuring.patch_screen import middle_of
from runner.presenter.depth import code_texture, highest_code
from runner.presenter.drawing import BLACK, BLUE, Painter
from runner.presenter.errors import GraphicsError
from runner.presenter.lettering import coverage
from runner.presenter.modes.mode import EyeArea, Mode
from runner.presenter.modes.registry import require
from runner.presenter.surfaces.gl_calls import Codes
from runner.presenter.surfaces.surface import Buffer, Surface
from runner.presenter.words import squeezed

Shares = tuple[float, float, float, float]
_INK = 0.6  # the code of words' grey
_EYES: Mapping[Buffer, Eye | None] = MappingProxyType(
    {Buffer.BACK: None, Buffer.BACK_LEFT: "left", Buffer.BACK_RIGHT: "right"}
)


@dataclass(frozen=True, slots=True)
class EyeCodes:
    """What each eye sees: codes in 0..1, over all of its area, or in ``window`` alone.

    ``window`` holds the left, top, right and bottom edges as shares of each eye's area, or, if it is ``of_panel``, of
    the panel; outside it each eye sees the codes that ``around`` has for it, left and right.
    """

    left: CodeTriple
    right: CodeTriple
    window: Shares | None = None
    around: tuple[CodeTriple, CodeTriple] = (BLACK, BLACK)
    of_panel: bool = False

    @classmethod
    def of(cls, codes: CodeTriple, eye: str) -> EyeCodes:
        """Return ``codes`` for ``eye``, one or ``both``; the other eye's are black."""
        return cls(codes if eye in ("left", "both") else BLACK, codes if eye in ("right", "both") else BLACK)

    @classmethod
    def of_patch(cls, patch: Patch, eye: PatchEye) -> EyeCodes:
        """Return what each eye sees of ``patch``, in a measurement of ``eye``."""
        eye = patch.eye or eye
        plain = cls.of(patch.codes, eye)
        if patch.other is not None:
            return cls(patch.codes, patch.other) if eye == "left" else cls(patch.other, patch.codes)
        if patch.filled == 1.0:
            return plain
        around = cls.of(patch.surround, eye)
        window = _middle(patch.filled) if patch.place is None else patch.place.window
        return cls(plain.left, plain.right, window, (around.left, around.right), of_panel=patch.place is not None)

    @property
    def alike(self) -> bool:
        """Whether both eyes see the same."""
        return self.left == self.right and self.around[0] == self.around[1]

    def eye(self, eye: Eye) -> CodeTriple:
        """Return the codes of ``eye``."""
        return self.left if eye == "left" else self.right

    def fills(self, eye: Eye, area: EyeArea, size_px: Size) -> list[tuple[Rectangle, CodeTriple]]:
        """Return what of ``area``, on a surface of ``size_px``, is filled with which codes for ``eye``, in order.

        A squeezed view is stretched back over the panel, so that shares of its area are shares of the panel.
        """
        if self.window is None:
            return [(area.rectangle, self.eye(eye))]
        over = Rectangle(0, 0, *size_px) if self.of_panel and area.squeeze == (1, 1) else area.rectangle
        left, right = (round(over.width * share) for share in (self.window[0], self.window[2]))
        top, bottom = (round(over.height * share) for share in (self.window[1], self.window[3]))
        inside = Rectangle(over.left + left, over.top + top, right - left, bottom - top)
        around = self.around[1] if eye == "right" else self.around[0]
        return [(area.rectangle, around), (inside.intersection(area.rectangle), self.eye(eye))]


def _middle(area: float) -> Shares:
    """Return the edges of a window in the middle that fills ``area`` of the whole, in its shape."""
    edge = (1.0 - math.sqrt(area)) / 2.0
    return edge, edge, 1.0 - edge, 1.0 - edge


class CodeScreen:
    """Fills ``surface`` in ``mode``, without any display model. It draws again what the window system has lost.

    The sync line of frames in turn is drawn over the patches, because the glasses need it; a photodiode's square is
    not. Moving and mirroring views has no effect, as the patches fill each eye's area.

    Raises PresentationError if the surface cannot show the mode.
    """

    def __init__(self, surface: Surface, mode: Mode) -> None:
        require(mode, surface)
        self.surface = surface
        self.mode = mode
        self._painter = Painter(surface.context, surface.calls)
        areas = self._areas()
        self._turns = 1 + max(area.turn for area in areas)
        self._turn = self._turns - 1
        self._codes = EyeCodes(BLACK, BLACK)
        self._words = ""
        surface.on_damage = surface.on_move = self.redraw

    @property
    def takes_turns(self) -> bool:
        """Whether the eyes see frames in turn, so that `redraw` must be called for every refresh."""
        return self._turns > 1

    @property
    def shared(self) -> bool:
        """Whether both eyes see the same pixels, as in anaglyphs, which filters alone separate."""
        return any(len(area.eyes) > 1 for area in self._areas())

    @property
    def highest(self) -> int:
        """The code of full drive: 255 or 1023."""
        return highest_code(self.surface.bits)

    def show(self, codes: EyeCodes) -> None:
        """Show ``codes`` from now on.

        Raises
        ------
        MeasuringError
            If they differ by eye where both eyes see the same pixels.
        """
        if self.shared and not codes.alike:
            raise MeasuringError(f"the mode '{self.mode.name}' shows both eyes the same pixels")
        self._codes = codes
        for _ in range(self._turns):
            self.redraw()

    def show_patch(self, patch: Patch, eye: PatchEye) -> ShownPatch:
        """Show ``patch`` in a measurement of ``eye``, and return what stands there; errors as `show`."""
        codes = EyeCodes.of_patch(patch, "both" if self.shared else eye)
        self.show(codes)
        right = (patch.eye or eye) == "right"
        own, other = (codes.right, codes.left) if right else (codes.left, codes.right)
        area = next(area for area in self._areas() if ("right" if right else "left") in area.eyes)
        place = middle_of(area, self.surface.size_px) if patch.place is None else patch.place.centre
        return ShownPatch(own, None if self.shared else other, place)

    def say(self, words: str) -> None:
        """Show ``words`` to both eyes over the codes, until other ones come; none if they are empty."""
        self._words = words
        for _ in range(self._turns):
            self.redraw()

    def redraw(self) -> None:
        """Show the codes again, to the next eye where they take turns."""
        self._turn = (self._turn + 1) % self._turns
        self._draw(self._turn)
        self.surface.swap()

    def capture(self) -> dict[str, Codes]:
        """Draw, and return the codes (height, width, 3) of each buffer or turn, top row first, before any swap.

        The keys are ``screen``, or ``left`` and ``right`` in a mode with a buffer or a frame for each eye.
        """
        captured: dict[str, Codes] = {}
        for turn in range(self._turns):
            self._draw(turn)
            for area in self._areas():
                name = area.eyes[0] if self._turns > 1 else _EYES[area.buffer] or "screen"
                if area.turn == turn and name not in captured:
                    captured[name] = self.surface.read(_EYES[area.buffer])
        return captured

    def seen_by(self, eye: Eye) -> NDArray[np.float64]:
        """Return the codes in 0..``highest`` of every pixel that is ``eye``'s, shape (n, 3), read back."""
        captured = self.capture()
        area = next(area for area in self._areas() if eye in area.eyes)
        place = area.rectangle
        codes = captured[area.eyes[0] if self._turns > 1 else _EYES[area.buffer] or "screen"]
        view = codes[place.top : place.top + place.height, place.left : place.left + place.width]
        if area.weave is not None:
            return view[area.weave.mask(place.height, place.width)].astype(np.float64)
        height = place.height if area.sync_line is None else area.sync_line.top - place.top
        return view[:height].reshape(-1, 3).astype(np.float64)

    def close(self) -> None:
        """Free what is held on the graphics card; the surface stays open."""
        self.surface.on_damage = self.surface.on_move = None
        self._painter.release()

    def __enter__(self) -> CodeScreen:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _areas(self) -> tuple[EyeArea, ...]:
        return self.mode.areas(self.surface.size_px, self.surface.position_px)

    def _draw(self, turn: int) -> None:
        areas = [area for area in self._areas() if area.turn == turn]
        cleared: set[Buffer] = set()
        for area in areas:
            # On a stereo surface, the one back buffer is both of them: see `runner.presenter.drawing`.
            both = self.surface.stereo and area.buffer is Buffer.BACK
            for buffer in (Buffer.BACK_LEFT, Buffer.BACK_RIGHT) if both else (area.buffer,):
                target = self.surface.target(buffer)
                if buffer not in cleared:
                    target.clear(viewport=(0, 0, *self.surface.size_px))
                    cleared.add(buffer)
                self._fill(buffer, area)
        error = self.surface.context.error
        if error != "GL_NO_ERROR":
            raise GraphicsError(f"the graphics driver reports {error} ({self.surface.facts.renderer})")

    def _fill(self, buffer: Buffer, area: EyeArea) -> None:
        target = self.surface.target(buffer)
        fills = self._codes.fills(area.eyes[0], area, self.surface.size_px)
        if area.weave is None:
            for place, codes in fills:
                self._painter.fill(target, place, codes)
        else:
            corner = area.rectangle
            texture = code_texture(self.surface.context, corner.size_px, self.surface.bits)
            filled = self.surface.context.framebuffer([texture])
            try:
                filled.use()
                for place, codes in fills:
                    moved = Rectangle(place.left - corner.left, place.top - corner.top, *place.size_px)
                    self._painter.fill(filled, moved, codes)
                self._painter.picture(self.surface.target(buffer), filled, corner, corner, area)
            finally:
                filled.release()
                texture.release()
        if self._words:
            self._write(buffer, area)
        if area.sync_line is not None:
            line = area.sync_line
            self._painter.fill(target, Rectangle(0, line.top, self.surface.size_px[0], line.height), BLACK)
            self._painter.fill(target, line, BLUE)

    def _write(self, buffer: Buffer, area: EyeArea) -> None:
        """Put the words on black into the half of ``area`` where the patch is not aimed at."""
        width, height = area.view_px
        drawn = coverage(self._words, max(12, height // 32), width * 3 // 4)
        if drawn is None:
            return
        levels = np.floor(squeezed(np.pad(drawn, height // 64), area.squeeze) * _INK + 0.5).astype(np.uint8)[::-1]
        rgba = np.dstack([levels] * 3 + [np.full_like(levels, 255)])
        texture = code_texture(self.surface.context, (levels.shape[1], levels.shape[0]), self.surface.bits)
        texture.write(np.ascontiguousarray(rgba).tobytes())
        written = self.surface.context.framebuffer([texture])
        try:
            low = self._codes.window is None or self._codes.window[3] < 0.9
            down = area.rectangle.height * (1 if low else -1) // 3
            place = area.rectangle.centred(texture.size, (0, down))
            self._painter.picture(self.surface.target(buffer), written, place, place.intersection(area.rectangle), area)
        finally:
            written.release()
            texture.release()
