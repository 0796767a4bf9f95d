"""The kinds of block: what can stand under `blocks:` in an experiment file.

A kind is a file of its own with a `BlockKind`, which is its entry in experiment files and runs it: ours are named here,
those of other packages in their entry points (`docs/extend.md`). What it records is of a kind in `analysis.kinds`.
"""

from __future__ import annotations

from typing import Annotated

from documents.extensions import Registry, of_base
from documents.yaml import ByKind
from runner.blocks.block import BlockKind

BLOCKS: Registry[type[BlockKind]] = Registry(
    "cyclopean.blocks",
    {
        "instructions": "runner.blocks.message:Instructions",
        "break": "runner.blocks.message:Break",
        "all_pairs": "runner.blocks.all_pairs:AllPairs",
        "best_of_series": "runner.blocks.best_of_series:BestOfSeries",
        "rating": "runner.blocks.rating:Rating",
        "preference": "runner.blocks.preference:Preference",
        "questionnaire": "runner.blocks.questionnaire:Questionnaire",
        "practice": "runner.blocks.practice:Practice",
    },
    of_base(BlockKind),
)
AnyBlock = Annotated[BlockKind, ByKind(BLOCKS)]
