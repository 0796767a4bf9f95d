"""Drawing a frame of a scene, one texel to one pixel: each eye's area of each buffer, then marks for instruments."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TypeAlias

import moderngl

from devices.compensation import Rectangle
from devices.display import Eye
from runner.presenter.ground import Inks
from runner.presenter.modes.mode import EyeArea, Weave
from runner.presenter.shaders import compile_program, set_uniform, shader_file
from runner.presenter.surfaces.gl_calls import GlCalls
from runner.presenter.surfaces.surface import Buffer, Surface
from runner.presenter.view_codes import PictureCodes
from runner.presenter.words import Words
from runner.scene import Box, Picture, Scene, Text

BLACK = (0.0, 0.0, 0.0)
WHITE = (1.0, 1.0, 1.0)
BLUE = (0.0, 0.0, 1.0)


Step: TypeAlias = Callable[[moderngl.Framebuffer], None]


@dataclass(frozen=True, slots=True)
class BufferPlan:
    """What to draw in a buffer, in order, and the codes that fill it first; None if pictures cover it."""

    buffer: Buffer
    clear: tuple[float, float, float] | None
    steps: tuple[Step, ...]


@dataclass(frozen=True, slots=True)
class DrawPlan:
    """One frame: what to draw where, computed in advance; ``square`` is the photodiode's, white or black.

    It holds for as long as the pictures that it copies are held, the surface keeps its place, and its areas are so.
    """

    buffers: tuple[BufferPlan, ...]
    square: Rectangle | None = None


@dataclass(frozen=True, slots=True)
class SceneDrawing:
    """Draws with ``painter`` and ``words`` on ``surface``; on black where there is no background of ``inks``."""

    surface: Surface
    painter: Painter
    words: Words
    inks: Inks | None = None

    def plan(
        self,
        scene: Scene,
        areas: Sequence[EyeArea],
        pictures: Mapping[Picture, PictureCodes],
        square: Rectangle | None = None,
    ) -> DrawPlan:
        """Return how to draw ``scene`` in ``areas``, all of one frame."""
        buffers = (
            BufferPlan(
                buffer,
                clear=None if self._covered(own, scene, pictures) else self._background(own),
                steps=(
                    *self._backgrounds(own),
                    *(step for area in own for step in self._steps(scene, area, pictures)),
                ),
            )
            for buffer, own in _by_buffer(areas, stereo=self.surface.stereo).items()
        )
        return DrawPlan(tuple(buffers), square)

    def frame(self, plan: DrawPlan, *, lit: bool) -> None:
        """Draw a frame as planned, the photodiode's square ``lit`` or black."""
        for own in plan.buffers:
            target = self.surface.target(own.buffer)
            if own.clear is not None:
                target.clear(*own.clear, viewport=(0, 0, *self.surface.size_px))
            for step in own.steps:
                step(target)
            if plan.square is not None:
                self.painter.fill(target, plan.square, WHITE if lit else BLACK)

    def _steps(self, scene: Scene, area: EyeArea, pictures: Mapping[Picture, PictureCodes]) -> Iterator[Step]:
        for item in scene.items:
            if isinstance(item, Picture):
                codes = pictures[item].eye(area.eyes[0])
                place, shown = area.place(codes.size, item.offset_px, item.aperture_px)
                yield partial(self.painter.picture, codes=codes, place=place, shown=shown, area=area)
            else:  # words are looked up for each frame: they may have been released for others
                yield partial(self._text, area=area, item=item)
        if area.sync_line is not None:
            line = Rectangle(0, area.sync_line.top, self.surface.size_px[0], area.sync_line.height)
            yield partial(self.painter.fill, place=line, codes=BLACK)
            yield partial(self.painter.fill, place=area.sync_line, codes=BLUE)

    def _background(self, areas: Sequence[EyeArea]) -> tuple[float, float, float]:
        """Return the codes of the background that all ``areas`` of a buffer share; else black."""
        codes = {self._codes[area.eyes[0]] for area in areas} if self._codes else set()
        return codes.pop() if len(codes) == 1 else BLACK

    def _backgrounds(self, areas: Sequence[EyeArea]) -> Iterator[Step]:
        """Yield what fills each eye's pixels where the eyes' backgrounds differ.

        Whole areas are filled at once; of pixels that are woven, the second eye's are drawn one by one.
        """
        if not self._codes or len({self._codes[area.eyes[0]] for area in areas}) == 1:
            return
        filled: set[Rectangle] = set()
        for area in areas:
            if area.rectangle in filled:
                yield partial(self._cover, area=area)
            else:
                yield partial(self.painter.fill, place=area.rectangle, codes=self._codes[area.eyes[0]])
            filled.add(area.rectangle)

    @property
    def _codes(self) -> Mapping[Eye, tuple[float, float, float]]:
        """The background's codes for each eye; none where it is black."""
        if self.inks is None or self.inks.ground.background is None:
            return {}
        return {eye: (float(r), float(g), float(b)) for eye, (r, g, b) in self.inks.background().items()}

    def _cover(self, target: moderngl.Framebuffer, area: EyeArea) -> None:
        """Fill an eye's own pixels as words would that have no letters: ink of share 0 is the background."""
        self.painter.cover(target, self.words.whole(), self.words.ink(area.eyes[0], 0.0), area)

    def _covered(self, areas: Sequence[EyeArea], scene: Scene, pictures: Mapping[Picture, PictureCodes]) -> bool:
        """Whether pictures will cover every pixel of a buffer, so that it need not be cleared."""
        covered_px = 0.0
        for area in areas:
            shown = (
                area.place(pictures[item].eye(area.eyes[0]).size, item.offset_px, item.aperture_px)[1]
                for item in scene.items
                if isinstance(item, Picture)
            )
            if area.rectangle in shown:
                covered_px += area.rectangle.width * area.rectangle.height * area.share
        width, height = self.surface.size_px
        return covered_px == width * height

    def _text(self, target: moderngl.Framebuffer, area: EyeArea, item: Text | Box) -> None:
        coverage = self.words.coverage(item)
        if coverage is None:
            return
        place, shown = area.place(coverage.texture.size, item.offset_px)
        ink = self.words.ink(area.eyes[0], item.luminance_share)
        self.painter.words(target, coverage.texture, ink, place, shown, area)


