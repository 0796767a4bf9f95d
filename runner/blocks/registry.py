"""The kinds of block: what can stand under `blocks:` in an experiment file.

A new kind is a file of its own in this folder, with its entry in experiment files (a `BlockSpec`) and its coroutine (a
`Block`), and a line here. `docs/blocks.md` says how; `tests/runner/every_kind.py` needs an example of it.
"""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from runner.blocks.active_pairs import ActivePairsSpec
from runner.blocks.all_pairs import AllPairsSpec
from runner.blocks.best_of_series import BestOfSeriesSpec
from runner.blocks.message import BreakSpec, InstructionsSpec
from runner.blocks.practice import PracticeSpec
from runner.blocks.preference import PreferenceSpec
from runner.blocks.questionnaire import QuestionnaireSpec
from runner.blocks.rating import RatingSpec
from runner.blocks.screening.block import ScreeningSpec
from runner.blocks.threshold import ThresholdSpec

AnyBlockSpec = Annotated[
    InstructionsSpec
    | BreakSpec
    | ActivePairsSpec
    | AllPairsSpec
    | BestOfSeriesSpec
    | RatingSpec
    | PreferenceSpec
    | ThresholdSpec
    | ScreeningSpec
    | QuestionnaireSpec
    | PracticeSpec,
    Field(discriminator="kind"),
]
# A practice holds a block of any kind.
PracticeSpec.model_rebuild(_types_namespace={"AnyBlockSpec": AnyBlockSpec})
