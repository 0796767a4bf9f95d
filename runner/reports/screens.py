"""Previewing a session: its blocks are run with an observer who answers at once, and each screen is kept."""

from __future__ import annotations

import shutil
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from PIL import Image, ImageDraw

from devices.compensation import Compensation, Correction, Mixture, XYZImage, clip_marks, mixed_tolerance
from devices.display import EYES, Eye, EyeModels
from documents.files import whole_file, writing
from documents.options import Typed
from runner.blocks.block import Block, Draft
from runner.errors import SessionError
from runner.observers.simulated import walk
from runner.presenter.lettering import write
from runner.presenter.modes.mode import EyeArea, Mode
from runner.presenter.modes.options import ModeOptions
from runner.presenter.modes.registry import find_mode
from runner.presenter.presenter import Presenter
from runner.presenter.screenshot import write_screenshot
from runner.presenter.surfaces.gl_calls import Codes
from runner.presenter.surfaces.opening import open_surface
from runner.presenter.surfaces.surface import Surface
from runner.protocol.experiment import Experiment, check_observer, read_experiment
from runner.scene import Offset, Scene
from runner.session.picture_source import PictureSource, Progress, build_stimuli, no_progress
from runner.views.pages import page
from stimuli.build import StimulusSet
from stimuli.pictures import StereoImage

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
    """What both eyes see of a screen, reduced, for a contact sheet: one picture where they see the same.

    It is in the shape that the eye would see it in: squeezed views are stretched, and of woven ones the other eye's
    pixels are filled with their neighbours. So its pixels are no device codes.
    """

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
    for number, tiles_of_page in enumerate(pages, start=1):
        file = folder / f"sheet-{number}.png"
        with whole_file(file) as draft:
            _page(tiles_of_page).save(draft, format="PNG")
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


@dataclass(frozen=True, slots=True)
class _Screen:
    """A screen of a session: its file's name, the kind of its block, and the trial that it is of, in words."""

    name: str
    kind: str
    trial: str
    scene: Scene


def _screens(
    experiment: Experiment, blocks: Sequence[Block], kinds: Sequence[str], first: int | None
) -> Iterator[_Screen | None]:
    """Yield the screens in order, and None after each trial; those of the ``first`` trials alone if that is given."""
    trials = 0
    style = experiment.style
    counts = [block.trials for block in blocks]
    for number, block in enumerate(blocks, start=1):
        screen = done = 0
        for step in walk(block):
            if isinstance(step, Draft):
                trials += bool(step.data)
                done = min(done + 1, block.trials)
                yield None
                if first is not None and trials >= first:
                    return
            else:
                screen += 1
                place = f"block {number}, trial {trials + 1}" if block.trials else f"block {number}"
                name = f"block-{number:02d}_screen-{screen:03d}"
                scene = step.scene
                if block.trials:
                    scene = style.with_progress(scene, sum(counts[: number - 1]) + done, sum(counts))
                yield _Screen(name, kinds[number - 1].replace("_", " "), place, scene)
    if experiment.end_page:
        yield _Screen("end", "end", "end", page(experiment.end_page, style, "finish").scene)


Again = Callable[[_Screen], None]


@dataclass(slots=True)
class _Album:
    """Writes each eye's view of every screen as PNG; what was written before is copied."""

    folder: Path
    files: list[Path] = field(default_factory=list)

    def add(self, screen: _Screen, suffix: str, presenter: Presenter) -> Again:
        """Write the presenter's views of ``screen``, and return what writes them again for an equal one."""
        views = presenter.eye_views()
        left, right = (self.folder / f"{screen.name}{suffix}_{eye}.png" for eye in EYES)
        write_screenshot({"screen": views["left"]}, left)
        if np.array_equal(views["left"], views["right"]):
            _copy(left, right)
        else:
            write_screenshot({"screen": views["right"]}, right)
        self.files += [left, right]

        def again(other: _Screen) -> None:
            for eye, before in zip(EYES, (left, right), strict=True):
                self.files.append(_copy(before, self.folder / f"{other.name}{suffix}_{eye}.png"))

        return again

    def finish(self) -> tuple[Path, ...]:
        """Return the files."""
        return tuple(self.files)