def _by_buffer(areas: Sequence[EyeArea], *, stereo: bool) -> dict[Buffer, list[EyeArea]]:
    """Return the areas to draw in each buffer; on a stereo surface, the one back buffer is both of them.

    GL_BACK should mean both to the driver too, but Mesa sends a shader's output to the left one only.
    """
    grouped: dict[Buffer, list[EyeArea]] = {}
    for area in areas:
        both = stereo and area.buffer is Buffer.BACK
        for buffer in (Buffer.BACK_LEFT, Buffer.BACK_RIGHT) if both else (area.buffer,):
            grouped.setdefault(buffer, []).append(area)
    return grouped


class Painter:
    """Draws into rectangles of a framebuffer that is bound; places count from its top left corner.

    ``place`` is where the whole of a thing stands, ``shown`` the part that is seen. A picture is copied by the driver;
    one whose pixels are woven with the other eye's is drawn through a mask.
    """

    def __init__(self, context: moderngl.Context, calls: GlCalls) -> None:
        self._context = context
        self._calls = calls
        self._text = _program(context, "text.frag")
        set_uniform(self._text, "ink", 1)
        self._picture = _program(context, "picture.frag")
        self._text_area = context.vertex_array(self._text, [])
        self._picture_area = context.vertex_array(self._picture, [])

    def picture(
        self,
        target: moderngl.Framebuffer,
        codes: moderngl.Framebuffer,
        place: Rectangle,
        shown: Rectangle,
        area: EyeArea,
    ) -> None:
        """Copy a picture's codes, whose bottom row is first."""
        if shown.is_empty:
            return
        if area.weave is None:
            self._calls.copy(codes, target, place, shown, area.mirror)
            return
        low = target.height - place.top - place.height
        _aim(self._picture, target, shown, area.weave)
        across = _axis(place.left, place.width, reverse=area.mirror[0])
        up = _axis(low, place.height, reverse=area.mirror[1])
        _map(self._picture, across, up)
        codes.color_attachments[0].use(0)  # type: ignore[union-attr]  # codes are in a texture, not a renderbuffer
        self._picture_area.render(moderngl.TRIANGLE_STRIP, vertices=4)

    def words(
        self,
        target: moderngl.Framebuffer,
        coverage: moderngl.Texture,
        ink: moderngl.Texture,
        place: Rectangle,
        shown: Rectangle,
        area: EyeArea,
    ) -> None:
        """Draw words, whose top row is first, over what is there: ink + (1 − coverage) · below."""
        if shown.is_empty:
            return
        low = target.height - place.top - place.height
        _aim(self._text, target, shown, area.weave)
        across = _axis(place.left, place.width, reverse=area.mirror[0])
        up = _axis(low, place.height, reverse=not area.mirror[1])
        _map(self._text, across, up)
        self._context.enable(moderngl.BLEND)
        self._context.blend_func = moderngl.ONE, moderngl.ONE_MINUS_SRC_ALPHA
        coverage.use(0)
        ink.use(1)
        self._text_area.render(moderngl.TRIANGLE_STRIP, vertices=4)
        self._context.disable(moderngl.BLEND)

    def cover(
        self, target: moderngl.Framebuffer, whole: moderngl.Texture, ink: moderngl.Texture, area: EyeArea
    ) -> None:
        """Cover all of an eye's area with ``ink``; ``whole`` is the coverage of one pixel."""
        _aim(self._text, target, area.rectangle, area.weave)
        _map(self._text, (0, 0), (0, 0))
        whole.use(0)
        ink.use(1)
        self._text_area.render(moderngl.TRIANGLE_STRIP, vertices=4)

    def fill(self, target: moderngl.Framebuffer, place: Rectangle, codes: tuple[float, float, float]) -> None:
        """Fill ``place`` with codes in 0..1, as they are."""
        low = target.height - place.top - place.height
        if not place.is_empty:
            target.clear(*codes, 1.0, viewport=(place.left, low, place.width, place.height))

    def release(self) -> None:
        """Free the programs."""
        for resource in (self._text_area, self._picture_area, self._text, self._picture):
            resource.release()


def _program(context: moderngl.Context, name: str) -> moderngl.Program:
    return compile_program(context, shader_file("area.vert"), [shader_file("weave.glsl"), shader_file(name)])


def _aim(program: moderngl.Program, target: moderngl.Framebuffer, shown: Rectangle, weave: Weave | None) -> None:
    target.viewport = (shown.left, target.height - shown.top - shown.height, shown.width, shown.height)
    woven = (weave.column_step, weave.row_step, weave.start) if weave else (0, 0, 0)
    set_uniform(program, "weave", woven)
    set_uniform(program, "height_px", target.height)


def _axis(first: int, count: int, *, reverse: bool) -> tuple[int, int]:
    """Return (origin, direction) of the texels 0 to ``count`` that stand on the pixels from ``first``."""
    return (first + count - 1, -1) if reverse else (-first, 1)


def _map(program: moderngl.Program, across: Sequence[int], up: Sequence[int]) -> None:
    set_uniform(program, "origin", (across[0], up[0]))
    set_uniform(program, "direction", (across[1], up[1]))
