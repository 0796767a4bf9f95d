"""Where a session's pictures come from, by name."""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence

from runner.blocks.block import Block
from runner.protocol.experiment import Experiment
from stimuli.build.stimulus_set import StimulusSet
from stimuli.pictures.stereo_image import StereoImage

_KEPT = 4  # so that a picture whose cost is computed is not read again to be shown


class PictureSource:
    """The stimuli of an experiment, cut to the aperture, and the pictures that its blocks make themselves."""

    def __init__(self, experiment: Experiment, stimuli: StimulusSet, blocks: Sequence[Block] = ()) -> None:
        load = functools.partial(stimuli.load, part=experiment.visible_part)
        self.stimulus: Callable[[str], StereoImage] = functools.lru_cache(maxsize=_KEPT)(load)
        self._made: dict[str, Callable[[], StereoImage]] = {}
        self.add(blocks)

    def add(self, blocks: Sequence[Block]) -> None:
        """Know the pictures that ``blocks`` make, too."""
        for block in blocks:
            self._made.update(block.pictures)

    def load(self, name: str) -> StereoImage:
        """Return the picture ``name``."""
        return self._made[name]() if name in self._made else self.stimulus(name)
