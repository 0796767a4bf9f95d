"""A block from its first screen to its last, with an observer who gives the plainest answers at once."""

from __future__ import annotations

from collections.abc import Iterator

from analysis.records import PooledBatch
from runner.blocks.block import Block, Draft, Ended, Hold, Response
from runner.observers.simulated import plain_key
from runner.ports import Ask, ChooseBatch, NoOthers


def walk(block: Block) -> Iterator[Ask | Hold | Draft]:
    """Yield what ``block`` yields: what is asked, what is shown for a time, and what would be recorded."""
    steps = block.steps()
    response: Response | PooledBatch | None = None
    while True:
        try:
            step = steps.send(response)
        except (StopIteration, Ended):
            return
        if isinstance(step, ChooseBatch):
            response = NoOthers().batch(0, 0, step)
            continue
        yield step
        response = None
        if isinstance(step, Ask):
            key = plain_key(step)
            response = Response(key, step.meaning(key) or "", 0.0)
