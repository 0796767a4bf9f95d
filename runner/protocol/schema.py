"""The schema of `experiments/*.yaml`."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from runner.protocol.kinds.active_pairs import ActivePairsSpec
from runner.protocol.kinds.all_pairs import AllPairsSpec
from runner.protocol.kinds.best_of_series import BestOfSeriesSpec
from runner.protocol.kinds.instructions import BreakSpec, InstructionsSpec
from runner.protocol.kinds.practice import PracticeSpec
from runner.protocol.kinds.preference import PreferenceSpec
from runner.protocol.kinds.questionnaire import QuestionnaireSpec
from runner.protocol.kinds.rating import RatingSpec
from runner.protocol.kinds.screening import ScreeningSpec
from runner.protocol.parts import AnalysisSpec, LayoutSpec, Line, Strict

AnyBlockSpec = Annotated[
    InstructionsSpec
    | BreakSpec
    | ActivePairsSpec
    | AllPairsSpec
    | BestOfSeriesSpec
    | RatingSpec
    | PreferenceSpec
    | ScreeningSpec
    | QuestionnaireSpec
    | PracticeSpec,
    Field(discriminator="kind"),
]
PracticeSpec.model_rebuild(_types_namespace={"AnyBlockSpec": AnyBlockSpec})  # a block within a block


class ExperimentSpec(Strict):
    """An experiment file. ``rig`` and ``stimuli`` are paths relative to it."""

    schema_version: Literal[1]
    name: Annotated[str, Field(pattern=r"^[a-z0-9][a-z0-9_-]*$", max_length=64)]
    rig: str
    stimuli: str
    question: Line
    layout: LayoutSpec
    blocks: Annotated[list[AnyBlockSpec], Field(min_length=1)]
    seed: int = 0
    analysis: AnalysisSpec = AnalysisSpec()
