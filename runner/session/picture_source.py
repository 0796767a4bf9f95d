"""Where a session's pictures come from: built from the experiment's recipe, then loaded by name."""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from typing import TypeAlias

from runner.blocks.block import Block
from runner.protocol.experiment import Experiment
from stimuli.build import StimulusSet, build_set
from stimuli.pictures import StereoImage
from stimuli.recipes import DisplaySetup

# Called with what is being done, how much of it is done, and of how much.
Progress: TypeAlias = Callable[[str, int, int], None]

_KEPT = 4  # so that a picture is not read again to be shown after its cost was computed


def no_progress(what: str, done: int, of: int) -> None:
    """Report nothing."""


def build_stimuli(experiment: Experiment, progress: Progress = no_progress) -> StimulusSet:
    """Build the experiment's stimuli for its rig's display, or return them from the cache.

    Raises
    ------
    InputError
        If the recipe or a picture is wrong, or the cache cannot be written.
    """
    return build_set(
        experiment.recipe_file,
        experiment.rig.display.panel.pixel_pitch_mm,
        lambda _, done, of: progress("Building stimuli", done, of),
        setup=DisplaySetup.of(experiment.rig),
    )


class PictureSource:
    """The stimuli of an experiment, cut to the aperture, and the pictures that its blocks make themselves.

    ``read`` counts the stimuli's pictures that were read from their files; ``on_read`` is called with the name of each
    stimulus that `load` returns, and its picture.
    """

    def __init__(self, experiment: Experiment, stimuli: StimulusSet, blocks: Sequence[Block] = ()) -> None:
        self._stimuli, self._part = stimuli, experiment.visible_part
        self.stimulus: Callable[[str], StereoImage] = functools.lru_cache(maxsize=_KEPT)(self._read)
        self.read = 0
        self.on_read: Callable[[str, StereoImage], object] = lambda name, image: None
        self._made: dict[str, Callable[[], StereoImage]] = {}
        self.add(blocks)

    def _read(self, name: str) -> StereoImage:
        self.read += 1
        return self._stimuli.load(name, part=self._part)

    def add(self, blocks: Sequence[Block]) -> None:
        """Add the pictures that ``blocks`` make."""
        for block in blocks:
            self._made.update(block.pictures)

    def load(self, name: str) -> StereoImage:
        """Return the picture ``name``."""
        if name in self._made:
            return self._made[name]()
        image = self.stimulus(name)
        self.on_read(name, image)
        return image