def _copy(before: Path, file: Path) -> Path:
    with whole_file(file) as draft:
        shutil.copyfile(before, draft)
    return file


@dataclass(slots=True)
class _Sheets:
    """Gathers each screen once, for contact sheets."""

    folder: Path
    tiles: list[Tile] = field(default_factory=list)

    def add(self, screen: _Screen, suffix: str, presenter: Presenter) -> Again:
        """Gather a screen, and return what notes where an equal one comes."""
        areas = {eye: next(area for area in presenter.areas if eye in area.eyes) for eye in EYES}
        tile = Tile.of(presenter.eye_views(), areas, screen.kind + suffix.replace("_", ", "))
        self.tiles.append(tile)

        def again(other: _Screen) -> None:
            if other.trial not in tile.places:
                tile.places.append(other.trial)

        again(screen)
        return again

    def finish(self) -> tuple[Path, ...]:
        """Write the sheets and return the files."""
        return tuple(write_sheets(self.tiles, self.folder))


def preview(
    experiment: str | Path,
    folder: Annotated[str | Path, Typed("-o --output")],
    observer: str = "01",
    *,
    mode: str | None = None,
    backend: Literal["egl", "null", "window"] = "egl",
    sheet: bool = False,
    first: Annotated[int | None, Typed(metavar="N", least=1)] = None,
    clipping: bool = False,
    allow_uncharacterised: bool = False,
    progress: Progress = no_progress,
    notify: Callable[[str], None] = lambda line: None,
) -> tuple[Path, ...]:
    """Write what each eye sees in every trial, as PNG.

    The files hold the exact device codes of each eye's area, named by block, screen and eye. For a first look, --sheet
    puts all screens on pages of small pictures instead. With --clipping, red marks pixels that ask a channel for more
    light than it has, blue those that ask for less than none, magenta both.

    Parameters
    ----------
    experiment
        Experiment file.
    folder
        Folder to write to.
    observer
        Observer whose order of trials is shown.
    mode
        Stereo mode to use instead of the rig's.
    backend
        Where to draw.
    sheet
        Write all screens on pages of small pictures instead, each screen once.
    first
        Show the first N trials only.
    clipping
        Also write each screen with the pixels outside the gamut marked.
    allow_uncharacterised
        Use another mode's characterisation if this mode has none; every record states it.
    progress
        Called with what is being done, how much of it is done, and of how much.
    notify
        Called with each line that the user should read first: that the display was not measured.

    Returns
    -------
    tuple of Path
        The files, in the order in which the screens would be seen.

    Raises
    ------
    InputError
        If a file is wrong, the folder cannot be made, or the surface cannot show the mode.

    Examples
    --------
    ``preview("experiments/dynamic_range.yaml", "out")`` writes ``out/block-01_screen-001_left.png`` and so on. Wrong
    input is refused:

    >>> preview("experiments/dynamic_range.yaml", "out", mode="side by side")
    Traceback (most recent call last):
    ...
    runner.errors.SessionError: configs/displays/asus_vg248qe.yaml: the display was not characterised in the mode
    'side by side' (did you mean 'side-by-side'? ...)
    """
    if first is not None and first < 1:
        raise SessionError(f"the number of trials to show is {first}: give 1 or more")
    design = read_experiment(experiment, mode, allow_uncharacterised=allow_uncharacterised)
    check_observer(observer)
    if design.rig.nominal:
        notify(f"warning: {design.rig.nominal.remark}")
    stimuli = build_stimuli(design, progress)
    folder = Path(folder)
    with writing(folder, "screens", SessionError):
        folder.mkdir(parents=True, exist_ok=True)
        album = _Sheets(folder) if sheet else _Album(folder)
        return _write_screens(design, stimuli, design.blocks(observer), album, backend, clipping, first, progress)


