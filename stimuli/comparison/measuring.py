"""The measures that pictures are published with, of pictures that were brought to one grid."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from stimuli.comparison.pictures import Eye
from stimuli.comparison.registering import EyePair, Progress
from stimuli.comparison.results import CompareOptions, EyeComparison
from stimuli.measures import LONGEST_PX, MeasureTable, PicturePair, measure_pairs
from stimuli.pictures.rows import Mask


def measure_eyes(eyes: Mapping[Eye, EyeComparison], options: CompareOptions, step: Progress) -> MeasureTable | None:
    """Return the measures that were asked for, None for none: of the pixels that count, with one white for both eyes.

    Raises
    ------
    StimulusError
        If a measure cannot take these pictures.
    """
    if not options.measures or options.viewing is None:
        return None
    white = np.array(next(iter(eyes.values())).table.white_XYZ)
    viewing = replace(options.viewing, lab_white_XYZ=white, observer=options.reading.observer)
    pairs = {eye: PicturePair(one.photo, one.rendering, *(one.masks or ())) for eye, one in eyes.items()}
    return measure_pairs(pairs, options.measures, viewing, map_longest_px=LONGEST_PX, progress=step)


def usable_pixels(pair: EyePair) -> Mask:
    """Return where both pictures of a pair can be used, (height, width): within the rendering, and not saturated."""
    usable = pair.within.copy()
    for full in (pair.photo.saturated, pair.saturated):
        if full is not None:
            usable &= ~full
    return usable
