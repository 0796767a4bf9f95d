"""Previewing a session: its blocks are run with an observer who answers at once, and each screen is kept."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import dataclass, field, replace
from pathlib import Path

from devices.compensation.clipping import clip_marks
from devices.display.display_file import EYES, EyeModels
from documents import Finding
from runner.blocks.block import Draft, Response
from runner.errors import SessionError
from runner.observers.plain import plain_key
from runner.ports import Ask
from runner.presenter.compensation import Compensation
from runner.presenter.modes.mixture import Mixture
from runner.presenter.modes.options import ModeOptions
from runner.presenter.modes.registry import find_mode
from runner.presenter.presenter import Presenter
from runner.presenter.scene import Offset, Picture, Scene
from runner.presenter.screenshot import write_screenshot
from runner.presenter.surfaces.surface import Surface, open_surface
from runner.protocol.experiment import Experiment
from runner.session.placed_presenter import ReadyPictures
from stimuli.build.stimulus_set import StimulusSet
from stimuli.pictures.stereo_image import StereoImage


@dataclass(slots=True)
class _Album:
    """Writes each eye's view of a screen."""

    folder: Path
    files: list[Path] = field(default_factory=list)

    def add(self, name: str, presenter: Presenter) -> None:
        for eye in EYES:
            self.files += write_screenshot({"screen": presenter.eye_view(eye)}, self.folder / f"{name}_{eye}.png")


def preview(
    experiment: Experiment,
    stimuli: StimulusSet,
    observer: str,
    folder: Path,
    backend: str,
    progress: Callable[[str, int, int], None] = lambda what, done, of: None,
    *,
    clipping: bool = False,
) -> tuple[Path, ...]:
    """Write every screen that ``observer`` would see, per eye, to ``folder`` and return the files.

    With ``clipping``, each screen is followed by one in which marks stand for the pixels outside the gamut.

    Raises
    ------
    InputError
        If the folder cannot be made, or the surface cannot show the mode.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise SessionError(Finding(f"the folder cannot be made: {error.strerror}", str(folder))) from error
    rig = experiment.rig
    blocks = experiment.blocks(observer)
    total = sum(block.trials for block in blocks)
    album = _Album(folder)
    mode = experiment.mode
    load = experiment.shown(stimuli.load)
    images = (load(name) for name in stimuli.names)
    compensation = Compensation.of(rig, mode, images)
    pictures = ReadyPictures(load, compensation, in_pass=True)
    for block in blocks:
        pictures.add(block.pictures)
    resolution = rig.display.panel.resolution_px

    marks = _Marks(load, compensation)

    def marking(surface: Surface) -> Presenter:
        # Not the presenter of the pictures: marks are shown as they are, with nothing cancelled, dithered or mixed.
        return marks.presenter(surface, ModeOptions.parse(rig.mode_options))

    with (
        open_surface(
            backend, resolution, stereo=mode.needs_stereo, windows=mode.windows, bits=rig.output_bits
        ) as surface,
        Presenter(
            surface, mode, rig.models, pictures.load, dithering=experiment.dithering, correction=pictures.correction
        ) as presenter,
        marking(surface) if clipping else nullcontext() as marker,
    ):
        shown = 0
        for number, block in enumerate(blocks):
            steps = block.steps()
            response: Response | None = None
            screen = 0
            while True:
                try:
                    step = steps.send(response)
                except StopIteration:
                    break
                if isinstance(step, Draft):
                    response = None
                    shown += bool(step.data)
                    progress("Previewing trials", shown, total)
                else:
                    response = _answered(step) if isinstance(step, Ask) else None
                    presenter.show(pictures.placed(step.scene))
                    name = f"block-{number + 1:02d}_screen-{screen + 1:03d}"
                    album.add(name, presenter)
                    if marker is not None and set(step.scene.stimuli) & set(stimuli.names):
                        marker.show(marks.placed(step.scene))
                        album.add(f"{name}_clipping", marker)
                    screen += 1
    return tuple(album.files)


@dataclass(frozen=True, slots=True)
class _Marks:
    """Pictures of where the pictures of ``load`` leave the gamut, at each place where a gain map makes it matter."""

    load: Callable[[str], StereoImage]
    compensation: Compensation
    places: dict[str, tuple[str, Offset]] = field(default_factory=dict)

    def placed(self, scene: Scene) -> Scene:
        """Return ``scene`` with each picture named by its place too."""
        return Scene(tuple(self._placed(item) if isinstance(item, Picture) else item for item in scene.items))

    def presenter(self, surface: Surface, options: ModeOptions) -> Presenter:
        """Return one that shows scenes that `placed` gave."""
        models, mode = self.compensation.models, self.compensation.mode
        mixture = mode.mixture(models)
        if mixture is None:
            return Presenter(surface, mode, models, lambda name: self._of_each_eye(self._evened(name)))
        # What is clipped is the one picture that both views make: its marks are shown as a flat picture would be.
        flat = find_mode("flat", replace(options, filters=None))
        one = EyeModels(models.left, models.left)
        return Presenter(surface, flat, one, lambda name: self._of_one_picture(self._evened(name), mixture))

    def _placed(self, picture: Picture) -> Picture:
        if not self.compensation.depends_on_place:
            return picture
        name = f"{picture.stimulus} at {picture.offset_px[0]},{picture.offset_px[1]}"
        self.places[name] = picture.stimulus, picture.offset_px
        return replace(picture, stimulus=name)

    def _evened(self, name: str) -> StereoImage:
        """Return what is asked of the display, as the ledger counts it."""
        stimulus, offset_px = self.places.get(name, (name, (0, 0)))
        return self.compensation.evened(self.load(stimulus), offset_px)

    def _of_each_eye(self, image: StereoImage) -> StereoImage:
        models = self.compensation.models
        left = clip_marks(models.left, image.left)
        if image.is_flat and models.left is models.right:
            return StereoImage.flat(left)
        return StereoImage(left, clip_marks(models.right, image.right))

    def _of_one_picture(self, image: StereoImage, mixture: Mixture) -> StereoImage:
        model = self.compensation.models.left
        light = mixture.light(image.left, image.right)
        return StereoImage.flat(clip_marks(model, model.black_XYZ_cd_m2 + light @ model.primaries_XYZ_cd_m2.T))


def _answered(ask: Ask) -> Response:
    key = plain_key(ask)
    return Response(key, ask.meaning(key) or "", 0.0)
