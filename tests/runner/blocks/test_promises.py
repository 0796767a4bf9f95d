"""Ratings and series: what holds for every block, right in what they say, by the mouse alone."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from runner.blocks import Block, Stimuli
from runner.ports import Ask, Browse, GoOn, Rate
from tests.runner.every_kind import met, setting

Play = Callable[..., Any]  # conftest.py
SCALES = [
    {"name": "quality", "question": "How good?", "highest": 5},
    {"name": "depth", "question": "How deep?", "lowest": 0, "highest": 100},
]
SERIES = {f"{paint}-{kind}": [f"{paint}{kind}1", f"{paint}{kind}2"] for paint in "ab" for kind in "xy"}
TWICE: dict[str, Any] = {"ratings": SCALES, "repeats": 2}
BEST: dict[str, Any] = {"series": SERIES}
BLOCKS: dict[str, tuple[str, dict[str, Any], str | None, set[type]]] = {
    "rating": ("rating", TWICE, None, {Rate}),
    "rating, timed": (
        "rating",
        TWICE | {"fixation_s": 1.0, "exposure_s": 0.5, "blank_s": 2.0, "break_every": 2},
        None,
        {Rate, GoOn},
    ),
    "rating beside a reference": ("rating", {"ratings": SCALES, "stimuli": ["a"]}, "r", {Rate}),
    "best of series": ("best_of_series", BEST, None, {Browse, Rate}),
    "best of series, with breaks": (
        "best_of_series",
        BEST | {"break_every": 1, "wrap": True, "start": "first"},
        None,
        {Browse, Rate, GoOn},
    ),
    "best of series without ratings": ("best_of_series", BEST | {"ratings": [], "see_all": False}, "r", {Browse}),
}


def block(name: str) -> Block:
    kind, keys, reference, _ = BLOCKS[name]
    stimuli = Stimuli({stimulus: {} for stimulus in ("a", "b", "c", *([reference] if reference else []))}, reference)
    return met(kind, setting(stimuli), **keys)


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

    clicked = play(block(name), click)
    assert len(clicked.trials) == block(name).trials
    assert all(key.startswith("click ") for trial in clicked.trials for key, _ in trial.events)
