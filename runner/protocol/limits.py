"""What no session can hold: refused where it is written, before memory or a lifetime goes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from documents.yaml.source import Path_
from runner.blocks.steps import Block
from runner.protocol.kinds.block_spec import BlockSpec, Fault

MOST_TRIALS = 100_000
# More than the textures of any graphics card, and than any screen.
MOST_PX = 65_536


def too_many(specs: Sequence[BlockSpec], blocks: Sequence[Block]) -> Iterator[Fault]:
    """Yield blocks of more trials than a session can hold."""
    for index, (spec, block) in enumerate(zip(specs, blocks, strict=True)):
        if block.trials > MOST_TRIALS:
            keys = [key for key in ("repeats", "trials") if key in type(spec).model_fields]
            path: Path_ = ("blocks", index, *keys[:1])
            yield Fault(f"these are {block.trials} trials", path, f"a block has {MOST_TRIALS} at most")


def too_large(resolution_px: tuple[int, int]) -> Iterator[Fault]:
    """Yield a panel that no graphics card can serve."""
    if max(resolution_px) > MOST_PX:
        what = f"the display's panel has {resolution_px[0]} x {resolution_px[1]} px"
        yield Fault(what, ("rig",), f"at most {MOST_PX} each way can be drawn; correct resolution_px")
