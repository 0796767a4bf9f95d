"""The kinds of block: what can stand under `blocks:` in an experiment file.

A new kind is a file of its own in this folder, with a `BlockKind`, which is its entry in experiment files and runs it,
and a line here. `docs/blocks.md` says how; `tests/runner/every_kind.py` needs an example of it.
"""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from runner.blocks.active_pairs import ActivePairs
from runner.blocks.all_pairs import AllPairs
from runner.blocks.best_of_series import BestOfSeries
from runner.blocks.message import Break, Instructions
from runner.blocks.practice import Practice
from runner.blocks.preference import Preference
from runner.blocks.questionnaire import Questionnaire
from runner.blocks.rating import Rating
from runner.blocks.screening.block import Screening
from runner.blocks.threshold import Threshold

AnyBlock = Annotated[
    Instructions
    | Break
    | ActivePairs
    | AllPairs
    | BestOfSeries
    | Rating
    | Preference
    | Threshold
    | Screening
    | Questionnaire
    | Practice,
    Field(discriminator="kind"),
]
# A practice holds a block of any kind.
Practice.model_rebuild(_types_namespace={"AnyBlock": AnyBlock})
