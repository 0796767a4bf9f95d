"""The presenter: scenes onto a surface, for each eye, in one stereo mode."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Iterable, Mapping
from types import MappingProxyType

from devices.compensation import Compensation, Correction, Size
from devices.display import Eye, EyeModels
from documents import Finding
from runner.presenter.counters import Counters, SwapLog, Work, missed_frames
from runner.presenter.dithering import Dithering
from runner.presenter.drawing import DrawPlan, Painter, SceneDrawing
from runner.presenter.errors import GraphicsError, PresentationError
from runner.presenter.ground import Ground, Inks
from runner.presenter.modes.mode import EyeArea, Mode
from runner.presenter.modes.registry import require
from runner.presenter.pictures import PictureKey, Pictures
from runner.presenter.pointer import Pointer
from runner.presenter.surfaces.gl_calls import Codes
from runner.presenter.surfaces.surface import Buffer, Surface
from runner.presenter.view_codes import PictureCodes, view_codes
from runner.presenter.words import Words
from runner.scene import Box, Offset, Picture, Scene, Text
from stimuli.pictures import StereoImage

PICTURE_BUDGET_BYTES = 2 << 30
TEXT_BUDGET_BYTES = 64 << 20

_EYES: Mapping[Buffer, Eye | None] = MappingProxyType(
    {Buffer.BACK: None, Buffer.BACK_LEFT: "left", Buffer.BACK_RIGHT: "right"}
)


class Presenter:
    """Shows scenes on ``surface`` in ``mode``, each eye through its display model.

    Codes have the surface's ``bits``. Where a picture's codes depend on its place, they are made for each place.

    Parameters
    ----------
    surface
        What is drawn to; it stays open when the presenter is closed.
    mode
        Stereo mode, as `find_mode` gives it.
    models
        Display model of each eye, in that mode.
    load
        Returns the picture of a stimulus by name, in absolute XYZ. It is called once per picture for as long as the
        picture's codes stay within the budget, after the first scene from a thread of its own.
    picture_budget_bytes
        Bytes of codes that may be kept on the graphics card beside those that are needed now.
    dithering
        How codes keep the mean light between two codes; rounded if None.
    correction
        Crosstalk to cancel and gain map to even out, in the pass or, where the mode mixes both views into one picture,
        as the picture is decoded. Words and marks stay as they are.
    prepare
        Changes a picture for the place at which it is shown, an offset in pixels from the middle of the eyes' views.
    ground
        The background and the light of words; black, and shares of the display's white if None.

    Raises
    ------
    PresentationError
        If the surface cannot show the mode, the mode shows both eyes the same pixels while the models differ, or the
        dithering is to other levels than the surface has.
    """

    def __init__(
        self,
        surface: Surface,
        mode: Mode,
        models: EyeModels,
        load: Callable[[str], StereoImage],
        *,
        picture_budget_bytes: int = PICTURE_BUDGET_BYTES,
        dithering: Dithering | None = None,
        correction: Correction | None = None,
        prepare: Callable[[StereoImage, Offset], StereoImage] | None = None,
        ground: Ground | None = None,
    ) -> None:
        require(mode, surface)
        self.surface = surface
        self.mode = mode
        self.areas: tuple[EyeArea, ...] = mode.areas(surface.size_px, surface.position_px)
        mixture = mode.mixture(models)
        shared = mixture is None and any(len(area.eyes) > 1 for area in self.areas)
        if shared and models.left is not models.right:
            raise PresentationError(
                Finding(
                    f"the mode '{mode.name}' shows both eyes the same pixels, but was characterised per eye",
                    remedy="characterise it once, for both eyes",
                )
            )
        if shared and dithering is not None and dithering.differs_by_eye:
            raise PresentationError(
                Finding(
                    f"the mode '{mode.name}' shows both eyes the same pixels, so their dither masks cannot differ",
                    remedy="dither with shared masks",
                )
            )
        self._work = Work()
        bits = surface.bits
        dithering = dithering and dithering.on_surface(bits)
        squeeze = self.areas[0].squeeze
        if correction is not None and correction.is_none:
            correction = None
        self._by_place = prepare is not None or (correction is not None and correction.depends_on_place)
        if correction is not None and mixture is not None:
            panel_px = correction.gain_map.resolution_px if correction.gain_map else surface.size_px
            prepare = _prepared_by(mode.compensation(models, panel_px, correction))
        views = view_codes(surface.context, mode, models, mixture, correction, self._work, dithering, bits)

        self._pictures = Pictures(
            surface.context, views, load, self._work, picture_budget_bytes, prepare=prepare, decoded=surface.wake
        )
        weave = self.areas[0].weave
        leaks = correction and Correction(correction.crosstalk, lift_share=correction.lift_share)
        inks = None
        if ground is not None:
            inks = Inks(ground, mode.compensation(models, surface.size_px, leaks or Correction()))
        self._words = Words(surface.context, models, self._work, TEXT_BUDGET_BYTES, squeeze, mixture, bits, weave, inks)
        self._painter = Painter(surface.context, surface.calls)
        self._drawing = SceneDrawing(surface, self._painter, self._words, inks)
        self._swaps = SwapLog()
        self._scene: Scene | None = None
        self._upcoming: tuple[PictureKey, ...] = ()
        self._later: deque[PictureKey] = deque()
        self._filling: tuple[PictureKey, ...] = ()
        self._may_fill: Callable[[], bool] = lambda: True
        self._plans: tuple[DrawPlan, ...] = ()
        self._plans_for: tuple[Scene, Size, tuple[int, int], int] | None = None
        self._lit = False
        self._pointer = Pointer(self.areas[0].view_px)
        self._turns = 1 + max(area.turn for area in self.areas)
        self._turn = self._turns - 1
        self._onset_s = self._swapped_s = 0.0
        surface.on_damage = self.redraw
        surface.on_move = self._moved
        surface.on_wake = self._make_next_band
        surface.on_point = self._pointed
        surface.on_frame = self._alternate if self._turns > 1 else None

    @property
    def counters(self) -> Counters:
        """The work done so far."""
        return self._work.counters

    @property
    def swaps(self) -> SwapLog:
        """When frames were shown."""
        return self._swaps

    @property
    def codes_depend_on_place(self) -> bool:
        """Whether a picture has other codes at each place."""
        return self._by_place

    def show(self, scene: Scene) -> float:
        """Show ``scene`` and return its onset, in seconds of ``time.monotonic``; an equal scene is not redrawn.

        What was pressed until then, also while the scene was drawn, is stamped with a time before the onset.
        """
        if scene == self._scene:
            self.surface.hear()
            self._work.add(scenes_skipped=1)
            return self._onset_s
        self._lit = not self._lit
        self._pointer.shown = False
        self._onset_s = self._next_frame(scene, new=True)
        self._scene = scene
        self._work.add(frames_drawn=1)
        return self._onset_s

    def redraw(self) -> None:
        """Draw the current scene again, as when the window system has lost it; the onset stays."""
        if self._scene is not None:
            self._next_frame(self._scene)
            self._work.add(frames_redrawn=1)

    @property
    def pointer_px(self) -> Offset | None:
        """Where the mouse's pointer is seen, in pixels from the middle of each eye's view; None if it is not."""
        return self._pointer.place_px if self._pointer.shown else None

    def point(self, wanted: bool, at_once: bool = False) -> None:
        """Let a mouse point at what is shown, or no longer; its pointer is seen once it is moved, or ``at_once``.

        It is drawn over the scene, whose onset stays. It goes with the next scene: nothing is drawn to hide it.
        """
        self.surface.follow_mouse(self._pointer if wanted else None)
        if wanted and at_once and not self._pointer.shown:
            self._pointer.shown = True
            self._pointed()

    def prefetch(self, scene: Scene, at_once: bool = False) -> None:
        """Make the pictures and words of ``scene`` ready, keeping those of the current scene.

        Before the first scene nobody waits, and all is done ``at_once``, as where that is asked for. Later, pictures
        are decoded in a thread of their own and uploaded and transformed, a band of rows at a time, between the events
        of a window; whatever is missing when the scene is shown is done then. A picture that cannot be decoded is
        refused when it is shown.
        """
        if at_once or self._scene is None:
            self._ready(scene)
        else:
            self._upcoming = self._keys(scene)
            self._pictures.start((*self._upcoming, *self._filling))
            self._rasterise(scene)
        self._raise_gl_error()

    def prefetch_later(self, scenes: Iterable[Scene], when: Callable[[], bool] = lambda: True) -> None:
        """Make the pictures of ``scenes`` ready too, while a window waits for keys, until the budget is full.

        One is begun after another, each once what `prefetch` named is ready and ``when`` returns True. Where that
        becomes so later, the surface must be woken.
        """
        self._later = deque(key for scene in scenes for key in self._keys(scene))
        self._may_fill = when
        self.surface.wake()

    def capture(self) -> dict[str, Codes]:
        """Draw the current scene and return the codes (height, width, 3) of each buffer, top row first.

        They are uint8 in 0..255 on a surface of 8 bits, uint16 in 0..1023 on one of 10. The keys are ``screen``, or
        ``left`` and ``right`` in a mode with a buffer or a frame for each eye. Read from the back buffers, before any
        swap.
        """
        captured = {}
        for turn in range(self._turns):
            self._draw(self._scene or Scene(), turn)
            for area in self.areas:
                if area.turn == turn and self._picture_of(area) not in captured:
                    captured[self._picture_of(area)] = self.surface.read(_EYES[area.buffer])
        return captured

    def eye_view(self, eye: Eye) -> Codes:
        """Return the codes (height, width, 3) of just ``eye``'s area in the current scene.

        Of an area that is woven with the other eye's, the other's pixels are 0.
        """
        return self.eye_views()[eye]

    def eye_views(self) -> dict[Eye, Codes]:
        """Return what `eye_view` does for each eye, drawn once for both; the same array where they share an area."""
        captured = self.capture()
        views: dict[Eye, Codes] = {}
        for area in self.areas:
            place = area.rectangle
            codes = captured[self._picture_of(area)]
            view = codes[place.top : place.top + place.height, place.left : place.left + place.width].copy()
            if area.weave is not None:
                view[~area.weave.mask(place.height, place.width)] = 0
            for eye in area.eyes:
                views.setdefault(eye, view)
        return views

    def close(self) -> None:
        """Free what is held on the graphics card; the surface stays open."""
        surface = self.surface
        surface.on_damage = surface.on_move = surface.on_wake = surface.on_frame = None
        surface.on_point = None
        surface.follow_mouse(None)
        self._pictures.release()
        self._words.release()
        self._painter.release()

    def __enter__(self) -> Presenter:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _key(self, picture: Picture) -> PictureKey:
        return PictureKey(picture.stimulus, picture.offset_px if self._by_place else (0, 0))

    def _keys(self, scene: Scene) -> tuple[PictureKey, ...]:
        """Return the keys of the pictures shown, in drawing order, each once."""
        return tuple(dict.fromkeys(self._key(item) for item in scene.items if isinstance(item, Picture)))

    def _ready(self, scene: Scene) -> dict[Picture, PictureCodes]:
        keys = self._keys(scene)
        codes = {key: self._pictures.codes(key, keep=keys) for key in keys}
        for key, made in codes.items():
            self._refuse_unequal(key.stimulus, made.left is made.right)
        self._rasterise(scene)
        return {item: codes[self._key(item)] for item in scene.items if isinstance(item, Picture)}

    def _rasterise(self, scene: Scene) -> None:
        for item in scene.items:
            if isinstance(item, Text | Box):
                self._words.coverage(item)

    def _make_next_band(self) -> None:
        """Make a band of a picture ready that was decoded meanwhile, and come back if there are more."""
        current = self._keys(self._scene) if self._scene else ()
        if self._pictures.step(keep=(*current, *self._upcoming)):
            self.surface.wake()
        else:
            self._fill()
        self._raise_gl_error()

    def _fill(self) -> None:
        """Begin with the next picture that is wanted later, if there is time and room for it."""
        if not self._later or self._work.total("evictions") or not self._may_fill() or self._pictures.is_decoding:
            return
        self._filling = (self._later.popleft(),)
        self._pictures.start((*self._upcoming, *self._filling))
        if not self._pictures.is_decoding:  # it was there already
            self.surface.wake()

    def _picture_of(self, area: EyeArea) -> str:
        """Return the name of the captured picture that holds ``area``."""
        if self._turns > 1:
            return area.eyes[0]
        return _EYES[area.buffer] or "screen"

    def _refuse_unequal(self, stimulus: str, same: bool) -> None:
        if not same and any(len(area.eyes) > 1 for area in self.areas):
            raise PresentationError(
                Finding(
                    f"'{stimulus}' has a view for each eye; the mode '{self.mode.name}' shows both the same pixels",
                    remedy="show its flat version, or choose a stereo mode",
                )
            )

    def _moved(self) -> None:
        """Draw again if what each eye sees depends on where the window stands."""
        areas = self.mode.areas(self.surface.size_px, self.surface.position_px)
        if areas != self.areas:
            self.redraw()

    def _pointed(self) -> None:
        """Draw the pointer where it is now; where eyes take turns, the next frame does it anyway."""
        if self._scene is not None and self._turns == 1:
            self._next_frame(self._scene)
            self._work.add(pointers_drawn=1)

    def _draw(self, scene: Scene, turn: int = 0) -> None:
        if self._pointer.shown:
            scene = Scene((*scene.items, *self._pointer.items))
        self._drawing.frame(self._planned(scene)[turn], lit=self._lit)
        self._raise_gl_error()

    def _planned(self, scene: Scene) -> tuple[DrawPlan, ...]:
        """Return the plan of each turn, which stays until the scene, the window's place or the held pictures change."""
        surface = self.surface
        if self._plans_for != (scene, surface.size_px, surface.position_px, self._work.total("evictions")):
            pictures = self._ready(scene)
            self.areas = self.mode.areas(surface.size_px, surface.position_px)
            square = self.mode.patch(surface.size_px)
            by_turn = ([area for area in self.areas if area.turn == turn] for turn in range(self._turns))
            self._plans = tuple(self._drawing.plan(scene, areas, pictures, square) for areas in by_turn)
            self._plans_for = (scene, surface.size_px, surface.position_px, self._work.total("evictions"))
        return self._plans

    def _next_frame(self, scene: Scene, *, new: bool = False) -> float:
        """Draw and show ``scene`` for the eye whose turn it is, where they take turns; return the time of the swap."""
        self._turn = (self._turn + 1) % self._turns
        self._draw(scene, self._turn)
        return self._swap(new=new)

    def _alternate(self) -> None:
        """Show the current scene to the next eye."""
        if self._scene is not None:
            self._next_frame(self._scene)
            self._work.add(frames_alternated=1)

    def _swap(self, *, new: bool) -> float:
        self.surface.swap()
        if new:
            self.surface.hear()
        now_s = time.monotonic()
        if self._turns > 1 and self._swapped_s:
            self._work.add(frames_missed=missed_frames(now_s - self._swapped_s, self.surface.facts.refresh_hz))
        self._swaps.add(now_s)
        self._swapped_s = now_s
        return now_s

    def _raise_gl_error(self) -> None:
        error = self.surface.context.error
        if error != "GL_NO_ERROR":
            raise GraphicsError(f"the graphics driver reports {error} ({self.surface.facts.renderer})")


def _prepared_by(compensation: Compensation) -> Callable[[StereoImage, Offset], StereoImage]:
    def prepare(image: StereoImage, offset_px: Offset) -> StereoImage:
        return StereoImage(*compensation.apply((image.left, image.right), offset_px)[0])

    return prepare
