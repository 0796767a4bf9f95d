"""How a comparison is asked for, in Python and typed: here, so that help appears before numpy is there."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

from documents.options import Typed
from stimuli.comparison import CompareOptions


@dataclass(frozen=True, slots=True)
class ComparisonOptions:
    """How two pictures are compared, where they are seen, and what is written of it.

    Attributes
    ----------
    compare
        How they are compared.
    display
        Display on which the pictures are seen, pixel for pixel.
    rig
        Rig that gives display and viewing distance, also for --experiment.
    distance_mm
        Viewing distance. Default: the rig's.
    page
        HTML page to write.
    experiment
        Also write experiments/NAME.yaml, an experiment that asks observers.
    """

    compare: CompareOptions = field(default_factory=CompareOptions)
    display: Annotated[Path | None, Typed(metavar="D.yaml")] = None
    rig: Annotated[Path | None, Typed(metavar="RIG.yaml")] = None
    distance_mm: float | None = None
    page: Annotated[Path | None, Typed("-o --output", "OUT.html")] = None
    experiment: Annotated[str | None, Typed(metavar="NAME")] = None

    @property
    def refused(self) -> str:
        """Which options do not go together, in words; empty where all do."""
        if self.display and self.rig:
            return "the rig names a display already: give one of display and rig"
        if self.display and self.distance_mm is None:
            return "display needs distance-mm"
        if self.distance_mm is not None and not (self.display or self.rig):
            return "distance-mm needs display or rig: how large is a pixel?"
        if self.experiment is not None and self.rig is None:
            return "experiment needs rig: an experiment is run on one"
        return ""
