"""Ratings and series: what holds for every block, right in what they say, by the mouse alone."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from runner.blocks import Browse, Rate
from runner.blocks.best_of_series import BestOfSeries
from runner.blocks.layout import SingleLayout
from runner.blocks.rating import Rating
from runner.blocks.scale import Scale
from runner.blocks.series import Series
from runner.blocks.tasks import GoOn
from runner.ports import Ask

Play = Callable[..., Any]  # conftest.py
LAYOUT = SingleLayout((0, -60), (400, 300), (0, -250), 800, 90)
BESIDE = SingleLayout((210, -60), (400, 300), (0, -250), 800, 90, (-210, -60))
SCALES = (Scale("quality", "How good?", 1, 5), Scale("depth", "How deep?", 0, 100))
SERIES = tuple(
    Series(f"{paint}-{kind}", (f"{paint}{kind}1", f"{paint}{kind}2"), paint) for paint in "ab" for kind in "xy"
)
RATING = Rating(("a", "b", "c"), SCALES, LAYOUT, "s", repeats=2)
BEST = BestOfSeries(SERIES, "Which?", LAYOUT, "s")
BLOCKS: dict[str, tuple[Rating | BestOfSeries, set[type]]] = {
    "rating": (RATING, {Rate}),
    "rating, timed": (replace(RATING, fixation_s=1.0, exposure_s=0.5, blank_s=2.0, break_every=2), {Rate, GoOn}),
    "rating beside a reference": (replace(RATING, stimuli=("a",), repeats=1, layout=BESIDE, reference="r"), {Rate}),
    "best of series": (BEST, {Browse, Rate}),
    "best of series, with breaks": (replace(BEST, break_every=1, wrap=True, start="first"), {Browse, Rate, GoOn}),
    "best of series without ratings": (replace(BEST, scales=(), see_all=False, layout=BESIDE, reference="r"), {Browse}),
}


@pytest.mark.parametrize("name", BLOCKS)
def test_it_keeps_what_every_block_promises(name: str, promised: Play) -> None:
    block, tasks = BLOCKS[name]
    whole = promised(block, "rating" if isinstance(block, Rating) else "best_of_series")
    assert {type(ask.task) for ask in whole.asks} == tasks
    reference = block.reference
    for ask in whole.asks:
        assert isinstance(ask.task, GoOn) or ask.task.reference == reference
        assert isinstance(ask.task, GoOn) or bool(reference) == ("r" in ask.scene.stimuli)
        assert set(ask.keys) <= {*block.keys, "home", "end", "page_up", "page_down"}


@pytest.mark.parametrize("name", BLOCKS)
def test_everything_can_be_answered_with_the_mouse_alone(name: str, play: Play) -> None:
    def click(ask: Ask) -> str:
        task = ask.task
        if isinstance(task, Rate):
            return f"click {task.highest}" if task.current is None else "click accept"
        if isinstance(task, Browse):
            left = set(range(len(task.series))) - task.seen
            return "click choose" if not left else "click next" if max(left) > task.index else "click previous"
        return "click continue"

    clicked = play(BLOCKS[name][0], click)
    assert len(clicked.trials) == BLOCKS[name][0].trials
    assert all(key.startswith("click ") for trial in clicked.trials for key, _ in trial.events)
