"""What a session would be: trials and minutes, and what the keys do, block by block."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from documents.yaml.source import YamlSource
from runner.blocks.block import Block
from runner.blocks.message import CONTINUE_KEYS
from runner.check.checked import Checked
from runner.check.places import finding_at
from runner.protocol.experiment import Experiment

# ITU-R BT.500: a session should last up to half an hour.
LONG_MINUTES = 30.0
# Every observer of pairs meets them in another order, but as many; any will do for counting.
OBSERVER = "01"


def course(checked: Checked, design: Experiment, source: YamlSource) -> None:
    """Say how many trials there are, how long they take and which keys do what, for each block and in all."""
    blocks = design.blocks(OBSERVER)
    told = [_block(spec.kind, spec, block) for spec, block in zip(design.spec.blocks, blocks, strict=True)]
    minutes = sum(block.expected_s for block in blocks) / 60
    checked.facts["trials"] = sum(block.trials for block in blocks)
    checked.facts["minutes"] = round(minutes, 1)
    checked.facts["blocks"] = told
    everywhere = {"space": "continue", "escape": "pause"}
    checked.facts["keys"] = {key: what for block in blocks for key, what in block.keys.items()} | everywhere
    if minutes > LONG_MINUTES:
        what = f"a session takes about {minutes:.0f} minutes, and ITU-R BT.500 has half an hour at most"
        checked.warnings.append(finding_at(source, ("blocks",), what, "split it, or let observers rest"))
    if not checked.facts["trials"]:
        what = "no block asks anything that is scored"
        checked.warnings.append(finding_at(source, ("blocks",), what, "add a block such as all_pairs"))


def _block(kind: str, spec: Any, block: Block) -> dict[str, Any]:
    return {
        "kind": kind,
        "trials": block.trials,
        "minutes": round(block.expected_s / 60, 2),
        "keys": dict(block.keys) or ({} if block.trials else dict.fromkeys(CONTINUE_KEYS, "continue")),
        **_particulars(spec, block),
    }


def _particulars(spec: Any, block: Block) -> Mapping[str, Any]:
    """Return what several kinds of blocks have: repeats, breaks, ties, catch trials, scales."""
    told: dict[str, Any] = {}
    if getattr(spec, "repeats", 1) != 1:
        told["repeats"] = spec.repeats
    every = getattr(spec, "break_every", None)
    if every:
        told["breaks"] = max(0, (block.trials - 1) // every)
    ties = getattr(spec, "ties", "none")
    if isinstance(ties, str) and ties != "none":
        told["ties"] = ties
    catch = getattr(block, "catch", None)
    if catch is not None:
        told["catch_trials"] = catch.count
    told |= getattr(block, "facts", {})
    ratings = getattr(spec, "ratings", None)
    if ratings:
        told["ratings"] = [scale.name for scale in ratings]
    return told
