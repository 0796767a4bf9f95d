"""A presenter whose pictures are made ready for the place at which a scene shows them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

from runner.ports import Holding
from runner.presenter.compensation import Compensation
from runner.presenter.presenter import Presenter
from runner.presenter.scene import Offset, Picture, Scene
from runner.presenter.view_codes import PlacedImage
from runner.session.pace import Pace
from stimuli.pictures.stereo_image import StereoImage

Load = Callable[[str], StereoImage]


class ReadyPictures:
    """Loads pictures through a compensation, by names that hold their place where it matters.

    With ``in_pass``, the presenter's pass compensates what it can: it must be given ``correction``, and gets pictures
    that know their place. Otherwise, and in a mode that mixes both views into one picture, they are compensated here.
    """

    def __init__(self, load: Load, compensation: Compensation, *, in_pass: bool = False) -> None:
        self._load = load
        self._compensation = compensation
        self.correction = compensation.correction if in_pass else None
        self._places: dict[str, tuple[str, Offset]] = {}
        self._made: dict[str, Callable[[], StereoImage]] = {}

    def add(self, pictures: Mapping[str, Callable[[], StereoImage]]) -> None:
        """Let pictures that a block makes itself be shown too, by name."""
        self._made.update(pictures)

    def load(self, name: str) -> StereoImage:
        """Return the picture of a name that `placed` gave, ready to be sent."""
        stimulus, offset_px = self._places.get(name, (name, (0, 0)))
        image = self._made[stimulus]() if stimulus in self._made else self._load(stimulus)
        if self.correction is None:
            return self._compensation.apply(image, offset_px)[0]
        return PlacedImage(image.left, image.right, offset_px)

    def placed(self, scene: Scene) -> Scene:
        """Return ``scene`` with each picture named by its place too; as it is where the place does not matter."""
        if not self._compensation.depends_on_place:
            return scene
        return Scene(tuple(self._placed(item) if isinstance(item, Picture) else item for item in scene.items))

    def _placed(self, picture: Picture) -> Picture:
        name = f"{picture.stimulus} at {picture.offset_px[0]},{picture.offset_px[1]}"
        self._places[name] = picture.stimulus, picture.offset_px
        return replace(picture, stimulus=name)


class PlacedPresenter:
    """Shows scenes on ``presenter``, whose ``load`` must be that of ``pictures``; timed ones at ``pace``."""

    def __init__(self, presenter: Presenter, pictures: ReadyPictures, pace: Pace) -> None:
        self._presenter = presenter
        self._pictures = pictures
        self._pace = pace

    def show(self, scene: Scene) -> float:
        """Show ``scene`` and return its onset."""
        return self._presenter.show(self._pictures.placed(scene))

    def prefetch(self, scene: Scene) -> None:
        """Make ready what ``scene`` will need."""
        self._presenter.prefetch(self._pictures.placed(scene))

    def hold(self, scene: Scene, seconds: float) -> Holding:
        """Show ``scene`` for the whole frames nearest to ``seconds``: drawn once, slept through, keys let go."""
        frames = self._pace.frames(seconds)
        onset_s = self.show(scene)
        self._pace.wait(onset_s, frames, each_frame=self._presenter.surface.on_frame)
        self._presenter.surface.poll_keys()
        return Holding(onset_s, frames, self._pace.period_s)