def _write_screens(
    experiment: Experiment,
    stimuli: StimulusSet,
    blocks: Sequence[Block],
    album: _Album | _Sheets,
    backend: str,
    clipping: bool,
    first: int | None,
    progress: Progress,
) -> tuple[Path, ...]:
    rig = experiment.rig
    total = min(sum(block.trials for block in blocks), first or sys.maxsize)
    kinds = [block.kind for block in experiment.spec.blocks]
    mode = experiment.mode
    pictures = PictureSource(experiment, stimuli, blocks)
    resolution = rig.display.panel.resolution_px
    compensation = mode.compensation(rig.models, resolution, Correction(rig.crosstalk, rig.gain_map))
    if rig.spec.lift_black:
        images = (pictures.stimulus(name) for name in stimuli.names)
        compensation = compensation.lifted_for((image.left, image.right) for image in images)

    def marking(surface: Surface) -> Presenter:
        # Not the presenter of the pictures: marks are shown as they are, with nothing cancelled, dithered or mixed.
        return _marking(surface, mode, ModeOptions.parse(rig.spec.mode_options), compensation, pictures.stimulus)

    with (
        open_surface(
            backend, resolution, stereo=mode.needs_stereo, windows=mode.windows, bits=rig.output_bits
        ) as surface,
        Presenter(
            surface,
            mode,
            rig.models,
            pictures.load,
            dithering=experiment.dithering,
            correction=compensation.correction,
            ground=experiment.ground,
        ) as presenter,
        marking(surface) if clipping else nullcontext() as marker,
    ):
        shown = 0
        known: dict[Scene, list[Again]] = {}
        # The photodiode's square is white and black in turn: no screen is then the same as one before it.
        always = mode.patch(resolution) is not None
        for screen in _screens(experiment, blocks, kinds, first):
            if screen is None:
                shown += 1
                progress("Previewing trials", min(shown, total), total)
            elif screen.scene in known and not always:
                for again in known[screen.scene]:
                    again(screen)
            else:
                presenter.show(screen.scene)
                known[screen.scene] = [album.add(screen, "", presenter)]
                if marker is not None and set(screen.scene.stimuli) & set(stimuli.names):
                    marker.show(screen.scene)
                    known[screen.scene].append(album.add(screen, "_clipping", marker))
    return album.finish()


def _marking(
    surface: Surface, mode: Mode, options: ModeOptions, compensation: Compensation, load: Callable[[str], StereoImage]
) -> Presenter:
    """Return a presenter of pictures of where the pictures of ``load`` leave the gamut."""
    models, mixture = compensation.models, compensation.mixture

    def of_each_eye(left: XYZImage, right: XYZImage, half: bool) -> StereoImage:
        marked = clip_marks(models.left, left, models.left.tolerance(left, half=half))
        if left is right and models.left is models.right:
            return StereoImage.flat(marked)
        return StereoImage(marked, clip_marks(models.right, right, models.right.tolerance(right, half=half)))

    def of_one_picture(mixture: Mixture, left: XYZImage, right: XYZImage, half: bool) -> StereoImage:
        model = models.left
        light = mixture.light(left, right)
        shown = model.dark_XYZ_cd_m2 + light @ model.primaries_XYZ_cd_m2.T
        tolerance = mixed_tolerance(mixture, compensation.models, left, right, half=half)
        return StereoImage.flat(clip_marks(model, shown, tolerance))

    def marks(image: StereoImage, offset_px: Offset) -> StereoImage:
        """Mark what is asked of the display, as the clipping costs count it."""
        left, right = compensation.evened((image.left, image.right), offset_px)
        if mixture is None:
            return of_each_eye(left, right, image.half)
        return of_one_picture(mixture, left, right, image.half)

    if mixture is not None:
        # What is clipped is the one picture that both views make: its marks are shown as a flat picture would be.
        mode, models = find_mode("flat", replace(options, filters=None)), EyeModels(models.left, models.left)
    if compensation.correction.depends_on_place:
        return Presenter(surface, mode, models, load, prepare=marks)
    return Presenter(surface, mode, models, lambda name: marks(load(name), (0, 0)))
