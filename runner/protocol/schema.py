"""The schema of `experiments/*.yaml`."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, NonNegativeFloat, PositiveFloat, PositiveInt


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class LayoutSpec(_Strict):
    """How a trial looks: ``size_mm`` is each picture's aperture (width, height) on the screen."""

    arrangement: Literal["vertical", "horizontal"]
    size_mm: tuple[PositiveFloat, PositiveFloat]
    gap_mm: NonNegativeFloat = 10.0
    reference: Literal["physical"] = "physical"


class InstructionsSpec(_Strict):
    """A page of words."""

    kind: Literal["instructions"]
    text: Annotated[str, Field(min_length=1, max_length=2000)]


class BreakSpec(_Strict):
    """A break, ended by the observer."""

    kind: Literal["break"]
    text: Annotated[str, Field(min_length=1, max_length=2000)] = "Time for a break."


class AllPairsSpec(_Strict):
    """Every two of the stimuli together, one answer each.

    Times are in seconds, to the nearest frame: a fixation cross before each pair, a limited exposure of the pair (it
    stays until answered if left out), black between trials.
    """

    kind: Literal["all_pairs"]
    stimuli: Literal["all"] | Annotated[list[str], Field(min_length=2)] = "all"
    sides: Literal["counterbalanced"] = "counterbalanced"
    repeats: PositiveInt = 1
    break_every: PositiveInt | None = None
    fixation_s: Annotated[float, Field(ge=0, le=60)] = 0.0
    exposure_s: Annotated[float, Field(gt=0, le=600)] | None = None
    blank_s: Annotated[float, Field(ge=0, le=60)] = 0.0


BlockSpec = Annotated[InstructionsSpec | BreakSpec | AllPairsSpec, Field(discriminator="kind")]


class AnalysisSpec(_Strict):
    """How the report forms perceptual classes: level of the pairwise tests and their adjustment."""

    alpha: Annotated[float, Field(gt=0, lt=1)] = 0.05
    adjust: Literal["none", "holm", "bh", "maxz"] = "holm"


class ExperimentSpec(_Strict):
    """An experiment file. ``rig`` and ``stimuli`` are paths relative to it."""

    schema_version: Literal[1]
    name: Annotated[str, Field(pattern=r"^[a-z0-9][a-z0-9_-]*$", max_length=64)]
    rig: str
    stimuli: str
    question: Annotated[str, Field(min_length=1, max_length=300)]
    layout: LayoutSpec
    blocks: Annotated[list[BlockSpec], Field(min_length=1)]
    seed: int = 0
    analysis: AnalysisSpec = AnalysisSpec()
